"""A track broken at the date line and by eclipses."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.report.common.scales import split_where_wrapped
from torquer.report.flight.ground_track import only_where


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_track_is_broken_at_the_dateline(way):
    lon, lat = split_where_wrapped(way * np.array([170.0, 178.0, -174.0]), [0.0, 10.0, 50.0])
    expected = way * np.array([170.0, 178.0, 180.0, np.nan, -180.0, -174.0])
    np.testing.assert_array_equal(lon, expected)
    np.testing.assert_allclose(lat, [0.0, 10.0, 20.0, np.nan, 20.0, 50.0])


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_line_crosses_the_map(seed):
    steps = np.random.default_rng(seed).uniform(-60.0, 90.0, 300)
    lon = (np.cumsum(steps) + 180.0) % 360.0 - 180.0
    split, rows = split_where_wrapped(lon, np.arange(300.0))
    jumps = np.abs(np.diff(split))
    assert np.all(jumps[np.isfinite(jumps)] <= 180.0)
    assert np.isnan(split).sum() == np.sum(np.abs(np.diff(lon)) > 180.0)
    kept = np.isfinite(rows) & (rows == np.round(rows)) & (np.abs(split) < 180.0)
    np.testing.assert_allclose(split[kept], lon[rows[kept].astype(int)])


def test_joints_belong_to_both_sides():
    mask = np.array([True, True, False, False, True])
    (sunlit_fraction,) = only_where(mask, np.arange(5.0))
    (dark,) = only_where(~mask, np.arange(5.0))
    np.testing.assert_array_equal(sunlit_fraction, [0, 1, 2, np.nan, 4])
    np.testing.assert_array_equal(dark, [np.nan, np.nan, 2, 3, 4])
