"""Whole runs against conservation laws, against scipy, and against the theory of B-dot."""

import numpy as np
import pytest
from integrators import INTEGRATORS, by
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.compile import engine
from torquer.environment.field.averaged import cone_angle, mean_over_orbit
from torquer.theory.slow.gains import bdot_gain, damping_efficiency, sampling_limit_rad_s

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Wheels are kicks to the splitting, and strong ones: its error with them has a test of its own.
HELD = [0.02, -0.05, 0.03]
WHEELS = {name: [0.0] * 3 if name == "splitting" else HELD for name in INTEGRATORS}


def inertia_of(scenario):
    return np.array(scenario.spacecraft.body.inertia_kg_m2)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def body_from_inertial(result, name):
    return Rotation.from_quat(result.q_body_to_inertial.values).inv().apply(result[name].values)


def gravity_torque(inertia, r_body):
    """3 mu / r^5 r x J r, row by row."""
    r = np.linalg.norm(r_body, axis=-1, keepdims=True)
    return 3.0 * MU_EARTH_M3_S2 / r**5 * np.cross(r_body, r_body @ inertia)


def start_state(result):
    return np.append(result.q_body_to_inertial.values[0], result.omega_body.values[0])


def final_state(result):
    return np.append(result.q_body_to_inertial.values[-1], result.omega_body.values[-1])


def state_error(a, b):
    """Greatest difference in attitude components and, relatively, in rate."""
    q = min(np.abs(a[:4] - b[:4]).max(), np.abs(a[:4] + b[:4]).max())
    return max(q, np.abs(a[4:] - b[4:]).max() / np.linalg.norm(b[4:]))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_jacobi_integral_is_conserved(make, integrator):
    wheels = WHEELS[integrator]
    scenario = make(
        {
            "spacecraft.body.wheel_momentum_n_m_s": wheels,
            "initial.rate_deg_s": [0.03, -0.05, 0.04],
            "initial.rate_relative_to": "orbital",
            "simulation.duration_s": 6000.0,
            **by(integrator),
        }
    )
    result = simulate(scenario)
    inertia = inertia_of(scenario)
    up = unit(body_from_inertial(result, "position_inertial"))
    turning = np.cross(result.position_inertial, result.velocity_inertial)
    normal = Rotation.from_quat(result.q_body_to_inertial.values).inv().apply(unit(turning))
    omega0 = scenario.orbit.rate_rad_s()
    omega = result.omega_body.values

    def form(v):
        return np.einsum("ni,ij,nj->n", v, inertia, v)

    gravity = 1.5 * omega0**2 * form(up)
    energy = 0.5 * form(omega) + gravity
    # dE/dt = omega0 n . dH/dt, and the normal stands still in space
    jacobi = energy - omega0 * np.sum(normal * (omega @ inertia + wheels), axis=1)
    assert np.ptp(gravity) > 1e-7
    assert np.ptp(energy) > 5e-7
    assert np.ptp(jacobi) < 1e-11


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_momentum_changes_by_the_recorded_torque(make, integrator):
    wheels = WHEELS[integrator]
    scenario = make(
        {
            "environment.field.kind": "igrf14",
            "spacecraft.body.wheel_momentum_n_m_s": wheels,
            "spacecraft.coils.residual_dipole_a_m2": [0.1, -0.2, 0.15],
            "control.law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e6},
            "control.sample_s": 4.0,
            "simulation.step_s": 0.5,
            "simulation.record_s": 1.0,
            "simulation.duration_s": 400.0,
            **by(integrator),
        }
    )
    result = simulate(scenario)
    inertia = inertia_of(scenario)
    to_inertial = Rotation.from_quat(result.q_body_to_inertial.values)
    b = body_from_inertial(result, "b_inertial")
    assert np.abs(b - result.b_body.values).max() < 1e-18
    momentum = to_inertial.apply(result.omega_body.values @ inertia + wheels)
    assert np.abs(momentum - result.momentum_inertial.values).max() < 1e-15
    dipole = result.dipole_body.values
    assert np.array_equal(dipole[1], dipole[3]) and not np.array_equal(dipole[3], dipole[4])
    gravity = gravity_torque(inertia, body_from_inertial(result, "position_inertial"))
    error = []
    for k in range(0, len(dipole) - 1, 4):  # Simpson's rule over each hold
        five = slice(k, k + 5)
        torque = to_inertial[five].apply(np.cross(dipole[k], b[five]) + gravity[five])
        impulse = (torque[0] + 4 * torque[1] + 2 * torque[2] + 4 * torque[3] + torque[4]) / 3.0
        error.append(momentum[k + 4] - momentum[k] - impulse)
    assert np.linalg.norm(np.diff(momentum[::4], axis=0), axis=1).min() > 1e-6
    assert np.abs(error).max() < 1e-11


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_momentum_changes_by_the_torque_of_coils_that_lag(make, integrator):
    """The dipole that moves the body goes to its target as the recorded one does."""
    scenario = make(
        {
            "environment.gravity_gradient": False,
            "spacecraft.coils.lag_s": 4.0,
            "control.law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e6},
            "control.sample_s": 4.0,
            "simulation.step_s": 0.5,
            "simulation.record_s": 0.5,
            "simulation.duration_s": 200.0,
            **by(integrator),
        }
    )
    result = simulate(scenario)
    momentum = result.momentum_inertial.values
    torque = np.cross(result.dipole_body.values, result.b_body.values)
    torque = Rotation.from_quat(result.q_body_to_inertial.values).apply(torque)
    simpson = np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]) / 6.0
    holds = range(0, len(torque) - 1, 8)
    change = np.array([momentum[k + 8] - momentum[k] for k in holds])
    impulse = np.array([simpson @ torque[k : k + 9] for k in holds])
    assert np.linalg.norm(change, axis=1).max() > 1e-4
    assert np.abs(change - impulse).max() < 1e-8


