"""Time stamps of rows: from counts and texts to UTC."""

from __future__ import annotations

import re
from email.utils import parsedate_to_datetime
from typing import NamedTuple

import numpy as np

from torquer.base.time import parse_utc
from torquer.ground.telemetry.reading.cells import NumberCells, cell_texts
from torquer.ground.telemetry.reading.epochs import count_instants, is_clock, is_counted, is_local
from torquer.ground.telemetry.reading.zones import parse_zone, utc_of_clock

#: What states UTC at the end of a stamp, and an offset after a time of day.
_UNIVERSAL = r"\s*(?:Z|GMT|UTC|UT)$"
_OFFSET = r"[T: ]\d\d(?:\d\d){0,2}(?:[.,]\d+)?\s*[+-]\d\d(?::?\d\d)?$"
_ABBREVIATION = r"(?<=[\d ])\s*([A-Z]{2,5})$"
#: The day that a time without one has.
_STRPTIME_DAY = np.datetime64("1900-01-01", "D")
#: Rows by which the kind of the stamps is told.
_SOME = 1000
#: Part of the stamps that may differ from the others: these are left out.
_FEW = 0.05
#: The day of the year in ISO 8601, which pandas does not read.
_ORDINAL = r"\d{4}-\d{3}(?!\d)"
_RFC_2822 = r"(?:[A-Z][a-z]{2}, )?\d{1,2} [A-Z][a-z]{2} \d{4} "
_SECOND_60 = r"\d:\d\d:60(?!\d)"


class Stamps(NamedTuple):
    """Stamps of rows: UTC (datetime64[ns], NaT where a row has none that can be read) [n], the
    texts as they were, how many are leap seconds, and whether they state their own zone."""

    utc: np.ndarray
    given: list[str]
    leap_seconds: int = 0
    zone_is_stated: bool = False


def count_stamps(columns: list[NumberCells], formats: list[str], epoch, zone) -> Stamps:
    """Stamps of numbers that count from an instant."""
    instants = count_instants([each.values for each in columns], formats, epoch)
    given = [f"{each:.15g}" for each in columns[0].values]
    if is_local(formats[0]):
        return Stamps(utc_of_clock(instants, _stated(zone, given)), given)
    if zone is not None:
        raise ValueError(
            f"zone: must not be given, as {formats[0]} counts from an instant; received {zone}"
        )
    return Stamps(instants, given)


def _stated(zone: str | None, given) -> str:
    if zone is None:
        raise ValueError(
            "zone: must be given, as the stamps state none; received none for "
            f"{next(iter(given), '')!r}"
        )
    return zone


def date_stamps(column, is_utc: bool, zone: str | None) -> Stamps:
    """Stamps of a column of dates; `is_utc`: by the format of the file."""
    if column.dt.tz is not None:
        _refuse_zone(zone)
        utc = column.dt.tz_convert("UTC").dt.tz_localize(None).to_numpy("datetime64[ns]")
        return Stamps(utc, [str(each) for each in column], zone_is_stated=True)
    clock, given = column.to_numpy("datetime64[ns]"), [str(each) for each in column]
    if is_utc and zone is None:
        return Stamps(clock, given)
    return Stamps(utc_of_clock(clock, _stated(zone, given)), given)


