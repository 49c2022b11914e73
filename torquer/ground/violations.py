"""Alarms and the out-of-limits log as an archive has them; both also of one that is not written."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import TypeAdapter, ValidationError

from torquer.ground.alarm import Alarm, Shelf, Violation
from torquer.ground.archive import ArchiveError, read_only

_LAST_MS = 2**53

#: Most violations of an answer.
MOST = 20_000
#: Columns of the out-of-limits log.
COLUMNS = tuple(each.name for each in fields(Violation))
_NAMES = ", ".join(f'"{name}"' for name in COLUMNS)
_ALARM, _SHELF = TypeAdapter(Alarm | None), TypeAdapter(Shelf | None)


class AlarmRecord(NamedTuple):
    """What an archive has of alarms: those that are there with their shelves, and violations."""

    alarms: list[dict[str, Any]]
    violations: list[dict[str, Any]]


def read_alarms(
    archive: Path | str, start_ms: int = -_LAST_MS, end_ms: int = _LAST_MS, size: int = 1000
) -> AlarmRecord:
    """Alarms and the last violations of an archive, also while it is written (a second late).

    `ArchiveError` with one line for a file that is none.
    """
    with closing(read_only(archive)) as db:
        try:
            alarms = [describe(*each) for each in stored_alarms(db)]
            return AlarmRecord(alarms, stored_violations(db, start_ms, end_ms, size))
        except sqlite3.Error as error:
            raise ArchiveError(f"archive: must be readable; received {archive}: {error}") from None


def describe(key: str, alarm: Alarm | None, shelf: Shelf | None) -> dict[str, Any]:
    """An alarm as it is told; one that is over, and on no shelf, has its key only."""
    found: dict[str, Any] = {"key": key}
    if alarm is not None:
        found |= asdict(alarm) | {"state": alarm.state}
    if shelf is not None:
        found["shelf"] = asdict(shelf)
    return found


def stored_alarms(db: sqlite3.Connection) -> Iterator[tuple[str, Alarm | None, Shelf | None]]:
    """(key, alarm, shelf) of each point that has one; none of an archive without such tables."""
    for key, alarm, shelf in _rows(db, "SELECT key, alarm, shelf FROM _alarms ORDER BY key"):
        try:
            yield key, _ALARM.validate_json(alarm or "null"), _SHELF.validate_json(shelf or "null")
        except ValidationError:
            continue  # of another version: it is raised again where it lasts


def stored_violations(
    db: sqlite3.Connection,
    start_ms: int = -_LAST_MS,
    end_ms: int = _LAST_MS,
    size: int = 1000,
    lasting: bool = False,
) -> list[dict[str, Any]]:
    """The last violations within a span of on-board time, newest first; `lasting`: not yet over."""
    rows = _rows(
        db,
        f"SELECT {_NAMES} FROM _violations WHERE end_ms >= ? AND start_ms <= ? AND is_over <= ? "
        "ORDER BY id DESC LIMIT ?",
        *(start_ms, end_ms, 0 if lasting else 1, size),
    )
    return [violation_of(row) for row in rows]


def violation_of(row: tuple) -> dict[str, Any]:
    """A violation of a row of the archive, or of one that waits for it."""
    found = dict(zip(COLUMNS, row, strict=True))
    return found | {"is_over": bool(found["is_over"])}


def _rows(db: sqlite3.Connection, statement: str, *values) -> list[tuple]:
    try:
        return db.execute(statement, values).fetchall()
    except sqlite3.OperationalError as error:
        if "no such table" in str(error):
            return []
        raise
