"""Flights of the magneto-gyroscopic law: from tip-off to pointing, what it learns, its limits."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr
from law_cases import compiled, inputs
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer.analysis.attitude import find_attitude_error
from torquer.computer.laws.magneto_gyro.kernel import MEMORY
from torquer.environment.earth.rotation import dcm_inertial_to_ecef
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate
from torquer.theory.magneto_gyro.accuracy import follow_revolution, noise_error, steady_motion
from torquer.theory.magneto_gyro.along_orbit import field_along, model_error
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Weights, stage_2_gains
from torquer.theory.periodic.floquet import degree_of_stability, monodromy, multipliers

EXAMPLE = load_scenario(Path(__file__).parents[3] / "examples/magneto_gyro.toml")
PERIOD_S, RATE = EXAMPLE.orbit.period_s, EXAMPLE.orbit.rate_rad_s()
LAW = EXAMPLE.control.law
GAINS = LAW.gains
CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, RATE)
RESIDUAL = np.array([8.0, -6.0, 5.0])
#: Pointed but for a few degrees, at rest in the orbital frame.
NEARLY = {
    "initial.euler_deg": (5.0, -4.0, 5.0), "initial.rate_deg_s": (0.0, 0.0, 0.0),
    "initial.rate_relative_to": "orbital",
}  # fmt: skip
#: The field is read and calculated without an error.
EXACT = {"control.ephemeris.field": None, "spacecraft.magnetometer.noise_nt": 0.0}
NO_DIPOLE = {"spacecraft.coils.residual_dipole_a_m2": (0.0, 0.0, 0.0)}
#: Errors (roll, pitch, yaw) [deg] of the microsatellite by noise, field model, bias, as designed.
MICRO_PREDICTED = ((0.010, 0.018, 0.011), (0.026, 0.058, 0.030), (0.191, 0.143, 0.221))
#: Of tip-offs: two every time, six more with the slow tests.
SEEDS = pytest.mark.parametrize("seeds", slow_after(1, [range(2), range(2, 8)]), ids=str)
STAGE_1_ALONE = {"control.law.stage_2_angle_deg": 1e-3}


class Flown(NamedTuple):
    """A result; times in orbits; errors (roll, pitch, yaw) [deg]."""

    result: xr.Dataset
    orbits: np.ndarray
    error_deg: np.ndarray

    def stays_below(self, limit_deg):
        """From when on [orbits]."""
        above = np.flatnonzero(np.linalg.norm(self.error_deg, axis=1) > limit_deg)
        return 0.0 if len(above) == 0 else self.orbits[above[-1]]

    def rms_deg(self, after):
        """Root mean square of each angle."""
        return np.sqrt(np.mean(self.error_deg[self.orbits > after] ** 2, axis=0))

    def logged(self, name, after=-1.0):
        """What the law logged."""
        return self.result[f"law.{name}"].values[self.orbits > after]


def fly(changes, orbits=12.0):
    """The example, changed."""
    scenario = EXAMPLE.replace("simulation.revolutions", orbits)
    for key, value in changes.items():
        scenario = scenario.replace(key, value)
    result = simulate(scenario)
    return Flown(result, result.time.values / PERIOD_S, find_attitude_error(result).error_deg)


def tip_off(seed, rate_deg_s=3.0):
    """Any attitude, a rate about any axis."""
    rng = np.random.default_rng(seed)
    rate, attitude = rng.normal(size=3), Rotation.random(random_state=rng)
    return {
        "initial.euler_deg": tuple(attitude.as_euler("ZYX", degrees=True).tolist()),
        "initial.rate_deg_s": tuple((rate_deg_s * rate / np.linalg.norm(rate)).tolist()),
    }


def test_from_tip_off_in_any_attitude_it_points():
    for seed in range(3):
        flown = fly(tip_off(seed), 13.0)
        assert flown.stays_below(5.0) < 8.0 and flown.stays_below(1.0) < 9.0
        assert flown.rms_deg(after=9.0).max() < 0.1
        stages = flown.logged("stage")
        assert stages[0] == 1.0 and stages[-1] == 2.0 and np.sum(np.diff(stages) != 0.0) == 1


@pytest.mark.slow
def test_two_hundred_tip_offs_all_end_pointed():
    for seed in range(200):
        flown = fly(tip_off(seed), 10.0)
        assert flown.stays_below(5.0) < 8.0 and flown.stays_below(1.0) < 9.0, seed
        assert flown.rms_deg(after=9.0).max() < 0.1, seed


def test_the_law_knows_the_attitude_and_the_rate():
    flown = fly(EXACT)
    late = flown.orbits > 9.0
    error = np.degrees(flown.logged("angles_rad")[late]) - flown.error_deg[late]
    assert np.abs(error).max() < 1e-3
    turning = fly({**EXACT, **NO_DIPOLE, **NEARLY, **STAGE_1_ALONE}, 0.2)
    assert np.all(turning.logged("angles_rad") == 0.0)


def test_satellite_dipole_is_learned_exactly_in_an_exact_field():
    flown = fly(EXACT, 14.0)
    begun = flown.orbits[np.argmax(flown.logged("stage") == 2.0)]
    off = np.linalg.norm(flown.logged("residual_dipole_a_m2") - RESIDUAL, axis=1)
    part = off / np.linalg.norm(RESIDUAL)
    assert part[flown.orbits > begun + 4.0].max() < 0.05
    assert part[flown.orbits > begun + 6.0].max() < 0.01
    assert part[flown.orbits > begun + 8.0].max() < 1e-3
    assert flown.rms_deg(after=13.0).max() < 1e-3


def test_learned_mean_dipole_is_right_despite_field_model_errors():
    flown = fly({}, 25.0)
    found, records = flown.logged("residual_dipole_a_m2", after=10.0), round(PERIOD_S / 20.0)
    means = np.array([np.convolve(c, np.full(records, 1 / records), "valid") for c in found.T])
    off = np.linalg.norm(means.T - RESIDUAL, axis=1) / np.linalg.norm(RESIDUAL)
    assert off.max() < 0.05


def test_magnetometer_bias_tilts_by_less_than_half_a_degree():
    flown = fly({"spacecraft.magnetometer.bias_nt": (100.0, -100.0, 100.0)}, 20.0)
    assert 0.15 < flown.rms_deg(after=10.0).max() < 0.5


def strength(flown):
    """A [T]: root of the mean square of the field in the orbit's plane, as that of a dipole."""
    normal = np.cross(flown.result.position_inertial, flown.result.velocity_inertial)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    b = flown.result.b_inertial.values
    square = np.sum(b**2, axis=1) - np.sum(b * normal, axis=1) ** 2
    return math.sqrt(square.mean() / (0.5 * ((2 / 3) ** 2 + (4 / 3) ** 2)))