def by_scipy(scenario, result):
    """The final state by another integrator, under the dipoles held in the run."""
    inertia, environment = inertia_of(scenario), scenario.orbit_environment()
    wheels = np.array(scenario.spacecraft.body.wheel_momentum_n_m_s)

    def rates(t, y, dipole):
        around_now = environment.sample(np.array([t]))[0]
        q, w, to_body = y[:4], y[4:], Rotation.from_quat(y[:4]).inv()
        r, b = to_body.apply(around_now[:3]), to_body.apply(around_now[3:6])
        torque = np.cross(dipole, b) + gravity_torque(inertia, r)
        torque -= np.cross(w, inertia @ w + wheels)
        dq = 0.5 * np.append(q[3] * w + np.cross(q[:3], w), -q[:3] @ w)
        return np.append(dq, np.linalg.solve(inertia, torque))

    y, hold_s = start_state(result), scenario.control.sample_s
    for t in np.arange(0.0, result.time.values[-1], hold_s):
        dipole = result.dipole_body.sel(time=t).values
        span = (t, t + hold_s)
        y = solve_ivp(rates, span, y, "DOP853", args=(dipole,), rtol=1e-11, atol=1e-13).y[:, -1]
    return y


def controlled(make, integrator, step_s, wheels):
    return make(
        {
            "environment.field.kind": "igrf14",
            "environment.earth_rotation": "precise",
            "spacecraft.body.wheel_momentum_n_m_s": wheels,
            "control.law": {"kind": "bdot_derivative", "gain_a_m2_s_per_t": 1e6},
            "control.sample_s": 20.0,
            "simulation.step_s": step_s,
            "simulation.duration_s": 200.0,
            **by(integrator),
        }
    )


