"""The periodic regulator, matrix gains as a law, and the constant ones that settle fastest."""

import math
from dataclasses import replace

import numpy as np
import pytest
from attitude_holds import CUBESAT, at_strength, gains_of, hold
from scipy.integrate import solve_ivp
from slow_cases import slow_after

from torquer.theory.three_axis.feedback import _Smoothed, best_feedback, feedback_law, lqr_law
from torquer.theory.three_axis.floquet import exact_stability
from torquer.theory.three_axis.periodic_lqr import Weights, monodromy_steps, periodic_lqr
from torquer.theory.three_axis.response import pointing_error
from torquer.theory.three_axis.sampled import Cycle, SampledHold

WEIGHTS = Weights(math.radians(5.0), 0.1, 0.02)


@pytest.fixture(scope="module")
def held():
    return hold(70.0, gravity_gradient=True)


@pytest.fixture(scope="module")
def lqr(held):
    return periodic_lqr(held, WEIGHTS)


def test_the_solution_is_what_it_should_be(lqr):
    """Symmetric, positive definite, periodic, a solution of Riccati's equation."""
    assert lqr.asymmetry < 1e-9 and lqr.unclosed < 1e-12
    assert lqr.least > 1e-4
    assert np.linalg.eigvalsh(lqr.riccati).min() > 0.0
    assert lqr.residual < 1e-8
    assert lqr.riccati[-1] == pytest.approx(lqr.riccati[0], rel=1e-9)


def test_the_hamiltonian_flow_is_symplectic(held):
    transitions = monodromy_steps(held, WEIGHTS, 128)
    unit = np.block([[np.zeros((6, 6)), np.eye(6)], [-np.eye(6), np.zeros((6, 6))]])
    for t in transitions[::17]:
        assert t.T @ unit @ t == pytest.approx(unit, abs=1e-9 * np.abs(t).max() ** 2)


def costs(held, feedback_at, factors, x0, span):
    """Costs of the motions regulated by multiples of the feedback, by SciPy, from the plain
    definitions."""
    q = WEIGHTS.of_state

    def rates(u, y):
        free, gains, found = held.free(np.array([u % held.period])), feedback_at(u), []
        for factor, x in zip(factors, y.reshape(-1, 7)[:, :6], strict=True):
            m = np.cross(factor * gains @ x, free.b_body_t[0])
            turn = free.slopes[0] @ x + free.drive[0] @ m
            found += [*x[3:], *turn, q @ x**2 + m @ m / WEIGHTS.dipole**2]
        return np.array(found)

    start = np.tile(np.append(x0, 0.0), len(factors))
    return solve_ivp(rates, (0.0, span), start, rtol=1e-9, atol=1e-12).y[6::7, -1]


def test_solution_is_cost_to_go_and_no_gain_is_cheaper(held, lqr):
    """x.P x is the cost of the regulated motion from x; gains a few per cent off cost more."""
    x0 = np.array([0.03, -0.02, 0.05, 0.01, 0.02, -0.04])

    def at(u):
        place = (u % held.period) / held.period * (len(lqr.u) - 1)
        k = min(int(place), len(lqr.u) - 2)
        part = place - k
        return (1.0 - part) * lqr.feedback[k] + part * lqr.feedback[k + 1]

    wanted = x0 @ lqr.riccati[0] @ x0
    cost, *others = costs(held, at, (1.0, 0.9, 1.1), x0, 3.0 * held.period)
    assert cost == pytest.approx(wanted, rel=2e-4)
    assert min(others) > wanted * (1.0 + 5e-4)


@pytest.mark.parametrize(
    ("harmonics", "most"), slow_after(2, [(2, 0.2), (4, 0.05), (8, 0.005)], names=2)
)
def test_the_law_of_many_harmonics_has_the_regulators_degree(held, lqr, harmonics, most):
    """Exact multipliers of the law's own kernel, beside those of the Riccati solution."""
    law = lqr_law(held, lqr, harmonics)
    degree = exact_stability(replace(held, law=law), 1e-10).degree
    assert abs(degree / lqr.degree - 1.0) < most


def test_the_law_goes_by_the_argument_of_latitude():
    """A table that starts elsewhere on the orbit gives the same law."""
    lqrs = [hold(60.0, u0_deg=u0) for u0 in (0.0, 137.0)]
    series = [
        np.array(lqr_law(each, periodic_lqr(each, WEIGHTS, 1e-6), 2).parameters.rate_gains)
        for each in lqrs
    ]
    assert series[1] == pytest.approx(series[0], abs=1e-3 * np.abs(series[0]).max())


def test_field_turning_with_earth_has_a_regulator_too():
    cubesat = hold(field="tilted_dipole", revolutions=3, **CUBESAT)
    lqr = periodic_lqr(cubesat, Weights(math.radians(5.0), 0.1, 1e-3), 1e-6)
    law = lqr_law(cubesat, lqr, 2)
    assert exact_stability(replace(cubesat, law=law), 1e-8).degree > 0.5


