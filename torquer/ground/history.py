"""Rows of an archive within an interval, thinned where there are more than can be drawn."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from typing import Any

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.reasons import Reason, describe_code
from torquer.ground.archive import quote_names

#: Columns of time that an interval may be of.
TIMES = {"time": "_time_ms", "received": "_received_ms"}
#: What telemetry's entries of the error log are made of.
_EVENT = ("module_id", "code", "argument")
#: Entries that are no failures.
_HARMLESS = {Reason.BOOTED, Reason.READY, Reason.MODE_CHANGED, Reason.TIME_SET, Reason.REBOOT}


def points(
    db: sqlite3.Connection,
    packet: str,
    number: str,
    start_ms: int,
    end_ms: int,
    size: int,
    by: str = "time",
) -> list[tuple]:
    """(time_ms, received_ms, value, quality) of a number from start to end, in order of time.

    Up to `size` rows as they are. Of more, the least and the greatest of each bin, so that no peak
    is lost: at most `size` in all. Names must be of the dictionary, `by` of `TIMES`.
    """
    at, value = TIMES[by], f'"{number}"'
    rows = db.execute(
        f'SELECT _time_ms, _received_ms, {value}, _quality FROM "{packet}" '
        f"WHERE {at} BETWEEN ? AND ? ORDER BY {at} LIMIT ?",
        (start_ms, end_ms, size + 1),
    ).fetchall()
    if len(rows) <= size:
        return rows
    # SQLite takes the other columns from the row that has the least or greatest value; a query for
    # each bin walks along the table, where GROUP BY would sort it: half the time
    ends = [
        f'SELECT _time_ms, _received_ms, {end}({value}), _quality FROM "{packet}" '
        f"WHERE {at} BETWEEN ? AND ? AND {value} IS NOT NULL"
        for end in ("min", "max")
    ]
    width, found = max(1, -(-2 * (end_ms - start_ms + 1) // size)), []
    for first in range(start_ms, end_ms + 1, width):
        span = (first, min(first + width - 1, end_ms))
        pair = {db.execute(end, span).fetchone() for end in ends}
        found += sorted((row for row in pair if row[0] is not None), key=lambda row: row[0])
    return found


def latest(
    db: sqlite3.Connection,
    packet: str,
    numbers: Sequence[str],
    start_ms: int,
    end_ms: int,
    size: int = 1,
    by: str = "time",
) -> list[tuple]:
    """(time_ms, received_ms, quality, value of each number) of the last rows, in order of time.

    Up to `size` rows from start to end. Names must be of the dictionary, `by` of `TIMES`.
    """
    at = TIMES[by]
    rows = db.execute(
        f'SELECT _time_ms, _received_ms, _quality, {quote_names(numbers)} FROM "{packet}" '
        f"WHERE {at} BETWEEN ? AND ? ORDER BY {at} DESC LIMIT ?",
        (start_ms, end_ms, size),
    )
    return rows.fetchall()[::-1]


def log(
    db: sqlite3.Connection, dictionary: Dictionary, start_ms: int, end_ms: int, size: int = 500
) -> list[dict]:
    """The last entries of satellite and ground in an interval of on-board time.

    In the order in which they were received, those of recordings by on-board time.
    """
    found = [
        ground_entry(*entry)
        for entry in db.execute(
            "SELECT id, time_ms, made_ms, severity, text FROM _log WHERE time_ms BETWEEN ? AND ? "
            "ORDER BY id DESC LIMIT ?",
            (start_ms, end_ms, size),
        )
    ]
    if has_events(dictionary):
        found += [
            satellite_entry(
                dictionary, digest, time_ms, received_ms, dict(zip(_EVENT, values, strict=True))
            )
            for time_ms, received_ms, digest, *values in db.execute(
                f"SELECT _time_ms, _received_ms, _digest, {', '.join(_EVENT)} FROM event "
                "WHERE _time_ms BETWEEN ? AND ? ORDER BY _time_ms DESC LIMIT ?",
                (start_ms, end_ms, size),
            )
        ]
    return sorted(found, key=_reception)[-size:]


def _reception(entry: dict) -> int:
    return entry["time_ms"] if entry["received_ms"] is None else entry["received_ms"]


def has_events(dictionary: Dictionary) -> bool:
    """Whether the packets have entries of an error log."""
    packet = dictionary.down.get("event")
    return packet is not None and set(_EVENT) <= set(packet.names)


def ground_entry(number: int, time_ms: int, made_ms: int, severity: str, text: str) -> dict:
    """An entry of the ground's log."""
    return {
        "id": f"g{number}",
        "time_ms": time_ms,
        "received_ms": made_ms,
        "source": "ground",
        "severity": severity,
        "text": text,
    }


def satellite_entry(
    dictionary: Dictionary,
    digest: int,
    time_ms: int,
    received_ms: int | None,
    values: Mapping[str, Any],
) -> dict:
    """An entry of the satellite's error log in words; `values`: of the packet `event`, by name."""
    number, code, argument = (values[name] for name in _EVENT)
    modules = {id_: name for name, id_ in dictionary.modules.items()}
    doc, _, what = describe_code(code).partition("; argument: ")
    if argument or what:
        doc += f"; {what or 'argument'}: {argument}"
    return {
        "id": f"s{digest}",
        "time_ms": time_ms,
        "received_ms": received_ms,
        "source": "satellite",
        "severity": "info" if code in _HARMLESS else "warning",
        "text": f"{modules.get(number, number)}: {doc}",
    }