def loop(gains=GAINS, form="field"):
    return follow_revolution(
        stage_2_loop(CRAFT.satellite(), CRAFT.gyrostat, gains, normal=-0.1, form=form)
    )


def test_the_exact_model_predicts_the_error_under_noise():
    noise = {**EXACT, **NO_DIPOLE, **NEARLY, "spacecraft.magnetometer.noise_nt": 1000.0}
    flown = fly(noise, 40.0)
    intensity = (1e-6 / strength(flown)) ** 2 * RATE  # a reading a second
    want = np.degrees(noise_error(loop(), [0.0] * 3 + [intensity] * 3))
    assert flown.rms_deg(after=8.0) == pytest.approx(want, rel=0.2)


@pytest.mark.parametrize(("axis", "size_n_m"), [(0, 1e-4), (1, 1e-4), (2, 1e-4)])
def test_the_exact_model_predicts_what_a_constant_torque_does(axis, size_n_m):
    """Greatest error [deg] of 1e-4 N m about roll, pitch, yaw: flown 0.348, 0.399, 0.223; by the
    exact model 0.346, 0.390, 0.223; by the frozen one 0.243, 0.421, 0.243.
    """
    torque = np.zeros(3)
    torque[axis] = size_n_m
    disturbance = {"constant_torque_n_m": tuple(torque.tolist())}
    flown = fly({**EXACT, **NO_DIPOLE, **NEARLY, "disturbance": disturbance}, 30.0)
    motion = steady_motion(loop(), [*(torque / CRAFT.torque_unit), 0.0, 0.0, 0.0])
    want = np.degrees(np.sqrt(np.mean(motion[:, axis] ** 2)))
    assert flown.rms_deg(after=15.0)[axis] == pytest.approx(want, rel=0.2)


def test_exact_model_predicts_the_residual_of_the_on_board_field():
    scenario = EXAMPLE.replace("spacecraft.magnetometer.noise_nt", 0.0)
    along = field_along(scenario.orbit_environment(), scenario.believed_environment())
    assert along.strength_t == pytest.approx(strength(fly(NEARLY, 15.0)), rel=1e-3)
    want = np.degrees(model_error(loop(), along))
    flown = fly({**NEARLY, "spacecraft.magnetometer.noise_nt": 0.0}, 20.0)
    assert flown.rms_deg(after=5.0) == pytest.approx(want, rel=0.2)


