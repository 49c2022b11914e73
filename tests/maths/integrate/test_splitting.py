"""Splitting into exact free rotation and kicks: order, invariants, fast spinners, wheels."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from torquer.compile.engine import kernel
from torquer.environment.local import LocalEnvironment
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import as_symmetric, cross
from torquer.maths.integrate.rk4 import advance, rk4_sum
from torquer.maths.integrate.splitting import NODES, drift, kick
from torquer.spacecraft.body import Body, motion_rates

INERTIA = np.array([[1.0, 0.05, -0.08], [0.05, 1.3, 0.04], [-0.08, 0.04, 1.7]])
NO_WHEELS = (0.0, 0.0, 0.0)
DIPOLE = (1.0, -0.7, 0.4)
SPIN = 0.15


@kernel
def field_at(t, strength):
    """Field [T] in the inertial frame, turning slowly."""
    c, s = np.cos(SPIN * t), np.sin(SPIN * t)
    return (strength * c, strength * s, -0.5 * strength)


@kernel
def by_splitting(inertia, principal, wheels, strength, x, h, steps):
    """Drift, kick, drift, kick, drift, with the torque at the Gauss nodes."""
    moments, axes = principal
    early, late = NODES
    for i in range(steps):
        t = i * h
        x = drift(moments, axes, x, early * h)
        b = rotate_inverse(x.q, field_at(t + early * h, strength))
        x = kick(inertia, wheels, cross(DIPOLE, b), x, 0.5 * h)
        x = drift(moments, axes, x, (late - early) * h)
        b = rotate_inverse(x.q, field_at(t + late * h, strength))
        x = kick(inertia, wheels, cross(DIPOLE, b), x, 0.5 * h)
        x = drift(moments, axes, x, early * h)
    return x


@kernel
def by_rk4(rigid, strength, x, h, steps):
    gravity_gradient = (0.0, 0.0, 0.0)
    for i in range(steps):
        local = LocalEnvironment(field_at(i * h, strength), gravity_gradient, ())
        middle = LocalEnvironment(field_at((i + 0.5) * h, strength), gravity_gradient, ())
        end = LocalEnvironment(field_at((i + 1) * h, strength), gravity_gradient, ())
        k1 = motion_rates(rigid, local, DIPOLE, x, ())
        k2 = motion_rates(rigid, middle, DIPOLE, advance(x, 0.5 * h, k1), ())
        k3 = motion_rates(rigid, middle, DIPOLE, advance(x, 0.5 * h, k2), ())
        k4 = motion_rates(rigid, end, DIPOLE, advance(x, h, k3), ())
        x = rk4_sum(x, h, k1, k2, k3, k4)
    return x


def reference(strength, wheels, start, t_end):
    """Euler's equations and kinematics written out, by an independent integrator."""
    inverse = np.linalg.inv(INERTIA)

    def rates(t, y):
        v, s, w = y[:3], y[3], y[4:]
        c, sine = np.cos(SPIN * t), np.sin(SPIN * t)
        b = Rotation.from_quat(y[:4]).as_matrix().T @ (strength * np.array([c, sine, -0.5]))
        torque = np.cross(DIPOLE, b) - np.cross(w, INERTIA @ w + wheels)
        return np.r_[0.5 * (s * w + np.cross(v, w)), -0.5 * v @ w, inverse @ torque]

    y0 = np.r_[start.q, start.omega]
    return solve_ivp(rates, (0.0, t_end), y0, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]


def body(wheels=NO_WHEELS):
    spec = Body(inertia_kg_m2=INERTIA.tolist(), wheel_momentum_n_m_s=wheels)
    return spec.pack(), spec.pack_principal()


def start_with(omega):
    q = np.array([0.5, -0.5, 0.1, 0.7])
    return Motion(tuple((q / np.linalg.norm(q)).tolist()), tuple(float(w) for w in omega))


def errors_of(strength, wheels, omega, t_end, counts):
    """Error of the rates at the end for several numbers of steps."""
    rigid, principal = body(wheels)
    start = start_with(omega)
    exact = reference(strength, wheels, start, t_end)
    ends = [
        by_splitting(rigid.inertia, principal, wheels, strength, start, t_end / n, n)
        for n in counts
    ]
    return np.array([np.abs(np.subtract(x.omega, exact[4:])).max() for x in ends])


def order_of(errors, counts):
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


def test_order_is_four_while_the_torque_is_small():
    counts = np.array([24, 36, 54, 80])
    errors = errors_of(1e-5, NO_WHEELS, (0.4, -0.3, 0.5), 24.0, counts)
    assert order_of(errors, counts) == pytest.approx(4.0, abs=0.2)


