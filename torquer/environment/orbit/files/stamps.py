"""Instants and numbers as files of orbits write them, checked one by one.

Every instant is read in its time scale and returned in TAI: a leap second is an instant of UTC
that no other scale has.
"""

import math
import re
from calendar import isleap
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from datetime import date
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from torquer.base.time import tai_minus_utc

#: Nanoseconds by which a time scale is ahead of TAI; UTC follows its leap seconds.
AHEAD_OF_TAI_NS = {
    "TAI": 0, "TT": 32_184_000_000, "GPS": -19_000_000_000, "GAL": -19_000_000_000,
    "QZS": -19_000_000_000, "IRN": -19_000_000_000, "BDT": -33_000_000_000,
}  # fmt: skip
SCALES = ("UTC", *AHEAD_OF_TAI_NS)
#: Years that a file may be of: those of satellites, and of the last run.
_YEARS = (1957, 2100)
_DAY_S, _NS = 86400, 1_000_000_000
_WEEK_S = 604800
_EPOCH = date(1970, 1, 1).toordinal()
_GPS_EPOCH = date(1980, 1, 6).toordinal()
_STAMP = re.compile(
    r"(\d{4})(?:-(\d{3})|([-/])(\d{1,2})\3(\d{1,2}))[Tt ] *(\d{1,2}):(\d{2})(?::(\d{2})"
    r"(?:[.,](\d*))?)? ?([Zz]|UTC|[+-]\d{2}(?::?\d{2})?)?",
    re.ASCII,
)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class _Clock(NamedTuple):
    """A time of day: hour, minute, whole seconds, nanoseconds."""

    hour: int
    minute: int
    second: int
    ns: int


