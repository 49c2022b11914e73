"""Time: civil times carry a zone, runs count SI seconds from their start.

23:59:60 is a time where UTC has it: the datetime of 23:59:59 with `fold` = 1, for datetime knows no
second 60. What computes seconds here takes it for the second after; its own arithmetic does not.

A run's clock never stops at a leap second, so UT1 and TT are the start's value plus `t_s`.
The number of leap seconds matters twice: for TT at the start, and when a later instant is
named in UTC. Leap seconds come from the table in pyerfa. After its last entry, and so for every
future date, the last known TAI - UTC is used; before 1972 its first value, 10 s. The table is
read here rather than through `erfa.dat`, which would warn of a 'dubious year' for each future date.
"""

import math
import re
from bisect import bisect_right
from datetime import UTC, datetime, timedelta
from functools import cache

import erfa
import numpy as np

from torquer.compile.engine import kernel

DAY_S = 86400.0
#: TT - TAI, exact by definition [s].
TT_MINUS_TAI_S = 32.184
#: Julian date of 1 January of the year 1 minus its proleptic ordinal (1).
_JD_OF_ORDINAL_0 = 1721424.5
#: The inserted second in a text, of any zone.
_SECOND_60 = re.compile(r"(.*\d:\d\d:)60(.*)", re.ASCII)


def parse_utc(value: str | datetime, name: str = "utc") -> datetime:
    """The instant in UTC of an ISO 8601 text or a datetime; one without a zone is an error.

    Second 60 is one of the leap seconds that there were, else an error.
    """
    inserted = _SECOND_60.fullmatch(value) if isinstance(value, str) else None
    text = f"{inserted[1]}59{inserted[2]}" if inserted else value
    try:
        moment = datetime.fromisoformat(text) if isinstance(text, str) else text
    except ValueError:
        moment = None
    if not isinstance(moment, datetime) or moment.utcoffset() is None:
        raise ValueError(
            f"{name}: must be a time with a zone, such as 2012-03-04T10:31:47Z; received "
            f"{str(value)!r}"
        )
    utc = moment.astimezone(UTC)
    if inserted is None:
        return utc
    if not _before_leap(utc):
        raise ValueError(
            f"{name}: must have seconds below 60 unless UTC has a leap second there; received "
            f"{value!r}"
        )
    return utc.replace(fold=1)


def utc_text(moment: datetime) -> str:
    """An instant of UTC as ISO 8601 text, its leap second as such."""
    text = moment.isoformat().replace("+00:00", "Z")
    return f"{text[:17]}60{text[19:]}" if _inserted_s(moment) else text


def _before_leap(utc: datetime) -> bool:
    """Whether the second of an instant is followed by a leap second."""
    second = np.datetime64(utc.replace(tzinfo=None, microsecond=0), "us")
    return bool(tai_minus_utc(second + np.timedelta64(1, "s")) > tai_minus_utc(second))


def _inserted_s(utc: datetime) -> int:
    """1 within a leap second, else 0."""
    return int(utc.fold == 1 and _before_leap(utc))


@cache
def _leap_table() -> tuple[np.ndarray, np.ndarray]:
    """UTC midnights (datetime64[us]) from which TAI - UTC [s] has the second array's values."""
    table = erfa.leap_seconds.get()
    table = table[table["year"] >= 1972]
    months = (table["year"] - 1970) * 12 + table["month"] - 1
    return months.astype("datetime64[M]").astype("datetime64[us]"), table["tai_utc"]


def tai_minus_utc(utc) -> np.ndarray:
    """TAI - UTC [s] at datetime64 UTC instants; the last known value for future dates."""
    midnights, offsets = _leap_table()
    return offsets[np.maximum(np.searchsorted(midnights, utc, side="right") - 1, 0)]


def utc_at(start_utc: str | datetime, t_s) -> np.ndarray:
    """UTC (datetime64[us]) at SI seconds `t_s` after the start.

    datetime64 has no 23:59:60: an inserted second reads as the first one of the next day.
    """
    start, t_s = _stamp(start_utc), np.asarray(t_s, dtype=np.float64)
    midnights, offsets = _leap_table()
    ahead_s = tai_minus_utc(start) + _inserted_s(parse_utc(start_utc))
    tai = start + _microseconds(ahead_s + t_s)
    row = np.searchsorted(midnights + _microseconds(offsets), tai, side="right") - 1
    return tai - _microseconds(offsets[np.maximum(row, 0)])


