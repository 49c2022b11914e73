"""What is demanded of an array, and the rates that a satellite reaches; the published figures."""

import numpy as np
import pytest

from torquer.spacecraft.wheel_array import angles, layout
from torquer.spacecraft.wheel_array.demand import (
    Box,
    Ellipsoid,
    Series,
    greatest_momentum,
    greatest_norm,
    greatest_share,
    share_for_generators,
)
from torquer.spacecraft.wheel_array.envelope import Envelope
from torquer.spacecraft.wheel_array.rates import rate_about, required_momenta, semi_axes, worst_case

INERTIA = (2600.0, 11100.0, 10900.0)
LIMIT = 18.0
FOUR, SIX = layout.four_sided_pyramid(80.5, 45.5), layout.regular_pyramid(6, 81.1)
RANDOM = np.random.default_rng(11)
SKEWED = RANDOM.normal(size=(3, 3))
POINTS = RANDOM.normal(size=(50, 3))


def worst_deg_s(axes):
    return np.degrees(worst_case(Envelope(LIMIT * axes), INERTIA).rate)


def samples_of(demand):
    """Many points of a demand's surface."""
    directions = np.random.default_rng(2).normal(size=(40000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    if isinstance(demand, Ellipsoid):
        return directions @ demand.matrix.T
    if isinstance(demand, Box):
        return np.sign(directions) * demand.half
    return demand.samples


@pytest.mark.parametrize(
    "demand", [Box((3.0, 1.0, 2.0)), Ellipsoid((3.0, 1.0, 2.0)), Ellipsoid(SKEWED), Series(POINTS)]
)
def test_measures_of_a_demand_are_those_of_its_points(demand):
    points, unit = samples_of(demand), np.random.default_rng(1).normal(size=(30, 3))
    assert demand.support(unit) == pytest.approx(np.abs(unit @ points.T).max(axis=1), rel=1e-3)
    form = SKEWED @ SKEWED.T + np.eye(3)
    most = np.einsum("pi,ij,pj->p", points, form, points).max()
    assert demand.forms(form).max() == pytest.approx(most, rel=1e-3)
    exact = demand.support(unit)
    assert demand.supports(unit).max(axis=-1) == pytest.approx(exact, rel=1e-14)
    found = Envelope(LIMIT * SIX)
    assert greatest_share(found, demand) == pytest.approx(found.share(points).max(), rel=1e-3)
    assert share_for_generators(LIMIT * SIX, demand) == pytest.approx(greatest_share(found, demand))
    momenta = points @ np.linalg.pinv(SIX)
    assert greatest_norm(SIX, demand) == pytest.approx(
        np.linalg.norm(momenta, axis=1).max(), rel=1e-3
    )
    assert greatest_momentum(SIX, demand) == pytest.approx(np.abs(momenta).max(), rel=1e-3)


def test_a_flat_envelope_holds_only_flat_demands():
    flat = Envelope([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    assert greatest_share(flat, Box((0.5, 0.5, 0.0))) == pytest.approx(0.5)
    assert greatest_share(flat, Box((0.5, 0.5, 1e-3))) == np.inf
    assert worst_case(flat, INERTIA).rate == 0.0


@pytest.mark.parametrize("matrix", [np.diag([3.0, 1.0, 2.0]), SKEWED, -SKEWED])
def test_the_mesh_of_an_ellipsoid_is_closed_and_faces_outwards(matrix):
    points, triangles = Ellipsoid(matrix).mesh(rows=60, columns=120)
    assert np.linalg.norm(np.linalg.solve(matrix, points.T), axis=0) == pytest.approx(1.0)
    a, b, c = (points[k] for k in triangles.T)
    inside = np.einsum("ti,ti->t", a, np.cross(b, c))
    assert np.all(inside > 0.0)
    whole = 4.0 / 3.0 * np.pi * abs(np.linalg.det(matrix))
    assert inside.sum() / 6.0 == pytest.approx(whole, rel=3e-3)
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]))
    assert np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2)


def test_published_rates_of_four_wheels():
    """0.184 deg/s is cut, not rounded: 2 sqrt(2) h / |I| = 0.18494. One lost: half of it."""
    rate = worst_deg_s(layout.four_sided_pyramid(*angles.balanced_four_sided(INERTIA)))
    closed = np.degrees(2.0 * np.sqrt(2.0) * LIMIT / np.linalg.norm(INERTIA))
    assert rate == pytest.approx(closed, rel=1e-12)
    assert closed == pytest.approx(0.18494, abs=5e-6)
    assert worst_deg_s(FOUR) == pytest.approx(closed, rel=1e-4)
    for lost in range(4):
        assert round(worst_deg_s(np.delete(FOUR, lost, axis=0)), 3) == 0.092
        assert worst_deg_s(np.delete(FOUR, lost, axis=0)) == pytest.approx(0.5 * closed, rel=1e-4)