@contextmanager
def at_line(line: int) -> Iterator[None]:
    """Within the block, what is wrong is so in a line of the file."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"line {line}: {error}") from None


def by_line(read: Callable, lines: Iterable[int], *values: Iterable) -> np.ndarray:
    """What `read` makes of the values of each line; ValueError says of which line."""
    found = []
    for line, *given in zip(lines, *values, strict=True):
        with at_line(line):
            found.append(read(*given))
    return np.array(found)


def scale_named(name: str) -> str:
    """The time scale that a file names, in small letters or capital ones."""
    scale = name.upper()
    if scale == "GLO":  # as SP3 calls it for GLONASS
        return "UTC"
    if scale not in SCALES:
        raise ValueError(f"time scale must be one of {', '.join(SCALES)}; received {name!r}")
    return scale


def read_stamp(word: str, scale: str) -> np.datetime64:
    """The instant of an ISO 8601 text, calendar or day of year: of UTC, or without a zone."""
    found = _STAMP.fullmatch(word.strip())
    if found is None:
        raise ValueError(f"must be a time such as 2025-07-01T12:00:00; received {word!r}")
    year, day_of_year, _, month, day, hour, minute, second, fraction, zone = found.groups()
    _check_zone(zone, scale, word)
    clock = _Clock(int(hour), int(minute), int(second or 0), _nanoseconds(fraction or ""))
    if day_of_year is None:
        when = _calendar_day(int(year), int(month), int(day), word)
    else:
        when = _day_of_year(int(year), int(day_of_year), word)
    return _instant(when, clock, scale, word)


def instant_of_numbers(numbers: list[float], scale: str, received: str) -> np.datetime64:
    """The instant of year, month, day, hour, minute and seconds."""
    if any(not number.is_integer() for number in numbers[:5]):
        raise ValueError(
            f"must hold whole years, months, days, hours and minutes; received {received!r}"
        )
    year, month, day, hour, minute = map(int, numbers[:5])
    ns = round(_NS * numbers[5])
    when = _calendar_day(year, month, day, received)
    return _instant(when, _Clock(hour, minute, *divmod(ns, _NS)), scale, received)


def gps_instant(week: float, seconds: float) -> np.datetime64:
    """The instant of a week since January 1980 and seconds in it."""
    last = (date(_YEARS[1], 12, 31).toordinal() - _GPS_EPOCH) // 7
    if not (week.is_integer() and 0.0 <= week <= last):
        raise ValueError(f"gps_week must be a whole number of 0 to {last}; received {week:.12g}")
    if not 0.0 <= seconds < _WEEK_S:
        raise ValueError(
            f"gps_s must be within its week, 0 to below {_WEEK_S} s; received {seconds:.12g}"
        )
    day = _GPS_EPOCH - _EPOCH + 7 * int(week)
    return _in_tai(day * _DAY_S * _NS + round(_NS * seconds), "GPS")


def read_numbers(words: list[str], count: int) -> list[float]:
    """So many finite numbers of a line."""
    numbers = [float(word) for word in words if _NUMBER.fullmatch(word)]
    if len(numbers) != len(words) or len(words) != count or not all(map(math.isfinite, numbers)):
        points = " with decimal points" if any("," in word for word in words) else ""
        raise ValueError(f"must hold {count} numbers{points}; received {' '.join(words)[:80]!r}")
    return numbers


def _nanoseconds(fraction: str) -> int:
    """Nanoseconds of the digits behind the point of seconds; those beyond the ninth are cut."""
    return int(fraction[:9].ljust(9, "0"))


def _check_zone(zone: str | None, scale: str, word: str) -> None:
    if zone is None:
        return
    if zone not in ("Z", "z", "UTC") and zone.strip("+-").replace(":", "").strip("0"):
        raise ValueError(f"must be a time of no other zone than UTC; received {word!r}")
    if scale != "UTC":
        raise ValueError(
            f"must be a time without the zone of UTC, as the scale is {scale}; received {word!r}"
        )


def _check_year(year: int, word: str) -> None:
    if not _YEARS[0] <= year <= _YEARS[1]:
        raise ValueError(f"must hold a year of {_YEARS[0]} to {_YEARS[1]}; received {word!r}")


def _calendar_day(year: int, month: int, day: int, word: str) -> int:
    """Days since 1970-01-01."""
    _check_year(year, word)
    try:
        return date(year, month, day).toordinal() - _EPOCH
    except ValueError:
        raise ValueError(
            f"must hold a month and a day of the calendar; received {word!r}"
        ) from None


def _day_of_year(year: int, day: int, word: str) -> int:
    """Days since 1970-01-01."""
    _check_year(year, word)
    last = 366 if isleap(year) else 365
    if not 1 <= day <= last:
        raise ValueError(f"must hold a day of year of 1 to {last}; received {word!r}")
    return date(year, 1, 1).toordinal() - _EPOCH + day - 1


def _instant(day: int, clock: _Clock, scale: str, word: str) -> np.datetime64:
    """An instant in TAI, of days since 1970 and a time of day that there was."""
    if not (0 <= clock.hour <= 23 and 0 <= clock.minute <= 59):
        raise ValueError(f"must hold hours of 0 to 23 and minutes of 0 to 59; received {word!r}")
    is_last_minute = (clock.hour, clock.minute) == (23, 59)
    last = 60 if scale == "UTC" and is_last_minute and _has_leap(day) else 59
    if not 0 <= clock.second <= last:
        raise ValueError(
            f"must hold seconds below 60, or 61 where UTC has a leap second; received {word!r}"
        )
    seconds = _DAY_S * day + 3600 * clock.hour + 60 * clock.minute + clock.second
    ns = _NS * seconds + clock.ns
    return _in_tai(ns + _NS * _behind_s(day), "TAI") if scale == "UTC" else _in_tai(ns, scale)


def _in_tai(ns: int, scale: str) -> np.datetime64:
    return np.datetime64(ns - AHEAD_OF_TAI_NS[scale], "ns")


@lru_cache(maxsize=1024)
def _behind_s(day: int) -> int:
    """TAI - UTC throughout a day; its leap second, too, is counted on."""
    return int(tai_minus_utc(np.datetime64(day, "D").astype("datetime64[us]")))


def _has_leap(day: int) -> bool:
    return _behind_s(day + 1) > _behind_s(day)


def seconds_behind(tai: np.datetime64) -> float:
    """TAI - UTC at an instant in TAI; within its seconds of a leap second, that before it."""
    near = float(tai_minus_utc(tai))
    return float(tai_minus_utc(tai - np.timedelta64(round(1e9 * near), "ns")))
