"""The error that `integration_error` states, against the true one, over random scenarios."""

import numpy as np
import pytest

from torquer import integration_error, simulate
from torquer.compile import engine
from torquer.maths.geometry.quaternion import angle_between

pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT"),
    pytest.mark.slow,
]

COUNT = 200


def random_case(random, number):
    """Changes to the plain scenario; the tolerances take turns from 1 to 1e-10 deg."""
    rate_deg_s = 10.0 ** random.uniform(-1.5, 1.5)
    direction = random.normal(size=3)
    law = random.choice(["off", "bdot", "bdot_rate"])
    gain = {} if law == "off" else {"gain_a_m2_s_per_t": 10.0 ** random.uniform(3.5, 5.0)}
    lag = {"lag_s": 0.3} if random.random() < 0.4 else {}
    changes = {
        "spacecraft.body.inertia_kg_m2": list(random_moments(random)),
        "spacecraft.coils": {"limit_a_m2": 0.2} | lag,
        "environment.field.kind": "igrf14",
        "initial.rate_deg_s": list(rate_deg_s * direction / np.linalg.norm(direction)),
        "control": {
            "law": {"kind": str(law)} | gain,
            "sample_s": float(random.choice([1.0, 2.0, 5.0, 10.0, 30.0])),
        },
        "simulation": {
            "duration_s": float(random.choice([600.0, 3000.0, 6000.0])),
            "record_s": 30.0,
            "tolerance_deg": 10.0 ** -(number % 11),
        },
    }
    if random.random() < 0.3:
        momentum = 10.0 ** random.uniform(-3.5, -2.0)
        changes["spacecraft.body.wheel_momentum_n_m_s"] = [0.0, 0.0, momentum]
    if random.random() < 0.3:
        changes["disturbance"] = {"random_torque_n_m": 1e-7, "random_hold_s": 60.0}
    return changes


def random_moments(random):
    """Principal moments of a body that can be built."""
    while True:
        moments = np.sort(random.uniform(0.01, 0.05, 3))
        if moments[2] < 0.95 * (moments[0] + moments[1]):
            return moments


def apart(a, b):
    """Greatest angle [rad] between two attitudes over a run."""
    return angle_between(a.q_body_to_inertial.values, b.q_body_to_inertial.values).max()


def reference(make, changes, longest_s):
    """The run with the finest tolerance, and no step longer than this."""
    finest = {"tolerance_deg": 1e-10, "max_step_s": longest_s}
    return simulate(make(changes | {"simulation": changes["simulation"] | finest}))


def test_measured_error_is_within_tenfold_of_the_true_one(make):
    """As far as the reference itself is known: to the change by twice as long steps."""
    random = np.random.default_rng(12)
    wrong, above = [], 0
    for number in range(COUNT):
        changes = random_case(random, number)
        result = simulate(make(changes))
        measured = float(integration_error(result).attitude_error.max())
        longest_s = min(0.5, 0.5 * float(result["mean_step"]))  # else it may be the run itself
        best = reference(make, changes, longest_s)
        true, unknown = apart(result, best), apart(best, reference(make, changes, 2.0 * longest_s))
        above += true > 10.0 * unknown
        if not 0.1 * (true - unknown) <= measured <= 10.0 * (true + unknown):
            wrong.append((number, true, unknown, measured))
    assert not wrong
    assert above > COUNT // 4
