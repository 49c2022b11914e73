"""Disturbance torques in the loop: their work on the momentum, jumps, shadow, resuming."""

import numba
import numpy as np
import pytest
from integrators import INTEGRATORS, by
from scipy.integrate import simpson, solve_ivp
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer import load, resume, save, simulate
from torquer.analysis.budget import budget_along_run
from torquer.base import noise
from torquer.compile import engine
from torquer.environment.light import PRESSURE_AT_1_AU_PA
from torquer.maths.geometry.motion import Motion
from torquer.scenario.load import ScenarioError
from torquer.simulation.propagate.forces import environment_at
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.setup.run import prepare
from torquer.spacecraft.body import motion_rates

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

PANEL = {"kind": "plate", "axis": [0, 0.6, 0.8], "area_m2": 1.5, "centre_m": [0.5, 0.1, 0.0],
         "specular_reflectivity": 0.3, "diffuse_reflectivity": 0.1}  # fmt: skip
BALL = {"kind": "sphere", "radius_m": 0.4, "centre_m": [0.0, -0.3, 0.2]}
LIGHT = {"solar_pressure": {"parts": [PANEL, BALL]}}
#: Sunlight on a ball of no size: what is compiled then is what flies with all torques.
NO_LIGHT = {"solar_pressure": {"parts": [BALL | {"radius_m": 1e-9}]}}
REST = {
    "residual_dipole": {"constant_a_m2": [0.01, 0.0, -0.02], "amplitude_a_m2": [0.0, 0.02, 0.0],
                        "cycles_per_orbit": 0.5, "phase_deg": 30.0},
    "unmodelled": {"constant_n_m": 1e-7, "harmonic_1_n_m": 2e-7, "harmonic_2_n_m": 1e-7,
                   "hold_s": 250.0},
}  # fmt: skip
EDDIES = {"eddy_currents": {"damping_n_m_s_per_t2": [3e3, 2e3, 1e3]}}
SHARP = {"environment.eclipse": "cylindrical"}


def disturbed(make, given, integrator="auto", **changes):
    """One revolution through the shadow, from the node on."""
    keys = {
        "start": "2025-03-20T00:00:00Z",
        "spacecraft.coils": None,
        "initial.rate_deg_s": [0.2, -0.1, 0.15],
        "control": {"law": {"kind": "off"}, "sample_s": 50.0},
        "simulation": {"duration_s": 5500.0, "record_s": 5.0, "step_s": 1.0},
        "disturbance": given,
    }
    return make(keys | by(integrator) | changes)


def everything(integrator):
    """All torques that an integrator takes."""
    return LIGHT | REST | ({} if integrator == "splitting" else EDDIES)


def momentum_gained(result):
    return result.momentum_inertial.values[-1] - result.momentum_inertial.values[0]


@needs_jit
@pytest.mark.parametrize("integrator", slow_after(1, INTEGRATORS))
def test_momentum_gained_is_the_integral_of_the_torques(make, integrator):
    """The torques along the recorded motion are those of the kernels; sums are the loop's."""
    without = {"environment.gravity_gradient": False}
    result = simulate(disturbed(make, everything(integrator), integrator, **without))
    along = budget_along_run(result).disturbance
    assert set(along) == {*everything(integrator)}
    attitude = Rotation.from_quat(result.q_body_to_inertial.values)
    t, expected = result.time.values, np.zeros(3)
    for first in range(0, 1100, 50):  # the unmodelled one jumps every 250 s
        last = min(first + 50, 1100)
        for name, torque in along.items():
            rows = torque[first : last + 1].copy()
            if name == "unmodelled":  # after the jump at the end of the span
                rows[-1] = 2.0 * rows[-2] - rows[-3]
            turned = attitude[first : last + 1].apply(rows)
            expected += simpson(turned, x=t[first : last + 1], axis=0)
    gained = momentum_gained(result)
    assert np.linalg.norm(gained) > 1e-4
    assert gained == pytest.approx(expected, abs=2e-3 * np.linalg.norm(expected))


