"""A selection of the archive as CSV or Parquet, in pieces: a packet, some numbers, an interval.

The columns are those of `export`. Rows come a part at a time, each part by a question of its own:
whoever reads slowly holds back neither memory nor the archive's journal.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from datetime import UTC, datetime
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

from pydantic import Field, model_validator

from torquer.base.explain import ScenarioError
from torquer.base.spec import Spec
from torquer.flight.packets.dictionary import Packet
from torquer.flight.packets.mistakes import quote_value
from torquer.ground.archive import quote_names, read_only
from torquer.ground.columns import FIRST_MS, LAST_MS, Column, as_numbers, fitting, packet_columns
from torquer.ground.pieces import csv_bytes, parquet_bytes
from torquer.ground.span import refuse_reversed

#: Rows of a part.
_PART = 8192
#: Columns by which rows are found, in order, where the interval is of the first.
_KEYS = {
    "time": ("_time_ms", "_digest"),
    "received": ("_received_ms", "_time_ms", "_digest"),
}
#: Below all that a column of a key can have.
_LEAST = -(2**63)


class Selected(Spec):
    """What is selected of a packet."""

    start: int = Field(default=FIRST_MS, ge=FIRST_MS, le=LAST_MS)
    """First time [ms since 1970]."""
    end: int = Field(default=LAST_MS, ge=FIRST_MS, le=LAST_MS)
    """Last time [ms since 1970]."""
    by: str = Field(default="time", pattern="^(time|received)$")
    """Which time it is."""
    numbers: str = Field(default="", max_length=65_536)
    """Names of numbers with commas between them [all]."""
    format: str = Field(default="csv", pattern="^(csv|parquet)$")
    """Format of the file."""
    _in_order = model_validator(mode="after")(refuse_reversed)


class _Kind(NamedTuple):
    """A format: how it is written, what it is called in HTTP."""

    pieces: Callable[[dict, list[Column], Iterable], Iterator[bytes]]
    media_type: str


KINDS = {
    "csv": _Kind(csv_bytes, "text/csv; charset=utf-8"),
    "parquet": _Kind(parquet_bytes, "application/vnd.apache.parquet"),
}


def has_parquet() -> bool:
    """Whether Parquet can be written here."""
    return importlib.util.find_spec("pyarrow") is not None


def check_selection(packet: Packet, selected: Selected) -> list[Column]:
    """The columns of a selection; `ScenarioError` with one line for what cannot be selected."""
    if selected.format == "parquet" and not has_parquet():
        raise ScenarioError("format: must be csv where pyarrow is missing; received parquet")
    numbers = [name for name in selected.numbers.split(",") if name]
    for name in numbers:
        if name not in packet.names:
            raise ScenarioError(
                f"numbers: must be of packet {packet.name}; received {quote_value(name)}"
            )
    return [
        column
        for column in packet_columns(packet)
        if column.source.startswith("_") or not numbers or column.source in numbers
    ]


def file_name(satellite: str, packet: Packet, selected: Selected) -> str:
    """Name of the file: letters, digits, `_`, `-` and a dot, whatever was asked."""
    known = selected.start > FIRST_MS and selected.end < LAST_MS
    span = f"_{_stamp(selected.start)}_{_stamp(selected.end)}" if known else ""
    return f"{satellite}_{packet.name}{span}.{selected.format}"


def selection(
    archive: Path, satellite: str, packet: Packet, columns: list[Column], selected: Selected
) -> Iterator[bytes]:
    """The file of a selection, in pieces; `satellite`: its name, which Parquet keeps.

    The first part is read at once: ArchiveError and sqlite3.Error for what cannot be read.
    """
    about = {"satellite": satellite, "packet": packet.name, "description": packet.description}
    parts = _parts(archive, packet, columns, selected)
    first = [*islice(parts, 1)]
    return KINDS[selected.format].pieces(about, columns, chain(first, parts))


def _parts(
    archive: Path, packet: Packet, columns: list[Column], selected: Selected
) -> Iterator[list]:
    """The columns of the rows, some thousand rows at a time, with values that fit."""
    key = _KEYS[selected.by]
    names, marks = quote_names(key), ", ".join("?" * len(key))
    statement = (
        f"SELECT {names}, {quote_names([column.source for column in columns])} "
        f'FROM "{packet.name}" WHERE {key[0]} BETWEEN ? AND ? AND ({names}) > ({marks}) '
        f"ORDER BY {names} LIMIT {_PART}"
    )
    last: tuple = (selected.start, *[_LEAST] * (len(key) - 1))
    while True:
        with closing(read_only(archive)) as db:
            rows = db.execute(statement, (last[0], selected.end, *last)).fetchall()
        if rows:
            last = rows[-1][: len(key)]
            values = [*zip(*rows, strict=True)][len(key) :]
            yield [
                fitting(column, as_numbers(column, each))[0]
                for column, each in zip(columns, values, strict=True)
            ]
        if len(rows) < _PART:
            return


def _stamp(time_ms: int) -> str:
    at = datetime.fromtimestamp(time_ms / 1e3, UTC)
    return f"{at:%Y%m%dT%H%M%SZ}"
