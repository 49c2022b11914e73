"""Time: zones, leap seconds, Julian dates against erfa, decimal years."""

import warnings
from datetime import UTC, datetime, timedelta, timezone

import erfa
import numpy as np
import pytest

from torquer.base import time

LEAP_START = "2016-12-31T23:59:50Z"


@pytest.mark.parametrize(
    "value",
    (
        "2012-03-04T10:31:47Z",
        "2012-03-04T14:31:47+04:00",
        datetime(2012, 3, 4, 10, 31, 47, tzinfo=UTC),
        datetime(2012, 3, 4, 14, 31, 47, tzinfo=timezone(timedelta(hours=4))),
    ),
)
def test_any_zone_gives_the_same_instant_in_utc(value):
    parsed = time.parse_utc(value)
    assert parsed.isoformat() == "2012-03-04T10:31:47+00:00"


@pytest.mark.parametrize(
    "bad", ("2012-03-04T10:31:47", "2012-03-04", "yesterday", datetime(2012, 3, 4), 5.0, None)
)
def test_a_time_without_a_zone_is_one_clear_line(bad):
    with pytest.raises(ValueError) as error:
        time.parse_utc(bad, "start_utc")
    text = str(error.value)
    assert text.startswith("start_utc: must be a time with a zone, such as 2012-03-04T10:31:47Z")
    assert text.endswith(f"received {str(bad)!r}") and "\n" not in text


def erfa_dates(*calendar):
    """UT1 = UTC and TT by erfa's own leap second arithmetic, as days from J2000 in two parts."""
    utc = erfa.dtf2d("UTC", *calendar)
    return utc, erfa.taitt(*erfa.utctai(*utc))


def days_apart(pair, other):
    return (pair[0] - other[0]) + (pair[1] - other[1])


@pytest.mark.parametrize(
    "calendar",
    ((1972, 1, 1, 0, 0, 0.0), (1998, 12, 31, 12, 0, 0.5), (2012, 3, 4, 10, 31, 47.0),
     (2016, 12, 31, 0, 0, 0.0), (2017, 1, 1, 0, 0, 0.0), (2024, 2, 29, 23, 59, 59.0)),
)  # fmt: skip
def test_julian_dates_equal_erfa(calendar):
    start = datetime(*calendar[:5], tzinfo=UTC) + timedelta(seconds=calendar[5])
    ut1, tt = time.julian_dates(start, 0.0)
    # erfa stretches the UTC day that holds a leap second
    on_leap_day = calendar[1:3] == (12, 31) and calendar[3] > 0
    utc_e, tt_e = erfa_dates(*calendar)
    assert abs(days_apart(ut1, utc_e)) < (1e-5 if on_leap_day else 1e-14)
    assert abs(days_apart(tt, tt_e)) * 86400.0 < 1e-9


def test_terrestrial_time_runs_through_a_leap_second():
    _, tt = time.julian_dates(LEAP_START, np.array([0.0, 9.0, 10.0, 11.0, 20.0]))
    for k, calendar in enumerate(
        ((2016, 12, 31, 23, 59, 50.0), (2016, 12, 31, 23, 59, 59.0), (2016, 12, 31, 23, 59, 60.0),
         (2017, 1, 1, 0, 0, 0.0), (2017, 1, 1, 0, 0, 9.0))
    ):  # fmt: skip
        _, tt_e = erfa_dates(*calendar)
        assert abs(days_apart((tt[0], tt[1][k]), tt_e)) * 86400.0 < 1e-9


def test_universal_time_is_smooth_and_offset_by_dut1():
    t = np.array([0.0, 10.0, 11.0, 86400.0])
    plain, _ = time.julian_dates(LEAP_START, t)
    assert np.allclose(np.diff(plain[1]) * 86400.0, np.diff(t), rtol=0, atol=1e-10)
    moved, _ = time.julian_dates(LEAP_START, t, dut1_s=-0.4)
    assert np.allclose((moved[1] - plain[1]) * 86400.0, -0.4, rtol=0, atol=1e-10)


def test_utc_at_counts_leap_seconds():
    stamps = time.utc_at(LEAP_START, [0.0, 9.5, 10.25, 11.25, 20.0])
    expected = ("2016-12-31T23:59:50", "2016-12-31T23:59:59.5", "2017-01-01T00:00:00.25",
                "2017-01-01T00:00:00.25", "2017-01-01T00:00:09")  # fmt: skip
    assert np.array_equal(stamps, np.array(expected, dtype="datetime64[us]"))
    # 1972 to 2017 held 27 leap seconds
    years = (np.datetime64("2020-01-01") - np.datetime64("1972-01-01")).astype(int) * 86400.0
    assert time.utc_at("1972-01-01T00:00:00Z", years + 27) == np.datetime64("2020-01-01")