@pytest.mark.parametrize(
    ("integrator", "tolerance"),
    [("auto", 1e-9), ("rk4", 2e-9), ("splitting", 2e-8)],
)
def test_final_state_equals_that_of_scipy(make, integrator, tolerance):
    scenario = controlled(make, integrator, 0.25, WHEELS[integrator])
    result = simulate(scenario)
    assert np.linalg.norm(result.dipole_body.values, axis=1).max() > 0.5
    assert state_error(final_state(result), by_scipy(scenario, result)) < tolerance


def test_splitting_with_wheels_is_of_order_two(make):
    errors = []
    for step_s in (1.0, 0.5, 0.25):
        scenario = controlled(make, "splitting", step_s, WHEELS["rk4"])
        result = simulate(scenario)
        errors.append(state_error(final_state(result), by_scipy(scenario, result)))
    assert np.abs(np.log2(np.divide(errors[:-1], errors[1:])) - 2.0).max() < 0.1


def free(make, **simulation):
    return simulate(make({
        "environment.gravity_gradient": False,
        "environment.field.kind": "igrf14",
        "initial.rate_deg_s": [10.0, -6.0, 8.0],
        **{f"simulation.{key}": value for key, value in simulation.items()},
    }))  # fmt: skip


def test_free_motion_keeps_momentum_and_energy_and_integrators_agree(make):
    steps = ({"step_s": 0.1}, {"integrator": "splitting", "step_s": 0.1}, {"tolerance_deg": 1e-7})
    results = [free(make, duration_s=300.0, **{"step_s": None} | each) for each in steps]
    inertia = inertia_of(make())
    for result, tolerance in zip(results, (1e-7, 1e-11, 1e-9), strict=True):
        momentum = result.momentum_inertial.values
        drift = np.linalg.norm(momentum - momentum[0], axis=1) / np.linalg.norm(momentum[0])
        omega = result.omega_body.values
        energy = 0.5 * np.einsum("ni,ij,nj->n", omega, inertia, omega)
        assert drift.max() < tolerance
        assert np.abs(energy / energy[0] - 1.0).max() < tolerance
    exact = final_state(results[1])
    assert state_error(final_state(results[0]), exact) < 1e-6
    assert state_error(final_state(results[2]), exact) < 1e-8


def driven(make, integrator, step_s, rate_deg_s, **simulation):
    """A body with a residual dipole: a smooth torque that needs no sampling."""
    return final_state(simulate(make({
        "spacecraft.coils.residual_dipole_a_m2": [20.0, -10.0, 15.0],
        "initial.rate_deg_s": rate_deg_s,
        "control.sample_s": 40.0,
        "simulation.duration_s": 400.0,
        "simulation.record_s": 40.0,
        "simulation.step_s": step_s,
        "simulation.integrator": integrator,
        **simulation,
    })))  # fmt: skip


SLOW, FAST = [1.0, -0.6, 0.8], [20.0, -15.0, 60.0]


def exactly_driven(make, rate_deg_s):
    return driven(make, "auto", None, rate_deg_s, **{"simulation.tolerance_deg": 1e-10})


def orders(make, integrator, rate_deg_s, steps_s):
    exact = exactly_driven(make, rate_deg_s)
    errors = [state_error(driven(make, integrator, h, rate_deg_s), exact) for h in steps_s]
    return np.log2(np.divide(errors[:-1], errors[1:]))


def test_rk4_is_of_order_four(make):
    assert np.abs(orders(make, "rk4", SLOW, (2.0, 1.0, 0.5, 0.25)) - 4.0).max() < 0.2


def test_splitting_has_order_four_for_small_torque_and_otherwise_two(make):
    assert np.abs(orders(make, "splitting", FAST, (2.0, 1.0, 0.5)) - 4.0).max() < 0.2
    assert np.abs(orders(make, "splitting", SLOW, (2.0, 1.0, 0.5)) - 2.0).max() < 0.02


def test_splitting_beats_rk4_on_fast_spinner_with_tenfold_step(make):
    exact = exactly_driven(make, FAST)
    splitting = state_error(driven(make, "splitting", 1.0, FAST), exact)
    rk4 = state_error(driven(make, "rk4", 0.1, FAST), exact)
    assert splitting < 0.3 * rk4


