"""From the time of a zone's clock to UTC, its changes included."""

from __future__ import annotations

from datetime import UTC, datetime
from zoneinfo import ZoneInfo

import numpy as np

#: A row follows the one before it if it comes within so many times the cadence.
_FOLLOWS = 1.5


def parse_zone(text: str):
    """The zone of a text: 'UTC', '+04:00' or 'Europe/Moscow'. ValueError for any other."""
    if text in ("UTC", "Z"):
        return UTC
    try:
        if text[:1] in "+-":
            return datetime.fromisoformat(f"2000-01-01T00:00:00{text}").tzinfo
        return ZoneInfo(text)
    except (ValueError, OSError, KeyError):
        raise ValueError(
            "must be 'UTC', an offset such as '+04:00', or a name such as 'Europe/Moscow'; "
            f"received {text!r}"
        ) from None


def utc_of_clock(clock: np.ndarray, zone: str, abbreviations: np.ndarray | None = None):
    """UTC (datetime64[ns], NaT for none) of the clock of a zone (datetime64[ns]) [n].

    In the hour that a clock shows twice the order of the rows decides, or an abbreviation beside
    the stamps [n]. ValueError where neither does, and for times that the clock never shows.
    """
    import pandas as pd

    where = parse_zone(zone)
    stamps = pd.DatetimeIndex(clock).tz_localize(None)

    def on(is_first: bool) -> np.ndarray:
        first = np.full(len(stamps), is_first)
        found = stamps.tz_localize(where, ambiguous=first, nonexistent="NaT")
        in_utc = found.tz_convert("UTC").tz_localize(None)
        return np.array(in_utc, dtype="datetime64[ns]")

    early, late = on(True), on(False)
    _check_shown(clock, early, zone)
    if abbreviations is not None:
        return _by_abbreviation(early, late, abbreviations, where, zone)
    _decide_by_order(clock, early, late, zone)
    return early


def _check_shown(clock, found, zone: str) -> None:
    never = np.isnat(found) & ~np.isnat(clock)
    if never.any():
        raise ValueError(
            "zone: must be one in which every stamp is an instant, such as the offset of a clock "
            f"that is not put forward; received {zone}, where {_text(clock[never][0])} is none"
        )


def _text(stamp) -> str:
    return str(np.datetime_as_string(stamp, unit="s")).replace("T", " ")


def _by_abbreviation(early, late, abbreviations, where, zone: str):
    import pandas as pd

    def names(stamps):
        in_zone = pd.DatetimeIndex(stamps).tz_localize("UTC").tz_convert(where)
        return np.array([each.tzname() if each is not pd.NaT else "" for each in in_zone])

    known = ~np.isnat(early)
    is_early = names(early) == abbreviations
    fits = is_early | (names(late) == abbreviations) | ~known
    if not fits.all():
        wrong = int(np.flatnonzero(~fits)[0])
        raise ValueError(
            f"zone: must be one whose clock is called {abbreviations[wrong]} in row {wrong + 1}; "
            f"received {zone}"
        )
    return np.where(is_early, early, late)


def _decide_by_order(clock, early, late, zone: str) -> None:
    """Set rows of `early` to `late` that are after the change in an hour that comes twice."""
    twice = (early != late) & ~np.isnat(early)
    if not twice.any():
        return
    rows = np.flatnonzero(~np.isnat(early))
    steps = np.diff(early[rows])
    ahead = steps[steps > np.timedelta64(0)]
    cadence = np.median(ahead) if len(ahead) else np.timedelta64(0)
    inside = np.flatnonzero(twice[rows])
    for run in np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1):
        begin = _first_late(early[rows], late[rows], run, cadence)
        if begin is None:
            raise ValueError(
                "zone: must be an offset such as '+01:00' where the order of the rows does not "
                f"tell an hour that comes twice; received {zone} with {_text(clock[rows[run[0]]])}"
            )
        early[rows[begin : run[-1] + 1]] = late[rows[begin : run[-1] + 1]]


def _first_late(early, late, run, cadence):
    """Number of the first row of a run after the change of the clock; None if none can be told."""
    back = np.flatnonzero(np.diff(early[run]) < np.timedelta64(0))
    if len(back):
        return run[back[0] + 1] if len(back) == 1 else None
    first, last = run[0], run[-1]
    follows = first > 0 and early[first] - early[first - 1] <= _FOLLOWS * cadence
    leads = last + 1 < len(early) and early[last + 1] - late[last] <= _FOLLOWS * cadence
    if follows != leads:
        return last + 1 if follows else first
    return None