def test_far_dates_use_the_nearest_known_offset_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, tt = time.julian_dates("2080-06-01T00:00:00Z", 0.0)
        assert tt[1] * 86400.0 == pytest.approx(37.0 + 32.184, abs=1e-9)
        _, tt = time.julian_dates("1965-06-01T00:00:00Z", 0.0)
        assert tt[1] * 86400.0 == pytest.approx(10.0 + 32.184, abs=1e-9)
        assert time.utc_at("2080-06-01T00:00:00Z", 1.5) == np.datetime64("2080-06-01T00:00:01.5")


def test_decimal_years():
    assert time.decimal_year("2012-01-01T00:00:00Z") == 2012.0
    assert time.decimal_year("2012-07-02T00:00:00Z") == 2012.5  # leap year: 183 of 366 days
    assert time.decimal_year("2013-07-02T12:00:00Z") == 2013.5
    assert time.decimal_year("1965-12-31T00:00:00Z") == pytest.approx(1965 + 364 / 365, abs=1e-12)
    assert time.decimal_year("2020-01-01T02:00:00+03:00") < 2020.0
    t = np.array([0.0, 3600.0, 400 * 86400.0])
    many = time.decimal_years("2012-02-28T23:00:00Z", t)
    later = (time.parse_utc("2012-02-28T23:00:00Z") + timedelta(seconds=s) for s in t)
    one_by_one = [time.decimal_year(moment) for moment in later]
    # a leap second fell on 2012-06-30, within the last span: the years run on through it
    assert np.allclose(many, one_by_one, rtol=0, atol=5e-13)
    with pytest.raises(OverflowError):
        time.decimal_years("2012-02-28T23:00:00Z", 1e12)


def test_new_years_enclose_a_span():
    day = 86400.0
    at_s, years = time.new_years("2019-12-31T18:00:00Z", -day, 370.0 * day)
    assert years.tolist() == [2019.0, 2020.0, 2021.0, 2022.0]
    assert (at_s / day).tolist() == [-364.75, 0.25, 366.25, 731.25]
    at_s, years = time.new_years("2020-01-01T00:00:00Z", 0.0, 366 * day)
    assert years.tolist() == [2020.0, 2021.0, 2022.0] and at_s[0] == 0.0


def test_seconds_between_counts_leap_seconds():
    assert time.seconds_between("2016-12-31T23:59:00Z", "2017-01-01T00:01:00Z") == 121.0
    assert time.seconds_between("2017-01-01T00:01:00Z", "2016-12-31T23:59:00.5Z") == -120.5


def test_years_have_their_gregorian_length():
    assert [time.days_in(y) for y in (1900, 2000, 2023, 2024)] == [365, 366, 365, 366]


LEAP = "2016-12-31T23:59:60Z"


def test_a_leap_second_is_a_time():
    moment = time.parse_utc(LEAP)
    assert time.utc_text(moment) == LEAP
    assert time.parse_utc("2017-01-01T05:29:60+05:30") == moment
    assert time.seconds_between("2016-12-31T23:59:59Z", LEAP) == 1.0
    assert time.seconds_between(LEAP, "2017-01-01T00:00:00Z") == 1.0
    assert time.seconds_between(LEAP, "2016-12-31T23:59:60.25Z") == 0.25
    assert time.leap_seconds_between(LEAP, "2017-01-01T00:00:00Z") == 1
    after = time.utc_at(LEAP, [-1.0, 1.0, 61.0]).astype(str).tolist()
    assert [text[:19] for text in after] == [
        "2016-12-31T23:59:59", "2017-01-01T00:00:00", "2017-01-01T00:01:00"
    ]  # fmt: skip
    (_, tt), (_, tt_before) = (
        time.julian_dates(text, [0.0])[1] for text in (LEAP, "2016-12-31T23:59:59Z")
    )
    assert (tt - tt_before)[0] * 86400.0 == pytest.approx(1.0, abs=1e-6)


def test_other_times_are_as_they_were():
    for text in ("2016-12-31T23:59:59Z", "2024-03-20T12:59:59.5Z", "2017-01-01T00:00:00Z"):
        assert time.parse_utc(text).fold == 0
        assert time.parse_utc(time.utc_text(time.parse_utc(text))) == time.parse_utc(text)


@pytest.mark.parametrize(
    "text", ["2016-11-30T23:59:60Z", "2016-12-31T23:58:60Z", "2030-12-31T23:59:60Z"]
)
def test_second_60_is_a_time_only_where_there_was_one(text):
    with pytest.raises(ValueError, match="must have seconds below 60 unless UTC has a leap second"):
        time.parse_utc(text, "start")
