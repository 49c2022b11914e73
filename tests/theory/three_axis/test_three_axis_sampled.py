"""The sampled loop: its limit, the simulation's cycle, delays, periodic error, covariance."""

import math
from dataclasses import replace

import numpy as np
import pytest
from attitude_holds import CUBESAT, at_strength, gains_of, hold
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import torquer
from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.scenario.load import scenario_from_data
from torquer.spacecraft.aerodynamics import Aerodynamics
from torquer.spacecraft.parts import Plate
from torquer.theory.periodic import floquet
from torquer.theory.three_axis.floquet import exact_stability
from torquer.theory.three_axis.response import (
    CONSTANT,
    READINGS,
    Noise,
    Offsets,
    greatest_angle,
    pointing_error,
)
from torquer.theory.three_axis.sampled import (
    Cycle,
    SampledHold,
    delayed_degree,
    sampled_family,
)
from torquer.theory.validity import VALID

ALONE = np.empty((1, 0))


def whole_altitude_km(period_s):
    """Altitude of the circular orbit with this period."""
    return 1e-3 * (np.cbrt(MU_EARTH_M3_S2 * (period_s / 2 / np.pi) ** 2) - EARTH_RADIUS_M)


def degree(held, *cycle):
    return sampled_family(SampledHold(held, Cycle(*cycle))).degrees(ALONE)[0]


def test_a_short_hold_is_the_continuous_loop():
    """The degree differs by a term that is linear in the hold."""
    held = at_strength(hold(70.0), 1.5)
    exact, holds = exact_stability(held).degree, np.array([2.0, 4.0, 8.0])
    apart = [abs(degree(held, each) - exact) for each in holds]
    assert np.polyfit(np.log(holds), np.log(apart), 1)[0] == pytest.approx(1.0, abs=0.05)
    assert apart[0] < 0.01 * exact


def test_a_duty_cycle_counts_by_its_part():
    held = at_strength(hold(70.0), 1.5)
    third = held.with_parameters(
        **{name: held.law.values()[name] / 3.0 for name in ("rate_gain", "angle_gain")}
    )
    assert degree(held, 3.0, 6.0) == pytest.approx(exact_stability(third).degree, rel=5e-3)


SCENARIO = {
    "start": "2025-03-01T00:00:00Z",
    "spacecraft": {"body": {"inertia_kg_m2": list(CUBESAT["inertia"])},
                   "coils": {"limit_a_m2": 10.0}},
    "initial": {"reference": "orbital", "rate_relative_to": "orbital", "rate_deg_s": [0, 0, 0]},
    "environment": {"field": {"kind": "averaged"}},
}  # fmt: skip


PERIOD_S = 5600.0


def cubesat(u0_deg=0.0):
    """The CubeSat under strong gains, from an argument of latitude on, and its scenario from 0."""
    altitude_km = whole_altitude_km(PERIOD_S)
    held = at_strength(hold(**(CUBESAT | {"altitude_km": altitude_km}), u0_deg=u0_deg), 3.0)
    orbit = {"kind": "circular", "altitude_km": altitude_km, "inclination_deg": 52.0}
    k, k_a = gains_of(held)
    law = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": k, "angle_gain_n_m_per_t2": k_a}
    return held, {**SCENARIO, "orbit": orbit, "control": {"law": law}}


def turns_of(run):
    """Small turns [rad] from the orbital frame, in body axes."""
    r, v = run.position_inertial.values, run.velocity_inertial.values
    up = r / np.linalg.norm(r, axis=1)[:, None]
    normal = np.cross(r, v)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    frame = np.stack([np.cross(normal, up), normal, up], axis=2)
    body = Rotation.from_quat(run.q_body_to_inertial.values)
    return (Rotation.from_matrix(frame).inv() * body).as_rotvec()