def sphere(make, changes):
    """A sphere with strong coils: only B-dot acts, and never at its limit."""
    return simulate(make({
        "spacecraft.body.inertia_kg_m2": [1.0, 1.0, 1.0],
        "spacecraft.coils.limit_a_m2": 1e6,
        "initial.euler_deg": [0.0, 0.0, 0.0],
        **changes,
    }))  # fmt: skip


def test_b_dot_ends_at_twice_orbital_rate_about_cone_axis(make):
    result = sphere(make, {
        "orbit.inclination_deg": 70.0,
        "initial.rate_deg_s": [0.5, -0.3, 0.4],
        "control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 5e5},
        "control.sample_s": 2.0,
        "simulation": {"revolutions": 10, "step_s": 2.0, "record_s": 100.0},
    })  # fmt: skip
    scenario = make()
    omega0 = scenario.orbit.rate_rad_s()
    theta = cone_angle(np.radians(70.0))
    axis = np.array([0.0, -np.sin(theta), np.cos(theta)])  # Z3 in Y, which is J here: raan = 0
    rate = result.momentum_inertial.values[-1]  # J = 1
    assert np.linalg.norm(rate) == pytest.approx(2.0 * omega0, rel=0.01)
    assert np.degrees(np.arccos(unit(rate) @ axis)) < 1.0


#: MAG 5.1: omega0, B0, and k B0^2/(J omega0) = 1, of a sphere of 1 kg m^2.
TUMBLING = {"omega0": 1e-3, "b0": 2.656e-5, "inclination": np.radians(62.0)}


def tumbling(make, model, rho=0.1):
    """Three revolutions from 10 omega0 at `rho` to the cone axis: result, gain, first rate."""
    omega0, b0, inclination = TUMBLING.values()
    radius_km = 1e-3 * (MU_EARTH_M3_S2 / omega0**2) ** (1.0 / 3.0)
    field = {"kind": "averaged", "b0": b0}
    if model != "averaged":
        mu_e = b0 / mean_over_orbit(1.0, inclination) * radius_km**3
        field = {"kind": model, "mu_e_t_km3": mu_e}
    if model == "tilted_dipole":
        field |= {"tilt_deg": 168.4, "longitude_deg": 107.4}
    gain, leaning = omega0 / b0**2, cone_angle(inclination) + rho
    rate = 10.0 * omega0 * np.array([0.0, -np.sin(leaning), np.cos(leaning)])
    result = sphere(make, {
        "orbit": {"kind": "circular", "radius_km": radius_km, "inclination_deg": 62.0},
        "environment.field": field,
        "initial.rate_deg_s": np.degrees(rate).tolist(),
        "control": {"law": {"kind": "bdot_derivative", "gain_a_m2_s_per_t": gain}, "sample_s": 1.0},
        "simulation": {"revolutions": 3.0, "step_s": 1.0, "record_s": 10.0},
    })  # fmt: skip
    return result, gain, rate


MODELS = ["averaged", "direct_dipole", "tilted_dipole"]


@pytest.mark.parametrize("model", MODELS)
def test_momentum_under_bdot_is_that_of_its_linear_equation(make, model):
    """A sphere: omega' = k (B x B' - B^2 omega + B (B.omega)), in the field of the run."""
    result, gain, rate = tumbling(make, model)
    field = CubicSpline(result.time.values, result.b_inertial.values)
    slope = field.derivative()

    def rates(t, omega):
        b = field(t)
        return gain * np.cross(b, slope(t) - np.cross(omega, b))

    found = solve_ivp(rates, result.time.values[[0, -1]], rate, t_eval=result.time.values,
                      rtol=1e-8, atol=1e-12)  # fmt: skip
    apart = np.linalg.norm(found.y.T - result.momentum_inertial.values, axis=1)
    assert apart.max() < 2e-3 * np.linalg.norm(rate)


