"""Which columns are the time stamps, of what format: every reading that gives plausible dates."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from torquer.base.time import parse_utc
from torquer.ground.telemetry.proposal.guess_layout import TIME
from torquer.ground.telemetry.reading.cells import cell_texts, read_numbers
from torquer.ground.telemetry.reading.epochs import DATE_WORDS, DATES, ORIGINS, find_epoch
from torquer.ground.telemetry.reading.mapping import Mapping, names_in
from torquer.ground.telemetry.reading.stamps import read_stamps
from torquer.ground.telemetry.reading.table import Table

#: Dates that telemetry may have; the last is two years from now.
_EARLIEST = np.datetime64("1995-01-01")
_AHEAD = np.timedelta64(2 * 366, "D")
#: Parts of a date and of a time of day, in the order of their likelihood.
_DAYS = (
    "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%m-%d-%Y", "%Y/%m/%d", "%Y.%m.%d",
    "%d %b %Y", "%d-%b-%Y", "%b %d %Y", "%b %d, %Y", "%Y %b %d", "%d.%m.%y", "%m/%d/%y", "%d/%m/%y",
    "%Y %j", "%Y-%j", "%Y/%j", "%Y%j", "%Y%m%d", "%Y_%m_%d",
)  # fmt: skip
_CLOCKS = (
    " %H:%M:%S", " %H:%M:%S.%f", " %H:%M", " %I:%M:%S %p", " %I:%M %p", "T%H:%M:%S", "T%H:%M:%S.%f",
    "-%H:%M:%S", "-%H:%M:%S.%f", ":%H:%M:%S", "_%H:%M:%S", " %H%M%S", "_%H%M%S", "-%H%M%S",
    " %H-%M-%S", "_%H-%M-%S", " %H.%M.%S", ", %H:%M:%S", ", %I:%M:%S %p", "%H%M%S",
)  # fmt: skip
_OFFSETS = ("", "%z", " %z")
_FORMS = [day + clock + offset for day, clock, offset in product(_DAYS, _CLOCKS, _OFFSETS)]
_FORMS += [f"{clock.strip()} {day}" for clock, day in product(_CLOCKS[:2], _DAYS)]


def _outline(stamp: str) -> str:
    """What parts the numbers and words of a stamp, these as "0" and "a"."""
    words = re.sub(r"[^\W\d_]+", "a", re.sub(r"\d+", "0", stamp))
    return re.sub(r"\s+", " ", words).strip()


def _example(form: str) -> str:
    """A stamp of a format, without its offset."""
    return re.sub(r"%\w", lambda of: {"%b": "a", "%p": "a", "%z": ""}.get(of[0], "0"), form)


#: Of each format, since comparing outlines takes a thousandth of trying a format.
_OUTLINES = {form: _outline(_example(form)) for form in _FORMS}
#: Zones whose abbreviations are met; others share some of these.
ABBREVIATIONS = {
    "MSK": "Europe/Moscow", "MSD": "Europe/Moscow", "CET": "Europe/Berlin",
    "CEST": "Europe/Berlin", "EET": "Europe/Helsinki", "EEST": "Europe/Helsinki",
    "BST": "Europe/London", "WET": "Europe/Lisbon", "WEST": "Europe/Lisbon",
    "EST": "America/New_York", "EDT": "America/New_York", "CST": "America/Chicago",
    "CDT": "America/Chicago", "MST": "America/Denver", "MDT": "America/Denver",
    "PST": "America/Los_Angeles", "PDT": "America/Los_Angeles", "JST": "Asia/Tokyo",
    "KST": "Asia/Seoul", "IST": "Asia/Kolkata", "AEST": "Australia/Sydney",
    "AEDT": "Australia/Sydney", "MEZ": "Europe/Berlin", "MESZ": "Europe/Berlin",
}  # fmt: skip
#: Rows by which a column is one of stamps whose name does not say so.
_LEAST_ROWS = 8
_YEAR_DAY = "year_day"
#: Part of the rows that must be stamps.
_MOST = 0.95
#: Weeks after which the counter of GPS receivers begins again.
ROLLOVERS = ("1999-08-21T23:59:47Z", "2019-04-06T23:59:42Z")
#: Names of columns of a date and a time of day in six parts, and the formats of these.
_PARTS = (
    r"y(ea)?r|y+", r"mon(th)?|m[mo]?", r"day|dom|d+", r"h(ou)?r|h+", r"min(ute)?|mi|mn|m",
    r"sec(ond)?|s+",
)  # fmt: skip
_OF_PARTS = ("%Y %m %d %H %M %S", "%Y %m %d %H %M %S.%f")
#: What is said where nothing states the zone.
UNSTATED_ZONE = "its zone is UTC: CHECK THIS, the stamps state none"
#: What is added where the name of a column says so.
_STATED = 3.0
#: Ticks that are met, and what each adds.
_LIKELY = {"s": 0.5, "ms": 0.3, "us": 0.2, "ns": 0.1, "days": -1.0}
#: Dates as near to the origin as this are those of small numbers, which come anyway.
_NEAR = np.timedelta64(366, "D")
#: Steps from row to row that are usual.
_LEAST_STEP, _MOST_STEP = np.timedelta64(500, "us"), np.timedelta64(1, "D")


class TimeReading(NamedTuple):
    """Keys of a mapping that read stamps, UTC of the rows (NaT for none), how likely it is by the
    names of the columns, what of it is a guess."""

    keys: dict[str, Any]
    utc: np.ndarray
    score: float
    guesses: tuple[str, ...]

    @property
    def middle(self) -> datetime:
        """UTC of the middle row."""
        known = self.utc[~np.isnat(self.utc)]
        return known[len(known) // 2].astype("datetime64[us]").item().replace(tzinfo=UTC)

    @property
    def text(self) -> str:
        """The keys, and the first stamp."""
        shown = ", ".join(f"{key} = {value!r}" for key, value in self.keys.items())
        known = self.utc[~np.isnat(self.utc)]
        return f"{shown}: {np.datetime_as_string(known[0], unit='s')}Z"


def time_readings(table: Table, is_archive: bool) -> list[TimeReading]:
    """Readings of the stamps of a table, the likeliest first."""
    if is_archive:
        return list(_tried(table, [({"time": "_time_ms", "time_format": "unix_ms"}, _STATED, ())]))
    named = [str(c) for c in table.data if TIME.search(str(c))]
    found = [*_dates(table), *_pairs(table, named)]
    for column in named:
        found += _of_column(table, column)
    readings = list(_tried(table, found))
    if not readings:
        first = str(next(iter(table.data)))
        if len(table.data) >= _LEAST_ROWS and first not in named:
            readings = list(_tried(table, _of_column(table, first)))
    return sorted(readings, key=lambda each: -each.score)


def _tried(table: Table, candidates):
    """Those candidates that give plausible stamps in nearly all rows."""
    latest = np.datetime64("now") + _AHEAD
    for keys, score, guesses in candidates:
        stated = {"epoch": parse_utc(keys["epoch"])} if "epoch" in keys else {}
        mapping = Mapping.model_construct(**keys | stated)
        try:
            utc = read_stamps(table, mapping, _numbers(table)).utc
        except ValueError:
            continue
        fine = (utc > _EARLIEST) & (utc < latest)
        if len(utc) and fine.mean() >= _MOST:
            back = np.mean(np.diff(utc[fine]) < np.timedelta64(0)) if fine.sum() > 1 else 0.0
            if _moves(utc[fine]) and not _near_origin(keys, utc[fine]):
                yield TimeReading(keys, utc, score - 3.0 * back, guesses)


def _near_origin(keys: dict, utc: np.ndarray) -> bool:
    """Whether counts begin shortly before the stamps, and no epoch was stated."""
    of = find_epoch(names_in(keys.get("time_format", "iso"))[0])
    if of is None or "epoch" in keys:
        return False
    start = np.datetime64(of.start.removesuffix("Z"), "us")
    return bool(np.min(utc) - start < _NEAR)


def _moves(utc: np.ndarray) -> bool:
    """Whether stamps are as far from one another as those of telemetry."""
    steps = np.abs(np.diff(utc))
    steps = steps[steps > np.timedelta64(0)]
    if len(utc) == 1:
        return True
    return len(steps) > 0 and _LEAST_STEP <= np.median(steps) <= _MOST_STEP


def _numbers(table: Table):
    missing = Mapping.model_fields["missing"].default
    return lambda column: read_numbers(table.data[column], missing, None)


def _dates(table: Table):
    """Columns of dates, of formats that have such columns."""
    for column in map(str, table.data):
        if table.data[column].dtype.kind != "M":
            continue
        if table.data[column].dt.tz is not None or column in table.is_utc:
            yield {"time": column}, 6.0, ()
        else:
            yield {"time": column, "zone": "UTC"}, 5.0, (UNSTATED_ZONE,)


def _of_column(table: Table, column: str):
    import pandas as pd

    values = table.data[column]
    if values.dtype.kind == "M":
        return
    text = cell_texts(values)
    head = [each for each in text.head(50) if each]
    if not head:
        return
    if pd.to_numeric(pd.Series(head), errors="coerce").notna().mean() > 0.5:
        yield from _counts(column)
        if all(re.fullmatch(r"\d{12,14}", each) for each in head):
            yield from _texts(column, text, 3.0)
        return
    yield from _texts(column, text, 4.0)


def _texts(columns, text, score: float):
    """Formats that texts have, with the zone that they need."""
    if re.search(r"(\d{4}-\d\d-\d\d|\d{8}T\d|\d{4}-\d{3}T|[a-z]{3} \d{4} )", text.iloc[0], re.I):
        yield from _with_zone({"time": columns}, text, score)
    forms = _formats(text)
    doubt = ": CHECK THIS, day and month may change places" if len(forms) > 1 else ""
    for form in forms:
        likely = 0.2 * (("%d" in form[:2]) + ("%m" in form[:2] and "%p" in form) * 2)
        guess = (f"its format is {form}{doubt}",)
        yield from _with_zone(
            {"time": columns, "time_format": form}, text, score - 0.5 + likely, guess
        )


def _formats(text) -> list[str]:
    """Formats of `strptime` that the first and the last rows have."""
    import pandas as pd

    some = pd.concat([text.head(20), text.tail(20)])
    bare = some.str.replace(r"\s*\b(?!AM|PM)[A-Z]{3,5}$|(?<=\d)\s*(?:Z|UT)$", "", regex=True)
    unzoned = bare.str.replace(r"\s*([+-]\d\d:?\d\d|Z)$", "", regex=True)
    outlines = {zoned: set(map(_outline, each)) for zoned, each in ((False, bare), (True, unzoned))}
    found = []
    for form in _FORMS:
        zoned = "%z" in form
        if _OUTLINES[form] not in outlines[zoned]:
            continue
        parsed = pd.to_datetime(bare, format=form, errors="coerce", utc=zoned)
        if parsed.notna().mean() >= _MOST and not ("%Y%j" in form and len(bare.iloc[0]) > 13):
            found.append(form)
    return found


def _with_zone(keys: dict, text, score: float, guesses: tuple[str, ...] = ()):
    """Keys as they are, or with UTC or the zone that an abbreviation names."""
    yield keys, score, guesses
    word = re.search(r"(?<=[\d ])\s*([A-Z]{2,5})$", text.iloc[0])
    if re.search(r"(?<![a-z])(utc|gmt|zulu)(?![a-z])", str(keys["time"]).lower()):
        yield keys | {"zone": "UTC"}, score, (*guesses, "its zone is UTC, by its name")
    elif word and word[1] in ABBREVIATIONS:
        zone = ABBREVIATIONS[word[1]]
        yield keys | {"zone": zone}, score, (*guesses, f"its zone, {word[1]}, is {zone}")
    else:
        yield keys | {"zone": "UTC"}, score, (*guesses, UNSTATED_ZONE)


def _pairs(table: Table, named: list[str]):
    """Columns together: date and time, week and seconds, year and day, or a part in each."""
    by = {each.lower(): each for each in named}
    yield from _in_parts(table)

    def one(pattern: str) -> str | None:
        return next((by[each] for each in by if re.search(pattern, each)), None)

    day, clock = one(r"date|datum|day$|дата"), one(r"time|clock|zeit|время|utc")
    if day and clock and day != clock:
        joined = cell_texts(table.data[day]) + " " + cell_texts(table.data[clock])
        yield from _texts([day, clock], joined, 4.5)
    week, second = one(r"week|wn"), one(r"tow|sow|sec|time_?of_?week|itow")
    if week and second and week != second:
        yield from _weeks(week, second)
    year, number = one(r"year|jahr"), one(r"doy|day_?of_?year|yday|day")
    if year and number and year != number:
        yield from _years(year, number, one(r"sod|sec|ms"))


def _in_parts(table: Table):
    """A date and a time of day with a column for each part, in this order."""
    columns, found = [str(c) for c in table.data], []
    for words in _PARTS:
        fits = (c for c in columns if re.fullmatch(rf"({words})s?", c.strip().lower()))
        found.append(next((c for c in fits if c not in found), None))
    if None not in found:
        for form in _OF_PARTS:
            yield {"time": found, "time_format": form, "zone": "UTC"}, 5.5, (UNSTATED_ZONE,)


def _weeks(week: str, second: str):
    for tick in ("s", "ms"):
        keys = {"time": [week, second], "time_format": ["gps_weeks", tick]}
        likely = (0.5 if tick == "s" else 0.0) + (1.0 if tick == "ms" and "ms" in second else 0.0)
        yield keys, 6.0 + likely, ()
        for start in ROLLOVERS:
            guess = f"its weeks count from {start[:10]}"
            yield keys | {"epoch": start}, 4.0 + likely, (guess,)


def _years(year: str, number: str, second: str | None):
    keys = {"time": [year, number], "time_format": ["year", "day_of_year"], "zone": "UTC"}
    yield keys, 5.0, (UNSTATED_ZONE,)
    if second:
        for tick in ("s", "ms"):
            more = {"time": [year, number, second], "time_format": ["year", "day_of_year", tick]}
            yield keys | more, 5.5 - (tick != "s"), (UNSTATED_ZONE,)


def _counts(column: str):
    """All counts, the likelier the more of the column's name says so."""
    name = column.lower()
    for k, (form, epoch) in enumerate(DATES.items()):
        stated = _STATED * bool(re.search(DATE_WORDS[form], name))
        keys = {"time": column, "time_format": form}
        keys, guesses = (keys | {"zone": "UTC"}, (UNSTATED_ZONE,)) if epoch.is_local else (keys, ())
        yield keys, 1.5 - 0.1 * k + stated, (f"its numbers are {form}", *guesses)
    for k, (origin, about) in enumerate(ORIGINS.items()):
        if not about.start:
            continue
        stated = _STATED * bool(re.search(about.words, name))
        for tick, usual in _LIKELY.items():
            ticked = 0.5 * bool(re.search(rf"(?<![a-z]){tick}(?![a-z])", name))
            form = f"{origin}_{tick}"
            score = 1.5 - 0.1 * k + stated + ticked + usual
            yield {"time": column, "time_format": form}, score, (f"its numbers are {form}",)
    if re.search(r"doy|day|y+d+", name):
        keys = {"time": column, "time_format": _YEAR_DAY, "zone": "UTC"}
        yield keys, _STATED, (f"its numbers are {_YEAR_DAY}", UNSTATED_ZONE)
