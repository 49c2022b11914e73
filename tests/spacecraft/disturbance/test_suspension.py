"""A body on the bearing of a test bench: pendulum, friction, the ring, and one line per mistake."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from torquer.analysis.budget import budget_while_held
from torquer.base.conventions import EARTH_RADIUS_M, EARTH_RATE_RAD_S, MU_EARTH_M3_S2
from torquer.maths.geometry.attitudes import to_body
from torquer.scenario.load import ScenarioError, load_scenario, scenario_from_data
from torquer.simulation.setup.simulate import RunStopped, simulate

EXAMPLE = Path(__file__).parents[3] / "examples/bench.toml"
INERTIA, MASS, FALL = (0.3, 0.4, 0.5), 20.0, 9.80665


def bench(
    suspension, euler_deg=(0.0, 0.0, 0.0), rate_deg_s=(0.0, 0.0, 0.0), duration_s=200.0, **keys
):
    """A body on a bench without coils."""
    return scenario_from_data({
        "start": "2012-01-15T09:00:00Z",
        "orbit": {"kind": "bench", "latitude_deg": 55.8, "longitude_deg": 37.6},
        "environment": {"field": {"kind": "helmholtz_coils"}},
        "spacecraft": {"body": {"inertia_kg_m2": list(INERTIA), "mass_kg": MASS}},
        "disturbance": {"suspension": suspension} | keys,
        "initial": {"reference": "orbital", "euler_deg": list(euler_deg), "sequence": "123",
                    "rate_deg_s": list(rate_deg_s)},
        "control": {"law": {"kind": "off"}, "sample_s": 1.0},
        "simulation": {"duration_s": duration_s, "record_s": 1.0},
    })  # fmt: skip


def upward(result):
    """The vertical in the body [n, 3]."""
    r = result["position_inertial"].values
    return to_body(result["q_body_to_inertial"].values, r / np.linalg.norm(r, axis=1)[:, None])


def test_pendulum_swings_as_the_elliptic_integral_says():
    """From 25 deg about axis 1: period 4 K(sin^2 12.5 deg) sqrt(J/(m g h))."""
    arm = 2e-5
    result = simulate(bench({"centre_of_mass_m": [0.0, 0.0, -arm]}, (25.0, 0.0, 0.0)))
    up, t = upward(result), result["time"].values
    angle = np.arctan2(up[:, 1], up[:, 2])
    down = np.flatnonzero((angle[:-1] > 0.0) & (angle[1:] <= 0.0))
    crossing = t[down] + angle[down] / (angle[down] - angle[down + 1])
    slow = math.sqrt(INERTIA[0] / (MASS * FALL * arm))
    period = 4.0 * ellipk(math.sin(math.radians(12.5)) ** 2) * slow
    # the crossings are interpolated between rows 1 s apart; the Earth's rotation adds 1e-3
    assert np.diff(crossing) == pytest.approx(period, rel=2e-3) and len(crossing) >= 3


def test_jacobis_integral_is_kept_without_friction():
    """w.J w/2 of the rate relative to the Earth, potentials of weight and gravity gradient."""
    arm, inertia = np.array([2e-6, -1e-6, -2e-5]), np.array(INERTIA)
    result = simulate(
        bench({"centre_of_mass_m": arm.tolist()}, (15.0, -8.0, 30.0), (0.0, 0.0, 3.0))
    )
    up, q = upward(result), result["q_body_to_inertial"].values
    axis = to_body(q, np.tile([0.0, 0.0, 1.0], (len(q), 1)))  # the Earth's, within its precession
    relative = result["omega_body"].values - EARTH_RATE_RAD_S * axis
    weight = MASS * FALL * up @ arm
    gradient = 1.5 * MU_EARTH_M3_S2 / EARTH_RADIUS_M**3 * up**2 @ inertia
    centrifugal = -0.5 * EARTH_RATE_RAD_S**2 * axis**2 @ inertia
    total = 0.5 * relative**2 @ inertia + weight + gradient + centrifugal
    assert np.ptp(weight) > 1e-4
    # precession moves the Earth's axis by 1.2e-3 rad since J2000
    assert np.ptp(total) < 1e-5 * np.ptp(weight)


def test_friction_and_the_bearings_torque_are_those_of_one_equation():
    """About the vertical J w' = M - k w - c w^2, against SciPy."""
    k, c, torque = 2e-3, 5e-3, -4e-4
    given = {"viscous_n_m_s": k, "air_drag_n_m_s2": c, "vertical_torque_n_m": torque}
    result = simulate(bench(given, rate_deg_s=(0.0, 0.0, 15.0)))
    t, w = result["time"].values, result["omega_body"].values[:, 2]

    def rate(_, w):
        return (torque - k * w - c * abs(w) * w) / INERTIA[2]

    wanted = solve_ivp(rate, (0.0, 200.0), [math.radians(15.0)], t_eval=t, rtol=1e-10, atol=1e-12)
    assert np.abs(w - wanted.y[0]).max() < EARTH_RATE_RAD_S  # the laboratory's own
    assert w[-1] < 0.0 < w[0]


