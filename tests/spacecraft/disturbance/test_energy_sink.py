"""The energy sink: momentum, closed form, a whole damper as twin, where it ends, mistakes."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from torquer.analysis.notes.disturbance_notes import disturbance_notes
from torquer.compile import engine
from torquer.environment.local import LocalEnvironment
from torquer.scenario.load import ScenarioError, scenario_from_data
from torquer.simulation.setup.simulate import resume, simulate
from torquer.spacecraft.body import Body
from torquer.spacecraft.disturbance.energy_sink import EnergySink, energy_sink_torque

compiled = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ZERO = (0.0, 0.0, 0.0)
NOWHERE = LocalEnvironment(ZERO, ZERO, (), (), (0.0,))
OBLATE, PROLATE = (1.0, 1.0, 1.4), (1.0, 1.0, 0.6)


def free(moments, omega_rad_s, sink, duration_s, record_s=1.0, **keys):
    """A body without torques from outside."""
    return scenario_from_data({
        "start": "2020-03-20T00:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 60.0},
        "environment": {"gravity_gradient": False},
        "spacecraft": {"body": {"inertia_kg_m2": list(moments)} | keys.pop("body", {})}
                      | keys.pop("craft", {}),
        "disturbance": {"energy_sink": sink},
        "initial": {"rate_deg_s": np.degrees(omega_rad_s).tolist()},
        "control": {"law": {"kind": "off"}, "sample_s": record_s},
        "simulation": {"duration_s": duration_s, "record_s": record_s, "tolerance_deg": 1e-7},
    } | keys)  # fmt: skip


def flown(moments, omega_rad_s, sink, duration_s, record_s=1.0, **keys):
    """Time [s], rate (n, 3) and momentum (n, 3), in the body."""
    result = simulate(free(moments, omega_rad_s, sink, duration_s, record_s, **keys))
    omega = result["omega_body"].values
    return result["time"].values, omega, omega * np.array(moments)


def nutation(momentum):
    """Angle [rad] of the momentum from axis 3."""
    return np.arctan2(np.hypot(momentum[..., 0], momentum[..., 1]), momentum[..., 2])


# ------------------------------------------------------------------ the torque


def test_torque_keeps_the_momentum_and_takes_the_energy_of_the_damper():
    """M . H = 0, and w . M = -w'.K w', at any rate and with a wheel."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        spread, k = rng.normal(size=(2, 3, 3))
        inertia = np.eye(3) * 3.0 + 0.2 * (spread + spread.T)
        sink = EnergySink(damper_kg_m2=tuple(map(tuple, k @ k.T)), time_constant_s=0.3)
        body = Body(inertia_kg_m2=tuple(map(tuple, inertia)),
                    wheel_momentum_n_m_s=tuple(rng.normal(size=3)))  # fmt: skip
        omega = rng.normal(size=3)
        torque = np.array(energy_sink_torque(sink.pack((), body), NOWHERE, tuple(omega)))
        momentum = inertia @ omega + body.wheel_momentum_n_m_s
        w_rate = np.linalg.solve(inertia, np.cross(momentum, omega))
        size = np.linalg.norm(torque) * np.linalg.norm(momentum)
        assert abs(torque @ momentum) < 1e-13 * size
        assert omega @ torque == pytest.approx(-0.3 * w_rate @ (k @ k.T) @ w_rate, rel=1e-11)


# ------------------------------------------------------------------ motion


@compiled
@pytest.mark.parametrize("moments", (OBLATE, PROLATE))
def test_nutation_changes_as_the_closed_form_says(moments):
    """tan(theta) = tan(theta_0) exp(-t/T); a prolate body falls over.

    From T' = -w'.K w' and |H| of an axisymmetric body: 1/T = K H^2 (J - J_t)/(J_t^3 J).
    """
    across, along = moments[0], moments[2]
    omega = np.array([0.25, 0.0, 0.9])
    h2 = float(np.sum((omega * moments) ** 2))
    sink = {"damper_kg_m2": 0.02, "time_constant_s": 0.05}
    rate = 1e-3 * h2 * (along - across) / (across**3 * along)
    duration_s = round(3.0 / abs(rate))
    t, _, momentum = flown(moments, omega, sink, duration_s, duration_s / 40.0)
    wanted = np.arctan(math.tan(nutation(momentum[0])) * np.exp(-rate * t))
    assert np.abs(nutation(momentum) - wanted).max() < 1e-8
    assert (nutation(momentum)[-1] - nutation(momentum)[0]) * rate < 0.0
    assert np.ptp(np.linalg.norm(momentum, axis=1)) < 1e-10 * math.sqrt(h2)


def cross(a, b):
    """The product of two vectors: `np.cross` takes ten times as long for a single one."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def whole_damper(moments, damper, tau, omega, duration_s):
    """Momentum in the body [3] after a time, with the damper's own rate as a state, by SciPy."""
    inertia = np.array(moments)
    rest, drag = inertia - damper, damper / tau

    def rates(_, y):
        w, d = y[:3], y[3:]
        w_rate = (drag * d - cross(w, rest * w)) / rest
        return np.concatenate((w_rate, -d / tau - w_rate - cross(w, d)))

    # the same momentum J W, and the damper as it follows a free body
    ahead = -cross(omega, inertia * omega) / inertia
    start = np.concatenate((omega + damper * tau * ahead / inertia, -tau * ahead))
    done = solve_ivp(rates, (0.0, duration_s), start, method="DOP853", rtol=1e-10, atol=1e-12)
    return inertia * done.y[:3, -1] + damper * done.y[3:, -1]


