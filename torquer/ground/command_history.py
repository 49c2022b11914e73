"""What became of commands: found by command, state, author and span, as JSON or CSV."""

from __future__ import annotations

import csv
import io
import json
import sqlite3
from collections.abc import Iterable

from pydantic import Field, model_validator

from torquer.base.dates import iso_ms
from torquer.base.spec import Spec
from torquer.ground.archive import quote_names
from torquer.ground.command_states import State
from torquer.ground.commands import COLUMNS, as_shown
from torquer.ground.pieces import plain_cell
from torquer.ground.span import refuse_reversed

#: Columns of a table of commands; times are those of the ground but for `execute`, the satellite's.
TIMES = ("made", "sent", "received", "answered", "execute")
_FIELDS = ("id", "request", "command", "values", "state", "reason", "made_by")
_LAST_MS = 2**53
#: Most commands of one answer: more would keep a ground busy for seconds.
MOST = 20_000


class Wanted(Spec):
    """Which commands; what is left out is any."""

    command: str = Field(default="", max_length=100)
    """Name of the command, or a part of it."""
    state: State | None = None
    """What became of it."""
    by: str = Field(default="", max_length=100)
    """Part of who ordered it, as stated."""
    start: int = Field(default=-_LAST_MS, ge=-_LAST_MS, le=_LAST_MS)
    """First time at which it was made [ms since 1970]."""
    end: int = Field(default=_LAST_MS, ge=-_LAST_MS, le=_LAST_MS)
    """Last time at which it was made [ms since 1970]."""
    before: int = Field(default=_LAST_MS, ge=0, le=_LAST_MS)
    """Number that its own must be below: for the next ones of a long list."""
    size: int = Field(default=1000, ge=1, le=MOST)
    """How many at most, the last ones."""
    _in_order = model_validator(mode="after")(refuse_reversed)


def find_commands(
    db: sqlite3.Connection | None, wanted: Wanted, newer: Iterable[dict] = ()
) -> list[dict]:
    """Commands of an archive as users see them, newest first; `newer`: as they are by now.

    `db` None: only these.
    """
    found = {} if db is None else {each["id"]: each for each in _stored(db, wanted)}
    for each in newer:
        found.pop(each["id"], None)
        if _is_wanted(each, wanted):
            found[each["id"]] = each
    return [found[number] for number in sorted(found, reverse=True)[: wanted.size]]


def _is_wanted(each: dict, wanted: Wanted) -> bool:
    """The same question as that of `_stored`."""
    return (
        wanted.command.lower() in each["command"].lower()
        and wanted.by.lower() in each["made_by"].lower()
        and wanted.state in (None, each["state"])
        and wanted.start <= each["made_ms"] <= wanted.end
        and each["id"] < wanted.before
    )


def _stored(db: sqlite3.Connection, wanted: Wanted) -> list[dict]:
    rows = db.execute(
        f"SELECT {quote_names(COLUMNS)} FROM _commands WHERE instr(lower(command), lower(?)) "
        "AND instr(lower(made_by), lower(?)) AND (? IS NULL OR state = ?) "
        "AND made_ms BETWEEN ? AND ? AND id < ? ORDER BY id DESC LIMIT ?",
        (
            *(wanted.command, wanted.by, wanted.state, wanted.state),
            *(wanted.start, wanted.end, wanted.before, wanted.size),
        ),
    )
    return [as_shown(dict(zip(COLUMNS, row, strict=True))) for row in rows]


def commands_csv(commands: Iterable[dict]) -> str:
    """A table of commands as CSV, times as ISO 8601; no cell is a formula."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*_FIELDS, *TIMES])
    for each in commands:
        cells = [each[name] for name in _FIELDS] + [iso_ms(each[f"{name}_ms"]) for name in TIMES]
        writer.writerow([_cell(value) for value in cells])
    return text.getvalue()


def _cell(value) -> str | int:
    if isinstance(value, int):
        return value
    return plain_cell(json.dumps(value) if isinstance(value, dict) else str(value))
