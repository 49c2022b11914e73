"""Axes that are nearly parallel or nearly coplanar, 1e-12 to 1e-3 rad apart, and exactly so.

References: linear programs, and the dual optimum in rational arithmetic (over all pairs of vectors,
the greatest |n . x| / sum |n . a|), which knows no rounding. What is asked of a float grows with
one over the thickness: the least component of the axes along the directions in which they hold.
"""

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from scipy.optimize import linprog
from slow_cases import slow_after

from torquer.spacecraft.wheel_array.allocation import allocate, minimax, wheel_set
from torquer.spacecraft.wheel_array.demand import (
    Box,
    Ellipsoid,
    greatest_share,
    share_for_generators,
)
from torquer.spacecraft.wheel_array.envelope import Envelope, momentum_envelope, support
from torquer.spacecraft.wheel_array.faces import is_closed
from torquer.spacecraft.wheel_array.failures import failure_table
from torquer.spacecraft.wheel_array.layout import WheelArray
from torquer.spacecraft.wheel_array.planes import FLAT, authority, face_rows, pair_normals
from torquer.spacecraft.wheel_array.rates import worst_case
from torquer.spacecraft.wheel_array.steering import make_steering, steer

SEPARATIONS = [10.0**-k for k in (7, 12, 3, 4, 5, 6, 8, 9, 10, 11)]
C, S = np.cos(np.radians(10.0)), np.sin(np.radians(10.0))
#: One axis and the same typed with eight decimals, and two others.
TYPED = np.array([[C, S, 0.0], [round(C, 8), round(S, 8), 0.0], [0.0, C, S], [S, 0.0, C]])
MANY = settings(max_examples=150, deadline=None)


def rational_share(vectors, point) -> float:
    """Exactly by how much the zonotope of the vectors must be scaled to hold the point."""
    rows = [[Fraction(x) for x in row] for row in np.asarray(vectors).tolist()]
    point = [Fraction(x) for x in np.asarray(point).tolist()]
    best = Fraction(0)
    for a, b in combinations(rows, 2):
        normal = [a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)]
        bound = sum(abs(_dot(normal, row)) for row in rows)
        if bound:
            best = max(best, abs(_dot(normal, point)) / bound)
    return float(best)


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def program_share(vectors, point) -> float:
    """The same by a linear program, as good as its solver (1e-7 in every row)."""
    n, one = len(vectors), np.ones((len(vectors), 1))
    found = linprog(
        np.append(np.zeros(n), 1.0), A_eq=np.hstack([vectors.T, np.zeros((3, 1))]), b_eq=point,
        A_ub=np.vstack([np.hstack([np.eye(n), -one]), np.hstack([-np.eye(n), -one])]),
        b_ub=np.zeros(2 * n), bounds=[(None, None)] * (n + 1), method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )  # fmt: skip
    return found.fun


def drawn(seed: int, separation: float, count: int = 7) -> WheelArray:
    """Axes of which most are that near to another's line, or to the plane of two others."""
    random = np.random.default_rng(seed)
    axes = list(random.normal(size=(2, 3)) if seed % 3 else [[1, 2, 3], [2, -1, 0]])
    axes = [axis / np.linalg.norm(axis) for axis in axes]
    while len(axes) < count:
        i, j = random.integers(len(axes), size=2)
        part = random.normal() if seed % 2 else 1.0
        near = [axes[i], axes[i] + part * axes[j], random.normal(size=3)][random.integers(3)]
        axis = near + separation * random.normal(size=3)
        if np.linalg.norm(axis) > 0.1:
            axes.append(random.choice([-1.0, 1.0]) * axis / np.linalg.norm(axis))
    limits = random.uniform(0.5, 5.0, count).tolist()
    axes.append(random.normal(size=3))  # so that it is no plane
    return WheelArray(axes=np.array(axes).tolist(), momentum_limit_n_m_s=[*limits, 1.0])


def thickness(wheels) -> float:
    """Least component, along the directions of their hold, of the working axes."""
    sizes = np.array(authority(np.array(wheels.axes), wheels.momentum_limits())[1])
    return sizes[sizes > 0.0].min()


def demands(found: Envelope, seed: int) -> np.ndarray:
    """Anywhere, and where faces meet: at vertices, on edges, within faces, and just beside."""
    random = np.random.default_rng(seed)
    faces = [list(found.faces[k]) for k in random.integers(len(found.faces), size=6)]
    points = np.vstack([
        random.normal(size=(4, 3)),
        found.vertices[random.integers(len(found.vertices), size=4)],
        *[found.vertices[face[:2]].mean(axis=0) for face in faces],
        *[random.dirichlet(np.ones(len(face))) @ found.vertices[face] for face in faces],
    ])  # fmt: skip
    return np.vstack([points, points + 1e-10 * random.normal(size=points.shape)])