@numba.njit(error_model="numpy")
def rates_in_light(t, y, rigid, tables):
    zero, x = (0.0, 0.0, 0.0), Motion((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    rate = motion_rates(rigid, environment_at(tables, t), zero, x, zero)
    return np.array((*rate.q, *rate.omega))


def by_scipy(scenario, t_s):
    """Attitudes of a satellite without control, (n, 4)."""
    run = prepare(scenario)
    first = run.state.cells.view(np.float64)[:7]
    found = solve_ivp(
        rates_in_light, (0.0, t_s[-1]), first, "DOP853", t_s, rtol=3e-14, atol=1e-16, max_step=5.0,
        args=(run.dynamics.rigid, run.piece.moving),
    )  # fmt: skip
    q = found.y[:4].T
    return q / np.linalg.norm(q, axis=1)[:, None]


@needs_jit
@pytest.mark.parametrize("shadow", [{}, SHARP], ids=["conical", "cylindrical"])
def test_adaptive_steps_end_at_the_edges_of_the_shadow(make, shadow):
    """The motion is that of SciPy, which gropes for the edges with a far finer tolerance."""
    scenario = disturbed(make, LIGHT, "auto", **shadow, **{"simulation.record_s": 50.0})
    auto = simulate(scenario)
    p, q = auto.q_body_to_inertial.values, by_scipy(scenario, auto.time.values)
    apart = 2.0 * np.minimum(np.linalg.norm(p - q, axis=1), np.linalg.norm(p + q, axis=1)).max()
    assert apart < float(auto.integration_error) + 1e-10 < np.radians(1e-4)
    assert float(auto.least_step) > 1e-3  # no groping for the edge


@needs_jit
def test_in_the_umbra_sunlight_does_nothing(make):
    keys = {"environment.gravity_gradient": False, "simulation.tolerance_deg": 1e-8}
    result = simulate(disturbed(make, LIGHT, "auto", **keys))
    dark, momentum = result.sunlit_fraction.values == 0.0, result.momentum_inertial.values
    inside = dark[1:] & dark[:-1]
    change = np.linalg.norm(np.diff(momentum, axis=0), axis=1)
    assert inside.sum() > 300
    assert change[inside].max() < 1e-14
    assert np.median(change[~inside]) > 1e-6


@needs_jit
def test_black_ball_off_the_mass_centre_feels_its_cross_section(make):
    """M = -c x P pi r^2 s, at rest on the first second."""
    keys = {"environment.gravity_gradient": False, "initial.rate_deg_s": [0.0, 0.0, 0.0],
            "simulation.duration_s": 50.0}  # fmt: skip
    result = simulate(disturbed(make, {"solar_pressure": {"parts": [BALL]}}, **keys))
    sun = result.sun_inertial.values[0]
    body = Rotation.from_quat(result.q_body_to_inertial.values[0]).inv().apply(sun)
    # in March the Sun is 0.995 to 1.000 au away
    torque = -np.cross(BALL["centre_m"], PRESSURE_AT_1_AU_PA * np.pi * 0.16 * body)
    attitude = Rotation.from_quat(result.q_body_to_inertial.values[0])
    expected = 50.0 * attitude.apply(torque)
    assert momentum_gained(result) == pytest.approx(expected, rel=0.012)


@needs_jit
@pytest.mark.parametrize("integrator", slow_after(1, ["auto", "rk4"]))
def test_unmodelled_torque_jumps_when_due_to_the_drawn_value(make, integrator):
    """A sphere without anything else: its momentum is a broken line."""
    given = NO_LIGHT | {"unmodelled": {"constant_n_m": 1e-6, "hold_s": 30.0}}
    keys = {
        "spacecraft.body.inertia_kg_m2": [1e3] * 3,
        "environment.gravity_gradient": False,
        "initial.rate_deg_s": [0.0, 0.0, 0.0],
        "simulation.duration_s": 300.0,
        "seed": 11,
    }
    result = simulate(disturbed(make, given, integrator, **keys))
    slopes = np.diff(result.omega_body.values, axis=0) * 1e3 / 5.0
    drawn = [1e-6 * np.array(noise.normal3(11, 8, 5 * (k // 6))) for k in range(60)]
    assert slopes == pytest.approx(np.array(drawn), abs=1e-13)
    other = simulate(disturbed(make, given, integrator, **keys | {"seed": 12}))
    assert not np.array_equal(other.omega_body, result.omega_body)


@needs_jit
@pytest.mark.parametrize("integrator", slow_after(1, INTEGRATORS))
def test_a_run_goes_on_with_the_same_bits(make, integrator, tmp_path):
    """Stopped between two jumps, at one, in the shadow; also where coils lag."""
    coils = {"limit_a_m2": 1.0, "lag_s": 0.7}
    control = {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e4}, "sample_s": 3.0}
    given = everything(integrator) | {"random_torque_n_m": 1e-7, "random_hold_s": 7.0}
    keys = {"spacecraft.coils": coils, "control": control, "simulation.duration_s": 2000.0}
    scenario = disturbed(make, given, integrator, **keys)
    whole = simulate(scenario)
    for stop_s in (500.0, 703.0, 1703.0):
        part = simulate(scenario, until_s=stop_s)
        save(part, tmp_path / "part.nc")
        on = resume(load(tmp_path / "part.nc"))
        for name in ("omega_body", "q_body_to_inertial", "checkpoint"):
            assert np.array_equal(on[name], whole[name], equal_nan=True), (stop_s, name)


@needs_jit
def test_eddy_currents_brake_what_turns_across_the_field(make):
    given = NO_LIGHT | {"eddy_currents": {"damping_n_m_s_per_t2": 2e5}}
    keys = {"environment.gravity_gradient": False, "initial.rate_deg_s": [3.0, -2.0, 1.0]}
    result = simulate(disturbed(make, given, **keys))
    inertia = np.array(flown_scenario(result).spacecraft.body.inertia_kg_m2)
    w = result.omega_body.values
    energy = 0.5 * np.sum(w * (w @ inertia), axis=1)
    assert (np.diff(energy) < 0.0).all()
    turning = np.cross(w, result.b_body.values)
    work = -simpson(2e5 * np.sum(turning**2, axis=1), x=result.time.values)
    assert energy[-1] - energy[0] == pytest.approx(work, rel=1e-4)


@needs_jit
@pytest.mark.parametrize(
    "given",
    [
        {"residual_dipole": {}},
        {"eddy_currents": {"damping_n_m_s_per_t2": 0.0}},
        {"unmodelled": {"hold_s": 100.0}},
    ],
    ids=str,
)
def test_zero_size_torque_leaves_the_motion_unchanged(make, given):
    still = simulate(disturbed(make, NO_LIGHT, **{"simulation.duration_s": 1000.0}))
    other = simulate(disturbed(make, NO_LIGHT | given, **{"simulation.duration_s": 1000.0}))
    assert other.omega_body.values == pytest.approx(still.omega_body.values, abs=1e-15)


@pytest.mark.parametrize(
    ("given", "changes", "expected"),
    [
        ({"solar_pressure": {}}, {},
         "disturbance.solar_pressure.parts: must be given without spacecraft.aerodynamics, whose "
         "parts they would be; received none"),
        ({"unmodelled": {"hold_s": 2.5}}, {},
         "disturbance.unmodelled.hold_s: must be a whole multiple of step_s = 1 s; received 2.5 s"),
        ({"unmodelled": {"constant_n_m": 1e-6}}, {},
         "disturbance.unmodelled.hold_s: must be given; received nothing"),
        ({"unmodelled": {"constant_n_m": -1e-6, "hold_s": 10.0}}, {},
         "disturbance.unmodelled.constant_n_m: must be greater than or equal to 0; "
         "received -1e-06"),
        (EDDIES, {"simulation.integrator": "splitting"},
         "simulation.integrator: must be 'auto' or 'rk4' with disturbance.eddy_currents; "
         "received 'splitting'"),
        ({"residual_dipole": {"cycles_per_orbit": 0.0}}, {},
         "disturbance.residual_dipole.cycles_per_orbit: must be greater than 0; received 0.0"),
        ({"solar_pressure": {"parts": [{"kind": "cone"}]}}, {},
         "disturbance.solar_pressure.parts[0].kind: must be one of box, cylinder, plate, sphere; "
         "received 'cone'"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_reported_in_one_line(make, given, changes, expected):
    with pytest.raises(ScenarioError) as error:
        disturbed(make, given, "rk4", **changes)
    assert str(error.value).removeprefix("scenario.") == expected.removeprefix("scenario.")
