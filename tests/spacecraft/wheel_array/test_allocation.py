"""Shares of the wheels: linear programming, certificates, closed forms, losses, continuity."""

import time

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import linprog

from torquer.compile import engine
from torquer.spacecraft.wheel_array import layout
from torquer.spacecraft.wheel_array.allocation import (
    _share_all,
    allocate,
    minimax,
    wheel_set,
    within_limits,
)
from torquer.spacecraft.wheel_array.envelope import momentum_envelope, support
from torquer.spacecraft.wheel_array.layout import WheelArray

COPLANAR = [[1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, -1, 0], [0, 0, -2], [0, 1, 1]]
ARRAYS = {
    "four": layout.four_sided_pyramid(80.5, 45.5),
    "six": layout.regular_pyramid(6, 81.1),
    "skew": layout.orthogonal_and_skew(),
    "coplanar": np.array(COPLANAR, dtype=np.float64),
    "twelve": np.random.default_rng(5).normal(size=(12, 3)),
}
MANY = settings(max_examples=100, deadline=None)


def array(name, equal=False):
    axes = ARRAYS[name]
    limits = 18.0 if equal else np.random.default_rng(6).uniform(5.0, 20.0, len(axes)).tolist()
    return WheelArray(axes=axes.tolist(), momentum_limit_n_m_s=limits)


def cases(name):
    """The array whole, after single and after double losses that leave three dimensions."""
    whole = array(name)
    double = [(0, 1), (2, 3)] if whole.count > 4 else []
    return [whole, *(whole.without(k) for k in range(whole.count)),
            *(whole.without(*pair) for pair in double)]  # fmt: skip


def best_of_linear_program(axes, limits, demand):
    """Least greatest share: unknown shares and their bound."""
    works = limits > 0.0
    n, one = works.sum(), np.ones((works.sum(), 1))
    rows = np.hstack([(axes[works] * limits[works, None]).T, np.zeros((3, 1))])
    bounds = np.vstack([np.hstack([np.eye(n), -one]), np.hstack([-np.eye(n), -one])])
    found = linprog(
        np.append(np.zeros(n), 1.0), A_eq=rows, b_eq=demand, A_ub=bounds, b_ub=np.zeros(2 * n),
        bounds=[(None, None)] * (n + 1), method="highs",
    )  # fmt: skip
    return found.fun


@pytest.mark.parametrize("name", ARRAYS)
def test_minimax_is_the_optimum_of_linear_programming(name):
    random = np.random.default_rng(1)
    for wheels in cases(name):
        demands = random.normal(size=(12, 3)) * 20.0
        axes, limits = np.array(wheels.axes), wheels.momentum_limits()
        best = [best_of_linear_program(axes, limits, demand) for demand in demands]
        assert allocate(wheels, demands)[1] == pytest.approx(np.array(best), rel=1e-9)


@pytest.mark.parametrize("name", ARRAYS)
def test_ten_thousand_demands_are_shared_with_a_proof(name):
    """What is written makes the demand with shares up to t; a direction proves that none less do.

    For any direction u, u . demand <= t * support(u): duality of linear programming.
    """
    random, all_cases = np.random.default_rng(2), cases(name)
    for wheels in all_cases:
        demands = random.normal(size=(2000 if len(all_cases) < 6 else 1250, 3)) * 20.0
        axes, limits = np.array(wheels.axes), wheels.momentum_limits()
        momenta, greatest = allocate(wheels, demands)
        size = np.linalg.norm(demands, axis=1)
        assert np.abs(momenta @ axes - demands).max(axis=1) == pytest.approx(0.0 * size, abs=1e-11)
        works = limits > 0.0
        assert np.all(momenta[:, ~works] == 0.0)
        shares = np.abs(momenta[:, works]) / limits[works]
        assert np.all(shares <= greatest[:, None] * (1.0 + 1e-12))
        i, j = np.triu_indices(works.sum(), 1)
        normals = np.cross(axes[works][i], axes[works][j])
        normals = normals[np.linalg.norm(normals, axis=1) > 1e-6]
        proof = np.abs(demands @ normals.T) / support(limits[works, None] * axes[works], normals)
        assert greatest == pytest.approx(proof.max(axis=1), rel=1e-9)