def test_an_axis_typed_with_eight_decimals_loses_no_face():
    """The demand of the report: 0.8494 of what four wheels hold, and no wheel beyond that."""
    wheels, demand = WheelArray(axes=TYPED.tolist(), momentum_limit_n_m_s=1.0), (
        0.9765, -0.3553, 0.7481,
    )  # fmt: skip
    best = rational_share(wheels.axes, demand)
    assert best == pytest.approx(0.8494, abs=5e-5)
    assert program_share(np.array(wheels.axes), demand) == pytest.approx(best, rel=1e-7)
    assert momentum_envelope(wheels).share(demand) == pytest.approx(best, rel=1e-13)
    momenta, greatest = allocate(wheels, demand)
    assert greatest == pytest.approx(best, rel=1e-13)
    assert np.abs(momenta).max() == pytest.approx(best, rel=1e-13)
    assert momenta @ np.array(wheels.axes) == pytest.approx(demand, abs=1e-13)


@pytest.mark.parametrize("separation", slow_after(1, [0.0, *SEPARATIONS]))
def test_shares_and_allocations_are_optimal_at_any_separation(separation):
    checked = 0
    for seed in range(12):
        for wheels in (drawn(seed, separation), drawn(seed, separation).without(7)):
            axes, limits = np.array(wheels.axes), wheels.momentum_limits()
            found, vectors, thin = momentum_envelope(wheels), limits[:, None] * axes, 0.0
            if found.rank < 3:
                continue
            thin = 1e-13 / thickness(wheels)
            points = demands(found, seed)
            momenta, greatest = allocate(wheels, points)
            best = np.array([rational_share(vectors, point) for point in points])
            assert found.share(points) == pytest.approx(best, rel=thin)
            assert greatest == pytest.approx(best, rel=thin)
            size = limits.sum() * best
            missing = np.linalg.norm(momenta @ axes - points, axis=1)
            assert np.all(missing <= 1e-12 * size + 1e-3 * thin * size)
            assert np.all(np.abs(momenta) <= limits * greatest[:, None] * (1.0 + 1e-15))
            checked += 1
    assert checked >= 14


@pytest.mark.parametrize("separation", [0.0, *SEPARATIONS])
def test_shares_are_those_of_linear_programs(separation):
    wheels = drawn(5, separation)
    vectors = wheels.momentum_limits()[:, None] * np.array(wheels.axes)
    for point in demands(momentum_envelope(wheels), 1)[:12]:
        best = program_share(vectors, point)
        assert momentum_envelope(wheels).share(point) == pytest.approx(best, rel=1e-6)


@MANY
@given(st.integers(0, 10**6), st.floats(2.0, 16.0))
@example(15256, 11.75)  # signs that make a closed surface of another volume
def test_the_envelope_is_a_closed_polyhedron_with_all_its_faces(seed, power):
    wheels = drawn(seed, 10.0**-power, count=5)
    found, thin = momentum_envelope(wheels), 1e-13 / thickness(wheels)
    if found.rank < 3:
        return
    assert is_closed(len(found.vertices), found.faces)
    assert len(found.vertices) - len(found.edges) + len(found.faces) == 2
    a, b, c = (found.vertices[k] for k in found.triangles().T)
    inside = np.einsum("ti,ti->t", a, np.cross(b, c)).sum() / 6.0
    size = np.linalg.norm(found.generators, axis=1).sum()
    assert inside == pytest.approx(found.volume, abs=1e-12 * size**3)
    assert found.share(found.vertices) == pytest.approx(1.0, abs=max(thin, 1e-11))
    directions = np.random.default_rng(seed).normal(size=(50, 3))
    farthest = (directions @ found.vertices.T).max(axis=1)
    assert support(found.generators, directions) == pytest.approx(farthest, abs=1e-11 * size)
    momenta, greatest = allocate(wheels, found.vertices)
    assert greatest == pytest.approx(1.0, abs=max(thin, 1e-11))
    assert np.abs(momenta @ np.array(wheels.axes) - found.vertices).max() < (1e-11 + thin) * size


@pytest.mark.parametrize("apart", [1e-4, 1e-5, 1e-6, 1e-7, 1e-8])
def test_three_near_collinear_axes_make_a_solid_for_any_determinant(apart):
    """The determinant is the square of the angle: below all tolerances but that of exact signs."""
    found = Envelope(np.array([[1.0, 0.0, 0.0], [1.0, apart, 0.0], [1.0, 0.0, apart]]))
    assert found.rank == 3 and len(found.vertices) == 8 and len(found.faces) == 6
    assert found.volume == pytest.approx(8.0 * apart**2, rel=1e-12)
    farthest = np.abs(found.vertices).max(axis=0)
    assert farthest == pytest.approx([3.0, apart, apart], rel=1e-12)


