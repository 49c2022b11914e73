"""The envelope: published polyhedra, Euler's formula, an independent hull, flat and merged ones."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from torquer.spacecraft.wheel_array import layout
from torquer.spacecraft.wheel_array.envelope import (
    Envelope,
    momentum_envelope,
    support,
    torque_envelope,
    volume,
)
from torquer.spacecraft.wheel_array.layout import WheelArray

FOUR, SIX = layout.four_sided_pyramid(80.5, 45.5), layout.regular_pyramid(6, 81.1)
D1, D2, D3 = np.abs(FOUR[0])
D4, D5 = np.cos(np.radians(81.1)), np.sin(np.radians(81.1))
MANY = settings(max_examples=40, deadline=None)
#: Directions with small whole components: many are parallel or coplanar.
WHOLE = st.lists(st.tuples(*[st.integers(-2, 2)] * 3), min_size=1, max_size=7)


def with_opposites(rows):
    return {tuple(row) for row in np.round(np.vstack([rows, -np.array(rows)]), 9) + 0.0}


def as_set(rows):
    return {tuple(row) for row in np.round(rows, 9) + 0.0}


@pytest.mark.parametrize(
    ("axes", "vertices", "faces"),
    [(FOUR, 14, 12), (FOUR[:3], 8, 6), (SIX, 32, 30), (SIX[:5], 22, 20)],
    ids=["P4", "P3", "P6", "P5"],
)
def test_published_polyhedra_have_their_counts(axes, vertices, faces):
    found = Envelope(axes)
    assert (len(found.vertices), len(found.faces)) == (vertices, faces)
    assert len(found.edges) == vertices + faces - 2
    assert {len(face) for face in found.faces} == {4}


def test_vertices_of_four_wheels_are_those_of_section_8_1():
    rows = [[0, 4, 0], [2, 2, 2], [2, -2, 2], [2, 2, -2], [-2, 2, 2], [0, 0, -4], [4, 0, 0]]
    assert as_set(Envelope(FOUR).vertices) == with_opposites(rows * np.array([D1, D2, D3]))


@pytest.mark.parametrize("lost", range(4))
def test_vertices_of_three_wheels_are_those_of_section_8_1(lost):
    """Whichever wheel is lost; signs apart, which depend on the numbering."""
    found = np.abs(Envelope(np.delete(FOUR, lost, axis=0)).vertices) / (D1, D2, D3)
    rows = sorted(map(tuple, np.rint(found).astype(int)))
    assert found == pytest.approx(np.rint(found))
    assert rows == sorted([(1, 3, 1), (1, 1, 1), (3, 1, 1), (1, 1, 3)] * 2)


def test_vertices_of_six_wheels_are_those_of_section_8_2():
    r = np.sqrt(3.0)
    rows = [
        [6, 0, 0], [4, 2, 0], [4, 1, -r], [4, -1, -r], [4, -2, 0], [4, -1, r], [4, 1, r],
        [2, 3, r], [2, 3, -r], [2, 0, -2 * r], [2, -3, -r], [2, -3, r], [2, 0, 2 * r],
        [0, 2, 2 * r], [0, 4, 0], [0, 2, -2 * r],
    ]  # fmt: skip
    assert as_set(Envelope(SIX).vertices) == with_opposites(rows * np.array([D4, D5, D5]))


def test_volumes_in_closed_form():
    assert Envelope(FOUR).volume == pytest.approx(128.0 * D1 * D2 * D3, rel=1e-14)
    assert Envelope(SIX).volume == pytest.approx(144.0 * np.sqrt(3.0) * D4 * D5**2, rel=1e-14)
    assert Envelope(layout.orthogonal()).volume == 8.0


def test_published_faces_are_rhombi_with_their_pairs_area():
    """Sides 2 (in units of the limit), area 4 |g_i x g_j|, each pair twice."""
    found = Envelope(SIX)
    areas = []
    for face in found.faces:
        a, b, c, d = found.vertices[list(face)]
        assert np.linalg.norm([b - a, c - b, d - c, a - d], axis=1) == pytest.approx([2.0] * 4)
        areas.append(np.linalg.norm(np.cross(b - a, d - a)))
    i, j = np.triu_indices(6, 1)
    pairs = 4.0 * np.linalg.norm(np.cross(SIX[i], SIX[j]), axis=1)
    assert sorted(areas) == pytest.approx(sorted(np.repeat(pairs, 2)))


def surface_volume(envelope):
    """Volume within the triangles by the divergence theorem: right only if all face outwards."""
    a, b, c = (envelope.vertices[k] for k in envelope.triangles().T)
    return float(np.einsum("ti,ti->t", a, np.cross(b, c)).sum() / 6.0)


def check_polyhedron(found):
    assert len(found.vertices) - len(found.edges) + len(found.faces) == 2
    hull = ConvexHull(found.vertices)
    assert found.volume == pytest.approx(hull.volume, rel=1e-10)
    assert surface_volume(found) == pytest.approx(hull.volume, rel=1e-10)
    assert len(hull.vertices) == len(found.vertices)
    assert found.share(found.vertices) == pytest.approx(1.0, abs=1e-12)
    for face in found.faces:  # all corners turn left, seen from outside
        corners = found.vertices[list(face)]
        sides = np.roll(corners, -1, axis=0) - corners
        turns = np.cross(sides, np.roll(sides, -1, axis=0))
        assert np.all(turns @ corners.mean(axis=0) > 0.0)


@pytest.mark.parametrize("count", range(3, 13))
def test_arrays_in_general_position_obey_the_counts_of_any_number(count):
    random = np.random.default_rng(count)
    found = Envelope(random.normal(size=(count, 3)))
    assert len(found.faces) == count * (count - 1)
    assert len(found.vertices) == count * (count - 1) + 2
    check_polyhedron(found)


@MANY
@given(WHOLE)
def test_parallel_and_coplanar_axes_are_merged(vectors):
    """The hull of all sums of signs, by an independent package."""
    found, vectors = Envelope(vectors), np.array(vectors, dtype=np.float64)
    signs = np.array(np.meshgrid(*[[-1, 1]] * len(vectors))).reshape(len(vectors), -1).T
    sums = np.unique(signs @ vectors, axis=0)
    assert found.rank == np.linalg.matrix_rank(vectors)
    assert found.support(sums) == pytest.approx((sums @ sums.T).max(axis=1))
    assert np.all(found.share(sums) <= 1.0 + 1e-12)
    if found.rank == 3:
        assert found.volume == pytest.approx(ConvexHull(sums).volume, rel=1e-10)
        check_polyhedron(found)
    elif found.rank == 2:
        assert len(found.vertices) == len(found.edges) == len(found.faces[0])
        assert len(found.faces) == 2
    else:
        assert len(found.vertices) == 1 + found.rank == 1 + len(found.edges)
        assert found.faces == () and found.triangles().shape == (0, 3)


def test_a_flat_envelope_reaches_nothing_outside_its_plane():
    found = Envelope([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    assert found.volume == 0.0
    assert found.inner_radius == 0.0
    assert found.extent([[1, 0, 0], [0, 5, 0], [1, 2, 0], [0, 0, 1], [1, 0, 1e-3]]) == (
        pytest.approx([1.0, 2.0, np.sqrt(5.0), 0.0, 0.0])
    )
    assert found.contains([[1.0, 2.0, 0.0], [0.0, 0.0, 0.1]]).tolist() == [True, False]
    nothing = Envelope(np.zeros((3, 3)))
    assert (nothing.rank, len(nothing.vertices), nothing.edges) == (0, 1, ())
    assert nothing.share([[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]).tolist() == [0.0, np.inf]


def test_extent_and_share_agree_with_linear_programming():
    random = np.random.default_rng(3)
    vectors, directions = random.normal(size=(7, 3)), random.normal(size=(40, 3))
    found = Envelope(vectors)
    for direction, extent in zip(directions, found.extent(directions), strict=True):
        unit = direction / np.linalg.norm(direction)
        best = linprog(
            [0.0] * 7 + [-1.0], A_eq=np.column_stack([vectors.T, -unit]), b_eq=np.zeros(3),
            bounds=[(-1, 1)] * 7 + [(0, None)],
        )  # fmt: skip
        assert extent == pytest.approx(-best.fun, rel=1e-9)
        assert found.share(extent * unit) == pytest.approx(1.0)


def test_the_support_is_reached_at_a_vertex():
    found, directions = Envelope(SIX), np.random.default_rng(4).normal(size=(200, 3))
    assert support(SIX, directions) == pytest.approx((directions @ found.vertices.T).max(axis=1))


def test_the_inner_radius_touches_a_face():
    found, directions = Envelope(SIX), np.random.default_rng(5).normal(size=(20000, 3))
    extents = found.extent(directions)
    assert np.all(extents >= found.inner_radius)
    assert extents.min() == pytest.approx(found.inner_radius, rel=1e-2)


def test_envelopes_scale_with_limits_and_omit_lost_wheels():
    wheels = WheelArray(
        axes=FOUR.tolist(), momentum_limit_n_m_s=(18.0, 9.0, 12.0, 20.0), torque_limit_n_m=0.2
    ).without(3)
    held = momentum_envelope(wheels)
    assert held.support([1.0, 0.0, 0.0]) == pytest.approx((18.0 + 9.0 + 12.0) * D1)
    assert len(held.faces) == 6
    assert volume(held.generators) == pytest.approx(held.volume)
    assert torque_envelope(wheels).volume == pytest.approx(0.2**3 * 32.0 * D1 * D2 * D3)


def test_what_is_refused():
    with pytest.raises(ValueError, match=r"generators: must have shape \(n, 3\); received \(3,\)"):
        Envelope([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="generators: must be finite"):
        Envelope([[1.0, np.nan, 3.0]])
    with pytest.raises(ValueError, match=r"directions: must not be zero; received \[0\.0, 0\.0"):
        Envelope(np.eye(3)).extent([0.0, 0.0, 0.0])


def test_points_that_are_no_numbers_are_not_inside():
    found = Envelope(np.eye(3))
    points = [[np.nan, 0.0, 0.0], [0.5, 0.0, 0.0], [np.inf, 0.0, 0.0]]
    assert found.contains(points).tolist() == [False, True, False]
    assert np.isnan(found.share(points)).tolist() == [True, False, True]


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_shares_do_not_depend_on_the_unit(scale):
    points = np.random.default_rng(6).normal(size=(20, 3))
    shares = Envelope(scale * SIX).share(scale * points)
    assert shares == pytest.approx(Envelope(SIX).share(points), rel=1e-13)
    weak = np.vstack([SIX[:2], 1e-6 * SIX[2]])
    point = weak.T @ [0.3, -0.2, 1.0]  # what the weak one holds decides
    assert Envelope(weak).share(point) == pytest.approx(1.0, rel=1e-9)
