"""Counted times: from which instant a number counts, in which ticks, with leap seconds or without.

A `time_format` of a mapping is a name of `ORIGINS` and one of `TICKS` ("gps_s"), or a name of
`DATES` ("mjd"). Of several columns the second and later ones count on in ticks ("gps_weeks", "s").
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from torquer.base.time import utc_at

#: Seconds of each tick.
TICKS = {
    "ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0,
    "weeks": 604800.0,
}  # fmt: skip
#: Seconds from 1970 to either end of what datetime64[ns] holds.
_MOST_S = 9.2e9


class Epoch(NamedTuple):
    """From which instant numbers count, and how."""

    start: str
    """UTC of the number `first`; "" if the mapping states it (`epoch`)"""
    tick_s: float
    counts_leaps: bool
    """whether leap seconds are counted, as GPS and TAI do; else each day has 86 400 s"""
    meaning: str
    first: float = 0.0
    is_local: bool = False
    """whether it may be the time of a zone, which must then be stated"""


class _Origin(NamedTuple):
    start: str
    counts_leaps: bool
    meaning: str
    words: str
    """what a column's name holds that says so"""


#: Instants from which counts begin, by the beginning of a `time_format`; the likeliest first.
ORIGINS = {
    "unix": _Origin("1970-01-01T00:00:00Z", False, "Unix time", r"unix|posix|epoch"),
    "gps": _Origin("1980-01-06T00:00:00Z", True, "GPS time", r"gps"),
    "j2000": _Origin(
        "2000-01-01T11:58:55.816Z", True, "TT since J2000 (noon, TT)", r"j2000|j2k|(?<![a-z])tt"
    ),
    "tai_2000": _Origin("1999-12-31T23:59:28Z", True, "TAI since 2000", r"tai"),
    "1904": _Origin("1904-01-01T00:00:00Z", False, "LabVIEW, old Macintosh", r"1904|labview|mac"),
    "tai_1958": _Origin("1957-12-31T23:59:50Z", True, "TAI since 1958 (CCSDS)", r"tai|cuc|ccsds"),
    "utc_2000": _Origin("2000-01-01T00:00:00Z", False, "UTC since 2000", r"2000|y2k"),
    "tai_1970": _Origin("1969-12-31T23:59:50Z", True, "TAI since 1970", r"tai"),
    "1900": _Origin("1900-01-01T00:00:00Z", False, "NTP", r"1900|ntp"),
    "1601": _Origin("1601-01-01T00:00:00Z", False, "Windows", r"1601"),
    "galileo": _Origin("1999-08-21T23:59:47Z", True, "Galileo time", r"galileo|gst"),
    "beidou": _Origin("2006-01-01T00:00:00Z", True, "BeiDou time", r"beidou|bdt|bds"),
    "since": _Origin("", False, "UTC since `epoch`", r"uptime|elapsed|mission|met"),
    "elapsed": _Origin("", True, "SI seconds since `epoch`", r"uptime|elapsed|met"),
}
#: Counts of days that have names of their own.
DATES = {
    "julian": Epoch("1858-11-17T00:00:00Z", 86400.0, False, "Julian date", 2400000.5),
    "mjd": Epoch("1858-11-17T00:00:00Z", 86400.0, False, "modified Julian date"),
    "mjd2000": Epoch("2000-01-01T00:00:00Z", 86400.0, False, "modified Julian date 2000"),
    "excel": Epoch(
        "1899-12-30T00:00:00Z", 86400.0, False, "serial number of a spreadsheet", is_local=True
    ),
    "excel_1904": Epoch(
        "1904-01-01T00:00:00Z", 86400.0, False, "of a Macintosh's spreadsheet", is_local=True
    ),
    "datenum": Epoch("1970-01-01T00:00:00Z", 86400.0, False, "MATLAB's", 719529.0, True),
}
#: Words in a column's name that say which date of `DATES` it is.
DATE_WORDS = {
    "julian": r"julian|(?<![a-z])jd", "mjd": r"mjd|modified", "mjd2000": r"mjd.?2000|mjd2k",
    "excel": r"excel|serial", "excel_1904": r"1904", "datenum": r"datenum|matlab",
}  # fmt: skip
#: The calendar's: a year, and the number of the day in it (1.0 = 1 January 00:00) after it or in
#: one number with it, 2012064.5 or 12064.5.
YEARS = {
    "year": "year; the next column is 'day_of_year'",
    "year_day": "YYYYDDD.d or YYDDD.d: year and day of the year in one number",
}
_DAY_OF_YEAR = "day_of_year"


def find_epoch(name: str) -> Epoch | None:
    """The epoch of a `time_format`; None for one that does not count from an instant."""
    if name in DATES:
        return DATES[name]
    origin, _, tick = name.rpartition("_")
    if origin not in ORIGINS or tick not in TICKS:
        return None
    of = ORIGINS[origin]
    return Epoch(of.start, TICKS[tick], of.counts_leaps, of.meaning)


