"""Exact free rotation against textbook formulas, an independent integrator and invariants."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk, ellipkm1

from torquer.maths.integrate.free_body import free_rates, free_rotation, jacobi_elliptic

TURN = (0.1, -0.7, 0.5, 0.5)
Q0 = tuple(np.array(TURN) / np.linalg.norm(TURN))
SEVERAL = settings(max_examples=60, deadline=None)

component = st.floats(-3.0, 3.0)
rates = st.tuples(component, component, component)


@st.composite
def bodies(draw):
    """Ascending moments of physical bodies, symmetric ones and spheres among them."""
    parts = [draw(st.floats(0.01, 2.0)) for _ in range(3)]
    shape = draw(st.sampled_from(["any", "flat", "long", "sphere", "nearly", "plate"]))
    if shape == "sphere":
        parts = [parts[0]] * 3
    elif shape == "nearly":
        parts = [parts[0], parts[0] * (1.0 + 1e-9), parts[0] * (1.0 + 3e-9)]
    elif shape == "plate":
        parts[0] = 0.0
    elif shape in ("flat", "long"):
        parts[1] = parts[0]
    # moments are sums of second moments of mass, so the triangle inequality holds
    x, y, z = sorted(parts)
    moments = (x + y, x + z, y + z)
    return tuple(float(m) for m in sorted(moments))


def reference(moments, omega, t):
    """Attitude and rates by an independent integration of Euler's equations and kinematics."""
    inertia = np.array(moments)

    def rates(_, y):
        v, s, w = y[:3], y[3], y[4:]
        turn = 0.5 * (s * w + np.cross(v, w))
        return np.concatenate([turn, [-0.5 * v @ w], -np.cross(w, inertia * w) / inertia])

    start = np.r_[Q0, omega]
    y = solve_ivp(rates, (0.0, t), start, method="DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
    return y[:4], y[4:]


def momentum(moments, q, omega):
    """Angular momentum in the inertial frame."""
    return Rotation.from_quat(q).apply(np.array(moments) * omega)


def energy(moments, omega):
    return 0.5 * np.dot(moments, np.square(omega))


@SEVERAL
@given(st.floats(-200.0, 200.0), st.floats(1e-6, 1.0))
def test_jacobi_functions_agree_with_scipy(u, complement):
    sn, cn, dn, _ = ellipj(u, 1.0 - complement)
    tolerance = 1e-13 + 2e-15 * abs(u) / complement**0.5
    assert jacobi_elliptic(u, complement) == pytest.approx((sn, cn, dn), abs=tolerance)


@pytest.mark.parametrize("exponent", [0, 1, 3, 6, 8, 10, 12, 14, 16, 20, 30, 60, 100, 300])
def test_jacobi_functions_at_the_quarter_period_however_near_the_separatrix(exponent):
    """sn, cn, dn of K/2 and K in closed form; k1 is the root of the complement."""
    complement = 10.0**-exponent
    k1 = math.sqrt(complement)
    quarter = ellipkm1(complement)
    assert jacobi_elliptic(quarter, complement) == pytest.approx((1.0, 0.0, k1), abs=2e-13)
    half = (1.0 / math.sqrt(1.0 + k1), math.sqrt(k1 / (1.0 + k1)), math.sqrt(k1))
    assert jacobi_elliptic(0.5 * quarter, complement) == pytest.approx(half, abs=2e-13)
    assert jacobi_elliptic(2.0 * quarter, complement) == pytest.approx((0.0, -1.0, 1.0), abs=5e-13)


@SEVERAL
@given(st.floats(-50.0, 50.0), st.floats(0.0, 1.0))
def test_jacobi_functions_keep_their_identities(u, complement):
    sn, cn, dn = jacobi_elliptic(u, complement)
    assert sn * sn + cn * cn == pytest.approx(1.0, abs=1e-14)
    assert dn * dn + (1.0 - complement) * sn * sn == pytest.approx(1.0, abs=1e-14)


def test_jacobi_functions_are_hyperbolic_on_separatrix_and_circular_for_sphere():
    c = 1.0 / math.cosh(1.7)
    assert jacobi_elliptic(1.7, 0.0) == pytest.approx((math.tanh(1.7), c, c), abs=1e-15)
    assert jacobi_elliptic(1.7, -1e-17) == pytest.approx((math.tanh(1.7), c, c), abs=1e-15)
    assert jacobi_elliptic(1.7, 1.0) == pytest.approx((math.sin(1.7), math.cos(1.7), 1.0))
    assert jacobi_elliptic(1.7, 1.0 + 1e-15)[2] == pytest.approx(1.0)


def textbook(moments, energy2, square, phase, t):
    """Landau and Lifshitz, Mechanics, section 37: rates at phase + n t; L^2 above 2 E I2."""
    i1, i2, i3 = moments
    amplitude = np.sqrt(
        [
            (energy2 * i3 - square) / (i1 * (i3 - i1)),
            (energy2 * i3 - square) / (i2 * (i3 - i2)),
            (square - energy2 * i1) / (i3 * (i3 - i1)),
        ]
    )
    frequency = math.sqrt((i3 - i2) * (square - energy2 * i1) / (i1 * i2 * i3))
    m = (i2 - i1) * (energy2 * i3 - square) / ((i3 - i2) * (square - energy2 * i1))
    sn, cn, dn, _ = ellipj(phase + frequency * np.asarray(t), m)
    return (amplitude * np.array([cn, sn, dn]).T).T, frequency, m


@SEVERAL
@given(
    st.floats(0.05, 0.95),
    st.floats(0.0, 0.98),
    st.floats(0.02, 0.98),
    st.floats(-4.0, 4.0),
    st.floats(-30.0, 30.0),
    st.sampled_from([(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)]),
    st.booleans(),
)
def test_rates_follow_the_textbook_solution(shape, width, place, phase, t, signs, about_first):
    """Both kinds of circulation; `signs`: the same motion seen from a body turned by half."""
    i1, i3 = 1.0, 1.0 + shape
    i2 = i1 + width * (i3 - i1)
    energy2 = 1.3
    if about_first:  # the order of the axes reversed: both signs in Euler's equations turn
        square = energy2 * (i1 + place * (i2 - i1))
        assume(i2 - i1 > 1e-3)
        moments, order = (i3, i2, i1), slice(None, None, -1)
    else:
        square = energy2 * (i2 + place * (i3 - i2))
        assume(i3 - i2 > 1e-3)
        moments, order = (i1, i2, i3), slice(None)
    start, end = (
        np.multiply(signs, textbook(moments, energy2, square, phase, at)[0][order])
        for at in (0.0, t)
    )
    got = free_rates((i1, i2, i3), tuple(start), t)
    assert got == pytest.approx(end, abs=2e-12 / min(place, 1.0 - place))


def test_rates_repeat_after_very_many_periods():
    moments, energy2 = (1.0, 1.4, 2.0), 1.3
    square = energy2 * 1.7
    start, frequency, m = textbook(moments, energy2, square, 0.4, 0.0)
    period = 4.0 * ellipk(m) / frequency
    end = free_rates(moments, tuple(start), 1e7 * period)
    assert end == pytest.approx(start, abs=1e-7)


@pytest.mark.parametrize("shape", [(1.0, 1.0, 1.6), (1.0, 1.6, 1.6)])
def test_symmetric_body_precesses_at_the_textbook_rates(shape):
    """Transverse rates turn at (I_axis/I_across - 1) w_axis; the axis turns at L/I_across."""
    moments = np.array(shape)
    axis = 2 if shape[0] == shape[1] else 0
    transverse = moments[1]
    omega = np.array([0.3, -0.4, 0.9])
    t = 57.3
    q, after = free_rotation(tuple(moments), Q0, tuple(omega), t)
    angle = (moments[axis] / transverse - 1.0) * omega[axis] * t
    spin = np.zeros(3)
    spin[axis] = angle
    assert after == pytest.approx(Rotation.from_rotvec(spin).apply(omega), abs=1e-13)
    precession = momentum(moments, Q0, omega) / transverse * t
    expected = (
        Rotation.from_rotvec(precession) * Rotation.from_quat(Q0) * (Rotation.from_rotvec(-spin))
    )
    assert (expected.inv() * Rotation.from_quat(q)).magnitude() < 1e-13


@SEVERAL
@given(bodies(), rates, st.floats(-15.0, 15.0))
@example((1.0, 1.0, 1.0), (0.3, 0.2, 0.1), 10.0)
@example((1.0, 1.0, 1.0), (0.3, 0.2, -0.0), 10.0)
@example((1.0, 2.0, 3.0), (1.0, 0.0, 0.0), 7.0)
@example((1.0, 2.0, 3.0), (0.0, -1.0, 0.0), 7.0)
@example((1.0, 2.0, 3.0), (0.0, 1.0, 1e-9), 12.0)
@example((1.0, 2.0, 3.0), (1e-9, 1.0, 0.0), 12.0)
@example((1.0, 2.0, 3.0), (0.0, 0.0, -1.0), 7.0)
@example((1.0, 2.0, 3.0), (math.sqrt(1.5), 0.3, math.sqrt(0.5)), 9.0)
@example((1.0, 2.0, 3.0), (-math.sqrt(1.5), 0.3, math.sqrt(0.5)), -9.0)
@example((1.0, 1.0, 2.0), (1.0, 1.0, 0.0), 9.0)
@example((1.0, 2.0, 2.0), (0.0, 1.0, 1.0), 9.0)
def test_motion_agrees_with_an_independent_integrator(moments, omega, t):
    q_expected, omega_expected = reference(moments, omega, t)
    q, after = free_rotation(moments, Q0, omega, t)
    # neighbouring motions part exponentially about the middle axis: rounding grows with them
    i1, i2, i3 = moments
    growth = math.sqrt((i2 - i1) * (i3 - i2) / (i1 * i3)) * np.linalg.norm(omega) * abs(t)
    tolerance = 1e-11 + 1e-15 * math.exp(min(growth, 25.0))
    assert after == pytest.approx(omega_expected, abs=tolerance)
    turn = Rotation.from_quat(q_expected).inv() * Rotation.from_quat(q)
    assert turn.magnitude() < tolerance


@SEVERAL
@given(bodies(), rates, st.floats(-1e3, 1e3))
@example((1.0, 2.0, 3.0), (1e-4, 1.0, 1e-4), 5000.0)
@example((0.3, 0.7, 1.0), (0.5, 0.2, 0.9), 1e5)
@example((1.0, 1.0, 1.0 + 1e-15), (1.0, 1.0, 1e-8), 1e4)
def test_energy_and_inertial_momentum_stay_to_rounding_however_long(moments, omega, t):
    q, after = free_rotation(moments, Q0, omega, t)
    before = momentum(moments, Q0, omega)
    size = np.linalg.norm(before)
    assert momentum(moments, q, after) == pytest.approx(before, abs=2e-13 * size + 1e-300)
    assert energy(moments, after) == pytest.approx(energy(moments, omega), rel=2e-13, abs=1e-300)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)


