"""Text as a table of columns: heads, separators, rows that are none, a row for each number."""

from __future__ import annotations

import csv
import io
import re
import warnings
from pathlib import Path
from typing import NamedTuple

from torquer.ground.telemetry.reading.packed import decode
from torquer.ground.telemetry.reading.quantities import UNITS, parse_unit
from torquer.ground.telemetry.reading.records import (
    is_json,
    is_protocol,
    json_records,
    protocol_records,
)
from torquer.ground.telemetry.reading.table import Finding, Table

#: What may separate columns, in the order in which it is tried.
SEPARATORS = (",", ";", "\t", "|", "whitespace")
#: Columns of InfluxDB's own exports, which have a row for each number: stamp, name, value.
INFLUX = ("_time", "_field", "_value")
#: Lines in which a head is looked for.
_HEAD_WITHIN = 2000
#: A line that is drawn, not written.
_RULE = re.compile(r"^[-+|=:_ ]{3,}$")
#: Name of a column of cells beyond the head's.
_BEYOND = "\0beyond"
_KNOWN_UNITS = {unit for units in UNITS.values() for unit in units} - {"1", "%", "T", "m", "K"}
#: What a row of units may hold beside units.
_NO_UNITS = {
    "", "1", "-", "utc", "iso", "s", "ms", "none", "time", "t", "m", "k", "deg", "%",
}  # fmt: skip


class Layout(NamedTuple):
    """How a text is written: keys of a mapping, and the columns that its head must have."""

    wanted: frozenset[str] = frozenset()
    skip: int = 0
    skip_lines: tuple = ()
    comment: str = "#"
    separator: str | None = None
    names: tuple[str, ...] | None = None
    encoding: str | None = None


class Body(NamedTuple):
    """A head with the lines below it, up to the next head."""

    head: list[str]
    separator: str
    lines: list[str]


def split_line(line: str, separator: str) -> list[str]:
    """The cells of a line, without blanks around them."""
    if separator == "whitespace":
        return line.split()
    if len(separator) > 1:
        return [each.strip().strip('"') for each in line.split(separator)]
    row = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [each.strip() for each in row]


def read_text_table(path: Path, layout: Layout) -> Table:
    """The table of a file of text; ValueError, which names the key, for what needs a decision."""
    text = decode(path.read_bytes(), layout.encoding, path)
    lines = text.split("\n")
    if is_json(text):
        records, cut = json_records(text)
        return _of_records(records, cut)
    if is_protocol(lines):
        return _of_records(protocol_records(lines), 0)
    lines, layout = prepare_lines(lines, layout)
    bodies = find_bodies(lines, layout)
    if not bodies:
        raise ValueError(f"FILE: must hold a head and rows; received {path}, which holds none")
    return _joined([_table(each, layout, path) for each in bodies])


def _of_records(records: list[dict], cut: int) -> Table:
    import pandas as pd

    notes = (_cut_off(cut),) if cut else ()
    return Table(pd.DataFrame.from_records(records), {}, "text", notes=notes)


def _cut_off(rows: int) -> Finding:
    return Finding("cut off", rows, f"{rows} row at the end is cut off and left out")


def prepare_lines(lines: list[str], layout: Layout) -> tuple[list[str], Layout]:
    """The lines that may be heads or rows; the separator is the one that "sep=;" states."""
    numbers = {each for each in layout.skip_lines if isinstance(each, int)}
    begins = tuple(each for each in layout.skip_lines if isinstance(each, str))
    kept = [
        line
        for number, line in enumerate(lines, 1)
        if number > layout.skip
        and line.strip()
        and number not in numbers
        and not (begins and line.lstrip().startswith(begins))
        and not _RULE.match(line)
    ]
    stated = re.fullmatch(r'"?sep=(.)"?', kept[0].strip()) if kept else None
    if stated:
        separator = layout.separator or stated[1]
        return kept[1:], layout._replace(separator=separator)
    return kept, layout


def find_bodies(lines: list[str], layout: Layout) -> list[Body]:
    """Heads with their rows: one, or several where exports were joined."""
    if layout.names is not None:
        rows = [line for line in lines if not line.lstrip().startswith(layout.comment)]
        return [Body(list(layout.names), _separator_of(rows, layout), rows)] if rows else []
    first = _first_head(lines, layout)
    if first is None:
        return []
    at, head, separator = first
    bodies, key = [Body(head, separator, [])], next(iter(layout.wanted), head[0])
    for line in lines[at + 1 :]:
        bare = line.lstrip()
        if key in line and (cells := _head_cells(line, separator, layout)) is not None:
            bodies.append(Body(cells, separator, []))
        elif not bare.startswith(layout.comment):
            bodies[-1].lines.append(line)
    return [each for each in bodies if each.lines] or bodies[:1]


def _head_cells(line: str, separator: str, layout: Layout) -> list[str] | None:
    """The names in a line if it is a head, else None."""
    bare = line.strip(" ").removeprefix(layout.comment).strip(" ") if layout.comment else line
    cells = split_line(bare, separator)
    return cells if layout.wanted <= set(cells) else None