def test_warming_up_moves_the_centre_of_mass():
    """Torque up x m g (a + b (1 - exp(-t/T))) of a body that is held upright."""
    a, b, warm_s = np.array([1e-6, 2e-6, 0.0]), np.array([-4e-6, 1e-6, 0.0]), 80.0
    given = {"centre_of_mass_m": a.tolist(), "warm_up_shift_m": b.tolist(), "warm_up_s": warm_s}
    budget = budget_while_held(bench(given))
    arm = a + np.outer(1.0 - np.exp(-budget.t_s / warm_s), b)
    expected = MASS * FALL * np.cross([0.0, 0.0, 1.0], arm)
    assert np.abs(budget.disturbance["suspension"] - expected).max() < 1e-9


def test_a_run_ends_where_the_body_strikes_the_ring():
    """With the centre of mass above the centre of rotation the body falls over."""
    scenario = bench(
        {"centre_of_mass_m": [0.0, 0.0, 2e-5], "tilt_limit_deg": 20.0}, (2.0, 0.0, 0.0)
    )
    line = r"the body tilts beyond the bearing's 20 deg \(disturbance.suspension.tilt_limit_deg\)"
    with pytest.raises(RunStopped, match=line) as stopped:
        simulate(scenario)
    tilt = np.degrees(np.arccos(upward(stopped.value.result)[:, 2]))
    end_s = stopped.value.result["time"].values[-1]
    # inverted pendulum: cosh(t/slow) = tilt/2 deg to first order
    slow = math.sqrt(INERTIA[0] / (MASS * FALL * 2e-5))
    assert tilt.max() < 20.0 and end_s == pytest.approx(slow * math.acosh(10.0), abs=2.0)


def test_example_is_damped_in_the_time_of_the_text():
    """MAG, section 5.2: about 700 s from 15 deg/s, to about 0.6 deg/s."""
    result = simulate(load_scenario(EXAMPLE))
    t, rate = result["time"].values, np.degrees(np.linalg.norm(result["omega_body"], axis=1))
    first = t[np.argmax(rate < 1.0)]
    assert 600.0 < first < 850.0 and rate[t > first].max() < 1.0
    assert 0.2 < rate[t > 900.0].mean() < 0.8
    tilt = np.degrees(np.arccos(upward(result)[:, 2]))
    assert 10.0 < tilt.max() < 30.0


@pytest.mark.parametrize(
    ("changes", "message"),
    (
        ({"orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 60.0},
          "environment": {"field": {"kind": "igrf14"}}},
         "disturbance.suspension: must be left out unless orbit.kind is 'bench'; received it with"),
        ({"orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 60.0},
          "disturbance": None},
         "environment.field.kind: must be another than 'helmholtz_coils' unless orbit.kind is"),
        ({"spacecraft": {"body": {"inertia_kg_m2": [0.3, 0.4, 0.5]}}},
         "spacecraft.body.mass_kg: must be given with disturbance.suspension, for the weight"),
        ({"environment": {"field": {"kind": "helmholtz_coils"}, "gravity_gradient": False}},
         "environment.gravity_gradient: must be true with disturbance.suspension"),
        ({"simulation": {"duration_s": 100.0, "step_s": 0.5, "record_s": 1.0,
                         "integrator": "splitting"}},
         "simulation.integrator: must be 'auto' or 'rk4' with disturbance.suspension"),
        ({"disturbance": {"suspension": {"axis": [0.0, 0.0, 0.0]}}}, "disturbance.suspension.axis"),
        ({"disturbance": {"suspension": {"tilt_limit_deg": 91.0}}},
         "disturbance.suspension.tilt_limit_deg: must be less than or equal to 90; received 91"),
        ({"orbit": {"kind": "bench", "latitude_deg": 90.0}}, "orbit.latitude_deg: must be less"),
    ),
)  # fmt: skip
def test_mistakes_are_one_line(changes, message):
    data = bench({}).model_dump(mode="json", exclude_unset=True) | changes
    if data["disturbance"] is None:
        del data["disturbance"]
    with pytest.raises(ScenarioError) as error:
        scenario_from_data(data)
    assert message in str(error.value) and "\n" not in str(error.value).strip()
