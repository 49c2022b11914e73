"""Downsampling keeps extremes, slow motion and gaps."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.report.common.downsample import downsample, thin


@settings(max_examples=60, deadline=None)
@given(
    st.integers(3001, 20000),
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(-1e6, 1e6)), max_size=5),
)
def test_downsampling_keeps_every_extreme_and_few_points(count, seed, spikes):
    y = np.random.default_rng(seed).normal(size=count)
    for place, size in spikes:
        y[int(place * (count - 1))] = size
    short = downsample(np.arange(count), y, limit=3000)
    assert 3 * len(short.t) <= 3000 and np.all(np.diff(short.t) > 0.0)
    assert short.high.max() == y.max() and short.low.min() == y.min()
    # every value lies within the range drawn at its place
    stretch = np.arange(count) // int(short.stretch_s)
    assert np.all(y <= short.high[stretch]) and np.all(y >= short.low[stretch])
    shown = np.isfinite(short.y)
    assert np.all(shown != short.fast)
    slack = 1e-12 * np.abs(y).max()
    assert np.all(short.y[shown] <= short.high[shown] + slack)
    assert np.all(short.y[shown] >= short.low[shown] - slack)


def test_downsampling_leaves_a_short_series_alone():
    t, y = np.arange(3000.0), np.arange(3000.0) ** 2
    short = downsample(t, y)
    np.testing.assert_array_equal(short.t, t)
    np.testing.assert_array_equal(short.y, y)
    assert short.low is None and short.stretch_s == 0.0


def test_downsampling_tells_fast_motion_from_slow():
    t = np.arange(20000.0)
    fast = np.where(t < 10000.0, np.sin(2.0 * t), np.sin(t / 2000.0))
    short = downsample(t, fast)
    early = short.t < 9000.0
    late = short.t > 11000.0
    assert short.fast[early].all() and not short.fast[late].any()
    # samples 2 rad apart, 20 in a stretch: they come within 0.1 rad of each crest
    np.testing.assert_allclose(short.high[early], 1.0, atol=5e-3)
    np.testing.assert_allclose(short.low[early], -1.0, atol=5e-3)
    np.testing.assert_allclose(short.y[late], np.sin(short.t[late] / 2000.0), atol=1e-4)


def test_downsampling_passes_over_gaps():
    y = np.ones(9000)
    y[1000:5000] = np.nan
    y[6000] = 9.0
    short = downsample(np.arange(9000.0), y)
    assert np.nanmax(short.high) == 9.0
    assert np.isnan(short.y[(short.t > 1010.0) & (short.t < 4990.0)]).all()
    assert downsample(np.arange(9000.0), np.full(9000, np.nan)).fast.any() == np.False_


def test_thinned_keeps_the_cloud_as_it_is():
    t = np.arange(50000.0)
    y = np.random.default_rng(1).normal(size=50000)
    y[777], y[33333] = 12.0, -15.0
    short = thin(t, y, limit=3000)
    assert len(short.t) <= 3000 and short.y.max() == 12.0 and short.y.min() == -15.0
    assert np.isin(short.y, y).all()
    # no pile-up at the extremes: the middle of the cloud is as full as it was
    assert np.mean(np.abs(short.y) < 0.5) == pytest.approx(np.mean(np.abs(y) < 0.5), abs=0.03)
