"""A member of each study over an hour by an independent code: laws of their formulas in NumPy."""

import math

import numpy as np
import pytest
from plain_flight import PlainFlight, apart

from gallery.studies import bar_magnet, non_monotonic, pocketqube
from torquer.compile import engine
from torquer.scenario.change import with_values
from torquer.simulation.setup.simulate import simulate

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
HOUR_S = 3600.0
#: An arc cosine of 1 has half the digits.
ANGLE = 1e-7


class FieldDirection:
    """The law of the PocketQube: B-dot of the field's direction as mean dipole of pulses."""

    def __init__(self, scenario):
        law, self.sample_s = scenario.control.law.parameters, scenario.control.sample_s
        self.gain, self.full, self.weighted = (
            law["gain_a_m2_t_s"], law["full_a_m2"], law["weighted"],
        )  # fmt: skip
        self.bias = 1e-9 * np.array(scenario.spacecraft.magnetometer.bias_nt)
        self.before, self.turning = None, np.full(3, 0.25)

    def __call__(self, b, turning, omega):
        unit, size, h = (
            (b + self.bias) / np.linalg.norm(b + self.bias),
            np.linalg.norm(b + self.bias),
            self.sample_s,
        )
        rate = np.zeros(3) if self.before is None else (unit - self.before) / h
        if self.before is not None:
            self.turning += (0.5 * h * np.abs(rate) - self.turning) / 200.0
        self.before = unit
        weight = 16.0 * np.linalg.norm(self.turning) + 1.0 - math.sqrt(3.0) * 16.0 * 0.065 / 8.0
        wanted = -self.gain / (weight if self.weighted else 1.0) * rate / size
        on_s = 0.6 * h * np.minimum(1.0, np.abs(wanted) / self.full)
        return np.sign(wanted) * (on_s - 0.01) * self.full / h


def b_dot(b, turning, omega):
    return -1.0 * turning / np.linalg.norm(b)


class TwoFields:
    """The non-monotonic law: the six unknowns of both impulses at once."""

    def __init__(self, scenario):
        self.inertia = np.array(scenario.spacecraft.body.inertia)
        self.limit = np.array(scenario.spacecraft.coils.limit_a_m2)

    def __call__(self, b, turning, omega):
        later = b + 600.0 * (turning + np.cross(omega, b))
        both = np.vstack([_hat(b / np.linalg.norm(b)).T, _hat(later / np.linalg.norm(later)).T])
        now = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        matrix = np.eye(6) + now @ both @ both.T @ now + 100.0 * both @ both.T
        wanted = np.linalg.solve(matrix, (now + 100.0 * np.eye(6)) @ both @ self.inertia @ omega)
        return self.limit * np.tanh(3e3 * wanted[:3])


def _hat(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def flown(scenario, length_s):
    """A scenario for some time [s] with steps that do not matter, and the state at the end."""
    precise = with_values(scenario, {
        "simulation.revolutions": None, "simulation.duration_s": length_s,
        "simulation.integrator": "auto", "simulation.step_s": None,
        "simulation.tolerance_deg": 1e-9,
    })  # fmt: skip
    last = simulate(precise).isel(time=-1)
    return precise, np.r_[last["q_body_to_inertial"].values, last["omega_body"].values]


def pocketqube_member(law):
    quiet = {"spacecraft.magnetometer.noise_nt": 0.0, "spacecraft.magnetometer.resolution_nt": 0.0}
    return with_values(pocketqube.members("converged", law, 4)[3], quiet)


def six_laws_member(law):
    return non_monotonic.of_orbit(3, law, non_monotonic.CASES["no noise"])


def bar_magnet_member():
    """Magnet alone: rods on their limiting curves fly in NumPy-like code of their own already."""
    return with_values(bar_magnet.EXAMPLE, {
        "spacecraft.hysteresis_rods": [], "environment.gravity_gradient": False,
        "control.sample_s": 2.0,
    })  # fmt: skip


MEMBERS = {
    "pocketqube plain": (lambda: pocketqube_member("plain"), FieldDirection),
    "pocketqube weighted": (lambda: pocketqube_member("weighted"), FieldDirection),
    "B-dot": (lambda: six_laws_member("B-dot"), lambda scenario: b_dot),
    "non-monotonic": (lambda: six_laws_member("non-monotonic"), TwoFields),
    "bar magnet": (bar_magnet_member, lambda scenario: lambda b, turning, omega: np.zeros(3)),
}


@pytest.mark.parametrize(("name", "steps", "length_s", "most"), [
    *((name, None, 60.0, 1e-9) for name in MEMBERS),
    pytest.param("pocketqube plain", None, HOUR_S, 1e-6, marks=pytest.mark.slow),
    pytest.param("B-dot", 10, HOUR_S, 1e-6, marks=pytest.mark.slow),
    pytest.param("non-monotonic", 10, HOUR_S, 1e-6, marks=pytest.mark.slow),
    pytest.param("bar magnet", None, HOUR_S, 1e-6, marks=pytest.mark.slow),
])  # fmt: skip
def test_a_member_by_an_independent_code(name, steps, length_s, most):
    """Rates to a part of the first one."""
    member, law = MEMBERS[name]
    scenario, end = flown(member(), length_s)
    plain = PlainFlight(scenario, law(scenario), length_s)
    angle, rate = apart(end, plain.flown(steps))
    assert rate < most * np.linalg.norm(plain.start[4:]) and angle < max(most, ANGLE)