def is_counted(name: str) -> bool:
    """Whether a `time_format` is that of numbers."""
    return name in YEARS or find_epoch(name) is not None


def is_clock(name: str) -> bool:
    """Whether a `time_format` is one of `strptime` without a date."""
    return "%" in name and not re.search(r"%[-#]?[djcxDFsuU]", name)


def is_local(name: str) -> bool:
    """Whether numbers of a `time_format` may be the time of any zone."""
    return name in YEARS or (name in DATES and DATES[name].is_local)


def count_instants(columns: list[np.ndarray], formats: list[str], epoch=None) -> np.ndarray:
    """Instants (datetime64[ns]) of numbers [n] in one column or several; NaT for what is none.

    `epoch`: UTC of the start, in place of the format's own. Of local formats the instants are
    those of the zone's clock.
    """
    if formats[0] in YEARS:
        return _in_years(columns, formats)
    of = find_epoch(formats[0])
    assert of is not None
    ticks = [of.tick_s, *(TICKS[each] for each in formats[1:])]
    values = [columns[0] if not of.first else columns[0] - of.first, *columns[1:]]
    seconds, rest_ns, known = _sum(values, ticks)
    start = np.datetime64((epoch or of.start).removesuffix("Z"), "us")
    if of.counts_leaps:
        found = utc_at(f"{start}Z", seconds + 1e-9 * rest_ns).astype("datetime64[ns]")
    else:
        known &= _within(seconds, start)
        found = _add(start, np.where(known, seconds, 0), rest_ns)
    found[~known] = np.datetime64("NaT")
    return found


def _sum(columns, ticks) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sum of counts, whole seconds and nanoseconds, and which rows are counts at all."""
    size = len(columns[0])
    seconds, rest_ns = np.zeros(size, dtype="int64"), np.zeros(size, dtype="int64")
    known = np.ones(size, dtype=bool)
    for values, tick in zip(columns, ticks, strict=True):
        values = np.asarray(values)
        known &= np.isfinite(values) & (np.abs(values * tick) < 4.0 * _MOST_S)
        values = np.where(known, values, 0)
        in_second = max(round(1.0 / tick), 1)
        more, rest = np.divmod(values, in_second)
        seconds += more.astype("int64") * max(round(tick), 1)
        rest_ns += np.rint(rest * round(tick * 1e9)).astype("int64")
    return seconds, rest_ns, known


def _within(seconds: np.ndarray, start: np.datetime64) -> np.ndarray:
    since_1970_s = (start - np.datetime64(0, "us")) / np.timedelta64(1, "s") + seconds
    return np.abs(since_1970_s) < _MOST_S


def _add(start: np.datetime64, seconds: np.ndarray, rest_ns: np.ndarray) -> np.ndarray:
    """Instants [ns] after a start that datetime64[ns] may not hold itself."""
    whole = start + seconds.astype("timedelta64[s]")
    return whole.astype("datetime64[us]").astype("datetime64[ns]") + rest_ns.astype(
        "timedelta64[ns]"
    )


def _in_years(columns, formats) -> np.ndarray:
    """Instants of years and days of the year."""
    numbers = [np.asarray(each, dtype=float) for each in columns]
    if formats[0] == "year_day":
        year = np.floor(numbers[0] / 1000.0)
        numbers, formats = [year, numbers[0] - 1000.0 * year, *numbers[1:]], ["", _DAY_OF_YEAR]
    year, day, *more = numbers
    year = np.where(year < 57, year + 2000, np.where(year < 100, year + 1900, year))
    known = (year > 1677) & (year < 2262) & (day >= 1.0) & (day < 367.0)
    begin = (np.where(known, year, 1970).astype("int64") - 1970).astype("datetime64[Y]")
    ticks = [86400.0, *(TICKS[each] for each in formats[2:])]
    seconds, rest_ns, fine = _sum([np.where(known, day - 1.0, 0.0), *more], ticks)
    known &= fine
    found = begin.astype("datetime64[ns]") + seconds.astype("timedelta64[s]")
    found = found + rest_ns.astype("timedelta64[ns]")
    found[~known] = np.datetime64("NaT")
    return found


def check_formats(formats: list[str], columns: int) -> None:
    """ValueError unless counted formats fit the columns of `time`."""
    first, *more = formats
    if len(formats) != columns:
        raise ValueError(
            f"time_format: must be given for each of {columns} columns, such as "
            f'["gps_weeks", "s"] or ["year", "day_of_year"]; received {len(formats)}'
        )
    wanted = {first: is_counted(first)} | dict.fromkeys(more, False)
    for k, each in enumerate(more):
        wanted[each] = each in TICKS or (k == 0 and first == "year" and each == _DAY_OF_YEAR)
    if first == "year" and more[:1] != [_DAY_OF_YEAR]:
        wanted[first] = False
    for each, fits in wanted.items():
        if not fits:
            raise ValueError(
                "time_format: must be a count such as 'gps_weeks' or 'year', then ticks "
                f"({', '.join(TICKS)}) or, after 'year', '{_DAY_OF_YEAR}'; received {each!r}"
            )
