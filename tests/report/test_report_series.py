"""Decimation, bands, angles and units of the report's time series."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from torquer.analysis.attitude import attitude_error_deg, orbital_axes
from torquer.analysis.series import angle_deg, bands_where, quiet_from, settled_from, usual_size
from torquer.geometry.frames import dcm_orbital_to_inertial
from torquer.orbit import kepler
from torquer.report.common.downsample import downsampled, thinned
from torquer.report.common.scales import clock_for, label_places, level_places, log_floor, prefixed
from torquer.report.flight.ground_track import only_where, split_at_dateline


@settings(max_examples=60, deadline=None)
@given(
    st.integers(3001, 20000),
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(-1e6, 1e6)), max_size=5),
)
def test_course_keeps_every_extreme_and_few_points(count, seed, spikes):
    y = np.random.default_rng(seed).normal(size=count)
    for place, size in spikes:
        y[int(place * (count - 1))] = size
    short = downsampled(np.arange(count), y, limit=3000)
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


def test_course_leaves_a_short_series_alone():
    t, y = np.arange(3000.0), np.arange(3000.0) ** 2
    short = downsampled(t, y)
    np.testing.assert_array_equal(short.t, t)
    np.testing.assert_array_equal(short.y, y)
    assert short.low is None and short.stretch_s == 0.0


def test_course_tells_fast_motion_from_slow():
    t = np.arange(20000.0)
    fast = np.where(t < 10000.0, np.sin(2.0 * t), np.sin(t / 2000.0))
    short = downsampled(t, fast)
    early = short.t < 9000.0
    late = short.t > 11000.0
    assert short.fast[early].all() and not short.fast[late].any()
    # samples 2 rad apart, 20 in a stretch: they come within 0.1 rad of each crest
    np.testing.assert_allclose(short.high[early], 1.0, atol=5e-3)
    np.testing.assert_allclose(short.low[early], -1.0, atol=5e-3)
    np.testing.assert_allclose(short.y[late], np.sin(short.t[late] / 2000.0), atol=1e-4)


def test_course_passes_over_gaps():
    y = np.ones(9000)
    y[1000:5000] = np.nan
    y[6000] = 9.0
    short = downsampled(np.arange(9000.0), y)
    assert np.nanmax(short.high) == 9.0
    assert np.isnan(short.y[(short.t > 1010.0) & (short.t < 4990.0)]).all()
    assert downsampled(np.arange(9000.0), np.full(9000, np.nan)).fast.any() == np.False_


def test_thinned_keeps_the_cloud_as_it_is():
    t = np.arange(50000.0)
    y = np.random.default_rng(1).normal(size=50000)
    y[777], y[33333] = 12.0, -15.0
    short = thinned(t, y, limit=3000)
    assert len(short.t) <= 3000 and short.y.max() == 12.0 and short.y.min() == -15.0
    assert np.isin(short.y, y).all()
    # no pile-up at the extremes: the middle of the cloud is as full as it was
    assert np.mean(np.abs(short.y) < 0.5) == pytest.approx(np.mean(np.abs(y) < 0.5), abs=0.03)


@pytest.mark.parametrize(
    ("inside", "bands"),
    [
        ([0, 0, 1, 1, 0], [(15.0, 35.0)]),
        ([1, 1, 0, 0, 0], [(0.0, 15.0)]),
        ([0, 0, 0, 1, 1], [(25.0, 40.0)]),
        ([1, 1, 1, 1, 1], [(0.0, 40.0)]),
        ([0, 0.25, 0.75, 0.25, 0], [(15.0, 25.0)]),
        ([0, 0.4, 0.9, 0.1, 0], [(12.0, 25.0)]),
        ([0, 0, 0, 0, 0], []),
        ([0, 1, 0, 1, 0], [(5.0, 15.0), (25.0, 35.0)]),
    ],
)
def test_bands_where(inside, bands):
    found = bands_where(10.0 * np.arange(5), inside)
    np.testing.assert_allclose(np.reshape(found, (-1, 2)), np.reshape(bands, (-1, 2)), rtol=1e-12)


def test_bands_of_a_single_record():
    assert bands_where([0.0], [1.0]) == [] and bands_where([0.0], [0.0]) == []


def test_angles():
    a = np.array([[1.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [0.0, 0, 0]])
    b = np.array([[3.0, 0, 0], [0, 2.0, 0], [-1.0, 0, 0], [1.0, 1e-9, 0], [1.0, 0, 0]])
    angles = angle_deg(a, b)
    np.testing.assert_allclose(angles[:4], [0.0, 90.0, 180.0, np.degrees(1e-9)], rtol=1e-12)
    assert np.isnan(angles[4])


@pytest.mark.parametrize(
    ("greatest", "unit"),
    [(5.0, "A"), (0.4, "A"), (0.05, "mA"), (2e-5, "µA"), (3e-9, "nA"), (1e-15, "nA"), (0.0, "A")],
)
def test_prefixed(greatest, unit):
    factor, shown = prefixed(np.array([0.0, -greatest, np.nan]), "A")
    size = {"A": 1.0, "mA": 1e-3, "µA": 1e-6, "nA": 1e-9}[unit]
    assert shown == unit and factor == pytest.approx(1.0 / size)


@pytest.mark.parametrize(
    ("span", "unit"), [(0.0, "s"), (600.0, "s"), (5700.0, "min"), (1e5, "h"), (1e6, "d")]
)
def test_clock(span, unit):
    clock = clock_for(span)
    assert clock.unit == unit
    assert clock.seconds == {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}[unit]


def test_quiet_from():
    t = np.arange(1000.0)
    size = np.where(t < 400.0, 1.0, 0.05)
    assert quiet_from(t, size) == 400.0
    assert quiet_from(t, np.ones(1000)) is None
    assert quiet_from(t, np.where(t < 950.0, 1.0, 0.05)) is None
    assert quiet_from(t[:1], size[:1]) is None
    assert quiet_from(t, np.zeros(1000)) is None


def test_log_floor():
    assert log_floor([0.0, np.nan, -1.0]) is None
    assert log_floor([0.0, 0.1, 10.0]) == 0.1
    assert log_floor([1e-20, 1.0]) == pytest.approx(1e-6)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_track_is_broken_at_the_dateline(way):
    lon, lat = split_at_dateline(way * np.array([170.0, 178.0, -174.0]), [0.0, 10.0, 50.0])
    expected = way * np.array([170.0, 178.0, 180.0, np.nan, -180.0, -174.0])
    np.testing.assert_array_equal(lon, expected)
    np.testing.assert_allclose(lat, [0.0, 10.0, 20.0, np.nan, 20.0, 50.0])


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_line_crosses_the_map(seed):
    steps = np.random.default_rng(seed).uniform(-60.0, 90.0, 300)
    lon = (np.cumsum(steps) + 180.0) % 360.0 - 180.0
    split, rows = split_at_dateline(lon, np.arange(300.0))
    jumps = np.abs(np.diff(split))
    assert np.all(jumps[np.isfinite(jumps)] <= 180.0)
    assert np.isnan(split).sum() == np.sum(np.abs(np.diff(lon)) > 180.0)
    kept = np.isfinite(rows) & (rows == np.round(rows)) & (np.abs(split) < 180.0)
    np.testing.assert_allclose(split[kept], lon[rows[kept].astype(int)])


def test_joints_belong_to_both_sides():
    mask = np.array([True, True, False, False, True])
    (lit,) = only_where(mask, np.arange(5.0))
    (dark,) = only_where(~mask, np.arange(5.0))
    np.testing.assert_array_equal(lit, [0, 1, 2, np.nan, 4])
    np.testing.assert_array_equal(dark, [np.nan, np.nan, 2, 3, 4])


def test_labels_of_levels_are_moved_apart():
    places, moved = level_places([1.0, 10.0], (0.1, 10.0), True, 0.1)
    assert places == pytest.approx([0.5, 1.0]) and moved == places
    _, moved = level_places([1.0, 2.0, 3.0], (0.0, 100.0), False, 0.1)
    assert np.all(np.diff(moved) > 0.0999) and np.mean(moved) == pytest.approx(0.02)


def test_orbital_axes_are_those_of_the_laws():
    r, v = kepler.states(np.linspace(0.0, 5e3, 7), 7.2e6, 0.2, (30.0, 63.0, 50.0), 0.4)
    matrices = orbital_axes(r, v).as_matrix()
    for n in range(7):
        known = dcm_orbital_to_inertial(tuple(r[n].tolist()), tuple(v[n].tolist()))
        np.testing.assert_allclose(matrices[n], known, atol=1e-14)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.0, 179.0),
    st.booleans(),
)
def test_attitude_error_is_the_turn_that_was_made(seed, degrees, orbital):
    rng = np.random.default_rng(seed)
    wanted, frames = Rotation.random(random_state=rng), Rotation.random(5, random_state=rng)
    axis = rng.normal(size=(5, 3))
    turns = degrees * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    body = wanted * Rotation.from_rotvec(turns, degrees=True)
    if orbital:
        body = frames * body
    answer = attitude_error_deg(body.as_quat(), wanted.as_quat(), frames if orbital else None)
    np.testing.assert_allclose(answer, turns, atol=1e-6)


def test_settled_once_it_is_as_small_as_later():
    t = np.arange(1000.0)
    size = 60.0 * np.exp(-t / 10.0) + 1.0
    since = settled_from(t, size)
    assert size[int(since)] <= 3.0 * np.median(size[500:]) < size[int(since) - 1]
    assert settled_from(t, np.ones(1000)) is None
    assert settled_from(t, 60.0 * np.exp(-t / 400.0) + 0.01) is None
    # a later peak does not matter, and nothing has to become smaller than a 300th
    size[400] = 50.0
    assert settled_from(t, size) == since
    assert settled_from(t, 60.0 * np.exp(-t / 10.0)) == pytest.approx(10.0 * np.log(300.0), abs=1.0)
    assert settled_from(t[:1], size[:1]) is None


def test_usual_size_leaves_few_values_out():
    values = np.concatenate([np.full(99, -2.0), [500.0], [np.nan]])
    assert usual_size(values) == 2.0
    assert usual_size([1.0, 500.0]) > 400.0
    assert usual_size([]) == 0.0 and usual_size([np.nan]) == 0.0


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(0.0, 1.0), max_size=8).map(sorted),
    st.lists(st.floats(0.01, 0.9), min_size=8, max_size=8),
)
def test_labels_beside_their_places_cover_no_other(places, widths):
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