@pytest.mark.parametrize(
    ("control", "cycle"),
    [({"sample_s": 140.0}, Cycle(140.0)),
     ({"sample_s": 20.0, "measure_s": 60.0, "actuate_s": 80.0}, Cycle(80.0, 60.0))],
)  # fmt: skip
def test_the_cycle_is_that_of_the_simulation(control, cycle):
    """A small error over two revolutions, by the maps and in flight, command by command.

    With a window the first command is given at its end: there the maps begin.
    """
    held, data = cubesat(360.0 * cycle.off_s / PERIOD_S)
    sampled = SampledHold(held, cycle)
    assert sampled.maps.cycle_s == pytest.approx(140.0, rel=1e-12) and sampled.count == 40
    start = np.array([1e-4, -2e-4, 1.5e-4, 0.0, 0.0, 0.0])
    data = {
        **data,
        "control": {**data["control"], **control},
        "initial": {**data["initial"], "euler_deg": np.degrees(start[2::-1]).tolist()},
        "simulation": {"duration_s": 2.0 * PERIOD_S, "record_s": 20.0},
    }
    flown = turns_of(torquer.simulate(scenario_from_data(data)))[round(cycle.off_s / 20.0) :: 7]
    a = np.zeros((6, 6))
    a[:3, 3:], a[3:] = np.eye(3), held.free(np.zeros(1)).slopes[0]
    x = expm(a * cycle.off_s * held.rate_rad_s) @ start
    maps, gains, path = sampled.maps, sampled.gains()[0], []
    for k in range(len(flown)):
        path.append(x[:3])
        x = (maps.free[k % 40] + maps.dipole[k % 40] @ gains[k % 40]) @ x
    assert np.abs(flown).max() > 1e-4
    assert flown == pytest.approx(np.array(path), abs=2e-3 * np.abs(flown).max())


@pytest.mark.parametrize("late", [1, 2, 5])
def test_a_delayed_command_is_a_longer_recursion(late):
    """Against the recursion written out with a list of commands under way."""
    sampled = SampledHold(at_strength(hold(70.0), 1.5), Cycle(120.0))
    maps, gains, n = sampled.maps, sampled.gains()[0], 6 + 3 * late
    columns = []
    for unit in np.eye(n):
        x, waiting = unit[:6], list(unit[6:].reshape(late, 3))
        for free, dipole, gain in zip(maps.free, maps.dipole, gains, strict=True):
            waiting.append(gain @ x)
            x = free @ x + dipole @ waiting.pop(0)
        columns.append(np.concatenate([x, *waiting]))
    rho = floquet.multipliers(np.array(columns).T)
    wanted = floquet.degree_of_stability(rho, sampled.hold.period)
    assert delayed_degree(sampled, late) == pytest.approx(wanted, abs=1e-9)


# the steady error


def test_the_steady_error_is_that_of_the_flight():
    """Residual dipole, constant torque and drag: the flight of a revolution, after ten."""
    _, data = cubesat()
    plate = Plate(axis=(1.0, 0.2, 0.1), area_m2=0.01, centre_m=(0.0, 0.01, 0.02))
    atmosphere = {"kind": "exponential", "density_kg_m3": 3e-15, "at_height_km": 480.0,
                  "scale_height_km": 60.0}  # fmt: skip
    data = {
        **data,
        "spacecraft": {
            **data["spacecraft"],
            "coils": {"limit_a_m2": 10.0, "residual_dipole_a_m2": [1e-6, -2e-6, 3e-6]},
            "aerodynamics": Aerodynamics(parts=(plate,)).model_dump(mode="json"),
        },
        "environment": {**data["environment"], "atmosphere": atmosphere},
        "control": {**data["control"], "sample_s": 20.0},
        "disturbance": {"constant_torque_n_m": [2e-11, -3e-11, 1e-11]},
        "simulation": {"duration_s": 11.0 * PERIOD_S, "record_s": 20.0, "step_s": 5.0},
    }
    scenario = scenario_from_data(data)
    hold_of_it = torquer.theory.AttitudeHold.of_scenario(scenario)
    sampled = SampledHold(hold_of_it, Cycle.of_control(scenario.control), (1e-6, -2e-6, 3e-6))
    error = pointing_error(sampled, (2e-11, -3e-11, 1e-11))
    flown = turns_of(torquer.simulate(scenario))[-281:-1]
    size = error.greatest_rad
    assert 0.003 < size < 0.03 and error.verdict == VALID
    for source in ("residual dipole", "air", CONSTANT):
        assert greatest_angle(error.by_source[source]) > 0.02 * size
    assert flown == pytest.approx(error.turns, abs=0.02 * size)
    assert sum(error.by_source.values()) == pytest.approx(error.turns, abs=1e-12)


