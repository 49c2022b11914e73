"""Wheels' laws in closed-loop flight: the Lyapunov function and its rate, the end of any motion."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wheel_cases import RATE, cross, deviation, flight, random_inertia, start, stepped

from torquer.computer.laws.wheel_lyapunov import WheelLyapunov
from torquer.computer.laws.wheel_pd import WheelPd

EULER = (40.0, -20.0, 110.0)
J = np.array([[2.6, 0.2, -0.3], [0.2, 3.1, 0.15], [-0.3, 0.15, 1.9]])


def lyapunov_function(f, x):
    turn, omega = deviation(f, x)
    half = 2.0 * math.sin(0.25 * turn.magnitude()) ** 2  # 1 - cos of half the angle
    return 0.5 * omega @ f.inertia @ omega + 2.0 * f.spec.angle_gain_n_m * half


def test_the_flight_of_these_tests_keeps_the_whole_momentum():
    """J omega + h in inertial axes, whatever the wheels do."""
    spec = WheelLyapunov(
        rate_gain_n_m_s=0.2, angle_gain_n_m=0.05, reference="inertial", inertia_kg_m2=J.tolist()
    )
    f = flight(spec, J)
    x = start(f, 70.0, np.array([0.02, -0.03, 0.05]), np.array([0.3, -0.2, 0.1]))

    def momentum(x):
        return Rotation.from_quat(x[:4]).apply(J @ x[4:7] + x[7:10])

    before, wheels = momentum(x), x[7:10].copy()
    for _ in range(200):
        x = stepped(f, x, 0.1)
    assert np.linalg.norm(x[7:10] - wheels) > 0.05
    assert momentum(x) == pytest.approx(before, abs=1e-9)


def test_pd_small_errors_fall_as_the_double_root_says():
    kappa = 0.1
    spec = WheelPd(bandwidth_rad_s=kappa, reference="inertial", inertia_kg_m2=J.tolist())
    f = flight(spec, J)
    x = start(f, 0.01, np.zeros(3), np.zeros(3), seed=2)
    first = deviation(f, x)[0].as_rotvec()
    for n in range(1, 101):
        x = stepped(f, x, 0.5)
        now = deviation(f, x)[0].as_rotvec()
        s = kappa * 0.5 * n
        expected = first * (1.0 + s) * math.exp(-s)
        # 0.1 percent for the step, and what the products of small errors leave
        assert now == pytest.approx(expected, abs=1e-3 * np.linalg.norm(expected) + 1e-11)


#: Reference, whether gravity turns the body, eccentricity of the orbit.
CASES = pytest.mark.parametrize(
    ("reference", "gravity", "eccentricity"),
    [("orbital", True, 0.3), ("inertial", True, 0.3), ("inertial", False, 0.0)],
)


def nominal(reference, gravity, eccentricity, seed):
    """A flight in which the law knows all that turns the body, of a body made by the seed."""
    inertia = random_inertia(np.random.default_rng(seed))
    spec = WheelLyapunov(
        rate_gain_n_m_s=0.4,
        angle_gain_n_m=0.1,
        reference=reference,
        euler_deg=EULER,
        inertia_kg_m2=inertia.tolist(),
        gravity_feedforward=gravity,
    )
    return flight(spec, inertia, eccentricity, gravity)


@CASES
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_lyapunov_function_falls_by_rate_gain_times_rate_squared(
    reference, gravity, eccentricity, seed
):
    f = nominal(reference, gravity, eccentricity, seed)
    rng = np.random.default_rng(seed)
    x = start(f, rng.uniform(0.0, 170.0), 0.05 * rng.normal(size=3), rng.normal(size=3), seed)
    h = 0.02
    v = {n: lyapunov_function(f, stepped(f, x, n * h)) for n in (-2, -1, 1, 2)}
    slope = (8.0 * (v[1] - v[-1]) - (v[2] - v[-2])) / (12.0 * h)
    _, omega = deviation(f, x)
    assert slope == pytest.approx(-f.spec.rate_gain_n_m_s * (omega @ omega), rel=1e-6)


@CASES
@pytest.mark.parametrize(("seed", "turn_deg"), [(1, 60.0), (2, 130.0), (3, 179.9)])
def test_lyapunov_any_motion_ends_at_the_wanted_attitude(
    reference, gravity, eccentricity, seed, turn_deg
):
    f = nominal(reference, gravity, eccentricity, seed)
    rng = np.random.default_rng(seed)
    x = start(f, turn_deg, 0.05 * rng.normal(size=3), rng.normal(size=3), seed)
    before = first = lyapunov_function(f, x)
    for _ in range(700):
        x = stepped(f, x, 0.4)
        now = lyapunov_function(f, x)
        assert now < before or now < 1e-13 * first
        before = now
    turn, omega = deviation(f, x)
    assert math.degrees(turn.magnitude()) < 1e-4
    assert np.linalg.norm(omega) < 1e-6


def test_lyapunov_gravity_left_out_is_met_by_the_spring():
    """On a circular orbit the body comes to rest where k_a e sin(a/2) is the gravity torque."""
    spec = WheelLyapunov(
        rate_gain_n_m_s=0.03,
        angle_gain_n_m=2e-4,
        euler_deg=EULER,
        inertia_kg_m2=J.tolist(),
        gravity_feedforward=False,
    )
    f = flight(spec, J, gravity=True)
    x = start(f, 0.0, np.zeros(3), np.zeros(3))
    for _ in range(600):
        x = stepped(f, x, 5.0)
    turn, omega = deviation(f, x)
    r = x[10:13]
    up = Rotation.from_quat(x[:4]).inv().apply(r) / np.linalg.norm(r)
    torque = 3.0 * RATE**2 * cross(up, f.inertia @ up)
    assert np.degrees(turn.magnitude()) > 0.3
    assert np.linalg.norm(omega) < 1e-7
    assert 2e-4 * turn.as_quat(canonical=True)[:3] == pytest.approx(torque, rel=1e-4)
