"""Mathieu's equation: characteristic values, edges and FIELD's series, against scipy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.linalg import eigvalsh_tridiagonal
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

from gallery.theory.mathieu import (
    edges,
    first_tongue,
    first_tongue_of_strength,
    first_tongue_solutions,
    half_trace,
    half_trace_series,
    hill_equation,
    mathieu_equation,
    mathieu_parameters,
    multipliers_from_half_trace,
)
from torquer.compile.engine import COMPILED
from torquer.theory.periodic.floquet import chart, monodromy, multipliers


def half_trace_at(a, q):
    return float(half_trace(monodromy(mathieu_equation, a=a, q=q)))


def characteristic_values(q, count):
    """(a_0 ... a_count-1), (b_1 ... b_count): the edges of all four kinds."""
    # values of one kind lie 4 apart or more; an odd first knot keeps whole numbers off the grid
    grid = np.arange(-2.0 * q - 1.0 + 1e-3 * math.sqrt(2.0), (count + 1.0) ** 2 + 2.0 * q, 0.5)
    found = edges(mathieu_equation.with_parameters(q=q), "a", grid)
    even = np.sort(np.concatenate([found.even_pi, found.even_2pi]))
    odd = np.sort(np.concatenate([found.odd_pi, found.odd_2pi]))
    return even[:count], odd[:count]


@pytest.mark.parametrize("q", [0.01, 0.3, 1.0, 5.0, 9.0])
@pytest.mark.parametrize("count", [1, 4, 7])
def test_characteristic_values_are_scipys(q, count):
    """At these q: mathieu_a(5, 21) of SciPy 1.17 is a_3, as the series' matrix shows."""
    even, odd = characteristic_values(q, count)
    assert even == pytest.approx([mathieu_a(m, q) for m in range(count)], abs=1e-10)
    assert odd == pytest.approx([mathieu_b(m, q) for m in range(1, count + 1)], abs=1e-10)


def by_fourier_series(q, parity, count):
    """Eigenvalues of the series' tridiagonal matrices: harmonics of one parity each."""
    found = []
    for first in (0, 1) if parity == "even" else (2, 1):
        harmonics = first + 2.0 * np.arange(60)
        diagonal, beside = harmonics**2, np.full(59, float(q))
        if first == 0:
            beside[0] *= math.sqrt(2.0)
        if first == 1:
            diagonal[0] += q if parity == "even" else -q
        found.append(eigvalsh_tridiagonal(diagonal, beside))
    return np.sort(np.concatenate(found))[:count]


@pytest.mark.parametrize("q", [0.01, 3.0, *([51.725517241379315, 100.0] if COMPILED else [])])
def test_characteristic_values_by_fourier_series(q):
    """At the third q scipy.special itself is off by 44 in one of these values."""
    even, odd = characteristic_values(q, 12)
    assert even == pytest.approx(by_fourier_series(q, "even", 12), abs=1e-9)
    assert odd == pytest.approx(by_fourier_series(q, "odd", 12), abs=1e-9)


@pytest.mark.parametrize("q", [0.1, 1.0, 4.0])
@pytest.mark.parametrize("m", [0, 1, 2, 3, 4])
def test_multipliers_at_scipys_values_are_one_or_minus_one(m, q):
    """The periodic solution returns, times (-1)^m, to 1e-8; two multipliers meet there."""
    sign = (-1.0) ** m
    for value, start in ((mathieu_a, (1.0, 0.0)), (mathieu_b, (0.0, 1.0))):
        if m == 0 and value is mathieu_b:
            continue
        matrix = monodromy(mathieu_equation, a=float(value(m, q)), q=q, tolerance=1e-13)
        assert matrix @ start == pytest.approx(sign * np.array(start), abs=1e-8)
        a = float(half_trace(matrix))
        assert a == pytest.approx(sign, abs=1e-10)
        # a double root: rounding of A enters with its square root
        assert np.abs(multipliers_from_half_trace(a) - sign).max() < 1e-5


@pytest.mark.parametrize(("m", "q"), [(1, 0.3), (2, 1.5), (1, 3.0), (3, 3.0)])
def test_edges_by_the_trace_of_the_monodromy_matrix(m, q):
    """Without use of the symmetry: A = +-1, for open tongues."""
    for value, scipys in (("a", mathieu_a(m, q)), ("b", mathieu_b(m, q))):
        exact = float(scipys)
        at = brentq(
            lambda a: half_trace_at(a, q) - (-1.0) ** m, exact - 0.03, exact + 0.03, xtol=1e-13
        )
        assert at == pytest.approx(exact, abs=1e-8), value


def test_edges_by_kind():
    found = edges(mathieu_equation.with_parameters(q=1.0), "a", np.linspace(-2.0, 20.0, 200))
    assert found.even_pi == pytest.approx([mathieu_a(m, 1.0) for m in (0, 2, 4)], abs=1e-11)
    assert found.odd_pi == pytest.approx([mathieu_b(m, 1.0) for m in (2, 4)], abs=1e-11)
    assert found.even_2pi == pytest.approx([mathieu_a(m, 1.0) for m in (1, 3)], abs=1e-11)
    assert found.odd_2pi == pytest.approx([mathieu_b(m, 1.0) for m in (1, 3)], abs=1e-11)


