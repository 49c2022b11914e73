"""Tables of losses, and least squares against the whole envelope."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from torquer.spacecraft.wheel_array import layout
from torquer.spacecraft.wheel_array.envelope import momentum_envelope
from torquer.spacecraft.wheel_array.failures import (
    failure_table,
    least_squares_against_minimax,
    least_squares_half_spaces,
)
from torquer.spacecraft.wheel_array.layout import WheelArray

INERTIA = (2600.0, 11100.0, 10900.0)


def array(axes, **more):
    return WheelArray(axes=axes.tolist(), momentum_limit_n_m_s=18.0, **more)


FOUR = array(layout.four_sided_pyramid(80.5, 45.5))
SIX = array(layout.regular_pyramid(6, 81.1), torque_limit_n_m=0.2)


def test_the_table_has_every_single_and_double_loss_once():
    for wheels in (FOUR, SIX):
        n = wheels.count
        table = failure_table(wheels, INERTIA)
        assert [case.lost for case in table[: n + 1]] == [(), *((k,) for k in range(n))]
        assert len({case.lost for case in table}) == len(table) == 1 + n + n * (n - 1) // 2
        assert (table[0].volume, table[0].rank) == (1.0, 3)


def test_four_wheels_survive_one_loss_and_not_two():
    table = failure_table(FOUR, INERTIA)
    for case in table[1:5]:
        assert case.volume == pytest.approx(0.25)
        assert round(np.degrees(case.worst_rate_rad_s), 3) == 0.092
        assert case.accelerations_rad_s2 is None and case.worst_acceleration_rad_s2 is None
    for case in table[5:]:
        assert (case.rank, case.volume, case.worst_rate_rad_s) == (2, 0.0, 0.0)
        assert case.inner_radius_n_m_s == 0.0


def test_six_wheels_survive_any_two_losses():
    table = failure_table(SIX, INERTIA)
    assert all(case.rank == 3 and case.worst_rate_rad_s > 0.0 for case in table)
    assert round(np.degrees(min(case.worst_rate_rad_s for case in table[1:7])), 3) == 0.184
    for case in table:  # accelerations go with rates as the limits do
        ratio = case.worst_acceleration_rad_s2 / case.worst_rate_rad_s
        assert ratio == pytest.approx(0.2 / 18.0)
        assert case.accelerations_rad_s2 == pytest.approx(0.2 / 18.0 * np.array(case.rates_rad_s))


def test_rates_stand_by_ascending_inertia_and_fall_with_each_loss():
    table = failure_table(FOUR, INERTIA)
    extents = momentum_envelope(FOUR).extent(np.eye(3)) / INERTIA
    assert table[0].rates_rad_s == pytest.approx(extents[[0, 2, 1]])
    assert all(max(case.rates_rad_s) < min(table[0].rates_rad_s) for case in table[1:5])


def test_losses_go_on_from_those_of_the_array():
    table = failure_table(SIX.without(2), INERTIA, most=1)
    assert [case.lost for case in table] == [(), (0,), (1,), (3,), (4,), (5,)]
    assert table[0].worst_rate_rad_s == failure_table(SIX, INERTIA, 1)[3].worst_rate_rad_s


def test_least_squares_against_the_whole_envelope():
    """Four wheels: volume 2/3; six: 1/2. In the worst direction 2/3 and 3/4 of what is there."""
    four, six = least_squares_against_minimax(FOUR), least_squares_against_minimax(SIX)
    assert (four.volume, four.least_extent) == pytest.approx((2.0 / 3.0, 2.0 / 3.0))
    assert (six.volume, six.least_extent) == pytest.approx((0.5, 0.75))
    three = least_squares_against_minimax(FOUR.without(1))
    assert (three.volume, three.inner_radius, three.least_extent) == pytest.approx((1.0, 1.0, 1.0))


@pytest.mark.parametrize("wheels", [FOUR, SIX.without(1), array(layout.icosahedral())])
def test_the_comparison_is_that_of_samples(wheels):
    found, envelope = least_squares_against_minimax(wheels), momentum_envelope(wheels)
    rows = least_squares_half_spaces(wheels)
    directions = np.random.default_rng(1).normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    extents = 1.0 / np.abs(directions @ rows.T).max(axis=1)
    ratios = extents / envelope.extent(directions)
    assert np.all(ratios <= 1.0 + 1e-12) and np.all(ratios >= found.least_extent - 1e-12)
    assert ratios.min() == pytest.approx(found.least_extent, abs=0.02)
    there = found.direction
    ratio = 1.0 / np.abs(rows @ there).max() / envelope.extent(there)
    assert ratio == pytest.approx(found.least_extent)
    assert extents.min() == pytest.approx(found.inner_radius * envelope.inner_radius, rel=0.02)
    hull = ConvexHull(extents[:, None] * directions)
    assert hull.volume == pytest.approx(found.volume * envelope.volume, rel=0.02)


def test_least_squares_holds_nothing_across_the_plane_of_two_wheels():
    left = FOUR.without(0, 1)
    rows, found = least_squares_half_spaces(left), momentum_envelope(left)
    corner = found.vertices[0]
    assert np.abs(rows[:2] @ corner).max() == pytest.approx(1.0)
    across = np.cross(*np.array(left.axes)[2:])
    assert np.abs(rows @ (corner + 1e-6 * across)).max() > 1e200


def test_a_flat_envelope_is_refused():
    with pytest.raises(ValueError, match="array: must span three dimensions; received rank 2"):
        least_squares_against_minimax(FOUR.without(0, 1))