def test_the_exact_model_predicts_what_a_bias_does():
    """A bias along pitch is taken for a dipole, which tilts roll and yaw."""
    bias = {**EXACT, **NO_DIPOLE, **NEARLY, "spacecraft.magnetometer.bias_nt": (0.0, 300.0, 0.0)}
    flown = fly(bias, 30.0)
    a = strength(flown)
    motion = steady_motion(loop(), [0.0, 0.0, 0.0, 0.0, 300e-9 / a, 0.0])
    tilt = np.degrees(np.sqrt(np.mean(motion[:, [0, 2]] ** 2, axis=0)))
    assert flown.rms_deg(after=15.0)[[0, 2]] == pytest.approx(tilt, rel=0.2)
    found = flown.logged("residual_dipole_a_m2", after=15.0).mean(axis=0)
    unit = CRAFT.torque_unit / a
    assert found[1] == pytest.approx(-unit * motion[:, 13].mean(), rel=0.2)


def text_form(gains):
    """Keys of the form of the text, with the dipole of IGRF-14 in 2025."""
    x, y, _ = dcm_inertial_to_ecef([0.0], EXAMPLE.start)[0, 0]
    return {
        "control.law": LAW.model_copy(update={
            "form": "text", "dipole_nt": (-29350.0, -1410.3, 4545.5),
            "meridian_deg": math.degrees(math.atan2(y, x)),
            "angle_gains": gains[:3], "rate_gains": gains[3:6],
            "estimator_gains": gains[6:12], "compensator_gains": gains[12:],
        }),
    }  # fmt: skip


def test_the_form_of_the_text_flies_as_well():
    gains = stage_2_gains(CRAFT.gyrostat, Stage2Weights(29.2, 126.0, 75.3, 43.6))
    assert loop(gains, "text").degree > 0.2
    flown = fly(text_form(gains), 13.0)
    assert flown.stays_below(1.0) < 9.0 and flown.rms_deg(after=9.0).max() < 0.1


def test_gains_by_the_frozen_model_alone_fail_in_flight():
    """Decay 0.1 in the text's model; a Floquet degree of -0.02, and the satellite swings out."""
    gains = stage_2_gains(CRAFT.gyrostat, Stage2Weights(1.0, 1.0, 10.0, 10.0))
    assert loop(gains, "text").degree < 0.0
    flown = fly({**NEARLY, **text_form(gains)}, 20.0)
    assert np.abs(flown.error_deg[flown.orbits > 5.0]).max() > 20.0


@pytest.mark.parametrize(("stiffness", "holds"), [(-0.6, False), (0.7, False), (3.0, True)])
def test_stage_1_needs_a_wheel_with_h_clearly_positive(stiffness, holds):
    """Near h = 0.7 the frozen model is stable, but not the exact one with gravity gradient."""
    wheel = CRAFT.wheel_at(stiffness)
    satellite = CRAFT.with_wheel(wheel).satellite()
    exact = STAGE_1.with_parameters(**satellite._asdict(), normal=-0.1, frequency=0.1 / RATE)
    rho = multipliers(monodromy(exact, tolerance=1e-6))
    assert (degree_of_stability(rho, 2.0 * math.pi) > 0.1) == holds
    changes = {"spacecraft.body.wheel_momentum_n_m_s": (0.0, wheel, 0.0),
               "control.law.bias_momentum_n_m_s": wheel}  # fmt: skip
    flown = fly({**EXACT, **NO_DIPOLE, **NEARLY, **STAGE_1_ALONE, **changes}, 15.0)
    late = np.linalg.norm(flown.error_deg[flown.orbits > 12.0], axis=1)
    assert late.max() < 1.0 if holds else late.max() > 30.0


def test_at_h_of_2_pointing_takes_many_orbits_more():
    """Roll and yaw part in the turning axes: one is neither controlled nor seen."""
    wheel = CRAFT.wheel_at(2.0)
    changes = {"spacecraft.body.wheel_momentum_n_m_s": (0.0, wheel, 0.0),
               "control.law.bias_momentum_n_m_s": wheel}  # fmt: skip
    assert fly(changes, 15.0).stays_below(1.0) > 14.0