@SEVERAL
@given(bodies(), rates, st.floats(0.1, 10.0))
@example((0.02, 1.9036646041121752, 1.9036646041121752), (0.01, -0.39404415417050487, 3.0), 5.0)
def test_running_backwards_and_in_two_legs(moments, omega, t):
    """Attitudes to the rounding of the phase L t/A, 1425 rad in the example (8e-16 of it seen)."""
    q, after = free_rotation(moments, Q0, omega, t)
    i1, i2, i3 = moments
    growth = math.sqrt((i2 - i1) * (i3 - i2) / (i1 * i3)) * np.linalg.norm(omega) * t
    tolerance = 1e-12 + 1e-15 * math.exp(min(growth, 25.0))
    phase = np.linalg.norm(momentum(moments, Q0, omega)) * t / i1
    angle = tolerance + 2e-15 * phase
    q_back, back = free_rotation(moments, q, after, -t)
    assert back == pytest.approx(omega, abs=tolerance)
    assert (Rotation.from_quat(q_back).inv() * Rotation.from_quat(Q0)).magnitude() < angle
    half = free_rotation(moments, *free_rotation(moments, Q0, omega, 0.3 * t), 0.7 * t)
    assert half[1] == pytest.approx(after, abs=tolerance)
    assert (Rotation.from_quat(half[0]).inv() * Rotation.from_quat(q)).magnitude() < angle


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_pure_spin_about_each_axis_is_a_plain_turn(axis, sense):
    omega = np.zeros(3)
    omega[axis] = 0.8 * sense
    q, after = free_rotation((1.0, 2.0, 2.5), Q0, tuple(omega), 123.0)
    assert after == pytest.approx(omega, rel=1e-15, abs=0.0)
    expected = Rotation.from_quat(Q0) * Rotation.from_rotvec(123.0 * omega)
    assert (expected.inv() * Rotation.from_quat(q)).magnitude() < 1e-12