def test_all_of_the_envelope_is_reached():
    for name in ARRAYS:
        wheels = array(name)
        found = momentum_envelope(wheels)
        momenta, greatest = allocate(wheels, found.vertices)
        assert greatest == pytest.approx(np.ones(len(greatest)), rel=1e-12)
        assert momenta @ np.array(wheels.axes) == pytest.approx(found.vertices, abs=1e-11)


def test_least_squares_is_the_pseudo_inverse_of_the_working_wheels():
    demands = np.random.default_rng(3).normal(size=(50, 3))
    for name in ARRAYS:
        for wheels in cases(name):
            works = wheels.momentum_limits() > 0.0
            momenta, greatest = allocate(wheels, demands, "least_squares")
            expected = demands @ np.linalg.pinv(np.array(wheels.axes)[works])
            assert momenta[:, works] == pytest.approx(expected, rel=1e-10, abs=1e-12)
            shares = np.abs(momenta[:, works]) / wheels.momentum_limits()[works]
            assert greatest == pytest.approx(shares.max(axis=1))


def test_pseudo_inverses_of_the_text_in_closed_form():
    momenta, _ = allocate(array("four"), np.eye(3), "least_squares")
    assert momenta == pytest.approx(0.25 / ARRAYS["four"].T)
    momenta, _ = allocate(array("six"), np.eye(3), "least_squares")
    gamma, turn = np.radians(81.1), np.radians(60.0) * np.arange(1, 7)
    across = np.array([np.cos(turn), np.sin(turn)]) / (3.0 * np.sin(gamma))
    expected = np.vstack([np.full(6, 1.0 / (6.0 * np.cos(gamma))), across])
    assert momenta == pytest.approx(expected, abs=1e-14)


def test_what_the_working_wheels_cannot_make_is_left_out():
    """Two wheels: the plane of their axes; one: its line; none: nothing."""
    demands = np.random.default_rng(4).normal(size=(100, 3))
    for lost in [(0, 1), (1, 3), (0, 1, 3), (0, 1, 2, 3)]:
        wheels = array("four").without(*lost)
        works = wheels.momentum_limits() > 0.0
        axes = np.array(wheels.axes)[works].reshape(-1, 3)
        expected = demands @ (np.linalg.pinv(axes) if len(axes) else np.zeros((3, 0)))
        for method in ("minimax", "least_squares"):
            momenta, greatest = allocate(wheels, demands, method)
            assert momenta[:, works] == pytest.approx(expected, abs=1e-11)
            shares = np.abs(momenta).max(axis=1, initial=0.0)
            assert np.all((greatest > 0.0) == (shares > 0.0))


def test_parallel_wheels_share_as_their_limits_do():
    axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 1]]
    wheels = WheelArray(axes=axes, momentum_limit_n_m_s=(1.0, 2.0, 1.0, 1.0))
    momenta, greatest = allocate(wheels, [[1.5, 0.2, -0.3], [0.3, 0.2, -0.9]])
    assert momenta == pytest.approx(np.array([[0.5, -1.0, 0.2, -0.3], [0.1, -0.2, 0.2, -0.9]]))
    assert greatest == pytest.approx([0.5, 0.9])


def test_wheels_left_free_by_the_worst_are_minimax_among_themselves():
    """Three in a plane beside one along its normal: the plane's own linear program."""
    plane = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]) / [[1], [1], [2**0.5]]
    wheels = WheelArray(axes=[*plane.tolist(), [0, 0, 1]], momentum_limit_n_m_s=1.0)
    for x, y in np.random.default_rng(8).normal(size=(30, 2)):
        momenta, greatest = allocate(wheels, [x, y, 9.0])
        assert (greatest, momenta[3]) == pytest.approx((9.0, 9.0))
        rows = np.column_stack([plane[:, :2].T, np.zeros(2)])
        one = np.ones((3, 1))
        best = linprog(
            [0, 0, 0, 1], A_eq=rows, b_eq=[x, y], b_ub=np.zeros(6), bounds=[(None, None)] * 4,
            A_ub=np.vstack([np.hstack([np.eye(3), -one]), np.hstack([-np.eye(3), -one])]),
        )  # fmt: skip
        assert np.abs(momenta[:3]).max() == pytest.approx(best.fun, rel=1e-9)


