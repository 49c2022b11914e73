"""How a file of text is written, without a mapping: its encoding, its head, names in a column."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from torquer.ground.telemetry.reading.mapping import Long
from torquer.ground.telemetry.reading.packed import decode
from torquer.ground.telemetry.reading.records import is_json, is_protocol
from torquer.ground.telemetry.reading.table import Table
from torquer.ground.telemetry.reading.text_tables import (
    INFLUX,
    SEPARATORS,
    Layout,
    is_units,
    pivot,
    prepare_lines,
    read_text_table,
    split_line,
)

#: A cell that holds a number, a date, numbers in brackets, or nothing.
_DATA = re.compile(r"""^[-+\u2212\[({"']*\.?\d|^(nan|null|n/a|-)?$|^[A-Z][a-z]{2}, \d""", re.I)
#: Names of columns of time stamps.
TIME = re.compile(
    r"time|date|stamp|utc|epoch|zeit|datum|дата|время|(?<![a-z])(ts|t|jd|mjd|gps|tai|tow|sow|sod|met|week|"
    r"year|doy|day|sec|seconds|clock|serial|datenum)(?![a-z])",
    re.I,
)
_VALUE = re.compile(r"^_?(value|val|data|eng|reading|number)", re.I)
_NAME = re.compile(r"^_?(name|param|field|channel|metric|tag|mnemonic|signal|key|item)", re.I)
_UNIT = re.compile(r"^_?(units?|uom|einheit|единиц[аы])$", re.I)
_LINES = 300
#: From so many cells on a row may hold a text more than data: a name, a unit, a status.
_WIDE = 4
#: Names in a column are as many as its rows divided by this or fewer.
_REPEATED = 4


class Guessed(NamedTuple):
    """A table, the keys of a mapping with which it is read, what of them is a guess."""

    table: Table
    keys: dict[str, Any]
    guesses: list[str]


def guess_text(path: Path, is_field: Callable[[list[str]], bool]) -> Guessed:
    """The table of a text. `is_field`: whether names of columns are those of a magnetometer.

    ValueError for a text without a head.
    """
    keys: dict[str, Any] = {}
    guesses: list[str] = []
    data = path.read_bytes()
    try:
        text = decode(data, None, path)
    except ValueError:
        keys["encoding"] = _encoding(data)
        guesses.append(f"the encoding is {keys['encoding']}")
        text = decode(data, keys["encoding"], path)
    layout = Layout(encoding=keys.get("encoding"))
    lines = text.split("\n")
    if not is_json(text) and not is_protocol(lines):
        layout = _with_head(lines, layout, path, guesses)
    return _turned(read_text_table(path, layout), keys, guesses, is_field)


def _encoding(data: bytes) -> str:
    """Latin letters are seldom more than two in a row beyond ASCII, Cyrillic ones often."""
    return "cp1251" if re.search(rb"[\xc0-\xff]{4,}", data[:100_000]) else "latin-1"


def _with_head(lines: list[str], layout: Layout, path: Path, guesses: list[str]) -> Layout:
    """The layout with the separator and the columns of the head: what is above the first row."""
    kept, layout = prepare_lines(lines, layout)
    head = [line.strip("\r ") for line in kept[:_LINES]]
    found = [
        (len(names), k, names, sign)
        for sign in ((layout.separator,) if layout.separator else SEPARATORS)
        if (one := _head(head, sign)) is not None
        for k, names in (one,)
    ]
    if len(head) < 2:
        raise ValueError(
            f"FILE: must hold a head and rows; received {path}, which holds {_few(head)}"
        )
    if not found:
        raise ValueError(
            f"names: must be given for a file without a head that names the columns; received "
            f"{path}, of which none was found"
        )
    _, k, names, sign = max(found, key=lambda each: each[0])
    number = lines.index(kept[k]) + 1
    if number > 1:
        guesses.append(f"the head is line {number}")
    return layout._replace(separator=sign, wanted=frozenset(each for each in names if each))


def _few(lines: list[str]) -> str:
    return f"one line, {lines[0][:60]!r}" if lines else "none"


def _head(lines: list[str], separator: str) -> tuple[int, list[str]] | None:
    """Number of the head, and its cells, with a separator; None if there is none."""
    for k in range(1, len(lines)):
        row = _cells(lines[k], separator)
        above = k - 2 if k > 1 and is_units(_cells(lines[k - 1].lstrip("# "), separator)) else k - 1
        names = _cells(lines[above].lstrip("# "), separator)
        named = [each for each in names if each]
        if len(row) != len(names) or len(named) < 2 or _DATA.match(named[0]):
            continue
        if not all(re.search(r"[^\W\d]", each) for each in named):
            continue
        data = sum(bool(_DATA.match(cell)) for cell in row)
        if 2 * data > len(row) or (len(row) >= _WIDE and 2 * data >= len(row) - 1):
            return above, names
    return None


def _cells(line: str, separator: str) -> list[str]:
    """The cells of a line without empty ones at its end."""
    cells = split_line(line, separator)
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _turned(table: Table, keys, guesses, is_field) -> Guessed:
    """The table, turned if it has a row for each number."""
    data = table.data
    if set(INFLUX) <= set(data):
        names = data["_field"].dropna().unique().tolist()
        guesses.append("an export of InfluxDB: its columns are what _field holds")
        return Guessed(pivot(table, ["_time"], names, *INFLUX[1:]), keys, guesses)
    long = _find_long(data, is_field)
    if long is None:
        return Guessed(table, keys, guesses)
    guesses.append(f"{long.name} holds names, {long.value} a number for each")
    if long.unit is not None:
        guesses.append(f"{long.unit} holds the units of the numbers")
    stamps = [c for c in data if c not in long.columns]
    stamps.sort(key=lambda each: not TIME.search(str(each)))
    names = data[long.name].dropna().unique().tolist()
    turned = pivot(table, stamps[:1], names, *long.columns)
    return Guessed(turned, keys | {"long": long.model_dump(exclude_none=True)}, guesses)


def _find_long(data, is_field) -> Long | None:
    import pandas as pd

    texts = [c for c in data if not pd.api.types.is_numeric_dtype(data[c])]
    for column in sorted(texts, key=lambda each: not _NAME.match(str(each))):
        if not all(isinstance(each, str) for each in data[column].head(5)):
            continue
        names = data[column].dropna().unique().tolist()
        if not 3 <= len(names) <= max(len(data) // _REPEATED, 3) or not is_field(names):
            continue
        values = [c for c in data if c != column and _VALUE.match(str(c))]
        if values:
            unit = next((str(c) for c in data if c != column and _UNIT.match(str(c))), None)
            return Long(name=str(column), value=str(values[0]), unit=unit)
    return None
