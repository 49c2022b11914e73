"""Poincare's small-parameter tool: closed forms, remainders of the second order, resonances."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp

from torquer.theory.periodic.poincare import (
    departure,
    derivatives,
    equidistant_points,
    forced_response,
    periodic_motion,
    remainder,
    small_parameter,
)


def oscillator(w2, damping):
    return np.array([[0.0, 1.0], [-w2, -damping]])


@settings(max_examples=60, deadline=None)
@given(
    w2=st.floats(0.1, 20.0),
    damping=st.floats(0.05, 2.0),
    k=st.integers(1, 7),
    constant=st.floats(-3.0, 3.0),
    period=st.floats(0.5, 20.0),
    count=st.sampled_from([16, 17, 64]),
)
def test_a_forced_oscillator(w2, damping, k, constant, period, count):
    """y'' + d y' + w2 y = constant + cos(k w u): amplitude and phase in closed form."""
    w = 2.0 * math.pi / period
    u = equidistant_points(period, count)
    forcing = np.stack([np.zeros(count), constant + np.cos(k * w * u)], axis=1)
    found = forced_response(oscillator(w2, damping), forcing, period)
    gain = 1.0 / (w2 - (k * w) ** 2 + 1j * damping * k * w)
    v = np.linspace(-3.0, 7.0, 11)
    expected = constant / w2 + (gain * np.exp(1j * k * w * v)).real
    assert found.at(v)[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert found.offset == pytest.approx([constant / w2, 0.0], abs=1e-9)
    assert found.amplitudes[k, 0] == pytest.approx(abs(gain), rel=1e-9)
    assert found.amplitudes[k, 1] == pytest.approx(k * w * abs(gain), rel=1e-9)


def test_the_highest_harmonic_of_an_even_number_of_samples():
    """cos(8 u) on 16 samples is seen whole, not double."""
    u = equidistant_points(2.0 * math.pi, 16)
    found = forced_response([[-1e6]], np.cos(8.0 * u)[:, None])
    assert found.amplitudes[8, 0] == pytest.approx(1e-6, rel=1e-6)
    assert found.tail == pytest.approx(1.0)


def pendulum(x):
    return np.stack([x[..., 1], -2.0 * np.sin(x[..., 0]) - 0.3 * x[..., 1]], axis=-1)


def push(u, x):
    """Depends on the state too: its share is of the second order."""
    force = 1.0 + np.cos(u) + np.sin(3.0 * u) * np.cos(x[..., 0]) + x[..., 0]
    return np.stack([np.zeros_like(force), force], axis=-1)


def test_remainder_and_departure_are_of_the_second_order():
    response = small_parameter(pendulum, push, (0.0, 0.0))
    assert response.offset == pytest.approx([0.5, 0.0], abs=1e-12)
    steps = (0.04, 0.02, 0.01)
    for measure in (remainder, departure):
        left = np.array([measure(pendulum, push, response, e) for e in steps])
        assert np.log2(left[:-1] / left[1:]) == pytest.approx(2.0, abs=0.1)
        assert left[-1].max() < 2e-4


def test_small_parameter_at_another_equilibrium():
    """About the upper rest the pendulum's response has the other sign and no oscillation."""
    response = small_parameter(pendulum, push, (math.pi, 0.0))
    assert response.offset[0] == pytest.approx(-(1.0 + math.pi) / 2.0, rel=1e-12)
    assert response.eigenvalues.real.max() > 0.0
    assert response.x0.tolist() == [math.pi, 0.0]


def test_a_periodic_motion_closes():
    """Duffing's equation with a strong force: integration comes back after the period."""

    def rates(u, x):
        spring = x[..., 0] + x[..., 0] ** 3
        return np.stack([x[..., 1], 0.8 * np.cos(u) - spring - 0.4 * x[..., 1]], axis=-1)

    u = equidistant_points(2.0 * math.pi, 63)
    guess = np.zeros((63, 2))
    for by in ("complex", "difference"):
        found = periodic_motion(rates, guess, by=by)
        run = solve_ivp(rates, (0.0, 2.0 * math.pi), found[0], "DOP853", rtol=1e-12, atol=1e-13)
        assert run.y[:, -1] == pytest.approx(found[0], abs=1e-9)
        assert np.abs(found[:, 0]).max() > 0.5
    middle = solve_ivp(rates, (0.0, u[20]), found[0], "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert middle == pytest.approx(found[20], abs=1e-9)


def test_resonances_are_reported():
    """Near and far from the natural frequency 2.01, and a motion that the force leaves alone."""
    u = equidistant_points(2.0 * math.pi, 32)
    two = np.zeros((4, 4))
    two[:2, :2], two[2:, 2:] = oscillator(2.01**2, 0.0), oscillator(9.0, 0.0)
    forcing = np.zeros((32, 4))
    forcing[:, 1] = np.cos(2.0 * u) + np.cos(3.0 * u)
    found = forced_response(two, forcing)
    assert [(r.harmonic, round(r.eigenvalue.imag, 9)) for r in found.resonances] == [(2, 2.01)]
    assert found.resonances[0].distance == pytest.approx(0.01, abs=1e-12)
    assert found.amplitudes[2, 0] == pytest.approx(1.0 / (2.01**2 - 4.0), rel=1e-9)
    assert found.amplitudes[3, 2:] == pytest.approx(0.0, abs=1e-12)
    assert forced_response(two, forcing, near=0.001).resonances == ()
    forcing[:, 3] = np.cos(3.0 * u)
    with pytest.raises(ArithmeticError, match="harmonic 3 of the forcing must not drive"):
        forced_response(two, forcing)


def test_constantly_forced_free_mass_has_no_periodic_motion():
    with pytest.raises(ArithmeticError, match="harmonic 0 of the forcing"):
        forced_response(oscillator(0.0, 0.0), np.tile([0.0, 1.0], (8, 1)))


@settings(max_examples=40, deadline=None)
@given(x=st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3))
def test_derivatives(x):
    def f(x):
        a, b, c = x[..., 0], x[..., 1], x[..., 2]
        return np.stack([np.sin(a) * b, np.exp(b * c), a * a * c], axis=-1)

    a, b, c = x
    exact = np.array(
        [
            [math.cos(a) * b, math.sin(a), 0.0],
            [0.0, c * math.exp(b * c), b * math.exp(b * c)],
            [2.0 * a * c, 0.0, a * a],
        ]
    )
    size = np.abs(exact).max()
    assert derivatives(f, np.array(x)) == pytest.approx(exact, abs=1e-13 * (1.0 + size))
    by = derivatives(f, np.array(x), "difference")
    assert by == pytest.approx(exact, abs=1e-8 * (1.0 + size))


def test_derivatives_of_many_points_at_once():
    x = np.random.default_rng(1).normal(size=(5, 2))
    together = derivatives(pendulum, x)
    assert together.shape == (5, 2, 2)
    assert together[3] == pytest.approx(derivatives(pendulum, x[3]), abs=0.0)


ZERO = np.zeros((2, 2))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (lambda: derivatives(pendulum, [0.0, 0.0], "x"), "must be 'complex' or 'difference'"),
        (lambda: forced_response(np.ones((2, 3)), ZERO), r"jacobian: must have shape \(2, 2\)"),
        (lambda: forced_response(ZERO, np.ones((9, 3))), r"forcing: .*or more, 2\); .*\(9, 3\)"),
        (lambda: forced_response(ZERO, np.ones((2, 2))), r"forcing: .*\(3 samples or more, 2\)"),
        (lambda: small_parameter(pendulum, push, (0.5, 0.0)), r"equilibrium of f; .*\|f\| = 0.95"),
        (lambda: periodic_motion(push, np.zeros((4, 2))), "odd number of samples; received"),
    ],
)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()


def test_no_periodic_motion_is_an_error():
    """y'' = 1: none exists, and the equations of the collocation are at odds."""

    def rates(u, x):
        return np.stack([x[..., 1], 1.0 + 0.0 * u + 1e-9 * x[..., 0] ** 2], axis=-1)

    with pytest.raises(ArithmeticError, match=r"Newton's steps must fall below 1e-11"):
        periodic_motion(rates, np.ones((9, 2)))


def test_a_free_oscillation_is_left_alone():
    """At y'' = -y every motion has the period 2 pi: an exact guess returns as it is."""

    def rates(u, x):
        return np.stack([x[..., 1], -x[..., 0]], axis=-1)

    u = equidistant_points(2.0 * math.pi, 9)
    guess = np.stack([np.cos(u), -np.sin(u)], axis=1)
    assert periodic_motion(rates, guess) == pytest.approx(guess, abs=1e-12)


def test_a_singular_step_is_an_error():
    """x' = 1 by x' = 1 + 0 x: the equations have no derivative to follow."""

    def rates(u, x):
        return 1.0 + 0.0 * x

    with pytest.raises(ArithmeticError, match="Newton's steps must fall below"):
        periodic_motion(rates, np.zeros((3, 1)))