def _first_head(lines: list[str], layout: Layout):
    separators = [layout.separator] if layout.separator else SEPARATORS
    if layout.wanted:
        for at, line in enumerate(lines[:_HEAD_WITHIN]):
            for separator in separators:
                cells = _head_cells(line, separator, layout)
                if cells is not None and len(cells) > 1:
                    return at, cells, separator
    return _likely_head(lines, layout, separators)


def _likely_head(lines, layout: Layout, separators):
    """The first line as a head, so that a message can list its columns."""
    nothing = layout._replace(wanted=frozenset())
    for at, line in enumerate(lines):
        bare = line.lstrip()
        if bare.startswith(layout.comment) and not bare.removeprefix(layout.comment).strip():
            continue
        found = [(_head_cells(line, each, nothing) or [], each) for each in separators]
        head, separator = max(found, key=lambda each: len(each[0]))
        return at, head, separator
    return None


def _separator_of(rows: list[str], layout: Layout) -> str:
    """The separator with which the first rows have as many cells as there are names."""
    if layout.separator:
        return layout.separator
    size = len(layout.names or ())

    def fits(separator: str) -> int:
        return sum(len(split_line(line, separator)) == size for line in rows[:20])

    best = max(SEPARATORS, key=fits)
    return best if fits(best) else ","


def _table(body: Body, layout: Layout, path: Path) -> Table:
    """The table of one head and its rows."""
    names = _unique(body.head)
    lines, units = body.lines, {}
    if lines and is_units(split_line(lines[0], body.separator)):
        row = split_line(lines[0], body.separator)
        units = {n: u.strip("[]() ") for n, u in zip(names, row, strict=False) if u}
        lines = lines[1:]
    if not lines:
        return Table(_empty(names), units, "text")
    return Table(_parse(names, lines, body, layout, path), units, "text")


def _empty(names):
    import pandas as pd

    return pd.DataFrame({name: pd.Series(dtype=object) for name in names})


def _unique(head: list[str]) -> list[str]:
    """Names of columns: cells without one and repeated ones get names that no mapping has."""
    names: list[str] = []
    for k, name in enumerate(head):
        names.append(f"\0{k}" if not name else f"\0{k} {name}" if name in names else name)
    return names


def is_units(cells: list[str]) -> bool:
    """Whether cells are those of a row of units."""
    bare = [each.strip("[]() ") for each in cells]
    known = [parse_unit(each) in _KNOWN_UNITS for each in bare]
    rest = [each for each, is_unit in zip(bare, known, strict=True) if not is_unit]
    return any(known) and all(each.lower() in _NO_UNITS for each in rest)


def _parse(names, lines, body: Body, layout: Layout, path: Path):
    import pandas as pd

    how: dict = {"sep": r"\s+"} if body.separator == "whitespace" else {"sep": body.separator}
    if len(body.separator) > 1 and body.separator != "whitespace":
        how = {"sep": re.escape(body.separator), "engine": "python"}
    else:
        how["low_memory"] = False
    if len(layout.comment) == 1:
        how["comment"] = layout.comment
    text = {name: str for name in layout.wanted if name in names}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pd.errors.ParserWarning)
            data = pd.read_csv(
                io.StringIO("\n".join(lines) + "\n"),
                names=[*names, _BEYOND],
                header=None,
                index_col=False,
                na_values=[""],
                keep_default_na=False,
                skipinitialspace=True,
                dtype=text,
                **how,
            )
    except (pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise ValueError(_not_a_table(str(error), path)) from None
    beyond = data.pop(_BEYOND).notna()
    if beyond.any():
        row = int(beyond.to_numpy().argmax()) + 1
        raise ValueError(
            f"names: must name each of {len(names) + 1} columns; received a head of {len(names)} "
            f"in {path.name} (row {row} has more)"
        )
    return data


def _not_a_table(reason: str, path: Path) -> str:
    found = re.search(r"in line (\d+), saw (\d+)", reason)
    where = f": row {found[1]} has {found[2]} cells" if found else ""
    return (
        "skip_lines: must name lines that are no rows, as all must have the head's columns; "
        f"received none for {path.name}{where}"
    )


def _joined(tables: list[Table]) -> Table:
    import pandas as pd

    if len(tables) == 1:
        return tables[0]
    data = pd.concat([each.data for each in tables], ignore_index=True)
    return tables[0]._replace(data=data)


def pivot(
    table: Table, stamps: list[str], wanted, name: str, value: str, unit: str | None = None
) -> Table:
    """A table with a row for each number as one with a column for each name in `wanted`; `unit`:
    the column of units, which then stand in the cells."""
    import pandas as pd

    data = table.data[table.data[name].isin(wanted)].reset_index(drop=True)
    if unit is not None:
        said = data[value].astype(str) + " " + data[unit].fillna("").astype(str)
        data[value] = said.where(data[value].notna(), "")
    at = pd.factorize(pd.MultiIndex.from_frame(data[stamps].astype(str)))[0]
    again = data.groupby([at, data[name]]).cumcount()
    rows = pd.factorize(pd.MultiIndex.from_arrays([at, again]))[0]
    wide = pd.DataFrame({"row": rows, "name": data[name], "value": data[value]})
    wide = wide.pivot(index="row", columns="name", values="value")
    first = data[stamps].groupby(rows).first()
    return table._replace(data=pd.concat([first, wide], axis=1))