def julian_dates(start_utc: str | datetime, t_s, dut1_s: float = 0.0) -> tuple[tuple, tuple]:
    """Julian dates of UT1 and of TT, each a pair (day, fraction [...]), at `t_s` after the start.

    `dut1_s` is UT1 - UTC at the start. UT1 runs on smoothly through a leap second (it is
    UT1 - UTC that jumps). With `dut1_s` = 0 the first pair is the UTC Julian date at the start
    that goes on in SI seconds, as SGP4 wants it.
    """
    start = parse_utc(start_utc)
    day = _JD_OF_ORDINAL_0 + start.toordinal()
    midnight = start.replace(hour=0, minute=0, second=0, microsecond=0)
    seconds = (start - midnight).total_seconds() + _inserted_s(start)
    seconds = seconds + np.asarray(t_s, dtype=np.float64)
    tt_s = seconds + (float(tai_minus_utc(_stamp(start))) + TT_MINUS_TAI_S)
    return (day, (seconds + dut1_s) / DAY_S), (day, tt_s / DAY_S)


def decimal_year(utc: str | datetime) -> float:
    """Decimal year: year + (UTC seconds since 1 January 00:00) / (length of that year)."""
    moment = parse_utc(utc)
    begin, end = (datetime(year, 1, 1, tzinfo=UTC) for year in (moment.year, moment.year + 1))
    return moment.year + (moment - begin) / (end - begin)


def decimal_years(start_utc: str | datetime, t_s) -> np.ndarray:
    """Decimal years at SI seconds `t_s` after the start.

    They run on through a leap second, as UT1 does: a date that stands still for a second would
    be a step in what depends on it. Within the calendar's years 1 to 9998; else OverflowError.
    """
    t_s = np.asarray(t_s, dtype=np.float64)
    return np.interp(t_s, *new_years(start_utc, float(t_s.min()), float(t_s.max())))


def utc_of_year(decimal_year: float) -> str:
    """The instant of a decimal year as text, to the second: the inverse of `decimal_years`."""
    year = int(decimal_year)
    begin, end = (datetime(each, 1, 1, tzinfo=UTC) for each in (year, year + 1))
    moment = begin + (end - begin) * (float(decimal_year) - year) + timedelta(seconds=0.5)
    return f"{moment:%Y-%m-%dT%H:%M:%SZ}"


def new_years(start_utc: str | datetime, first_s: float, last_s: float) -> tuple:
    """Each 1 January 00:00 UTC around first_s..last_s: seconds after the start [k], year [k].

    The first lies before the span or at its beginning, the last beyond its end. Leap seconds are
    not counted.
    """
    start = parse_utc(start_utc)
    first, last = ((start + timedelta(seconds=s)).year for s in (first_s, last_s))
    years = range(first, last + 2)
    days = [datetime(year, 1, 1, tzinfo=UTC) - start for year in years]
    return np.array([day / timedelta(seconds=1) for day in days]), np.array(years, dtype=float)


def seconds_between(start_utc: str | datetime, end_utc: str | datetime) -> float:
    """SI seconds from one instant to another, leap seconds counted."""
    start, end = parse_utc(start_utc), parse_utc(end_utc)
    inserted_s = _inserted_s(end) - _inserted_s(start)
    return (end - start) / timedelta(seconds=1) + inserted_s + _leaps_between(start, end)


def leap_seconds_between(start_utc: str | datetime, end_utc: str | datetime) -> int:
    """Number of leap seconds inserted between two instants."""
    return _leaps_between(parse_utc(start_utc), parse_utc(end_utc))


def _leaps_between(start: datetime, end: datetime) -> int:
    """Of two instants in UTC; without arrays, as passes ask it for each point in a sky."""
    midnights, offsets = _leap_moments()
    first, last = (max(bisect_right(midnights, each) - 1, 0) for each in (start, end))
    return offsets[last] - offsets[first]


@cache
def _leap_moments() -> tuple[list[datetime], list[int]]:
    """The table of leap seconds as instants and whole numbers."""
    midnights, offsets = _leap_table()
    moments = [each.replace(tzinfo=UTC) for each in midnights.tolist()]
    return moments, [round(each) for each in offsets.tolist()]


@kernel
def day_of_year(day, year):
    """Number of the day of its year, 1 = 1 January.

    `day`: 1.0 = 1 January 00:00 of `year`; it may lie before that year or beyond it.
    """
    while day < 1.0:
        year -= 1
        day += days_in(year)
    while day >= 1.0 + days_in(year):
        day -= days_in(year)
        year += 1
    return math.floor(day)


@kernel
def days_in(year):
    """Days of a Gregorian year."""
    leap = year % 4 == 0 and (year % 100 != 0 or year % 400 == 0)
    return 366 if leap else 365


def _stamp(utc: str | datetime) -> np.datetime64:
    """A zone-aware time as datetime64[us] in UTC."""
    return np.datetime64(parse_utc(utc).replace(tzinfo=None), "us")


def _microseconds(seconds) -> np.ndarray:
    return np.rint(np.asarray(seconds) * 1e6).astype("timedelta64[us]")
