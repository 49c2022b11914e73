"""Counts and clocks against the calendar, with the leap seconds of an independent list."""

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from torquer.ground.telemetry.reading.epochs import (
    DATES,
    ORIGINS,
    TICKS,
    YEARS,
    count_instants,
    find_epoch,
    is_counted,
)
from torquer.ground.telemetry.reading.mapping import make_mapping
from torquer.ground.telemetry.reading.read import read
from torquer.ground.telemetry.reading.zones import utc_of_clock

#: First days after leap seconds since GPS time began (IERS Bulletin C).
LEAPS = [
    datetime(*date, tzinfo=UTC)
    for date in (
        *((1981, 7, 1), (1982, 7, 1), (1983, 7, 1), (1985, 7, 1), (1988, 1, 1), (1990, 1, 1)),
        *((1991, 1, 1), (1992, 7, 1), (1993, 7, 1), (1994, 7, 1), (1996, 1, 1), (1997, 7, 1)),
        *((1999, 1, 1), (2006, 1, 1), (2009, 1, 1), (2012, 7, 1), (2015, 7, 1), (2017, 1, 1)),
    )
]
#: TAI - GPS, TAI - BeiDou time, TT - TAI [s].
SCALES = {"gps": -19.0, "galileo": -19.0, "beidou": -33.0, "j2000": 32.184}
MOMENTS = [
    datetime(1999, 12, 31, 23, 59, 59, 500000, tzinfo=UTC),
    datetime(2006, 1, 1, tzinfo=UTC),
    datetime(2012, 3, 4, 10, 32, 23, 125000, tzinfo=UTC),
    datetime(2012, 7, 1, 0, 0, 1, tzinfo=UTC),
    datetime(2026, 11, 27, 13, tzinfo=UTC),
]
STARTS = {
    "unix": (1970, 1, 1), "gps": (1980, 1, 6), "galileo": (1999, 8, 22), "beidou": (2006, 1, 1),
    "tai_1958": (1958, 1, 1), "tai_1970": (1970, 1, 1), "tai_2000": (2000, 1, 1),
    "j2000": (2000, 1, 1, 12), "utc_2000": (2000, 1, 1), "1904": (1904, 1, 1),
    "1900": (1900, 1, 1), "1601": (1601, 1, 1),
}  # fmt: skip


def tai_minus_utc(moment):
    return 19.0 + sum(moment >= leap for leap in LEAPS)


def expected_count(origin, moment, tick_s):
    """What a counter shows: calendar arithmetic, the scale and the leap seconds."""
    start = datetime(*STARTS[origin], tzinfo=UTC)
    seconds = (moment - start).total_seconds()
    if ORIGINS[origin].counts_leaps:
        seconds += tai_minus_utc(moment) + SCALES.get(origin, 0.0)
    return seconds / tick_s


@pytest.mark.parametrize("tick", TICKS)
@pytest.mark.parametrize("origin", STARTS)
def test_counts_are_those_of_the_calendar(origin, tick):
    counts = np.array([expected_count(origin, each, TICKS[tick]) for each in MOMENTS])
    found = count_instants([counts], [f"{origin}_{tick}"])
    expected = np.array([m.replace(tzinfo=None) for m in MOMENTS], dtype="datetime64[ns]")
    # a float has so many digits of the count
    allowed_s = 1e-6 + 4.0 * np.spacing(np.abs(counts).max()) * TICKS[tick]
    assert np.abs((found - expected) / np.timedelta64(1, "s")).max() <= allowed_s


def test_every_origin_is_tested_or_needs_an_epoch():
    assert {name for name, each in ORIGINS.items() if each.start} == {*STARTS}
    assert all(map(is_counted, (*DATES, *YEARS))) and not is_counted("iso")
    assert find_epoch("lunar_s") is None and find_epoch("gps_fortnights") is None


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("julian", 2455990.9391550925), ("mjd", 55990.4391550926), ("mjd2000", 4446.4391550926),
        ("excel", 40972.4391550926), ("excel_1904", 39510.4391550926),
        ("datenum", 734932.4391550926),
    ],
)  # fmt: skip
def test_days_of_the_calendar(name, number):
    """The numbers are the calendar's: Excel's 40972 is 4 March 2012, MATLAB's 734932."""
    (found,) = count_instants([np.array([number])], [name])
    off = found - np.datetime64("2012-03-04T10:32:23", "ns")
    assert abs(off / np.timedelta64(1, "s")) < 1e-4
    assert DATES[name].tick_s == 86400.0


def test_whole_counts_keep_their_last_digit():
    (found,) = count_instants([np.array([1330857143123456789])], ["unix_ns"])
    assert str(found) == "2012-03-04T10:32:23.123456789"


