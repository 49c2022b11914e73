"""Large turns by wheels, and one axis held: the Lyapunov function, the end, the greatest rate."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation
from wheel_cases import deviation, flight, random_inertia, start, stepped

from torquer.computer.laws.wheel_lyapunov import WheelLyapunov
from torquer.computer.laws.wheel_one_axis import WheelOneAxis, half_turn_between
from torquer.computer.laws.wheel_pd import WheelPd

J = [[2.6, 0.2, -0.3], [0.2, 3.1, 0.15], [-0.3, 0.15, 1.9]]
AXIS, TARGET = np.array([0.0, 0.6, 0.8]), np.array([2.0, -1.0, 2.0]) / 3.0
SPINS = pytest.mark.parametrize("spin_deg_s", [None, 0.0, 1.5])


def one_axis(spin_deg_s=None, inertia=J, **keys):
    return WheelOneAxis(
        rate_gain_n_m_s=0.4, angle_gain_n_m=0.1, axis=AXIS, target=TARGET, spin_deg_s=spin_deg_s,
        inertia_kg_m2=np.asarray(inertia).tolist(), **keys,
    )  # fmt: skip


def nominal(spin_deg_s, seed, gravity=True):
    """A flight in which the law knows all that turns the body."""
    inertia = random_inertia(np.random.default_rng(seed))
    return flight(one_axis(spin_deg_s, inertia, gravity_feedforward=gravity), inertia, 0.3, gravity)


def beginning(seed, rate=0.05):
    """Any attitude and rate; the orbit of `flight`."""
    rng = np.random.default_rng(seed)
    held = WheelLyapunov(rate_gain_n_m_s=1.0, angle_gain_n_m=1.0, reference="inertial",
                         inertia_kg_m2=J)  # fmt: skip
    x = start(flight(held, np.array(J), 0.3), 0.0, rate * rng.normal(size=3), rng.normal(size=3))
    x[:4] = Rotation.random(random_state=seed).as_quat()
    return x


def off_target(x):
    """Angle between axis and direction [rad]."""
    there = Rotation.from_quat(x[:4]).apply(AXIS)
    return math.atan2(np.linalg.norm(np.cross(there, TARGET)), there @ TARGET)


def lyapunov_function(f, x):
    spin = math.radians(f.spec.spin_deg_s or 0.0)
    omega = x[4:7] - spin * AXIS
    half = 2.0 * math.sin(0.25 * off_target(x)) ** 2
    return 0.5 * omega @ f.inertia @ omega + 2.0 * f.spec.angle_gain_n_m * half


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([1e-9, 1e-4, 0.1, 1.5, 1.6, 3.0, math.pi - 1e-6]))
def test_half_turn_between_axes_is_exact_at_any_angle(seed, angle):
    """a, turned by x about e, is b; what comes is e sin(x/2), to rounding at any angle."""
    a, across = Rotation.random(random_state=seed).as_matrix()[:2]
    b = math.cos(angle) * a + math.sin(angle) * across
    found = np.array(half_turn_between(tuple(a.tolist()), tuple(b.tolist())))
    expected = math.sin(0.5 * angle) * np.cross(a, across)
    # beyond 90 deg the axis comes from a product of the size sin(x), of which 1e-16 is rounding
    assert found == pytest.approx(expected, abs=1e-15 + 4e-16 / max(math.sin(angle), 1e-9)
                                  if angle > 1.5 else 1e-15)  # fmt: skip


def test_opposite_directions_have_a_half_turn_all_the_same():
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        half = np.array(half_turn_between(tuple(axis.tolist()), tuple((-axis).tolist())))
        assert np.linalg.norm(half) == pytest.approx(1.0) and half @ axis == 0.0


@SPINS
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_lyapunov_function_falls_by_gain_times_damped_rate_squared(spin_deg_s, seed):
    f, x, h = nominal(spin_deg_s, seed), beginning(seed), 0.02
    v = {n: lyapunov_function(f, stepped(f, x, n * h)) for n in (-2, -1, 1, 2)}
    slope = (8.0 * (v[1] - v[-1]) - (v[2] - v[-2])) / (12.0 * h)
    omega = x[4:7] - math.radians(spin_deg_s or 0.0) * AXIS
    damped = omega if spin_deg_s is not None else omega - (omega @ AXIS) * AXIS
    assert slope == pytest.approx(-f.spec.rate_gain_n_m_s * (damped @ damped), rel=1e-6)


@SPINS
@pytest.mark.parametrize("seed", [4, 5, 6])
def test_any_motion_ends_with_the_axis_on_the_direction(spin_deg_s, seed):
    """And with the wanted rate about it; with one of its own where that is free."""
    f, x = nominal(spin_deg_s, seed), beginning(seed)
    before = first = lyapunov_function(f, x)
    for _ in range(700):
        x = stepped(f, x, 0.4)
        now = lyapunov_function(f, x)
        assert now < before + 1e-13 * first
        before = now
    assert math.degrees(off_target(x)) < 1e-4
    about = x[4:7] @ AXIS
    assert np.linalg.norm(x[4:7] - about * AXIS) < 1e-6
    if spin_deg_s is None:
        assert abs(about) > 1e-3
    else:
        assert math.degrees(about) == pytest.approx(spin_deg_s, abs=1e-4)


def test_gravity_left_out_is_met_by_the_spring():
    """A constant torque is none of a fixed direction's; it stays within that of the spring."""
    knows, ignores = (one_axis(0.0, gravity_feedforward=known) for known in (True, False))
    worst = []
    for spec in (knows, ignores):
        f, x = flight(spec, np.array(J), 0.3, gravity=True), beginning(7, rate=0.0)
        for _ in range(400):
            x = stepped(f, x, 1.0)
        worst.append(off_target(x))
    assert worst[0] < 1e-8 < 1e-5 < worst[1]
    assert worst[1] < 3.0 * 1.2e-6 * 1.5 / 0.05  # gravity torque over k_a/2


