"""Members from a table: values that are listed for each, as a fleet's or another study's have them.

spacecraft.body.inertia_kg_m2[0],spacecraft.body.inertia_kg_m2[1],spacecraft.body.inertia_kg_m2[2]
0.00173,0.00172,0.00026
"""

import contextlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from torquer.base.explain import ScenarioError
from torquer.campaign.variation import ATTITUDE
from torquer.environment.orbit.files.csv_rows import table_rows
from torquer.environment.orbit.files.naming import first_line
from torquer.scenario.toml_text import read_text

#: Samplings whose members differ by design, in every key.
_DESIGNS = ("grid", "saltelli")
#: A component of a vector.
_COMPONENT = re.compile(r"(.*)\[(\d+)\]")
_WORDS = {"true": True, "false": False}


def check_table(table: Mapping[str, Sequence], runs: int, sampling: str) -> None:
    """ValueError unless a campaign's table has a value of each key for each member."""
    if ATTITUDE in table:
        raise ValueError(f"table: must have attitudes as initial.quaternion; received {ATTITUDE}")
    (first, values), *others = table.items()
    count = len(values)
    for key, each in others:
        if len(each) != count:
            raise ValueError(
                f'table."{key}": must have {count} values, as {first}; received {len(each)}'
            )
    if sampling in _DESIGNS:
        raise ValueError(
            f"table: must be left out with sampling {sampling!r}; received one of {count} rows"
        )
    if runs > count:
        raise ValueError(f"runs: must be at most {count}, the rows of the table; received {runs}")


def listed(table: Mapping[str, Sequence], members: np.ndarray) -> dict[str, np.ndarray | list]:
    """What members [n] have at the keys of a table: arrays of numbers and vectors, else lists."""
    columns = {key: _column(values) for key, values in table.items()}
    return {
        key: each[members] if isinstance(each, np.ndarray) else [each[k] for k in members.tolist()]
        for key, each in columns.items()
    }


def _column(values: Sequence) -> np.ndarray | list:
    if all(map(_is_numbers, values)):
        with contextlib.suppress(ValueError):  # vectors of different lengths
            return np.array(values, dtype=float)
    return [*values]


def _is_numbers(value) -> bool:
    if isinstance(value, list | tuple):
        return bool(value) and all(map(_is_numbers, value))
    return isinstance(value, float) or type(value) is int


def telling_rows(table: Mapping[str, Sequence], most: int) -> np.ndarray:
    """Rows that are tried for all: with the least and the greatest number of each key, and with
    each other value; of each key at most so many."""
    found: set[int] = set()
    for values in table.values():
        column = _column(values)
        if isinstance(column, np.ndarray):
            flat = column.reshape(len(column), -1)
            found |= {*flat.argmin(axis=0).tolist(), *flat.argmax(axis=0).tolist()}
        else:
            first = {repr(value): row for row, value in reversed([*enumerate(column)])}
            found |= {*sorted(first.values())[:most]}
    return np.array(sorted(found), dtype=np.int64)


# ------------------------------------------------------------------ from a file


def read_table(path: Path) -> dict[str, tuple]:
    """Values by key of a CSV file; ScenarioError, with the line, for one that has none."""
    text = read_text(path, "campaign.table")
    try:
        if not first_line(text, ("#",)):
            raise ValueError("must name keys of the scenario in its first line; received nothing")
        (line, names), *rows = table_rows(text)
        if not rows:
            raise ValueError("must have a row for each member; received none")
        if "" in names:
            shown = ",".join(names)
            raise ValueError(f"line {line}: must name a key above each column; received {shown}")
        columns = zip(*(_values(*row, names) for row in rows), strict=True)
        return _with_vectors(dict(zip(names, columns, strict=True)))
    except ValueError as error:
        raise ScenarioError(f"campaign.table: {path.name}: {error}") from None


def _values(line: int, words: list[str], names: list[str]) -> list:
    if "" in words:
        empty = names[words.index("")]
        raise ValueError(f"line {line}: must have a value for {empty}; received nothing")
    return [*map(_value, words)]


def _value(word: str):
    """A number, true, false, or the text itself."""
    with contextlib.suppress(ValueError):
        return float(word)
    return _WORDS.get(word, word)


def _with_vectors(columns: dict[str, tuple]) -> dict[str, tuple]:
    """The columns, with those of all components of a vector, or rows of a matrix, made one."""
    parts: dict[str, dict[int, str]] = {}
    for name in columns:
        if found := _COMPONENT.fullmatch(name):
            parts.setdefault(found[1], {})[int(found[2])] = name
    whole = {key: of for key, of in parts.items() if 1 < len(of) == max(of) + 1}
    if not whole:
        return columns
    joined: dict[str, tuple] = {}
    for name, values in columns.items():
        found = _COMPONENT.fullmatch(name)
        if not found or found[1] not in whole:
            joined[name] = values
        elif found[1] not in joined:
            named = [whole[found[1]][k] for k in range(len(whole[found[1]]))]
            joined[found[1]] = tuple(zip(*(columns[each] for each in named), strict=True))
    return _with_vectors(joined)
