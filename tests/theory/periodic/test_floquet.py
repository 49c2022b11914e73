"""The Floquet tool: exact solutions, Liouville's formula, invariants, scipy, charts, messages."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from gallery.theory.mathieu import mathieu_equation
from torquer.compile import engine
from torquer.environment.field import averaged
from torquer.theory.periodic import collocation
from torquer.theory.periodic.floquet import (
    chart,
    degree_of_stability,
    exponents,
    monodromy,
    multipliers,
    transitions,
)
from torquer.theory.periodic.periodic_systems import PeriodicSystem, compile_matrix, periodic_system

PERIOD = 2.0 * math.pi


def fourier(t, parameters, out):
    """A = gain (P + Q cos t + R sin t); the system's data are P, Q, R row by row."""
    n = out.shape[0]
    c, s = math.cos(t), math.sin(t)
    for i in range(n):
        for j in range(n):
            at = 1 + i * n + j
            turning = c * parameters[at + n * n] + s * parameters[at + 2 * n * n]
            out[i, j] = parameters[0] * (parameters[at] + turning)


def fourier_system(p, q, r, gain=1.0):
    data = tuple(np.concatenate([np.ravel(p), np.ravel(q), np.ravel(r)]).tolist())
    return PeriodicSystem("fourier", fourier, len(p), PERIOD, {"gain": gain}, data)


def random_system(n, seed, size=0.5):
    return fourier_system(*np.random.default_rng(seed).normal(0.0, size / math.sqrt(n), (3, n, n)))


def close(a, b, tolerance):
    return np.abs(a - b).max() <= tolerance * np.abs(b).max()


@pytest.mark.parametrize("n", [1, 2, 6, 15])
def test_constant_coefficients_give_the_exponential(n):
    p = np.random.default_rng(n).normal(0.0, 1.0 / math.sqrt(n), (n, n))
    found = monodromy(fourier_system(p, 0.0 * p, 0.0 * p))
    assert close(found, expm(p * PERIOD), 1e-11)


@settings(max_examples=40, deadline=None)
@given(n=st.integers(1, 7), seed=st.integers(0, 10**6), size=st.floats(0.05, 1.5))
def test_liouville(n, seed, size):
    """det M = exp of the integral of the trace, here 2 pi tr P."""
    system = random_system(n, seed, size)
    trace = np.trace(np.reshape(system.data[: n * n], (n, n)))
    found = monodromy(system, tolerance=1e-13)
    conditioned = np.linalg.cond(found)
    error = abs(np.linalg.slogdet(found)[1] - PERIOD * trace)
    assert error <= 1e-11 * (1.0 + conditioned)


def test_against_scipy():
    system = random_system(6, 5)

    def f(t, y):
        return (system.matrix(t) @ y.reshape(6, 6)).ravel()

    found = solve_ivp(f, (0.0, PERIOD), np.eye(6).ravel(), method="DOP853", rtol=3e-14, atol=1e-16)
    assert close(monodromy(system), found.y[:, -1].reshape(6, 6), 2e-12)


def test_the_rule_is_of_gauss():
    """Quadrature exact to degree 11, stages to degree 5; two stages as in the textbooks."""
    rule = collocation.gauss_rule()
    a, b, c = rule[:6], rule[6], rule[7]
    for k in range(12):
        assert b @ c**k == pytest.approx(1.0 / (k + 1), abs=2e-16)
    for k in range(6):
        assert a @ c**k == pytest.approx(c ** (k + 1) / (k + 1), abs=1e-15)
    r = math.sqrt(3.0) / 6.0
    two = [[0.25, 0.25 - r], [0.25 + r, 0.25], [0.5, 0.5], [0.5 - r, 0.5 + r]]
    assert collocation.gauss_rule(2) == pytest.approx(np.array(two), abs=1e-15)


def test_the_order_is_twelve():
    system = mathieu_equation.with_parameters(a=5.0, q=1.5)
    exact = monodromy(system, tolerance=1e-14)
    matrix, errors, counts = compile_matrix(system.function), [], np.array([2, 3, 4])
    for steps in counts:
        out = np.empty((2, 2))
        work = collocation.workspace(2)
        collocation.transition(matrix, system.pack(), 0.0, math.pi, int(steps), work, out)
        errors.append(np.abs(out - exact).max())
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(-12.0, abs=0.6)