@compiled
def test_a_whole_damper_comes_to_the_sink_as_the_square_of_its_time():
    """Nutation after 0.7 of the damping time, for ever faster dampers: order 2."""
    omega, damper = np.array([0.5, 0.0, 0.6]), 0.05
    h2 = float(np.sum((omega * OBLATE) ** 2))
    times, errors = (0.4, 0.2, 0.1, 0.05), []
    for tau in times:
        duration_s = round(0.7 * OBLATE[2] / (damper * tau * h2 * 0.4), 1)
        sink = {"damper_kg_m2": damper, "time_constant_s": tau}
        _, _, momentum = flown(OBLATE, omega, sink, duration_s, duration_s)
        theirs = whole_damper(OBLATE, damper, tau, omega, duration_s)
        errors.append(abs(nutation(momentum[-1]) - nutation(theirs)))
    order = np.diff(np.log(errors)) / np.diff(np.log(times))
    assert order == pytest.approx(2.0, abs=0.2) and errors[-1] < 5e-4


@compiled
def test_the_end_is_a_spin_about_the_axis_of_greatest_inertia():
    """From next to the axis of the least: three different moments, a damper about one axis."""
    moments = (0.5, 0.9, 1.2)
    sink = {"damper_kg_m2": [0.05, 0.02, 0.0], "time_constant_s": 0.2}
    _, omega, momentum = flown(moments, [1.5, 0.01, 0.02], sink, 6000.0, 20.0)
    size = np.linalg.norm(momentum, axis=1)
    energy = 0.5 * np.sum(omega * momentum, axis=1)
    assert abs(momentum[-1, 2]) == pytest.approx(size[-1], rel=1e-6)
    assert energy[-1] == pytest.approx(size[-1] ** 2 / (2.0 * 1.2), rel=1e-6)
    assert abs(momentum[0, 0]) == pytest.approx(size[0], rel=1e-3)
    assert np.all(np.diff(energy) <= 1e-12) and np.ptp(size) < 1e-9 * size[0]


@compiled
def test_a_wheel_within_the_body_is_known():
    """A fixed wheel makes a spin about the axis of least inertia stable (dual spin)."""
    moments, sink = (1.0, 1.0, 0.6), {"damper_kg_m2": 0.02, "time_constant_s": 0.1}
    omega = np.array([0.1, 0.0, 0.3])
    ends = []
    for wheel in (0.0, 1.0):
        body = {"wheel_momentum_n_m_s": [0.0, 0.0, wheel]}
        _, _, momentum = flown(moments, omega, sink, 2000.0, 500.0, body=body)
        momentum = momentum + np.array([0.0, 0.0, wheel])
        ends.append(nutation(momentum)[[0, -1]])
        assert np.ptp(np.linalg.norm(momentum, axis=1)) < 1e-9
    assert ends[0][1] > ends[0][0] and ends[1][1] < 0.5 * ends[1][0]


@compiled
def test_a_run_goes_on_bit_for_bit():
    scenario = free(OBLATE, [0.3, 0.1, 0.8], {"damper_kg_m2": 0.05, "time_constant_s": 0.1}, 60.0)
    whole, part = simulate(scenario), simulate(scenario, until_s=23.0)
    assert np.array_equal(resume(part)["omega_body"].values, whole["omega_body"].values)


# ------------------------------------------------------------------ mistakes and notes


@pytest.mark.parametrize(
    ("sink", "keys", "message"),
    (
        ({"damper_kg_m2": [[0.1, 0.05, 0], [0, 0.1, 0], [0, 0, 0.1]]}, {},
         "damper_kg_m2: must be symmetric"),
        ({"damper_kg_m2": [0.1, 0.1, -0.1]}, {}, "damper_kg_m2: must have no negative principal"),
        ({"damper_kg_m2": 0.7}, {},
         "disturbance.energy_sink.damper_kg_m2: must be below the body's inertia"),
        ({"time_constant_s": 0.0}, {}, "time_constant_s"),
        ({}, {"simulation": {"duration_s": 60.0, "record_s": 1.0, "step_s": 0.5,
                             "integrator": "splitting"}},
         "simulation.integrator: must be 'auto' or 'rk4' with disturbance.energy_sink; received"),
        ({}, {"craft": {"wheels": {"layout": {"kind": "orthogonal"},
                                   "torque_limit_n_m": 0.01, "momentum_limit_n_m_s": 0.1}}},
         "disturbance.energy_sink: must be left out with spacecraft.wheels"),
    ),
)  # fmt: skip
def test_mistakes_are_one_line(sink, keys, message):
    given = {"damper_kg_m2": 0.02, "time_constant_s": 0.1} | sink
    with pytest.raises(ScenarioError, match=message):
        free(PROLATE, [0.1, 0.0, 0.5], given, 60.0, **keys)


@pytest.mark.parametrize(
    ("sink", "said"),
    (
        ({"damper_kg_m2": 0.02, "time_constant_s": 0.1}, []),
        ({"damper_kg_m2": 0.02, "time_constant_s": 3.0}, ["follows at once"]),
        ({"damper_kg_m2": 0.3, "time_constant_s": 0.1}, ["is for a small damper"]),
        ({"damper_kg_m2": 0.0, "time_constant_s": 0.1}, ["has no effect"]),
    ),
)
def test_notes_tell_where_it_is_not_valid(sink, said):
    notes = disturbance_notes(free(PROLATE, [0.1, 0.0, 0.5], sink, 60.0))
    assert len(notes) == len(said) and all(a in b for a, b in zip(said, notes, strict=True))
