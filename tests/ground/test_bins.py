"""History of a number for plots: bins that keep extremes and lone values, infinities and gaps."""

import json
import math
import random
from contextlib import closing

import pytest
from hypothesis import given, settings, strategies as st

from torquer.base.strict_json import INFINITIES, json_text
from torquer.flight.packets.dictionary import load_dictionary
from torquer.ground.archive import Archive, Row, read_only
from torquer.ground.bins import points

CHIBIS = load_dictionary("chibis_m")
PLACE = CHIBIS.down["extended"].names.index("omega_x")
FOREVER = (-(2**53), 2**53)


def history(path, times_and_values, *asked):
    """Points of a number that an archive has at times [ms]; each is received 5 ms later."""
    made = []
    for number, (time_ms, value) in enumerate(times_and_values):
        values = [None] * len(CHIBIS.down["extended"].names)
        values[PLACE] = value
        made.append(Row("extended", time_ms, time_ms + 5, 2, 0, number, tuple(values)))
    with closing(Archive(path, CHIBIS)) as archive:
        archive.put(made)
    with closing(read_only(path)) as db:
        return points(db, "extended", "omega_x", *asked)


def rows(found):
    """(time, value) of what stands for rows."""
    return [(point.time_ms, point.value) for point in found if point.rows]


NUMBERS = st.none() | st.floats(-10.0, 10.0) | st.sampled_from([math.inf, -math.inf])
TIMES = st.integers(0, 5000) | st.integers(2**40, 2**40 + 50)


