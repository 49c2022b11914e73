"""Units of axes and the placement of labels."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.report.common.scales import (
    choose_prefix,
    clock_for,
    label_places,
    level_places,
    log_ends,
    log_floor,
)


@pytest.mark.parametrize(
    ("greatest", "unit"),
    [(5.0, "A"), (0.4, "A"), (0.05, "mA"), (2e-5, "µA"), (3e-9, "nA"), (1e-15, "nA"), (0.0, "A")],
)
def test_prefixed(greatest, unit):
    factor, shown = choose_prefix(np.array([0.0, -greatest, np.nan]), "A")
    size = {"A": 1.0, "mA": 1e-3, "µA": 1e-6, "nA": 1e-9}[unit]
    assert shown == unit and factor == pytest.approx(1.0 / size)


@pytest.mark.parametrize(
    ("span", "unit"),
    [
        (0.0, "s"),
        (600.0, "s"),
        (5700.0, "min"),
        (10_800.0, "min"),
        (10_801.0, "h"),
        (1e5, "h"),
        (1e6, "d"),
    ],
)
def test_clock(span, unit):
    clock = clock_for(span)
    assert clock.unit == unit
    assert clock.seconds == {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}[unit]


def test_log_floor():
    assert log_floor([0.0, np.nan, -1.0]) is None
    assert log_floor([0.0, 0.1, 10.0]) == 0.1
    assert log_floor([1e-20, 1.0]) == pytest.approx(1e-6)


def test_a_logarithmic_axis_reaches_beyond_its_values():
    assert log_ends([0.0, np.nan], 5.0, 0.1) is None
    low, high = log_ends([2.0, 2.0], 5.0, 0.1)
    assert low == 0.2 and 2.1 < high < 2.3
    low, high = log_ends([1e-9, 1e-3, 1.0], 5.0, 0.1, [30.0])
    assert low == pytest.approx(0.7e-5) and 45.0 < high < 70.0


def test_labels_of_levels_are_moved_apart():
    places, moved = level_places([1.0, 10.0], (0.1, 10.0), True, 0.1)
    assert places == pytest.approx([0.5, 1.0]) and moved == places
    _, moved = level_places([1.0, 2.0, 3.0], (0.0, 100.0), False, 0.1)
    assert np.all(np.diff(moved) > 0.0999) and np.mean(moved) == pytest.approx(0.02)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(0.0, 1.0), max_size=8).map(sorted),
    st.lists(st.floats(0.01, 0.9), min_size=8, max_size=8),
)
def test_labels_next_to_their_places_cover_no_other(places, widths):
    widths = widths[: len(places)]
    found = label_places(places, widths)
    boxes = []
    for place, width, (left, row) in zip(places, widths, found, strict=True):
        assert left in (place, max(0.0, place - width))
        assert left == place or place + width > 1.0
        for other_left, other_right, other_row in boxes:
            assert row != other_row or left >= other_right or left + width <= other_left
        boxes.append((left, left + width, row))
    assert label_places([0.2, 0.25, 0.6], [0.3] * 3) == [(0.2, 0), (0.25, 1), (0.6, 0)]