@pytest.mark.parametrize("name", ARRAYS)
def test_shares_are_continuous_also_where_the_face_changes(name):
    """Along a line through many faces; a jump would not shrink with the step."""
    wheels, random = array(name), np.random.default_rng(7)
    changes = []
    for step in (1e-3, 1e-5):
        start = random.normal(size=(3000, 3)) * 10.0
        way = random.normal(size=(3000, 3))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        moved = allocate(wheels, start + step * way)[0] - allocate(wheels, start)[0]
        changes.append(np.abs(moved).max() / step)
    assert 0.1 < changes[1] < 30.0 and 0.1 < changes[0] < 30.0


@pytest.mark.parametrize("name", ["six", "coplanar"])
def test_shares_are_continuous_at_edges_and_vertices_of_the_envelope(name):
    wheels, random = array(name, equal=True), np.random.default_rng(12)
    found = momentum_envelope(wheels)
    corners = found.vertices[np.array(found.edges)]
    for points in (found.vertices, corners.mean(axis=1), 1e-3 * found.vertices, 0.0 * corners[0]):
        here = allocate(wheels, points)[0]
        for _ in range(5):
            there = allocate(wheels, points + 1e-9 * random.normal(size=points.shape))[0]
            assert np.abs(there - here).max() < 1e-7


@MANY
@given(st.lists(st.tuples(*[st.integers(-2, 2)] * 3), min_size=3, max_size=7),
       st.tuples(*[st.integers(-3, 3)] * 3))  # fmt: skip
def test_whole_numbers_which_make_many_ties(axes, demand):
    axes = [axis for axis in axes if any(axis)]
    if len(axes) < 3 or np.linalg.matrix_rank(axes) < 3:
        return
    wheels = WheelArray(axes=axes, momentum_limit_n_m_s=2.0)
    momenta, greatest = allocate(wheels, demand)
    assert momenta @ np.array(wheels.axes) == pytest.approx(np.array(demand, float), abs=1e-12)
    assert np.abs(momenta).max() <= 2.0 * greatest + 1e-12
    assert greatest == pytest.approx(momentum_envelope(wheels).share(demand), abs=1e-12)


def test_beyond_the_limits_the_direction_is_kept():
    wheels = array("six")
    out = np.zeros(6)
    for factor in (3.0, 0.5):
        demand = factor * momentum_envelope(wheels).vertices[4]
        greatest = minimax(wheel_set(wheels), wheels.momentum_limits(), tuple(demand), out)
        assert greatest == pytest.approx(factor)
        within_limits(greatest, out)
        assert out @ np.array(wheels.axes) == pytest.approx(demand / max(factor, 1.0))
        assert np.all(np.abs(out) <= wheels.momentum_limits() * (1.0 + 1e-12))


def test_demands_keep_their_shape_and_methods_their_names():
    momenta, greatest = allocate(array("six"), np.ones((2, 4, 3)))
    assert (momenta.shape, greatest.shape) == ((2, 4, 6), (2, 4))
    momenta, greatest = allocate(array("six"), [1.0, 2.0, 3.0])
    assert (momenta.shape, greatest.shape) == ((6,), ())
    with pytest.raises(ValueError, match="method: must be 'minimax' or 'least_squares'; received"):
        allocate(array("six"), [1.0, 2.0, 3.0], "euclid")
    with pytest.raises(ValueError, match="demands: must be finite"):
        allocate(array("six"), [1.0, np.nan, 3.0])
    with pytest.raises(ValueError, match=r"demands: must have shape .*; received \(2,\)"):
        allocate(array("six"), [1.0, 2.0])


@pytest.mark.skipif(not engine.COMPILED, reason="times compiled code")
def test_six_wheel_call_takes_a_few_microseconds_at_most():
    wheels, demands = array("six"), np.random.default_rng(1).normal(size=(20000, 3))
    out, greatest = np.empty((20000, 6)), np.empty(20000)
    packed, limits, times = wheel_set(wheels), wheels.momentum_limits(), []
    for _ in range(5):
        start = time.perf_counter()
        _share_all(packed, limits, demands, True, out, greatest)
        times.append((time.perf_counter() - start) / len(demands))
    assert min(times) < 5e-6