def test_the_field_turns_by_at_most_about_three_orbital_rates():
    """|B x dB/dt|/B^2 along 15 orbits, over nu0: 3 over the equator for a polar dipole."""
    t = np.arange(0.0, 15.0 * PERIOD_S, 20.0)
    b = EXAMPLE.orbit_environment().sample(t)[:, 3:6]
    turning = np.linalg.norm(np.cross(b, np.gradient(b, t, axis=0))[1:-1], axis=1)
    greatest = np.max(turning / np.sum(b[1:-1] ** 2, axis=1)) / RATE
    assert 3.0 < greatest < 3.5


@pytest.mark.parametrize("seed", range(2))
def test_stage_1_alone_rests_in_orbital_frame_within_degrees(seed):
    flown = fly({**tip_off(seed), **STAGE_1_ALONE}, 12.0)
    rate = np.degrees(np.linalg.norm(flown.result.omega_orbital.values, axis=1))
    late = flown.orbits > 10.0
    assert rate[0] > 2.9 and rate[late].max() < 0.01
    assert flown.stays_below(20.0) < 10.0
    assert np.linalg.norm(flown.error_deg[late], axis=1).max() < 5.0


def test_the_dipole_leaves_an_error_without_the_compensator_alone():
    bare = LAW.model_copy(update={"compensator_gains": (0.0, 0.0, 0.0)})
    left = []
    for law in (LAW, bare):
        flown = fly({**EXACT, **NEARLY, "control.law": law}, 8.0)
        left.append(np.linalg.norm(flown.error_deg[flown.orbits > 6.0], axis=1).max())
    assert left[0] < 1e-3 and left[1] > 0.1


@pytest.mark.parametrize(("rate_deg_s", "brakes"), [(4.5, True), (8.0, False)])
def test_stage_1_brakes_below_the_frequency_of_its_filters_alone(rate_deg_s, brakes):
    """0.1 rad/s are 5.7 deg/s: beyond it the satellite is spun up."""
    flown = fly(tip_off(3, rate_deg_s), 6.0)
    rate = np.degrees(np.linalg.norm(flown.result.omega_body.values[-1]))
    assert rate < 0.5 * rate_deg_s if brakes else rate > 1.1 * rate_deg_s


@pytest.mark.parametrize("actuate_s", [3.0, 9.0])
def test_pointing_works_with_coils_off_during_field_readings(actuate_s):
    """Intervals between calls differ; the estimator has the mean dipole of each."""
    windows = {"measure_s": 1.0, "actuate_s": actuate_s}
    law = LAW.model_copy(update={"coil_duty": actuate_s / (1.0 + actuate_s)})
    control = EXAMPLE.control.model_copy(update={**windows, "law": law})
    flown = fly({"control": control}, 14.0)
    assert flown.stays_below(1.0) < 9.0 and flown.rms_deg(after=11.0).max() < 0.1


@SEEDS
@pytest.mark.parametrize(("eccentricity", "most_deg"), [(0.02, 0.1), (0.05, 0.2)])
def test_eccentric_orbit_error_grows_with_eccentricity(seeds, eccentricity, most_deg):
    """The law has the mean rate, the frame turns unevenly: about 2.4 deg of pitch per unit of e."""
    orbit = {"kind": "kepler", "semi_major_axis_km": 7208.0, "eccentricity": eccentricity,
             "inclination_deg": 98.8, "mean_anomaly_deg": 0.0}  # fmt: skip
    for seed in seeds:
        flown = fly({**tip_off(seed), "orbit": orbit}, 13.0)
        assert flown.stays_below(1.0) < 9.0 and flown.rms_deg(after=9.0).max() < most_deg, seed
    still = fly({**EXACT, **NO_DIPOLE, **NEARLY, "orbit": orbit}, 20.0)
    assert still.rms_deg(after=10.0)[1] == pytest.approx(2.4 * eccentricity, rel=0.1)


def remembered(calls_s):
    """Memory after calls, by name; without times."""
    law = LAW.law()
    memory, found, first = law.first_memory(), {}, 0
    for t_s in calls_s:
        row = inputs(t_s, (2e-5, -1e-5, 1e-5), r=(7.2e6, 0.0, 0.0), v=(0.0, 1e3, 7.3e3),
                     model_b=(1e-5, 2e-5, -1e-5))  # fmt: skip
        compiled(law)(row, law.pack(), memory)
    for name, part in MEMORY.items():
        found[name] = memory[first : first + np.size(part)].tolist()
        first += np.size(part)
    return {name: part for name, part in found.items() if not name.endswith("_s")}