def test_motion_on_the_separatrix_falls_towards_the_middle_axis():
    """L^2 = 2 E I2: the middle rate is W tanh, the others W sech."""
    i1, i2, i3 = moments = (1.0, 2.0, 3.0)
    size = 0.6
    a1 = size * math.sqrt(i2 * (i3 - i2) / (i1 * (i3 - i1)))
    a3 = size * math.sqrt(i2 * (i2 - i1) / (i3 * (i3 - i1)))
    rate = size * math.sqrt((i2 - i1) * (i3 - i2) / (i1 * i3))
    for t in (0.5, 3.0, 10.0):
        sech = 1.0 / math.cosh(rate * t)
        expected = (a1 * sech, size * math.tanh(rate * t), a3 * sech)
        assert free_rates(moments, (a1, 0.0, a3), t) == pytest.approx(expected, abs=1e-12)


def test_body_at_rest_stays_and_slowest_motion_is_finite():
    assert free_rotation((1.0, 2.0, 3.0), Q0, (0.0, 0.0, 0.0), 1e6) == (Q0, (0.0, 0.0, 0.0))
    for tiny in (1e-30, 1e-155, 1e-162, 5e-324):
        q, after = free_rotation((1e-3, 2e-3, 2.5e-3), Q0, (tiny, 0.0, 0.0), 10.0)
        assert q == pytest.approx(Q0, abs=1e-15)
        assert after == pytest.approx((tiny, 0.0, 0.0))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_rate_that_is_not_finite_comes_back_as_such(bad):
    for omega in ((bad, 0.1, 0.2), (0.1, bad, 0.2), (0.1, 0.2, bad)):
        assert not np.all(np.isfinite(free_rotation((1.0, 2.0, 3.0), Q0, omega, 1.0)[1]))