def momentum_of(result):
    """Over that of the turn with twice the orbital rate."""
    return np.linalg.norm(result.momentum_inertial.values, axis=1) / (2.0 * TUMBLING["omega0"])


def test_bdot_slows_tumbling_alike_under_three_models_of_the_field(make):
    """MAG Fig. 5.1.1: practically the same time; about half a revolution below the steady turn,
    which is so for a satellite that rotates against the field.
    """
    runs = [momentum_of(tumbling(make, model)[0]) for model in MODELS]
    turns = np.linspace(0.0, 3.0, len(runs[0]))
    assert runs[0][turns > 2.0] == pytest.approx(1.0, abs=1e-3)
    assert np.ptp([turns[np.argmax(run < 2.0)] for run in runs]) < 0.25
    below = [3.0 * np.mean(run < 0.95) for run in
             (runs[0], momentum_of(tumbling(make, "averaged", np.pi - 0.1)[0]))]  # fmt: skip
    assert below[0] == 0.0 and 0.25 < below[1] < 0.75


@pytest.mark.parametrize("law", ["bdot", "bdot_rate", "bdot_derivative"])
def test_damping_time_is_what_the_gain_was_chosen_for(make, law):
    scenario = make({"orbit.inclination_deg": 60.0})
    b = scenario.orbit_environment().sample(np.zeros(1))[0, 3:6]
    damping_time_s = scenario.orbit.period_s
    gain = bdot_gain(damping_time_s, 1.0, np.linalg.norm(b))
    result = sphere(make, {
        "initial.rate_deg_s": [3.0, 3.0, 3.0],
        "control.law": {"kind": law, "gain_a_m2_s_per_t": gain},
        "simulation": {"revolutions": 2, "step_s": 1.0, "record_s": 10.0},
    })  # fmt: skip
    rate = np.linalg.norm(result.omega_body.values, axis=1)
    e_fold = result.time.values[np.argmax(rate < rate[0] / np.e)]
    assert e_fold == pytest.approx(damping_time_s, rel=0.15)


@pytest.mark.parametrize("window", [{"measure_s": 6.0, "sample_s": 3.0, "actuate_s": 3.0}, {}])
@pytest.mark.parametrize("part", [0.5, 0.9, 1.1, 1.3])
def test_sampled_bdot_brakes_up_to_the_limit_and_drives_above(make, part, window):
    difference_s, hold_s, duty = (3.0, 3.0, 1.0 / 3.0) if window else (1.0, 1.0, 1.0)
    spin = part * sampling_limit_rad_s(difference_s, hold_s)
    result = sphere(make, {
        "orbit.inclination_deg": 0.0,  # the averaged field stands still along J3
        "initial.rate_deg_s": [np.degrees(spin), 0.0, 0.0],
        "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 2e4}, **window},
        "simulation": {"duration_s": 3600.0, "step_s": 0.25, "record_s": 9.0},
    })  # fmt: skip
    b2 = np.sum(result.b_body.values[0] ** 2)
    braking = 2e4 * b2 * duty * damping_efficiency(spin, difference_s, hold_s)
    rate = result.omega_body.values[:, 0]
    assert np.sign(spin - rate[-1]) == np.sign(1.0 - part)
    # the first cycle has no earlier reading, or an old one
    assert np.log(rate[1] / rate[-1]) == pytest.approx(braking * 3591.0, rel=0.03)


def test_table_and_exact_environment_agree(make):
    changes = {
        "environment.field.kind": "igrf14",
        "environment.earth_rotation": "precise",
        "control.law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e5},
        "initial.rate_deg_s": [1.0, -0.6, 0.8],
        "simulation": {"revolutions": 1, "step_s": 1.0, "record_s": 10.0},
    }
    table = simulate(make(changes))
    exact = simulate(make(changes | {"environment.table_tolerance": 0.0}))
    assert 0.0 < table.attrs["table_relative_error"] <= 1e-9
    assert exact.attrs["table_relative_error"] == 0.0
    assert state_error(final_state(table), final_state(exact)) < 1e-6
    assert not np.array_equal(final_state(table), final_state(exact))


