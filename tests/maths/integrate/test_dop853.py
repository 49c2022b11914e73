"""DOP853 against scipy's, exact solutions and the Kepler problem; its status codes."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from scipy.integrate import DOP853, solve_ivp

from torquer.compile import engine
from torquer.maths.integrate import dop853_tableau as tableau
from torquer.maths.integrate.dop853 import (
    DONE,
    MOST_STEPS,
    STEP_TOO_SMALL,
    TOO_MANY_STEPS,
    dop853,
    rates,
    rates_of,
    workspace,
)

KEPLER, OSCILLATOR, VAN_DER_POL, BLOW_UP, NOT_A_NUMBER, STILL, RATTLE = range(7)


class Problem(NamedTuple):
    """One class for all problems here, so that the integrator is compiled once."""

    kind: int
    constant: float


@rates_of(Problem)
def right_hand_side(problem, t, y, dy):
    if problem.kind == KEPLER:
        r3 = (y[0] * y[0] + y[1] * y[1]) ** 1.5
        dy[0], dy[1] = y[2], y[3]
        dy[2], dy[3] = -problem.constant * y[0] / r3, -problem.constant * y[1] / r3
    elif problem.kind == OSCILLATOR:
        dy[0] = y[1]
        dy[1] = -y[0] + problem.constant * np.cos(0.3 * t)
    elif problem.kind == VAN_DER_POL:
        dy[0] = y[1]
        dy[1] = problem.constant * (1.0 - y[0] * y[0]) * y[1] - y[0]
    elif problem.kind == BLOW_UP:
        dy[0] = y[0] * y[0]
    elif problem.kind == NOT_A_NUMBER:
        dy[0] = y[0] if t < problem.constant else np.nan
    elif problem.kind == STILL:
        dy[0] = 0.0
    else:
        dy[0] = np.cos(problem.constant * t)


def run(kind, constant, y0, span, rtol=1e-10, atol=1e-12, h=0.0):
    """(status, t reached, next step, steps, y)."""
    y = np.array(y0, dtype=float)
    t0, t1 = span
    ended = dop853(Problem(kind, float(constant)), t0, t1, y, rtol, atol, h, workspace(y.size))
    return (*ended, y)


def by_scipy(kind, constant, y0, span, rtol=1e-10, atol=1e-12):
    problem = Problem(kind, constant)

    def f(t, y):
        dy = np.empty_like(y)
        right_hand_side(problem, t, y, dy)
        return dy

    return solve_ivp(f, span, y0, method="DOP853", rtol=rtol, atol=atol)


def test_tableau_is_the_published_one_as_scipy_has_it():
    n = tableau.A.shape[0]
    assert np.array_equal(tableau.A, DOP853.A[:n, :n])
    assert np.array_equal(tableau.B, DOP853.B)
    assert np.array_equal(tableau.C, DOP853.C[:n])
    assert np.array_equal(tableau.ERROR_3, DOP853.E3)
    assert np.array_equal(tableau.ERROR_5, DOP853.E5)


def test_tableau_is_consistent():
    assert tableau.A.sum(axis=1) == pytest.approx(tableau.C, abs=1e-14)
    for power in range(8):
        assert tableau.B @ tableau.C**power == pytest.approx(1.0 / (power + 1), abs=1e-14)
    assert np.triu(tableau.A).any() == False  # noqa: E712
    for weights in (tableau.ERROR_3, tableau.ERROR_5):
        assert weights.sum() == pytest.approx(0.0, abs=1e-14)


CASES = [
    (KEPLER, 1.0, [0.4, 0.0, 0.0, 2.0], (0.0, 20.0)),
    (OSCILLATOR, 0.7, [1.0, -0.5], (2.0, 40.0)),
    (VAN_DER_POL, 3.0, [2.0, 0.0], (0.0, 15.0)),
]


@pytest.mark.parametrize(("kind", "constant", "y0", "span"), CASES)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_as_accurate_and_as_quick_as_scipy(kind, constant, y0, span, rtol):
    """Against a far tighter run of scipy's: no more error, and not many more steps."""
    exact = by_scipy(kind, constant, y0, span, 3e-14, 1e-16).y[:, -1]
    peer = by_scipy(kind, constant, y0, span, rtol, 1e-2 * rtol)
    status, _, _, steps, y = run(kind, constant, y0, span, rtol, 1e-2 * rtol)
    assert status == DONE
    ours, theirs = (np.abs(x - exact).max() for x in (y, peer.y[:, -1]))
    assert ours < 5.0 * theirs + 1e-12
    assert 12 * steps < 1.2 * peer.nfev + 50


def test_error_follows_the_tolerance():
    """The error at the end is proportional to the tolerance."""
    kind, constant, y0, span = CASES[0]
    exact = by_scipy(kind, constant, y0, span, 3e-14, 1e-16).y[:, -1]
    tolerances = np.array([1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10])
    runs = [run(kind, constant, y0, span, tol, tol) for tol in tolerances]
    errors = [np.abs(r[4] - exact).max() for r in runs]
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.2)


