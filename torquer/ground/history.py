"""The last rows of an archive within an interval, and the log of satellite and ground."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.reasons import Reason, describe_code
from torquer.ground.archive import quote_names
from torquer.ground.bins import TIMES

#: What telemetry's entries of the error log are made of.
_EVENT = ("module_id", "code", "argument")
#: Entries that are no failures.
_HARMLESS = {Reason.BOOTED, Reason.READY, Reason.MODE_CHANGED, Reason.TIME_SET, Reason.REBOOT}


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
    db: sqlite3.Connection | None,
    dictionary: Dictionary,
    start_ms: int,
    end_ms: int,
    size: int = 500,
    waiting: Sequence[tuple] = (),
) -> list[dict]:
    """The last entries of satellite and ground in an interval of on-board time.

    In the order in which they were received, those of recordings by on-board time. `waiting`:
    entries of the ground that are not in the archive yet; `db` None: only these.
    """
    found = [ground_entry(*entry) for entry in waiting if start_ms <= entry[1] <= end_ms][::-1]
    satellites: list[dict] = []
    if db is not None:
        found += islice(entries_of_ground(db, start_ms, end_ms), size)
        satellites += islice(entries_of_satellite(db, dictionary, start_ms, end_ms), size)
    once = {each["id"]: each for each in found}  # newest first
    return sorted([*once.values(), *satellites][::-1], key=reception)[-size:]


def entries_of_ground(db: sqlite3.Connection, start_ms: int, end_ms: int) -> Iterator[dict]:
    """The ground's own entries in an interval of on-board time, newest first."""
    for entry in db.execute(
        "SELECT id, time_ms, made_ms, severity, text FROM _log WHERE time_ms BETWEEN ? AND ? "
        "ORDER BY id DESC",
        (start_ms, end_ms),
    ):
        yield ground_entry(*entry)


def entries_of_satellite(
    db: sqlite3.Connection, dictionary: Dictionary, start_ms: int, end_ms: int
) -> Iterator[dict]:
    """The satellite's entries in an interval of on-board time, newest first."""
    if not has_events(dictionary):
        return
    for time_ms, received_ms, digest, *values in db.execute(
        f"SELECT _time_ms, _received_ms, _digest, {', '.join(_EVENT)} FROM event "
        "WHERE _time_ms BETWEEN ? AND ? ORDER BY _time_ms DESC",
        (start_ms, end_ms),
    ):
        named = dict(zip(_EVENT, values, strict=True))
        yield satellite_entry(dictionary, digest, time_ms, received_ms, named)


def reception(entry: dict) -> int:
    """When an entry was received; of a recording, its on-board time."""
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
