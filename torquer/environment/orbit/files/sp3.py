"""SP3, versions a to d: Earth-fixed positions, and velocities, of satellites."""

import re
from typing import NamedTuple

import numpy as np

from torquer.environment.orbit.files.naming import first_line, is_called
from torquer.environment.orbit.files.stamps import (
    at_line,
    instant_of_numbers,
    read_numbers,
    scale_named,
)
from torquer.environment.orbit.files.states import States, axes_named, rounding

#: The last column of a position or velocity, and the first.
_FIRST, _LAST = 4, 46


class _Row(NamedTuple):
    line: int
    tai: np.datetime64
    numbers: list[float]


def is_sp3(text: str) -> bool:
    """Whether a file begins as one."""
    return re.match(r"#[a-d][PV]", first_line(text)) is not None


def read_sp3(text: str, satellite: str | None) -> States:
    """The states of a satellite, which is named as in the file (G01, L74) if there are several.

    Positions of zeros are missing ones.
    """
    lines = text.splitlines()
    begin = next(k for k, line in enumerate(lines) if line.strip())
    with at_line(begin + 1):
        axes = axes_named(lines[begin].lstrip()[46:51].strip())
    rows = _rows(lines, _scale(lines))
    name = _chosen({key[1] for key in rows}, satellite)
    places = [row for row in rows.get(("P", name), []) if any(row.numbers)]
    if not places:
        raise ValueError(f"must hold positions of {name}; received none")
    speeds = {row.tai: row.numbers for row in rows.get(("V", name), []) if any(row.numbers)}
    v = None
    if all(row.tai in speeds for row in places):
        v = 0.1 * np.array([speeds[row.tai] for row in places])  # in dm/s
    tai, km = np.array([row.tai for row in places]), np.array([row.numbers for row in places])
    found = np.array([row.line for row in places])
    return States(tai, 1e3 * km, v, axes, found, rounding(km, 1e3))


def _scale(lines: list[str]) -> str:
    """The time scale of the header's first line %c; GPS where version a or b does not state one."""
    for number, line in enumerate(lines, start=1):
        if line.startswith("%c"):
            name = line[9:12].strip()
            with at_line(number):
                return "GPS" if name == "ccc" else scale_named(name)
    return "GPS"


def _chosen(known: set[str], satellite: str | None) -> str:
    found = [name for name in known if is_called(satellite, name)]
    if len(found) != 1:
        raise ValueError(
            f"satellite: must be one of {', '.join(sorted(known))}; received {satellite!r}"
        )
    return found[0]


def _rows(lines: list[str], scale: str) -> dict[tuple[str, str], list[_Row]]:
    """Positions ("P") and velocities ("V") of each satellite."""
    found: dict[tuple[str, str], list[_Row]] = {}
    tai = None
    for line, text in enumerate(lines, start=1):
        with at_line(line):
            if text.startswith("*"):
                tai = _instant(text, scale)
            elif text[:1] in ("P", "V"):
                if tai is None:
                    raise ValueError(f"must follow a line of its time (*); received {text[:40]!r}")
                numbers = read_numbers(text[_FIRST:_LAST].split(), 3)
                key = (text[0], text[1:4].strip())
                found.setdefault(key, []).append(_Row(line, tai, numbers))
    if not found:
        raise ValueError("must hold positions (lines that begin with P); received none")
    return found


def _instant(text: str, scale: str) -> np.datetime64:
    words = text[1:].split()
    return instant_of_numbers(read_numbers(words[:6], 6), scale, " ".join(words))