@settings(max_examples=100, deadline=None)
@given(
    values=st.lists(st.tuples(TIMES, NUMBERS), max_size=300),
    size=st.integers(2, 60),
    by=st.sampled_from(["time", "received"]),
    span=st.sampled_from([(500, 4500), FOREVER, (0, 2**41)]),
)
def test_points_are_rows_in_order_and_keep_the_extremes(tmp_path_factory, values, size, by, span):
    path = tmp_path_factory.mktemp("history") / "sat.sqlite"
    found = history(path, values, *span, size, by)
    shift = 5 if by == "received" else 0
    inside = [(t, v) for t, v in values if span[0] <= t + shift <= span[1]]
    shown = rows(found)
    times = [point.time_ms for point in found]
    assert times == sorted(times)
    assert len(found) <= max(4, size + 1) + max(1, size // 10)
    if len(inside) <= size:
        assert sorted(shown, key=repr) == sorted(inside, key=repr)
        return
    assert set(shown) <= set(inside)
    finite = [v for _, v in inside if v is not None and math.isfinite(v)]
    kept = {v for _, v in shown}
    assert {min(finite), max(finite)} <= kept if finite else True
    for infinite in (math.inf, -math.inf):
        assert (infinite in kept) == (infinite in {v for _, v in inside})


def test_no_bin_loses_its_peak(tmp_path):
    waves = [(t, math.sin(t / 37.0)) for t in range(0, 100_000, 10)]
    found = history(tmp_path / "sat.sqlite", waves, 0, 99_999, 100)
    assert 90 <= len(found) <= 100
    for first in range(0, 100_000, 2000):  # a bin is 2 s long
        truth = [value for t, value in waves if first <= t < first + 2000]
        shown = [p for p in found if first <= p.time_ms < first + 2000]
        assert {p.rows for p in shown} == {200}
        values = [p.value for p in shown]
        assert (min(values), max(values)) == (min(truth), max(truth))


@pytest.mark.parametrize("span", [(0, 2**53), FOREVER])
def test_a_wide_span_has_as_many_points_as_a_narrow_one(tmp_path, span):
    waves = [(10**12 + 1000 * t, math.sin(t / 37.0)) for t in range(2829)]
    found = history(tmp_path / "sat.sqlite", waves, *span, 1000)
    assert 900 < len(found) <= 1000 and all(point.rows in (5, 6) for point in found)


def test_passes_years_apart_share_the_points(tmp_path):
    draw, year_ms = random.Random(1), 365 * 86_400_000
    passes = [
        (k * year_ms + 1000 * t, draw.random()) for k in range(5) for t in range(1000 * (k != 3))
    ]
    passes.append((3 * year_ms, 0.5))
    found = history(tmp_path / "sat.sqlite", passes, *FOREVER, 600)
    for k in (0, 1, 2, 4):
        assert sum(point.time_ms // year_ms == k for point in found if point.rows) > 80
    assert (3 * year_ms, 0.5) in rows(found), "a lone value"
    gaps = [point for point in found if point.rows == 0]
    assert [point.time_ms // year_ms for point in gaps] == [0, 1, 2, 3]
    assert {(point.value, point.quality) for point in gaps} == {(None, None)}


def test_infinities_hide_nothing(tmp_path):
    values = [1.5, None, math.inf, -math.inf, 2.5]
    found = history(
        tmp_path / "sat.sqlite", [(1000 * k, values[k % 5]) for k in range(50)], *FOREVER, 6
    )
    assert {1.5, 2.5, math.inf, -math.inf} == {point.value for point in found if point.rows}
    assert all(point.rows == 50 for point in found)


def test_gaps_are_gaps_and_other_rates_are_none(tmp_path):
    fast = [(1000 * t, 1.0) for t in range(100)]
    slow = [(100_000 + 9_000 * t, 2.0) for t in range(100)]
    late = [(5_000_000 + 1000 * t, 3.0) for t in range(100)]
    for size in (1000, 80):
        path = tmp_path / f"{size}.sqlite"
        found = history(path, fast + slow + late, *FOREVER, size)
        (gap,) = [point for point in found if point.rows == 0]
        assert 991_000 < gap.time_ms < 5_000_000
        assert gap.received_ms == gap.time_ms + 5 and gap.value is gap.quality is None


def test_what_was_not_known_for_long_is_a_point_without_a_value(tmp_path):
    known = [(1000 * t, None if 3000 <= t < 6000 else 1.0) for t in range(10_000)]
    found = history(tmp_path / "sat.sqlite", known, *FOREVER, 100)
    assert sum(point.value is None for point in found) >= 13


def test_infinities_travel_by_name():
    text = json_text([1.5, math.nan, math.inf, -math.inf], None, INFINITIES)
    assert json.loads(text) == [1.5, None, "Infinity", "-Infinity"]
    assert json.loads(json_text([math.inf, math.nan], None)) == [None, None]


YEAR_MS = 365 * 86_400_000


@pytest.mark.parametrize("by", ["time", "received"])
@pytest.mark.parametrize("step_ms", [1, 1000, 3_600_000])
def test_regular_rows_have_no_gaps_however_their_extremes_lie(tmp_path, step_ms, by):
    waves = [(k * step_ms, math.sin(k)) for k in range(10_000)]
    found = history(tmp_path / "sat.sqlite", waves, *FOREVER, 500, by)
    assert len(found) == 500 and all(point.rows for point in found)


def test_a_pass_a_day_for_ten_years_is_seen_as_passes_once_they_can_be_told_apart(tmp_path):
    passes = [(day * 86_400_000 + 10_000 * k, float(k)) for day in range(3650) for k in range(4)]
    path = tmp_path / "sat.sqlite"
    assert all(point.rows for point in history(path, passes, *FOREVER, 1000))
    with closing(read_only(path)) as db:
        month = points(db, "extended", "omega_x", 0, 30 * 86_400_000 - 1, 1000)
    assert sum(point.rows == 0 for point in month) == 29


def test_a_lone_row_before_a_short_pass_is_a_year_away_from_it(tmp_path):
    for lone in (0, 2 * YEAR_MS):
        times = sorted([lone, *(YEAR_MS + 1000 * k for k in range(3))])
        path = tmp_path / f"{lone}.sqlite"
        found = history(path, [(time, 1.0) for time in times], *FOREVER, 100)
        assert [p.rows for p in found] == ([1, 0, 1, 1, 1] if lone == 0 else [1, 1, 1, 0, 1])


@pytest.mark.parametrize("value", [None, math.inf, -math.inf])
def test_what_is_nowhere_finite_is_told_in_every_bin(tmp_path, value):
    found = history(tmp_path / "sat.sqlite", [(k, value) for k in range(5000)], *FOREVER, 100)
    assert {point.value for point in found} == {value} and len(found) >= 25
    (one,) = history(tmp_path / "one.sqlite", [(7, value)], *FOREVER, 2)
    assert (one.value, one.rows) == (value, 1)


def test_rows_that_were_received_in_another_order_come_in_that_of_reception(tmp_path):
    path, names = tmp_path / "sat.sqlite", CHIBIS.down["extended"].names
    with closing(Archive(path, CHIBIS)) as archive:
        archive.put(
            Row("extended", 10_000 - k, k, 2, 0, k, (None,) * PLACE + (math.sin(k),)
                + (None,) * (len(names) - PLACE - 1))
            for k in range(10_000)
        )  # fmt: skip
    with closing(read_only(path)) as db:
        found = points(db, "extended", "omega_x", *FOREVER, 100, "received")
    received = [point.received_ms for point in found]
    assert received == sorted(received) and len(found) == 100