def test_ellipsoid_pokes_out_at_0_190_but_not_0_184():
    found = Envelope(LIMIT * FOUR)
    assert greatest_share(found, required_momenta(INERTIA, np.radians(0.190))) > 1.0
    assert greatest_share(found, required_momenta(INERTIA, np.radians(0.184))) < 1.0


def test_published_rates_of_six_wheels():
    """With gamma to the digits of print, 81.1; 0.291 with all digits. One lost: the worst wheel."""
    assert round(worst_deg_s(SIX), 3) == 0.292
    exact = layout.regular_pyramid(6, angles.balanced_regular(6, INERTIA))
    assert round(worst_deg_s(exact), 4) == 0.2915
    lost = [worst_deg_s(np.delete(SIX, k, axis=0)) for k in range(6)]
    assert round(min(lost), 3) == 0.184
    assert sorted(np.round(lost, 4)) == [0.1838] * 2 + [0.1854] * 4
    assert round(worst_deg_s(SIX) / min(lost), 1) == 1.6


def test_balanced_angles_are_the_published_ones_and_balance_the_rates():
    alpha, beta = angles.balanced_four_sided(INERTIA)
    assert (round(alpha, 1), round(beta, 1)) == (80.5, 45.5)
    gamma = angles.balanced_regular(6, INERTIA)
    assert np.tan(np.radians(gamma)) == pytest.approx(3.0 * INERTIA[1] / (2.0 * INERTIA[0]))
    assert round(gamma, 1) == 81.1
    # greatest components: those of vertices
    four = Envelope(layout.four_sided_pyramid(alpha, beta)).vertices.max(axis=0) / INERTIA
    assert four == pytest.approx(np.full(3, four[0]))
    for count in (5, 6, 7):
        axes = layout.regular_pyramid(count, angles.balanced_regular(count, INERTIA))
        first, second, _ = Envelope(axes).vertices.max(axis=0) / INERTIA
        assert first == pytest.approx(second)


def test_rates_about_axes_bound_the_worst_case():
    found = Envelope(LIMIT * SIX)
    worst = worst_case(found, INERTIA)
    directions = np.random.default_rng(6).normal(size=(5000, 3))
    rates = rate_about(found, INERTIA, directions)
    assert np.all(rates >= worst.rate * (1.0 - 1e-12))
    assert rate_about(found, INERTIA, 7.0 * worst.axis) == pytest.approx(worst.rate)
    # the momentum of that turn lies on the surface
    momentum = worst.rate * np.array(INERTIA) * worst.axis
    assert found.share(momentum) == pytest.approx(1.0)


def test_rates_do_not_depend_on_the_axes_of_reference():
    turn = np.linalg.qr(SKEWED)[0]
    turn *= np.linalg.det(turn)
    tensor = turn @ np.diag(INERTIA) @ turn.T
    there = worst_case(Envelope(LIMIT * FOUR @ turn.T), 0.5 * (tensor + tensor.T))
    here = worst_case(Envelope(LIMIT * FOUR), INERTIA)
    assert there.rate == pytest.approx(here.rate, rel=1e-12)
    assert rate_about(Envelope(LIMIT * FOUR @ turn.T), tensor, turn[:, 1]) == pytest.approx(
        rate_about(Envelope(LIMIT * FOUR), INERTIA, [0.0, 1.0, 0.0])
    )


def test_semi_axes_in_units_of_the_limit():
    found = semi_axes(INERTIA, 2e-3, LIMIT)
    assert found == pytest.approx(np.sort(INERTIA) * 2e-3 / LIMIT)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Box((1.0, -2.0, 3.0)), "half: must not be negative"),
        (lambda: Box((1.0, 2.0)), r"half: must have shape \(3,\)"),
        (lambda: Ellipsoid(np.eye(2)), r"matrix: must have shape \(3, 3\)"),
        (lambda: Series(np.zeros((0, 3))), r"samples: must have shape \(N, 3\); received \(0, 3\)"),
        (lambda: Series([1.0, 2.0, 3.0]), r"samples: must have shape \(N, 3\); received \(3,\)"),
        (
            lambda: required_momenta((1.0, 1.0, 3.0), 1.0),
            "inertia_kg_m2: the sum of two principal moments",
        ),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