def test_sensor_offsets_are_those_of_the_flight():
    """A mounting error of the attitude sensor and a bias of the gyro."""
    _, data = cubesat()
    craft = {
        **data["spacecraft"],
        "attitude_sensor": {"error_deg": [0.02, -0.04, 0.06]},
        "gyro": {"bias_deg_s": [2e-6, 4e-6, -6e-6]},
    }
    control = {**data["control"], "sample_s": 20.0}
    simulation = {"duration_s": 11.0 * PERIOD_S, "record_s": 20.0}
    scenario = scenario_from_data(
        {**data, "spacecraft": craft, "control": control, "simulation": simulation}
    )
    sampled = SampledHold(torquer.theory.AttitudeHold.of_scenario(scenario), Cycle(20.0))
    offsets = Offsets(*(np.radians(x) for x in ([0.02, -0.04, 0.06], [2e-6, 4e-6, -6e-6])))
    error = pointing_error(sampled, offsets=offsets)
    flown = turns_of(torquer.simulate(scenario))[-281:-1]
    assert error.by_source[READINGS] == pytest.approx(error.turns, abs=1e-12)
    assert flown == pytest.approx(error.turns, abs=0.02 * error.greatest_rad)


def test_a_constant_torque_that_gravity_holds():
    """Equatorial orbit: no dipole turns the body about the field, the orbit's normal; pitch comes
    to rest where gravity balances the torque."""
    inertia = (1.3, 1.7, 0.8)
    held = hold(0.001, inertia, reference="orbital", gravity_gradient=True, k=1e6, k_a=100.0)
    torque, n = 1e-8, held.rate_rad_s
    error = pointing_error(SampledHold(held, Cycle(20.0)), (0.0, torque, 0.0))
    pitch = torque / (3.0 * n**2 * (inertia[0] - inertia[2]))
    assert error.by_source[CONSTANT][:, 1].mean() == pytest.approx(pitch, rel=1e-3)


def test_noise_has_the_covariance_of_the_recursion():
    """Against 40 000 revolutions of it with random numbers."""
    sampled = SampledHold(at_strength(hold(70.0), 2.0), Cycle(300.0))
    noise = Noise(2e-3, 3e-6, 4e-8, 100.0)
    found = pointing_error(sampled, noise=noise)
    maps, gains, rng = sampled.maps, sampled.gains()[0], np.random.default_rng(2)
    n, x = sampled.hold.rate_rad_s, np.zeros((6, 2000))
    spread = np.array([[2e-3]] * 3 + [[3e-6 / n]] * 3)
    torque, squares = 4e-8 * math.sqrt(100.0 / maps.cycle_s), np.zeros((sampled.count, 3))
    for revolution in range(25):
        for k in range(sampled.count):
            if revolution >= 5:
                squares[k] += np.mean(x[:3] ** 2, axis=1) / 20.0
            read = x + sampled.readout[k] @ (spread * rng.normal(size=x.shape))
            pushed = maps.torque[k] @ (torque * rng.normal(size=(3, 2000)))
            x = maps.free[k] @ x + maps.dipole[k] @ (gains[k] @ read) + pushed
    assert np.sqrt(squares) == pytest.approx(found.noise_rad, rel=0.03)
    assert found.greatest_rad == pytest.approx(0.0, abs=1e-9)
    assert found.noise_rms_rad == pytest.approx(found.rms_rad, rel=1e-9)


def test_notes_say_where_the_theory_ends():
    weak = SampledHold(at_strength(hold(70.0, gravity_gradient=True), 0.5), Cycle(60.0))
    with pytest.raises(ArithmeticError, match="must be stable for a steady error to exist"):
        pointing_error(weak)
    strong = at_strength(hold(30.0, gravity_gradient=True), 3.0, 4.0)
    error = pointing_error(SampledHold(strong, Cycle(10.0)), limit_a_m2=0.01)
    assert error.greatest_rad > 0.4
    assert error.verdict.doubts[0].text.startswith("error beyond 0.34 rad: ")
    assert error.verdict.doubts[1].text.startswith("dipole asked for, over the coils' limit = ")
    assert len(error.verdict.doubts) == 2
    with pytest.raises(ValueError, match="noise: rate_rad_s: must be at least 0; received -1"):
        pointing_error(SampledHold(strong, Cycle(10.0)), noise=Noise(rate_rad_s=-1.0))


def test_messages():
    held = hold()
    with pytest.raises(ValueError, match="hold_s: must be above 0; received 0"):
        SampledHold(held, Cycle(0.0))
    with pytest.raises(ValueError, match="off_s: must be at least 0; received -1"):
        SampledHold(held, Cycle(1.0, -1.0))
    with pytest.raises(ValueError, match="cycle: must not be longer than the 1 revolutions"):
        SampledHold(held, Cycle(6000.0))
    with pytest.raises(ValueError, match="late: must be at least 1; received 0"):
        delayed_degree(SampledHold(held, Cycle(100.0)), 0)
    with pytest.raises(ValueError, match="residual_a_m2: must have shape"):
        replace(SampledHold(held, Cycle(1.0)), residual_a_m2=(1.0, 2.0))