KAPPA, MOST_DEG_S = 0.05, 0.8
LIMITED = {
    "pd": lambda **keys: WheelPd(
        bandwidth_rad_s=KAPPA, reference="inertial", inertia_kg_m2=J, **keys
    ),
    "lyapunov": lambda **keys: WheelLyapunov(
        rate_gain_n_m_s=2.0 * KAPPA * 2.5,
        angle_gain_n_m=2.0 * KAPPA**2 * 2.5,
        reference="inertial",
        inertia_kg_m2=J,
        **keys,
    ),
    "one axis": lambda **keys: WheelOneAxis(
        rate_gain_n_m_s=2.0 * KAPPA * 2.5,
        angle_gain_n_m=2.0 * KAPPA**2 * 2.5,
        axis=AXIS,
        target=TARGET,
        spin_deg_s=0.0,
        inertia_kg_m2=J,
        **keys,
    ),
}
EVERY = pytest.mark.parametrize("kind", LIMITED)


def turned(f, x):
    """What is left of the turn [rad]."""
    if isinstance(f.spec, WheelOneAxis):
        return off_target(x)
    return deviation(f, x)[0].magnitude()


def away(f, angle_deg, seed=3):
    """At rest, so far from where the law leads."""
    if not isinstance(f.spec, WheelOneAxis):
        return start(f, angle_deg, np.zeros(3), np.zeros(3), seed)
    x = beginning(seed, rate=0.0)
    x[7:10] = 0.0
    across = np.cross(TARGET, [0.0, 0.0, 1.0])
    to_target, _ = Rotation.align_vectors([TARGET], [AXIS])
    turn = Rotation.from_rotvec(math.radians(angle_deg) * across / np.linalg.norm(across))
    x[:4] = (turn * to_target).as_quat()
    return x


@EVERY
def test_large_turn_goes_at_greatest_rate_in_the_expected_time(kind):
    f = flight(LIMITED[kind](greatest_rate_deg_s=MOST_DEG_S), np.array(J))
    x, h = away(f, 170.0), 0.5
    rates, left = [], []
    for _ in range(1000):
        x = stepped(f, x, h)
        rates.append(math.degrees(np.linalg.norm(x[4:7])))
        left.append(math.degrees(turned(f, x)))
    assert max(rates) <= MOST_DEG_S * (1.0 + 1e-3)
    assert np.median(rates[100:300]) == pytest.approx(MOST_DEG_S, rel=5e-3)
    to_10_deg = h * np.argmax(np.array(left) < 10.0)
    # 160 deg at the greatest rate, and at both ends some times of the damper, 1/(2 kappa)
    assert 160.0 / MOST_DEG_S < to_10_deg < 160.0 / MOST_DEG_S + 4.0 / (2.0 * KAPPA)
    assert left[-1] < 1e-3


@EVERY
def test_small_turns_do_not_know_of_the_greatest_rate(kind):
    """While the spring asks for less than the damper has at that rate, the bits are the same."""
    free, bound = (flight(LIMITED[kind](**keys), np.array(J)) for keys in
                   ({}, {"greatest_rate_deg_s": MOST_DEG_S}))  # fmt: skip
    x = away(free, 10.0)
    assert np.array_equal(free.rates(x), bound.rates(x))
    x = away(free, 60.0)
    assert not np.allclose(free.rates(x)[4:7], bound.rates(x)[4:7], rtol=0.1)


@EVERY
def test_the_greatest_rate_must_be_positive(kind):
    with pytest.raises(ValueError, match="greater than 0"):
        LIMITED[kind](greatest_rate_deg_s=0.0)
