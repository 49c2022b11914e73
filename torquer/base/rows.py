"""An answer as rows: each number once, from which its text, JSON and HTML are made.

cells = [Row("settled_s", "last", 7200.0, "h", "2"), Row("runs", value=8)]
as_data(cells)               # {"settled_s": 7200.0, "runs": 8}
print(*as_text([cells]), sep="\\n")
"""

from collections.abc import Sequence
from html import escape
from typing import Any, NamedTuple

#: An angle up to this one [deg] is rounding of equations that give none.
_ROUNDING_DEG = 1e-9


class Row(NamedTuple):
    """A value of an answer: for programs `value` by `key`, for people `text` under a label.

    The key names the unit of the value; a slash leads into a nested table. `text`: the value in
    `unit`, which may be another than the key's. Without a text people do not see it, without a key
    programs do not.
    """

    key: str
    label: str = ""
    value: Any = None
    unit: str = ""
    text: str = ""


def degrees_text(angle_deg: float) -> str:
    """An angle for people: without rounding where nothing turns."""
    return f"{0.0 if angle_deg <= _ROUNDING_DEG else angle_deg:.3g}"


def as_data(rows: Sequence[Row]) -> dict:
    """Values by key, nested, for JSON."""
    data: dict = {}
    for row in rows:
        *tables, last = row.key.split("/")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        if last:
            table[last] = row.value
    return data


def as_text(table: Sequence[Sequence[Row]], width: int = 12, first: int = 0) -> list[str]:
    """A table, one line an entry, below labels and units; "-" for what an entry lacks.

    `first`: width of the first column if that holds words, which stand at its left.
    """
    cells = cells_of(table)
    widths = [f"<{first}" if first else f">{width}", *[f">{width}"] * (len(cells[0]) - 1)]
    return [
        "".join(f"{cell:{each}}" for cell, each in zip(line, widths, strict=True))
        for line in cells
        if any(line)
    ]


def as_html(table: Sequence[Sequence[Row]], notes: Sequence[str] = ()) -> str:
    """The table for notebooks, with notes below it."""
    labels, units, *rest = cells_of(table)
    head = [
        f"{label} [{unit}]" if unit else label for label, unit in zip(labels, units, strict=True)
    ]
    lines = [_line("th", head), *(_line("td", cells) for cells in rest)]
    below = "".join(f"<li>{escape(note)}</li>" for note in notes)
    grid = f"<table>{''.join(lines)}</table>" if table else ""
    return grid + (f"<ul>{below}</ul>" if below else "")


def _line(tag: str, cells: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in cells)}</tr>"


def cells_of(table: Sequence[Sequence[Row]]) -> list[list[str]]:
    """Labels, units and the texts of each entry; "-" for what an entry lacks."""
    units = {row.label: row.unit for rows in table for row in rows if row.text}
    texts = ({row.label: row.text for row in rows if row.text} for rows in table)
    return [[*units], [*units.values()], *([by.get(x, "-") for x in units] for by in texts)]
