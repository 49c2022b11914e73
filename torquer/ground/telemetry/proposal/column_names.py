"""What names of columns say: which belong together, the axis of each, the unit."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from torquer.ground.telemetry.reading.quantities import SPELLINGS, UNITS, parse_unit

_BRACKETS = re.compile(r"[\[(<{]([^\])>}]*)[\])>}]")
#: Units by their spellings in small letters, as names end with them.
_ENDINGS = {
    re.sub(r"\W+", "_", each.lower()).strip("_"): parse_unit(each)
    for each in [unit for units in UNITS.values() for unit in units] + list(SPELLINGS)
    if each not in ("", "1", "%")
}
#: Endings that are units only after an axis.
_SHORT = {"t", "m", "k", "c", "g", "gs"}
_AXIS = re.compile(r"^[xyzw0-4]$")
_AXIS_AT_END = re.compile(r"^(.*[^\d])([xyzw0-4])$")


class ColumnName(NamedTuple):
    """A column, the words of its name without axis and unit, the axis ("" for none), the unit."""

    column: str
    stem: str
    axis: str
    unit: str


def parse_name(column: str) -> ColumnName:
    """What the name of a column says."""
    stated = [parse_unit(each) for each in _BRACKETS.findall(column)]
    unit = next((each for each in stated if each in _ENDINGS.values()), "")
    bare = _BRACKETS.sub(lambda it: it[0] if _AXIS.match(it[1].lower()) else " ", column)
    parts = re.split(r"[\W_]+", bare)
    words = [word for part in parts for word in _words(part)]
    if not unit:
        words, unit = _without_unit(words)
    if not unit and len(words) > 2 and _AXIS.match(words[-1]):  # mag_nT_x
        before, unit = _without_unit(words[:-1])
        words = [*before, words[-1]]
    stem, axis = _without_axis(words)
    return ColumnName(column, stem, axis, unit)


def _words(part: str) -> list[str]:
    """Words of a part of a name in small letters: magFieldX is three, nT is one."""
    if part.lower() in _ENDINGS:
        return [part.lower()]
    return [each for each in re.sub(r"([a-z])([A-Z])", r"\1_\2", part).lower().split("_") if each]


def _without_unit(words: list[str]) -> tuple[list[str], str]:
    for size in (3, 2, 1):
        ending = "_".join(words[-size:])
        if len(words) <= size or ending not in _ENDINGS:
            continue
        if ending in _SHORT and not _AXIS.match(words[-size - 1][-1:]):
            continue
        return words[:-size], _ENDINGS[ending]
    return words, ""


def _without_axis(words: list[str]) -> tuple[str, str]:
    for at in reversed(range(len(words))):
        if _AXIS.match(words[at]):
            return "_".join([*words[:at], *words[at + 1 :]]), words[at]
    found = _AXIS_AT_END.match(words[-1]) if words else None
    if found:
        return "_".join([*words[:-1], found[1]]).strip("_"), found[2]
    return "_".join(words), ""


class Group(NamedTuple):
    """Columns that belong together, in the order of their axes."""

    stem: str
    columns: tuple[str, ...]
    axes: str
    unit: str


def group_columns(columns: Iterable[str], size: int) -> list[Group]:
    """Groups of `size` columns whose names differ by the axis alone: x, y, z or 1, 2, 3."""
    wanted = ("xyz", "012", "123") if size == 3 else ("xyzw", "0123", "1234")
    names = [each for each in map(parse_name, columns) if each.axis]
    groups = _groups(names, wanted, lambda each: each.stem)
    used = {column for group in groups for column in group.columns}
    rest = [each for each in names if each.column not in used]
    return groups + _groups(rest, wanted, lambda each: each.stem.rpartition("_")[2])


def _groups(names: list[ColumnName], wanted, key) -> list[Group]:
    by: dict[str, dict[str, ColumnName]] = {}
    for each in names:
        by.setdefault(key(each), {}).setdefault(each.axis, each)
    found = []
    for stem, axes in by.items():
        order = next((each for each in wanted if set(each) <= set(axes)), None)
        if order is not None:
            members = [axes[axis] for axis in order]
            unit = next((each.unit for each in members if each.unit), "")
            found.append(Group(stem, tuple(each.column for each in members), order, unit))
    return found
