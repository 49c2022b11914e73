"""Alarms and the out-of-limits log as an archive has them; both also of one that is not written."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from typing import Any

from pydantic import TypeAdapter, ValidationError

from torquer.ground.alarm import Alarm, Shelf

#: Columns of the out-of-limits log: fields of `Violation`.
COLUMNS = (
    "id", "key", "severity", "limit", "mode", "start_ms", "end_ms", "received_ms", "extreme",
    "count", "is_over", "acknowledged_by", "acknowledged_ms", "comment",
)  # fmt: skip
_NAMES = ", ".join(f'"{name}"' for name in COLUMNS)
_ALARM, _SHELF = TypeAdapter(Alarm | None), TypeAdapter(Shelf | None)


def stored_alarms(db: sqlite3.Connection) -> Iterator[tuple[str, Alarm | None, Shelf | None]]:
    """(key, alarm, shelf) of each point that has one; none of an archive without such tables."""
    for key, alarm, shelf in _rows(db, "SELECT key, alarm, shelf FROM _alarms ORDER BY key"):
        try:
            yield key, _ALARM.validate_json(alarm or "null"), _SHELF.validate_json(shelf or "null")
        except ValidationError:
            continue  # of another version: it is raised again where it lasts


def stored_violations(
    db: sqlite3.Connection,
    start_ms: int = -(2**53),
    end_ms: int = 2**53,
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
    found = [dict(zip(COLUMNS, row, strict=True)) for row in rows]
    return [each | {"is_over": bool(each["is_over"])} for each in found]


def _rows(db: sqlite3.Connection, statement: str, *values) -> list[tuple]:
    try:
        return db.execute(statement, values).fetchall()
    except sqlite3.OperationalError as error:
        if "no such table" in str(error):
            return []
        raise