def test_gap_between_calls_resets_all_to_the_first_call():
    """Ten minutes in which another law was at work; half a minute is none."""
    assert remembered((0.0, 1.0, 601.0)) == remembered((601.0,))
    assert remembered((0.0, 1.0, 31.0)) != remembered((31.0,))
    assert remembered((0.0, 60.0, 120.0)) != remembered((120.0,))  # calls a minute apart


def test_wrong_magnetometer_brings_back_stage_1_until_it_points_again():
    """Readings with the wrong sign for two hours: the mean angle calls stage 1, later stage 2."""
    failure = {"kind": "reversed", "from_s": 45_000.0, "until_s": 52_000.0}
    flown = fly({"spacecraft.magnetometer.failures": [failure]}, 15.0)
    stages = flown.logged("stage")
    changes = np.flatnonzero(np.diff(stages))
    assert stages[changes + 1].tolist() == [2.0, 1.0, 2.0]
    assert 45_000.0 < flown.result.time.values[changes[1]] < 47_000.0
    assert np.linalg.norm(flown.error_deg, axis=1)[flown.orbits > 8.0].max() > 90.0
    assert flown.stays_below(1.0) < 13.0 and flown.rms_deg(after=14.0).max() < 0.1


@SEEDS
@pytest.mark.parametrize("kind", ["silent", "zeros"])
def test_after_an_orbit_without_the_magnetometer_it_points_again(seeds, kind):
    """Stage 1 begins again, and stage 2 follows."""
    failure = {"kind": kind, "from_s": 9.0 * PERIOD_S, "until_s": 10.0 * PERIOD_S}
    for seed in seeds:
        lost = {"spacecraft.magnetometer.failures": [failure]}
        flown = fly({**tip_off(seed), **lost}, 16.0)
        assert np.linalg.norm(flown.error_deg, axis=1)[flown.orbits > 9.0].max() > 5.0
        assert flown.stays_below(1.0) < 13.0 and flown.rms_deg(after=13.0).max() < 0.1, seed


@SEEDS
@pytest.mark.parametrize(("coil", "holds"), [(0, False), (2, True)])
def test_loss_of_roll_coil_breaks_pointing_but_yaw_coil_not(seeds, coil, holds):
    """A pitch error of 0.7 deg (rms) is left without the coil along yaw."""
    failures = [{"coil": coil, "kind": "dead", "from_s": 9.0 * PERIOD_S}]
    for seed in seeds:
        flown = fly({**tip_off(seed), "spacecraft.coils.failures": failures}, 20.0)
        late = np.linalg.norm(flown.error_deg[flown.orbits > 15.0], axis=1).max()
        assert late < 3.0 if holds else late > 5.0, seed


@SEEDS
def test_a_microsatellite_points_from_tip_off(seeds):
    example = load_scenario(Path(__file__).parents[3] / "examples/magneto_gyro_micro.toml")
    for seed in seeds:
        scenario = example
        for key, value in tip_off(seed, 5.0).items():
            scenario = scenario.replace(key, value)
        result = simulate(scenario.replace("simulation.revolutions", 10.0))
        error = find_attitude_error(result).error_deg
        orbits = result.time.values / example.orbit.period_s
        assert np.linalg.norm(error[orbits > 5.0], axis=1).max() < 1.0, seed
        rms = np.sqrt(np.mean(error[orbits > 6.0] ** 2, axis=0))
        want = np.sqrt(np.sum(np.square(MICRO_PREDICTED), axis=0))
        assert rms == pytest.approx(want, rel=0.5), seed


@pytest.mark.parametrize(("coils", "threshold"), [("each_coil", 30.0), ("nearest_angle", 60.0)])
def test_relay_limit_cycle_of_stage_1_grows_with_its_threshold(coils, threshold):
    errors = []
    for each in (threshold, 2.0 * threshold):
        keys = {"coils": coils, "relay_threshold_a_m2": each, "relay_dipole_a_m2": 250.0}
        relay = {"control.law": LAW.model_copy(update=keys)}
        flown = fly({**relay, **STAGE_1_ALONE}, 14.0)
        commands = flown.result.command_body.values
        assert set(np.unique(np.abs(commands))) == {0.0, 250.0}
        assert 0.0 < np.mean(commands[flown.orbits > 11.0] != 0.0) < 0.3
        errors.append(flown.rms_deg(after=11.0).max())
    assert errors[0] > 0.1 and 2.0 * errors[0] < errors[1] < 10.0
    assert fly(relay).rms_deg(after=9.0).max() < 0.1  # stage 2 ends it