def test_order_is_eight_at_a_fixed_step():
    """With a tolerance that never rejects, each call takes the one step that it is given."""
    exact = by_scipy(OSCILLATOR, 0.7, [1.0, -0.5], (0.0, 12.0), 3e-14, 1e-16).y[:, -1]
    errors, counts = [], np.array([8, 12, 16, 24, 32])
    for n in counts:
        y, h = np.array([1.0, -0.5]), 12.0 / n
        for i in range(n):
            y = run(OSCILLATOR, 0.7, y, (i * h, (i + 1) * h), 1e9, 1e9, h)[4]
        errors.append(np.linalg.norm(y - exact))
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(8.0, abs=0.2)


def test_kepler_orbits_keep_energy_momentum_and_return():
    e, orbits = 0.6, 10
    y0 = np.array([1.0 - e, 0.0, 0.0, np.sqrt((1.0 + e) / (1.0 - e))])
    status, _, _, steps, y = run(KEPLER, 1.0, y0, (0.0, 2.0 * np.pi * orbits), 1e-13, 1e-15)
    assert status == DONE and steps < 1200
    assert y == pytest.approx(y0, abs=1e-9)
    energy = 0.5 * (y[2] ** 2 + y[3] ** 2) - 1.0 / np.hypot(y[0], y[1])
    assert energy == pytest.approx(-0.5, abs=2e-12)
    assert y[0] * y[3] - y[1] * y[2] == pytest.approx(np.sqrt(1.0 - e * e), abs=2e-12)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
    st.floats(-50.0, 50.0),
    st.floats(-60.0, 60.0),
    st.sampled_from([0.0, 1e-8, 0.1, -0.1, 1e3]),
)
@example(0.0, 3.861248155823164e-160, 0.0, 3.861248155823164e-160, 0.0)  # squares underflow
def test_harmonic_oscillator_either_way_in_time_from_any_first_step(a, b, t0, span, h):
    status, _, next_step, _, y = run(OSCILLATOR, 0.0, [a, b], (t0, t0 + span), 1e-11, 1e-13, h)
    c, s = np.cos(span), np.sin(span)
    assert status == DONE
    assert y == pytest.approx([a * c + b * s, b * c - a * s], abs=3e-9)
    assert next_step >= 0.0


def test_the_next_step_it_returns_serves_the_next_call():
    first = run(KEPLER, 1.0, [1.0, 0.0, 0.0, 1.0], (0.0, 3.0))
    second = run(KEPLER, 1.0, first[4], (3.0, 6.0), h=first[2])
    once = run(KEPLER, 1.0, [1.0, 0.0, 0.0, 1.0], (0.0, 6.0))
    assert second[4] == pytest.approx([np.cos(6.0), np.sin(6.0), -np.sin(6.0), np.cos(6.0)])
    assert first[3] + second[3] <= once[3] + 2


def test_nothing_to_do_takes_no_step():
    status, _, _, steps, y = run(OSCILLATOR, 1.0, [1.0, 2.0], (5.0, 5.0))
    assert (status, steps) == (DONE, 0)
    assert y.tolist() == [1.0, 2.0]


def test_a_constant_takes_one_step():
    status, _, _, steps, y = run(STILL, 1.0, [0.0], (0.0, 1e6))
    assert (status, steps, y[0]) == (DONE, 1, 0.0)


def test_a_solution_that_runs_away_is_reported():
    status, t, _, _, y = run(BLOW_UP, 1.0, [1.0], (0.0, 2.0))
    assert status == STEP_TOO_SMALL
    assert t == pytest.approx(1.0, abs=1e-9) and y[0] > 1e10  # 1/(1 - t)


@pytest.mark.parametrize("start", [0.0, 0.5])
def test_rates_that_are_not_numbers_are_reported_at_once(start):
    """At the start, or on the way: y is the last good point."""
    status, _, _, steps, y = run(NOT_A_NUMBER, start, [1.0], (0.0, 1.0))
    assert status == STEP_TOO_SMALL
    assert steps < 200
    assert y[0] == pytest.approx(np.exp(start), rel=1e-6)


def test_non_finite_state_is_reported_at_once():
    status, _, _, steps, _ = run(OSCILLATOR, 0.0, [np.nan, 0.0], (0.0, 1.0))
    assert status == STEP_TOO_SMALL
    assert steps < 200


@pytest.mark.skipif(not engine.COMPILED, reason="ten million steps take hours in plain Python")
def test_too_many_steps_are_reported():
    status, _, _, steps, _ = run(RATTLE, 1e10, [0.0], (0.0, 1.0), 1e-13, 1e-15)
    assert status == TOO_MANY_STEPS
    assert steps == MOST_STEPS


class Nameless(NamedTuple):
    """A problem without a right-hand side."""

    kind: int


def test_a_problem_without_rates_is_reported():
    with pytest.raises(TypeError, match=r"dop853: must have rates_of\(Nameless\); received none"):
        rates(Nameless(1), 0.0, np.zeros(1), np.zeros(1))


def test_problem_class_selects_the_rates_in_plain_python_too():
    dy = np.zeros(2)
    rates(Problem(OSCILLATOR, 0.0), 0.0, np.array([3.0, 4.0]), dy)
    assert dy.tolist() == [4.0, -3.0]


def test_rates_with_other_arguments_are_reported():
    message = "rates_of: f must have the arguments problem, t, y, dy; received p, t, y, dy"
    with pytest.raises(TypeError, match=message):

        @rates_of(Nameless)
        def f(p, t, y, dy):
            pass