SGP4 = {
    "orbit": {
        "kind": "sgp4",
        "tle": [
            "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
            "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
        ],
    },
    "environment.field.kind": "igrf14",
}


def test_precise_and_sidereal_rotation_agree_on_the_field_on_ground(make):
    seen = []
    for mode in ("precise", "sidereal"):
        scenario = make(SGP4 | {"environment.earth_rotation": mode})
        result = simulate(scenario)
        to_ecef = scenario.orbit_environment().dcm_to_ecef(result.time.values)
        seen.append([
            np.einsum("nij,nj->ni", to_ecef, result[name].values)
            for name in ("b_inertial", "position_inertial")
        ] + [result.b_inertial.values, result.latitude.values])  # fmt: skip
    (b, r, b_j, lat), (b_other, r_other, b_j_other, lat_other) = seen
    assert np.abs(r - r_other).max() < 1e-6 * 7e6 * 1e-3
    assert np.abs(b - b_other).max() < 1e-9 * np.abs(b).max()
    assert np.abs(lat - lat_other).max() < 1e-8
    lengths = np.linalg.norm(b_j, axis=1), np.linalg.norm(b_j_other, axis=1)
    assert np.abs(lengths[0] / lengths[1] - 1.0).max() < 1e-9
    assert np.abs(b_j - b_j_other).max() > 1e-4 * np.abs(b_j).max()  # twelve years of precession


def test_derived_variables_follow_from_the_recorded_ones(make):
    scenario = make(SGP4 | {
        "initial.reference": "orbital",
        "initial.rate_relative_to": "orbital",
        "initial.rate_deg_s": [0.2, -0.1, 0.3],
        "environment.earth_rotation": "precise",
    })  # fmt: skip
    result = simulate(scenario)
    first = result.isel(time=0)
    assert np.degrees(first.omega_orbital.values) == pytest.approx([0.2, -0.1, 0.3], rel=1e-9)
    r, v = result.position_inertial.values, result.velocity_inertial.values
    up, normal = unit(r), unit(np.cross(r, v))
    orbital = np.stack([np.cross(normal, up), normal, up], axis=-1)
    turn = Rotation.from_euler("ZYX", [20.0, -35.0, 70.0], degrees=True)
    expected = (Rotation.from_matrix(orbital[0]) * turn).as_quat()
    q = first.q_body_to_inertial.values
    assert min(np.abs(q - expected).max(), np.abs(q + expected).max()) < 1e-12
    assert np.linalg.norm(result.q_body_to_inertial.values, axis=1) == pytest.approx(1.0, abs=1e-12)
    # rates relative to the orbital frame, from the finite turn of that frame
    inertial = Rotation.from_quat(result.q_body_to_inertial.values)
    relative = Rotation.from_matrix(orbital).inv() * inertial
    mean = (relative[:-1].inv() * relative[1:]).as_rotvec() / np.diff(result.time.values)[:, None]
    both = 0.5 * (result.omega_orbital.values[1:] + result.omega_orbital.values[:-1])
    assert np.abs(mean - both).max() < 1e-3 * np.abs(both).max()
    assert result.altitude.values == pytest.approx(np.linalg.norm(r, axis=1) - 6371e3, abs=22e3)
    assert np.linalg.norm(result.sun_inertial.values, axis=1) == pytest.approx(1.0, abs=1e-12)
    start = np.datetime64("2012-03-04T10:31:47")
    assert np.array_equal(result.utc.values - start, (result.time.values * 1e9).astype("m8[ns]"))


def test_utc_knows_the_leap_second(make):
    result = simulate(make({"start": "2012-06-30T23:59:30Z", "simulation.duration_s": 60.0}))
    last = result.utc.values[-1]
    assert last == np.datetime64("2012-07-01T00:00:29")  # 23:59:60 lies in between