def text_stamps(columns: list, form: str, zone: str | None, day=None) -> Stamps:
    """Stamps of texts in columns [n] that belong together, by a format of `strptime` or 'iso'.

    `day` (datetime64[D]): that of the first row, for a format without a date.
    'iso' reads RFC 2822 ("Sun, 04 Mar 2012 10:32:23 GMT") and days of the year (2012-064), too.
    """
    parts = [cell_texts(each) for each in columns]
    text = parts[0].str.cat(parts[1:], sep=" ").str.strip()
    given = text.tolist()
    some = text.head(_SOME)
    if form == "iso" and some.str.fullmatch(r"[-+]?\d+(\.\d*)?(e[-+]?\d+)?").mean() > 0.5:
        raise ValueError(
            "time_format: must be given for stamps that are numbers, such as 'unix_s' "
            f"(`torquer explain mapping`); received none for {given[0]!r}"
        )
    inserted, plain = np.zeros(len(text), dtype=bool), text
    if text.str.contains(":60", regex=False).any():
        inserted = text.str.contains(_SECOND_60, regex=True).to_numpy()
        plain = text.str.replace(r"(\d:\d\d):60(?!\d)", r"\1:59", regex=True)
    if form == "iso" and some.str.match(_RFC_2822).mean() > 0.5:
        _refuse_zone(zone)
        return Stamps(_email_dates(plain), given, zone_is_stated=True)
    states = _states_zone(plain, form, given)
    utc = _utc_of_texts(plain, form, zone, given, day, states)
    is_stated = bool(states.mean() > 0.5) or "%z" in form
    return Stamps(utc, given, _shift_leaps(utc, inserted), is_stated)


def _states_zone(text, form: str, given: list[str]) -> np.ndarray:
    """Which texts [n] state UTC or an offset; ValueError where some do and some do not."""
    is_universal = text.str.contains(_UNIVERSAL, regex=True).to_numpy()
    states = (
        is_universal
        if is_universal.all()
        else is_universal | text.str.contains(_OFFSET, regex=True).to_numpy()
    )
    if form != "iso" and re.search(_UNIVERSAL, form):  # the format has it as a letter
        states = np.zeros(len(text), dtype=bool)
    if _FEW < states.mean() < 1.0 - _FEW:
        raise ValueError(
            "zone: must be stated by all stamps or by none; received "
            f"{given[int(np.argmin(states))]!r} beside {given[int(np.argmax(states))]!r}"
        )
    return states


def _utc_of_texts(text, form: str, zone: str | None, given: list[str], day, states) -> np.ndarray:
    """UTC of texts; NaT for those that state an offset where most do not, or the reverse."""
    if states.mean() > 0.5 or "%z" in form:
        _refuse_zone(zone)
        sign = "Z" if "%z" in form else ""
        found = _instants(text.str.replace(_UNIVERSAL, sign, regex=True), form)
        found[~states & ("%z" not in form)] = np.datetime64("NaT")
        return found
    bare, abbreviations = _without_abbreviation(text, form, zone)
    clock = _instants(bare, form)
    if day is not None:
        clock = _on_days(clock, day)
    clock[states] = np.datetime64("NaT")
    if np.isnat(clock).mean() > 0.5:
        return clock
    return utc_of_clock(clock, _stated(zone, given), abbreviations)


def _refuse_zone(zone) -> None:
    if zone is not None:
        raise ValueError(f"zone: must not be given, as the stamps state their own; received {zone}")


def _without_abbreviation(text, form: str, zone: str | None):
    """Stamps without the abbreviations of a zone that follow them, and these; None if none do."""
    found = text.str.extract(_ABBREVIATION, expand=False)
    if found.notna().mean() < 0.5 or "%p" in form or "%Z" in form:
        return text, None
    if zone is None:
        raise ValueError(
            f"zone: must name the zone of {found.dropna().iloc[0]!r}, such as 'Europe/Moscow', as "
            f"abbreviations have several meanings; received none for {text.iloc[0]!r}"
        )
    return text.str.replace(_ABBREVIATION, "", regex=True), found.fillna("").to_numpy(dtype=object)