def test_canonical_equations_stay_canonical():
    """Six stages keep quadratic invariants at any step, the coarse ones of a loose run too."""
    rng = np.random.default_rng(3)
    unit = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    hessians = [h + h.T for h in rng.normal(0.0, 0.15, (3, 4, 4))]
    system = fourier_system(*[unit @ h for h in hessians])
    coarse = transitions(system, tolerance=1e-2)
    assert coarse.steps[0] == 4
    found = coarse.matrices[0]
    assert close(found.T @ unit @ found, unit, 1e-12)
    exact = monodromy(system)
    assert 1e-11 < np.abs(found - exact).max() < 1e-2 * np.abs(exact).max()


def test_strong_damping_is_no_trouble():
    """x' = -(1e4 + cos t) x beside x' = -0.1 x: the slow multiplier is exact."""
    zero = np.zeros((2, 2))
    system = fourier_system(np.diag([-1e4, -0.1]), np.diag([-1.0, 0.0]), zero)
    assert monodromy(system)[1, 1] == pytest.approx(math.exp(-0.1 * PERIOD), rel=1e-11)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), start=st.floats(-5.0, 5.0), part=st.floats(0.1, 0.9))
def test_transitions_follow_each_other(seed, start, part):
    system = random_system(3, seed)
    first = transitions(system, start=start, span=part * PERIOD).matrices[0]
    second = transitions(system, start=start + part * PERIOD, span=(1.0 - part) * PERIOD)
    whole = transitions(system, start=start).matrices[0]
    assert close(second.matrices[0] @ first, whole, 1e-8)
    # the multipliers do not depend on where the period begins
    moved = np.poly(whole)
    assert moved == pytest.approx(np.poly(monodromy(system)), rel=1e-7, abs=1e-7 * abs(moved).max())


def test_exponents_of_decoupled_motions():
    """x1' = -(0.2 + cos t) x1 and a damped oscillator: -0.2 and -0.05 +- 0.3 i."""
    p = np.diag([-0.2, -0.05, -0.05])
    p[1, 2], p[2, 1] = 0.3, -0.3
    q = np.diag([-1.0, 0.0, 0.0])
    rho = multipliers(monodromy(fourier_system(p, q, 0.0 * q)))
    found = exponents(rho, PERIOD)
    assert sorted(found, key=lambda z: z.imag) == pytest.approx(
        [-0.05 - 0.3j, -0.2, -0.05 + 0.3j], abs=1e-12
    )
    assert np.all(np.diff(np.abs(rho)) <= 1e-12)
    assert degree_of_stability(rho, PERIOD) == pytest.approx(0.05, abs=1e-12)
    assert degree_of_stability(np.array([0.0, 0.0]), PERIOD) == math.inf


@periodic_system(order=6, period=math.pi, parameters={"k": 0.1, "k_a": 0.1, "cone": 1.0})
def three_axis(u, parameters, out):
    """J w' = (b b^T - 1)(k w + 2 k_a theta), theta' = w, J = diag(1, 2, 1.5): inertial hold."""
    b = averaged.b_z(1.0, u, parameters[2])
    for i in range(3):
        for j in range(6):
            out[i, j] = out[3 + i, j] = 0.0
        out[3 + i, i] = 1.0
        for j in range(3):
            across = (b[i] * b[j] - (1.0 if i == j else 0.0)) / (1.0, 2.0, 1.5)[i]
            out[i, j] = parameters[0] * across
            out[i, 3 + j] = 2.0 * parameters[1] * across


def test_slow_three_axis_control_follows_the_averaged_equations():
    """As gains fall (k_a with k^2), exponents over k tend to the averaged channels'."""
    p = 0.5 * math.sin(1.0) ** 2
    channels = zip((1.0, 2.0, 1.5), (1.0 - p, 1.0 - p, 2.0 * p), strict=True)
    wanted = [np.roots([1.0, s / j, 2.0 * 0.4 * s / j]) for j, s in channels]
    slowest = -np.concatenate(wanted).real.max()
    departures = []
    for k in (0.08, 0.04, 0.02):
        rho = multipliers(monodromy(three_axis, k=k, k_a=0.4 * k * k))
        departures.append(abs(degree_of_stability(rho, math.pi) / k - slowest))
    order = np.log2(departures[0] / departures[1]), np.log2(departures[1] / departures[2])
    assert departures[-1] < 1e-3 * slowest
    assert min(order) > 0.9