def test_order_is_two_in_the_square_of_a_large_torque():
    counts = np.array([400, 800, 1600])
    errors = errors_of(0.4, NO_WHEELS, (0.4, -0.3, 0.5), 24.0, counts)
    assert order_of(errors, counts) == pytest.approx(2.0, abs=0.2)
    # the fourth-order part goes with the torque, the second-order part with its square
    small, smaller = (
        errors_of(e, NO_WHEELS, (0.4, -0.3, 0.5), 6.0, [400])[0] for e in (5e-3, 2.5e-3)
    )
    assert small / smaller == pytest.approx(4.0, abs=0.1)


def test_error_goes_with_the_torque_while_it_is_small():
    coarse = [errors_of(e, NO_WHEELS, (0.4, -0.3, 0.5), 24.0, [24])[0] for e in (2e-5, 1e-5)]
    assert coarse[0] / coarse[1] == pytest.approx(2.0, abs=0.1)


def test_order_is_two_with_wheels_whose_momentum_is_not_small():
    counts = np.array([200, 400, 800])
    errors = errors_of(1e-3, (0.02, -0.05, 0.03), (0.4, -0.3, 0.5), 24.0, counts)
    assert order_of(errors, counts) == pytest.approx(2.0, abs=0.2)
    assert errors[-1] < 1e-6


def test_fast_spinner_at_large_steps_beats_rk4_by_far():
    """Ten revolutions a minute and a step of a quarter of a turn."""
    omega, h, n = (0.05, -0.03, 1.05), 1.5, 40
    strength = 1e-5
    rigid, principal = body()
    start = start_with(omega)
    exact = reference(strength, NO_WHEELS, start, n * h)
    x = by_splitting(rigid.inertia, principal, NO_WHEELS, strength, start, h, n)
    y = by_rk4(rigid, strength, start, h, n)
    ours, rk4 = (np.abs(np.subtract(m.omega, exact[4:])).max() for m in (x, y))
    assert ours < 5e-8
    assert rk4 > 1e5 * ours


@pytest.mark.parametrize("wheels", [NO_WHEELS, (0.02, -0.05, 0.03)])
def test_without_torque_energy_stays_to_rounding(wheels):
    rigid, principal = body(wheels)
    start = start_with((0.4, -0.3, 0.5))
    x = by_splitting(rigid.inertia, principal, wheels, 0.0, start, 0.5, 10_000)

    def energy(w):
        return 0.5 * np.dot(w, INERTIA @ w)

    assert energy(x.omega) == pytest.approx(energy(start.omega), rel=2e-11)
    assert np.linalg.norm(x.q) == pytest.approx(1.0, abs=1e-15)


def test_without_torque_and_wheels_inertial_momentum_stays_to_rounding():
    rigid, principal = body()
    start = start_with((0.4, -0.3, 0.5))
    x = by_splitting(rigid.inertia, principal, NO_WHEELS, 0.0, start, 0.5, 10_000)
    before, after = (Rotation.from_quat(m.q).apply(INERTIA @ m.omega) for m in (start, x))
    assert after == pytest.approx(before, abs=5e-12)


def test_body_axes_drift_is_free_motion_for_any_tensor():
    _, principal = body()
    start = start_with((0.4, -0.3, 0.5))
    exact = reference(0.0, NO_WHEELS, start, 12.0)
    x = drift(*principal, start, 12.0)
    assert x.omega == pytest.approx(exact[4:], abs=1e-12)
    assert (Rotation.from_quat(exact[:4]).inv() * Rotation.from_quat(x.q)).magnitude() < 1e-12


vectors = st.tuples(*[st.floats(-2.0, 2.0)] * 3)


@settings(max_examples=60, deadline=None)
@given(vectors, vectors, vectors, st.floats(-3.0, 3.0))
def test_kick_is_the_implicit_midpoint_rule(wheels, torque, omega, t):
    """J (w1 - w0) = t (M + h x (w0 + w1)/2): energy gained is the torque's work, exactly."""
    start = Motion((0.0, 0.0, 0.0, 1.0), omega)
    after = kick(as_symmetric(INERTIA), wheels, torque, start, t)
    assert after.q == start.q
    mean = 0.5 * np.add(omega, after.omega)
    change = INERTIA @ np.subtract(after.omega, omega)
    assert change == pytest.approx(t * (torque + np.cross(wheels, mean)), abs=1e-13)
    energy = [0.5 * np.dot(w, INERTIA @ w) for w in (omega, after.omega)]
    assert energy[1] - energy[0] == pytest.approx(t * np.dot(torque, mean), abs=1e-12)


def test_nodes_are_gauss_nodes():
    points = np.polynomial.legendre.leggauss(2)[0]
    assert pytest.approx((points + 1.0) / 2.0, abs=1e-16) == NODES