def _instants(text, form: str) -> np.ndarray:
    """Instants of texts, in UTC if they state an offset; NaT for what does not have the format."""
    import pandas as pd

    if form == "iso":
        form = "ISO8601"
        if text.str.contains(",", regex=False).any():
            text = text.str.replace(r"(?<=:\d\d),(?=\d)", ".", regex=True)
        if text.head(_SOME).str.match(_ORDINAL).mean() > 0.5:
            text, form = _calendar(text), "ISO8601"
        if text.str.contains(r" [+-]\d| Z$", regex=True).any():
            text = text.str.replace(r"(?<=\d) (?=[+-]\d|Z$)", "", regex=True)
    try:
        found = pd.to_datetime(text, format=form, errors="coerce", utc=True)
        other = form.replace("%S.%f", "%S") if "%f" in form else form.replace("%S", "%S.%f")
        if found.isna().any() and other != form:  # whole seconds among others are written so
            found = found.fillna(pd.to_datetime(text, format=other, errors="coerce", utc=True))
    except ValueError:
        raise ValueError(
            "time_format: must be 'iso', a count such as 'unix_s' or a format of strptime such as "
            f"'%d.%m.%Y %H:%M:%S'; received {form!r}"
        ) from None
    return np.array(found.dt.tz_localize(None), dtype="datetime64[ns]")


def _on_days(clock: np.ndarray, day: np.datetime64) -> np.ndarray:
    """Times of day as instants from a day on: one that goes back by half a day is of the next."""
    known = np.flatnonzero(~np.isnat(clock))
    passed = np.cumsum(np.append(False, np.diff(clock[known]) < -np.timedelta64(12, "h")))
    found = clock.copy()
    found[known] += passed * np.timedelta64(1, "D") + (day - _STRPTIME_DAY)
    return found


def _calendar(text):
    """ISO texts with a day of the year, 2012-064T10:32:23, with its date instead."""
    import pandas as pd

    days = pd.to_datetime(text.str[:8], format="%Y-%j", errors="coerce")
    return days.dt.strftime("%Y-%m-%d") + text.str[8:]


def _email_dates(text) -> np.ndarray:
    found = np.full(len(text), np.datetime64("NaT"), dtype="datetime64[ns]")
    for row, each in enumerate(text):
        try:
            moment = parsedate_to_datetime(each)
        except (ValueError, TypeError):
            continue
        if moment.tzinfo is not None:
            found[row] = np.datetime64(moment.timestamp().__round__(), "s")
    return found


def _shift_leaps(utc: np.ndarray, inserted: np.ndarray) -> int:
    """Move stamps of second 60, read as 59, by a second where UTC has one; else they are none."""
    rows = np.flatnonzero(inserted & ~np.isnat(utc))
    for row in rows:
        second = str(utc[row].astype("datetime64[s]"))
        try:
            parse_utc(f"{second[:-2]}60Z")
            utc[row] += np.timedelta64(1, "s")
        except ValueError:
            utc[row] = np.datetime64("NaT")
    return int(np.sum(~np.isnat(utc[rows])))


def read_stamps(table, mapping, numbers) -> Stamps:
    """The stamps of a table by a mapping; `numbers(column)`: reads the cells of a column."""
    columns, formats = mapping.time_columns, mapping.time_formats
    if is_counted(formats[0]):
        cells = [numbers(each) for each in columns]
        epoch = None if mapping.epoch is None else mapping.epoch.replace(tzinfo=None).isoformat()
        return count_stamps(cells, formats, epoch, mapping.zone)
    series = [table.data[each] for each in columns]
    if hasattr(series[0], "dt") and len(series) == 1 and series[0].dtype.kind == "M":
        return date_stamps(series[0], columns[0] in table.is_utc, mapping.zone)
    if mapping.time_formats[0] not in ("iso",) and "%" not in mapping.time_formats[0]:
        raise ValueError(
            "time_format: must be 'iso', a count such as 'unix_s', or a format of strptime such as "
            f"'%d.%m.%Y %H:%M:%S'; received {mapping.time_formats[0]!r}"
        )
    day = _first_day(mapping) if is_clock(formats[0]) else None
    return text_stamps(series, formats[0], mapping.zone, day)


def _first_day(mapping) -> np.datetime64 | None:
    """The day of the first stamp in the zone of the stamps."""
    if mapping.epoch is None:
        return None
    return np.datetime64(mapping.epoch.astimezone(parse_zone(mapping.zone or "UTC")).date(), "D")