def test_a_chart_is_its_points():
    seen = []
    a, q = np.linspace(0.1, 4.0, 23), np.linspace(0.0, 1.0, 29)
    found = chart(
        mathieu_equation, ("a", a), ("q", q), workers=2, progress=lambda *done: seen.append(done)
    )
    assert found.degree_of_stability.dims == ("q", "a")
    assert found.attrs == {"system": "mathieu_equation", "period": math.pi}
    for i, j in ((0, 0), (17, 5), (28, 22)):
        m = monodromy(mathieu_equation, a=a[j], q=q[i])
        rho = multipliers(m)
        assert float(found.trace[i, j]) == pytest.approx(np.trace(m), abs=1e-8)
        assert float(found.largest_multiplier[i, j]) == pytest.approx(abs(rho[0]), abs=1e-6)
        assert float(found.degree_of_stability[i, j]) == pytest.approx(
            degree_of_stability(rho, math.pi), abs=1e-6
        )
    assert float(found.error.max()) <= 1e-10
    assert seen[-1] == (667, 667)
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})
    alone = chart(mathieu_equation, ("a", a), ("q", q), workers=1)
    assert alone.identical(found)


def test_what_does_not_settle_is_not_a_number():
    zero = np.zeros((1, 1))
    wild = fourier_system(np.ones((1, 1)), zero, zero)
    found = transitions(wild, {"gain": [0.1, 1e3, 0.2]}, most_steps=4)
    assert np.isnan(found.matrices[:, 0, 0]).tolist() == [False, True, False]
    assert np.isnan(found.errors).tolist() == [False, True, False]
    rho = multipliers(found.matrices)
    assert np.isnan(rho[:, 0]).tolist() == [False, True, False]
    with pytest.raises(
        ArithmeticError, match=r"fourier: the monodromy matrix must converge to 1e-12"
    ):
        monodromy(wild, gain=1e3)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (
            lambda: mathieu_equation.with_parameters(b=1.0),
            r"mathieu_equation: parameter must be one of: a, q; .*'b'",
        ),
        (
            lambda: mathieu_equation.with_parameters(data=1.0),
            "mathieu_equation: data must be set by with_data",
        ),
        (
            lambda: mathieu_equation.with_parameters(a=math.nan).pack(),
            "mathieu_equation: a: must be finite",
        ),
        (lambda: mathieu_equation.with_data([math.inf]), "mathieu_equation: data: must be finite"),
        (lambda: PeriodicSystem("s", fourier, 0, 1.0), "s: order must be 1 or more; received 0"),
        (lambda: PeriodicSystem("s", fourier, 1, 0.0), "s: period must be positive; received 0"),
        (
            lambda: PeriodicSystem("s", fourier, 1, 1.0, {"data": 1}),
            "s: .* must not be called data",
        ),
        (
            lambda: transitions(mathieu_equation, {"a": 1.0}),
            r"a must have shape \(points,\); .* shape \(\)",
        ),
        (
            lambda: transitions(random_system(1, 1), {"data": [[1.0]]}),
            r"data must have shape \(points, 3\); received shape \(1, 1\)",
        ),
        (
            lambda: transitions(mathieu_equation, {"a": [1.0, 2.0], "q": [1.0]}),
            "mathieu_equation: values must be equally long; received lengths 2, 1",
        ),
        (
            lambda: transitions(mathieu_equation, tolerance=0.0),
            "tolerance must be positive .* received 0.0",
        ),
        (
            lambda: chart(mathieu_equation, ("a", [1.0]), ("a", [1.0])),
            "two parameters; received 'a' twice",
        ),
    ],
)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()


@pytest.mark.skipif(not engine.COMPILED, reason="says what the compiler does not take")
def test_messages_of_systems_that_do_not_compile():
    def two(t, out):
        out[0, 0] = t

    def wrong(t, parameters, out):
        out[0, 0] = t + "x"

    with pytest.raises(ValueError, match=r"two: must compile as A\(t, .* takes 2 arguments"):
        monodromy(PeriodicSystem("s", two, 1, 1.0))
    with pytest.raises(ValueError, match=r"system wrong: must compile as A\(t, parameters, out\)"):
        monodromy(PeriodicSystem("s", wrong, 1, 1.0))


def test_a_system_may_hold_numbers_of_its_surroundings():
    rate = 0.3

    def inner(t, parameters, out):
        out[0, 0] = -rate

    found = monodromy(PeriodicSystem("inner", inner, 1, 2.0))
    assert found[0, 0] == pytest.approx(math.exp(-0.6), rel=1e-13)