def test_numbers_that_are_no_dates_are_no_stamps():
    odd = np.array([1e300, np.inf, np.nan, -1e300, 1e12])
    for form in ("unix_s", "gps_s", "excel", "unix_ms"):
        found = count_instants([odd], [form])
        assert np.isnat(found[:4]).all(), form
    assert np.isnat(count_instants([odd], ["year_day"])).all()


def in_berlin(first, count, minutes=10):
    """Clock of Berlin at instants ten minutes apart, and these in UTC."""
    utc = [first + timedelta(minutes=minutes * k) for k in range(count)]
    shown = [each.astimezone(ZoneInfo("Europe/Berlin")).replace(tzinfo=None) for each in utc]
    return (
        np.array(shown, dtype="datetime64[ns]"),
        np.array([each.replace(tzinfo=None) for each in utc], dtype="datetime64[ns]"),
    )


@pytest.mark.parametrize("count", [24, 5, 8])
@pytest.mark.parametrize("hour", [23, 0, 1])
def test_the_order_of_the_rows_tells_an_hour_that_comes_twice(hour, count):
    """Passes before, within and after the change of 28 October 2012 at 1:00 UTC."""
    first = datetime(2012, 10, 27 if hour == 23 else 28, hour, 30, tzinfo=UTC)
    clock, utc = in_berlin(first, count)
    has_change = np.any(np.diff(clock) < np.timedelta64(0))
    outside = clock.astype("datetime64[h]") != np.datetime64("2012-10-28T02", "h")
    if has_change or outside[0] != outside[-1]:
        np.testing.assert_array_equal(utc_of_clock(clock.copy(), "Europe/Berlin"), utc)
    elif not outside.any():
        with pytest.raises(ValueError, match="the order of the rows does not tell an hour"):
            utc_of_clock(clock.copy(), "Europe/Berlin")
    else:
        np.testing.assert_array_equal(utc_of_clock(clock.copy(), "Europe/Berlin"), utc)


def test_an_hour_that_comes_twice_and_nothing_tells():
    clock, _ = in_berlin(datetime(2012, 10, 28, 0, 10, tzinfo=UTC), 3)
    with pytest.raises(ValueError) as caught:
        utc_of_clock(clock, "Europe/Berlin")
    assert str(caught.value) == (
        "zone: must be an offset such as '+01:00' where the order of the rows does not tell an "
        "hour that comes twice; received Europe/Berlin with 2012-10-28 02:10:00"
    )
    words = np.array(["CEST", "CET", "CEST"], dtype=object)
    found = utc_of_clock(clock, "Europe/Berlin", words)
    assert [str(each)[11:16] for each in found] == ["00:10", "01:20", "00:30"]


def test_a_time_that_the_clock_never_shows():
    clock = np.array(["2012-03-25T02:30:00"], dtype="datetime64[ns]")
    with pytest.raises(ValueError) as caught:
        utc_of_clock(clock, "Europe/Berlin")
    assert str(caught.value) == (
        "zone: must be one in which every stamp is an instant, such as the offset of a clock that "
        "is not put forward; received Europe/Berlin, where 2012-03-25 02:30:00 is none"
    )


def test_moscow_put_its_clock_back_without_a_summer_time():
    """On 26 October 2014 at 22:00 UTC MSK went from UTC+4 to UTC+3."""
    utc = np.datetime64("2014-10-25T21:30", "ns") + np.arange(6) * np.timedelta64(10, "m")
    clock = utc + np.where(np.arange(6) < 3, 4, 3) * np.timedelta64(1, "h")
    np.testing.assert_array_equal(utc_of_clock(clock, "Europe/Moscow"), utc)


@pytest.mark.parametrize(
    ("stamp", "keys", "states"),
    [
        ("2012-03-04T10:00:{:02d}Z", {}, True),
        ("2012-03-04T10:00:{:02d}+03:00", {}, True),
        ("Sun, 04 Mar 2012 10:00:{:02d} GMT", {}, True),
        ("2012-03-04 10:00:{:02d}", {"zone": "UTC"}, False),
        ("13308480{:02d}", {"time_format": "unix_s"}, False),
    ],
)
def test_a_session_knows_whether_its_stamps_state_their_zone(tmp_path, stamp, keys, states):
    """A zone may be accused only where the stamps leave it to hearsay."""
    rows = "".join(f"{stamp.format(k)};1;2;{k}\n" for k in range(20))
    (tmp_path / "a.csv").write_text("t;x;y;z\n" + rows)
    columns = {"b_measured": ["x", "y", "z"]}
    mapping = make_mapping(
        {"time": "t", "separator": ";", "columns": columns, "units": {"b_measured": "nT"}} | keys
    )
    assert read(tmp_path / "a.csv", mapping).zone_is_stated == states