def test_it_points_better_than_scalar_gains():
    """The CubeSat with a residual dipole of 0.2 mA m^2: a degree or so, not ten."""
    cubesat = hold(**CUBESAT)
    law = lqr_law(cubesat, periodic_lqr(cubesat, Weights(math.radians(5.0), 0.1, 1e-3)), 2)
    errors = [
        pointing_error(SampledHold(each, Cycle(3.0), (2e-4, 0.0, 0.0))).greatest_rad
        for each in (replace(cubesat, law=law), at_strength(cubesat, 3.0))
    ]
    assert math.degrees(errors[0]) == pytest.approx(0.84, abs=0.02)
    assert errors[1] > 3.0 * errors[0]


def test_more_steps_reach_tolerance_where_weights_ask_fast_motion():
    """A stiff one; the error says how near it came, not that there is no solution."""
    held = hold(**CUBESAT)
    weights = Weights(math.radians(10.0), math.radians(10.0), 0.02)
    with pytest.raises(ArithmeticError, match=r"most_steps = 1024 .*; with 1024 it changed by"):
        periodic_lqr(held, weights, 1e-10, 1024)
    found = periodic_lqr(held, weights, 1e-10)
    assert found.residual <= 1e-8 and found.degree > 0.0


def test_what_cannot_be_regulated_is_refused():
    """Equatorial orbit, direct dipole: the field stays along the normal, pitch is out of reach."""
    with pytest.raises(
        ArithmeticError, match=r"the Riccati equation must have .* none was found \(a motion"
    ):
        periodic_lqr(hold(0.0, reference="orbital", field="direct_dipole"), WEIGHTS)
    with pytest.raises(ValueError, match="dipole: must be above 0; received 0"):
        periodic_lqr(hold(), Weights(0.1, 0.1, 0.0))
    with pytest.raises(ValueError, match="harmonics: must be at least 0; received -1"):
        lqr_law(hold(), periodic_lqr(hold(), WEIGHTS, 1e-6), -1)


def test_feedback_of_scalar_gains_is_the_three_axis_law():
    held = at_strength(hold(70.0), 1.3)
    k, k_a = gains_of(held)
    f = np.hstack([2.0 * k_a * np.eye(3), k * held.rate_rad_s * np.eye(3)])
    same = replace(held, law=feedback_law(held, f[None]))
    assert exact_stability(same).degree == pytest.approx(exact_stability(held).degree, rel=1e-9)


@pytest.fixture(scope="module")
def sized():
    """A hold by good scalar gains, and their size."""
    k, k_a = 3.739e6, 1390.0
    held = hold(70.0, k=k, k_a=k_a)
    return held, math.sqrt(3.0) * math.hypot(2.0 * k_a, k * held.rate_rad_s)


@pytest.mark.slow
def test_constant_gains_settle_faster_than_scalar_ones_of_equal_size(sized):
    held, size = sized
    found = best_feedback(held, size, steps=32)
    assert np.linalg.norm(found.f) == pytest.approx(size, rel=1e-12)
    scalar, exact = (
        exact_stability(held).degree,
        exact_stability(replace(held, law=feedback_law(held, found.f[None]))),
    )
    assert exact.degree == pytest.approx(found.degree, abs=1e-6)
    assert found.degree > 1.3 * scalar
    assert 0.95 * found.degree < found.smoothed_degree < found.degree


def test_a_maximum_is_one(sized):
    """Its gradient vanishes, and no other gains around are better; nor are other starts."""
    held, size = sized
    found = best_feedback(held, size, steps=16)
    assert found.slope < 5e-3
    assert len(found.others) == 2 and max(found.others) <= found.smoothed_degree
    smoothed, rng = _Smoothed(held, size, found.bound, 16), np.random.default_rng(5)
    z = (found.f / size).ravel()
    for reach in (1e-3, 1e-2):
        for _ in range(20):
            trial = z + reach * rng.normal(size=18) / math.sqrt(18)
            assert -smoothed(trial)[0] < found.smoothed_degree + 1e-2 * reach


def test_the_gradient_of_the_smoothed_degree_is_right(sized):
    held, size = sized
    smoothed, rng = _Smoothed(held, size, 100.0, 64), np.random.default_rng(9)
    z = np.hstack([0.4 * np.eye(3), 0.5 * np.eye(3)]).ravel() + 0.05 * rng.normal(size=18)
    _, slope = smoothed(z)
    for _ in range(4):
        along = rng.normal(size=18)
        change = smoothed(z + 1e-4 * along)[0] - smoothed(z - 1e-4 * along)[0]
        assert change / 2e-4 == pytest.approx(slope @ along, rel=1e-3, abs=1e-4)


def test_messages_of_feedback():
    with pytest.raises(ValueError, match="size: must be above 0; received 0"):
        best_feedback(hold(), 0.0)
    with pytest.raises(ValueError, match=r"bound: must be above 6 \(the first period alone"):
        best_feedback(hold(), 1.0, bound=5.0)