def test_the_chart_is_unstable_between_the_edges_and_stable_outside():
    a, q = np.linspace(0.02, 5.0, 40), np.linspace(0.05, 1.5, 7)
    found = chart(mathieu_equation, ("a", a), ("q", q))
    for i, strength in enumerate(q):
        even, odd = characteristic_values(float(strength), 4)
        inside = a < even[0]
        for n in (1, 2):
            low, high = sorted((even[n], odd[n - 1]))
            inside |= (a > low) & (a < high)
        np.testing.assert_array_equal(found.largest_multiplier[i] > 1.0 + 1e-5, inside)


@settings(max_examples=50, deadline=None)
@given(a=st.floats(-1.0, 9.0), q=st.floats(0.0, 3.0))
def test_multipliers_from_the_half_trace(a, q):
    matrix = monodromy(mathieu_equation, a=a, q=q)
    rho = multipliers_from_half_trace(half_trace(matrix))
    assert np.prod(rho) == pytest.approx(1.0, abs=1e-9 * abs(rho).max() ** 2)
    assert rho.sum() == pytest.approx(np.trace(matrix), rel=1e-12, abs=1e-12)
    general = multipliers(matrix)
    nearest = np.abs(rho[:, None] - general[None]).min(axis=1)
    assert nearest.max() < 1e-6 * max(1.0, abs(rho).max())


def test_hill_with_one_harmonic_is_mathieu():
    for a, q in ((1.3, 0.4), (0.2, 1.1)):
        same = hill_equation.with_data([a, -2.0 * q])
        assert monodromy(same) == pytest.approx(monodromy(mathieu_equation, a=a, q=q), abs=1e-12)


@pytest.mark.parametrize("t", [0.0, 0.3, 1.1, 2.9])
@pytest.mark.parametrize("count", [1, 2, 3, 6])
def test_hills_sum(t, count):
    series = np.random.default_rng(count).normal(size=count)
    expected = -sum(c * math.cos(2.0 * k * t) for k, c in enumerate(series))
    matrix = hill_equation.with_data(series).matrix(t)
    assert matrix == pytest.approx(np.array([[0.0, 1.0], [expected, 0.0]]), abs=1e-14)


def order(errors):
    """Powers of chi with which errors at chi, chi/2, chi/4 fall."""
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])


def exact_first_tongue(chi):
    """lambda^2 on both edges (cosine's, sine's) for given chi, where q depends on lambda^2."""

    def at(characteristic, near):
        return brentq(
            lambda x: x - characteristic(1, abs(0.5 * x * chi)), 0.3, 3.0, xtol=1e-14, rtol=1e-14
        )

    pair = at(mathieu_b, 0), at(mathieu_a, 0)
    return pair if chi >= 0.0 else pair[::-1]


@pytest.mark.parametrize("side", [0, 1])
def test_field_2_13_is_right_to_second_order_in_chi(side):
    """7/32 belongs to chi; taken for lambda^2 chi the second order is wrong."""
    chis = np.array([0.2, 0.1, 0.05])
    exact = np.array([exact_first_tongue(chi)[side] for chi in chis])
    assert order(first_tongue(chis)[side] - exact) == pytest.approx([3.0, 3.0], abs=0.2)
    strength = chis * exact
    wrong = first_tongue(strength)[side]
    assert order(wrong - exact) == pytest.approx([2.0, 2.0], abs=0.2)


@pytest.mark.parametrize("side", [0, 1])
def test_the_same_edges_with_the_strength_given(side):
    strengths = np.array([1.0, 0.5, 0.25])
    exact = [[mathieu_b(1, s / 2), mathieu_a(1, s / 2)][side] for s in strengths]
    assert order(first_tongue_of_strength(strengths)[side] - exact) == pytest.approx(
        [5.0, 5.0], abs=0.3
    )


@pytest.mark.parametrize("side", [0, 1])
def test_field_2_14_solves_the_equation(side):
    u = np.arange(32) * (2.0 * math.pi / 32)
    waves = np.fft.fftfreq(32, 1.0 / 32)

    def residual(chi):
        y = first_tongue_solutions(chi, u)[side]
        second = np.fft.ifft(-(waves**2) * np.fft.fft(y)).real
        return np.abs(second + first_tongue(chi)[side] * (1.0 + chi * np.cos(2.0 * u)) * y).max()

    assert order(np.array([residual(c) for c in (0.2, 0.1, 0.05)])) == pytest.approx(
        [3.0, 3.0], abs=0.1
    )


@pytest.mark.parametrize("lambda2", [0.3, 1.0, 2.7, 9.0])
def test_field_2_12_begins_with_the_square_of_chi(lambda2):
    chis = np.array([0.2, 0.1, 0.05])
    exact = [half_trace_at(**mathieu_parameters(lambda2, chi)) for chi in chis]
    assert order(half_trace_series(lambda2, chis) - exact).min() > 3.7
    if lambda2 != 9.0:  # at 4, 9, ... the term vanishes
        bare = half_trace_series(lambda2, 0.0)
        assert order(bare - exact) == pytest.approx([2.0, 2.0], abs=0.3)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (lambda: edges(mathieu_equation, "a", [1.0]), "values of a must be 2 or more, ascending"),
        (
            lambda: edges(mathieu_equation, "a", [1.0, 0.5]),
            "values of a must be 2 or more, ascending",
        ),
        (lambda: edges(mathieu_equation, "c", [1.0, 2.0]), "parameter must be one of: a, q"),
    ],
)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