@pytest.mark.parametrize("separation", SEPARATIONS)
def test_rates_failures_and_demands_see_all_faces(separation):
    """The worst case over the normals of all pairs, exact to rounding, for each loss."""
    wheels, inertia = drawn(4, separation), np.array([2.0, 3.0, 4.0])
    for case in failure_table(wheels, inertia, most=1):
        left = wheels.without(*case.lost)
        if momentum_envelope(left).rank < 3 or thickness(left) < 1e-6:
            continue
        vectors = left.momentum_limits()[:, None] * np.array(left.axes)
        normals = pair_normals(np.array(wheels.axes))  # more of them do no harm
        normals = normals[np.linalg.norm(normals, axis=1) > 0.0]
        bounds = support(vectors, normals)
        some = bounds > 1e-9
        rate = (bounds[some] / np.linalg.norm(normals[some] * inertia, axis=1)).min()
        assert case.worst_rate_rad_s == pytest.approx(rate, rel=1e-7)
        radius = bounds[some].min()
        assert case.inner_radius_n_m_s == pytest.approx(radius, rel=1e-7)
        for demand in (Ellipsoid(inertia), Box(inertia)):
            share = (demand.support(normals[some]) / bounds[some]).max()
            assert greatest_share(momentum_envelope(left), demand) == pytest.approx(share, rel=1e-7)
            assert share_for_generators(vectors, demand) == pytest.approx(share, rel=1e-7)
        assert worst_case(momentum_envelope(left), inertia).rate == case.worst_rate_rad_s


@pytest.mark.parametrize("separation", [1e-4, 1e-7, 1e-9, 1e-11])
def test_steering_gives_the_greatest_part_that_linear_programs_find(separation):
    axes, random = drawn(8, separation).axes, np.random.default_rng(5)
    wheels = WheelArray(axes=axes, momentum_limit_n_m_s=18.0, torque_limit_n_m=0.2)
    steering, out, n = make_steering(wheels, None), np.zeros(wheels.count), wheels.count
    for _ in range(40):
        momenta = random.choice([-1.0, 1.0], n) * random.uniform(17.7, 18.0, n)
        torque = random.normal(size=3)
        part = steer(steering, 1.0, momenta, tuple(torque), out)
        low, high = np.maximum(-0.2, -18.0 - momenta), np.minimum(0.2, 18.0 - momenta)
        assert np.all(out >= low - 1e-12) and np.all(out <= high + 1e-12)
        assert out @ np.array(axes) == pytest.approx(part * torque, abs=1e-11)
        best = linprog(
            [0.0] * n + [-1.0], A_eq=np.column_stack([np.array(axes).T, -torque]),
            b_eq=np.zeros(3), bounds=[*zip(low, high, strict=True), (0.0, 1.0)],
        )  # fmt: skip
        assert part == pytest.approx(-best.fun, abs=1e-6)


@pytest.mark.parametrize("tilt", [0.0, 1e-13, 1e-10])
@pytest.mark.parametrize("lost", [(4,), (2, 4), (1, 2, 4)])
def test_all_methods_agree_on_flatness_below_its_limit(tilt, lost):
    """Wheels in a plane but for less than `FLAT`: demands are shared in the plane, nothing else."""
    angle = np.radians([0.0, 50.0, 130.0, 180.0])
    plane = np.column_stack([np.cos(angle), np.sin(angle), tilt * np.array([1.0, -1.0, 1.0, 1.0])])
    axes = [*plane.tolist(), [0.1, 0.2, 1.0]]
    left = WheelArray(axes=axes, momentum_limit_n_m_s=2.0, torque_limit_n_m=1.0).without(*lost)
    found = momentum_envelope(left)
    assert found.rank == 2 - (lost == (1, 2, 4))
    assert (found.volume, found.inner_radius) == (0.0, 0.0)
    points = 0.7 * found.vertices
    assert found.share(points) == pytest.approx(0.7)
    assert np.all(found.share(points + np.array([0.0, 0.0, 1e-3])) == np.inf)
    out = np.zeros(5)
    for point in points:
        over = tuple(point + np.array([0.0, 0.0, 0.5]))
        assert minimax(wheel_set(left), left.momentum_limits(), over, out) == pytest.approx(0.7)
        assert out @ np.array(left.axes) == pytest.approx(point, abs=2.0 * FLAT)
        part = steer(make_steering(left, None), 1.0, np.zeros(5), tuple(point), out)
        torque = min(1.0, float(1.0 / (found.share(point) * 2.0)))
        assert part == pytest.approx(torque)


def test_normals_are_square_to_both_axes_however_close_they_are():
    random = np.random.default_rng(1)
    for separation in SEPARATIONS:
        for _ in range(50):
            axis = random.normal(size=3)
            other = axis / np.linalg.norm(axis) + separation * random.normal(size=3)
            axes = np.array([axis / np.linalg.norm(axis), -other / np.linalg.norm(other)])
            assert np.abs(axes @ pair_normals(axes)[0]).max() < 5e-16
    same = np.array([axes[0], -axes[0], axes[0]])
    assert np.all(pair_normals(same) == 0.0)


def test_coplanar_axes_make_one_face_that_rounding_does_not_split():
    """Four in a plane in any attitude of it, one across: a prism with eight sides."""
    angle = np.radians([0.0, 40.0, 75.0, 130.0])
    plane = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    for seed in range(20):
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        axes = np.vstack([plane, [0.0, 0.0, 1.0], plane[1]]) @ turn.T
        found = Envelope(axes)
        assert (len(found.vertices), len(found.edges), len(found.faces)) == (16, 24, 10)
        assert len(face_rows(axes)) == 5
