"""RK4 on the attitude motion of a real body: order, invariants, time reversal."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from torquer.compile.engine import kernel
from torquer.environment.local import LocalEnvironment
from torquer.maths.geometry.motion import Motion
from torquer.maths.integrate.rk4 import advance, rk4_sum
from torquer.spacecraft.body import Body, motion_rates

INERTIA = np.array([[1.0, 0.05, -0.08], [0.05, 1.3, 0.04], [-0.08, 0.04, 1.7]])
WHEELS = np.array([0.02, -0.05, 0.03])
DIPOLE = (4e3, -2e3, 3e3)
START = Motion((0.5, -0.5, 0.1, 0.7), (0.4, -0.3, 0.5))
SPIN = 0.7


@kernel
def world_at(t, strength):
    """A field and a vertical that turn; strong, so that the torque matters."""
    c, s = np.cos(SPIN * t), np.sin(SPIN * t)
    b = (3e-5 * c * strength, 3e-5 * s * strength, -2e-5 * strength)
    gravity_gradient = np.sqrt(0.3 * strength)
    return LocalEnvironment(b, (gravity_gradient * s, 0.0, gravity_gradient * c), ())


@kernel
def by_rk4(rigid, dipole, strength, x, t, h, steps):
    """The scheme as its docstring says it, with a look at the world at each stage's time."""
    for i in range(steps):
        here = world_at(t + i * h, strength)
        middle = world_at(t + (i + 0.5) * h, strength)
        end = world_at(t + (i + 1) * h, strength)
        k1 = motion_rates(rigid, here, dipole, x, ())
        k2 = motion_rates(rigid, middle, dipole, advance(x, 0.5 * h, k1), ())
        k3 = motion_rates(rigid, middle, dipole, advance(x, 0.5 * h, k2), ())
        k4 = motion_rates(rigid, end, dipole, advance(x, h, k3), ())
        x = rk4_sum(x, h, k1, k2, k3, k4)
    return x


def unit_start():
    q = np.array(START.q) / np.linalg.norm(START.q)
    return Motion(tuple(q.tolist()), START.omega)


def reference(strength, t_end):
    """Euler's equations and kinematics written out, by an independent integrator."""
    inverse = np.linalg.inv(INERTIA)

    def rates(t, y):
        to_body = Rotation.from_quat(y[:4]).as_matrix().T
        w = y[4:]
        c, s = np.cos(SPIN * t), np.sin(SPIN * t)
        b = to_body @ (strength * np.array([3e-5 * c, 3e-5 * s, -2e-5]))
        up = to_body @ [s, 0.0, c]
        torque = np.cross(DIPOLE, b) + 0.3 * strength * np.cross(up, INERTIA @ up)
        turn = 0.5 * y[3] * w + 0.5 * np.cross(y[:3], w)
        gyroscopic = np.cross(w, INERTIA @ w + WHEELS)
        return np.r_[turn, -0.5 * y[:3] @ w, inverse @ (torque - gyroscopic)]

    y0 = np.r_[unit_start().q, START.omega]
    return solve_ivp(rates, (0.0, t_end), y0, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


@pytest.fixture(scope="module")
def rigid():
    return Body(inertia_kg_m2=INERTIA.tolist(), wheel_momentum_n_m_s=tuple(WHEELS)).pack()


def test_order_is_four_with_torque_wheels_and_a_full_tensor(rigid):
    exact = reference(1.0, 8.0)
    steps = np.array([80, 160, 320, 640])
    errors = []
    for n in steps:
        x = by_rk4(rigid, DIPOLE, 1.0, unit_start(), 0.0, 8.0 / n, n)
        errors.append(np.abs(np.r_[x.q, x.omega] - exact))
    rate, attitude = (
        np.polyfit(np.log(8.0 / steps), np.log([e[part].max() for e in errors]), 1)[0]
        for part in (slice(4, 7), slice(0, 4))
    )
    assert rate == pytest.approx(4.0, abs=0.2)
    assert attitude == pytest.approx(4.0, abs=0.2)
    assert errors[-1].max() < 1e-7


def test_free_motion_conserves_energy_and_momentum_to_order_of_step(rigid):
    x, h = unit_start(), 0.01
    y = by_rk4(rigid, (0.0, 0.0, 0.0), 0.0, x, 0.0, h, 10_000)

    def invariants(motion):
        w = np.array(motion.omega)
        momentum = Rotation.from_quat(motion.q).apply(INERTIA @ w + WHEELS)
        return np.r_[momentum, 0.5 * w @ INERTIA @ w]

    assert invariants(y) == pytest.approx(invariants(x), abs=3e-9)
    assert np.linalg.norm(y.q) == pytest.approx(1.0, abs=4e-16)


def test_running_backwards_returns_to_the_start(rigid):
    x = unit_start()
    there = by_rk4(rigid, DIPOLE, 1.0, x, 0.0, 0.01, 500)
    back = by_rk4(rigid, DIPOLE, 1.0, there, 5.0, -0.01, 500)
    assert np.abs(np.subtract(there.omega, x.omega)).max() > 0.1
    assert back.q == pytest.approx(x.q, abs=1e-8)
    assert back.omega == pytest.approx(x.omega, abs=1e-8)


def test_moved_adds_rates_to_both_parts():
    x = Motion((1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0))
    rate = Motion((0.1, 0.2, 0.3, 0.4), (-1.0, -2.0, -3.0))
    assert advance(x, 10.0, rate) == Motion((2.0, 4.0, 6.0, 8.0), (-5.0, -14.0, -23.0))


def test_weights_of_the_stages_are_one_two_two_one_sixths():
    x = Motion((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))

    def at(k):
        return Motion((0.0, 0.0, 0.0, 0.0), (k, 10.0 * k, -k))

    y = rk4_sum(x, 6.0, at(1.0), at(100.0), at(10000.0), at(1000000.0))
    assert y.omega == pytest.approx((1020201.0, 10202010.0, -1020201.0))
    assert y.q == (0.0, 0.0, 0.0, 1.0)
