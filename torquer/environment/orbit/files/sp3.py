"""SP3, versions a to d: Earth-fixed positions, and velocities, of satellites."""

import re
from typing import NamedTuple

import numpy as np

from torquer.environment.orbit.files.oem import read_numbers
from torquer.environment.orbit.files.states import States, axes_named, rounding, to_tai

#: The last column of a position or velocity, and the first.
_FIRST, _LAST = 4, 46


class _Row(NamedTuple):
    line: int
    stamp: np.datetime64
    numbers: list[float]


def is_sp3(text: str) -> bool:
    """Whether a file begins as one."""
    return re.match(r"#[a-d][PV]", text) is not None


def read_sp3(text: str, satellite: str | None) -> States:
    """The states of a satellite, which is named as in the file (G01, L74) if there are several.

    Positions of zeros are missing ones.
    """
    lines = text.splitlines()
    axes = axes_named(lines[0][46:51].strip(), 1)
    scale = next((line[9:12].strip() for line in lines if line.startswith("%c")), "ccc")
    scale = "GPS" if scale == "ccc" else scale  # not stated before version c
    rows = _rows(lines)
    name = _chosen({key[1] for key in rows}, satellite)
    places = [row for row in rows.get(("P", name), []) if any(row.numbers)]
    if not places:
        raise ValueError(f"must hold positions of {name}; received none")
    speeds = {row.stamp: row.numbers for row in rows.get(("V", name), [])}
    v = None
    if all(row.stamp in speeds for row in places):
        v = 0.1 * np.array([speeds[row.stamp] for row in places])  # in dm/s
    stamps = np.array([row.stamp for row in places])
    km = np.array([row.numbers for row in places])
    found, tai = np.array([row.line for row in places]), to_tai(stamps, scale, 1)
    return States(tai, 1e3 * km, v, axes, found, rounding(km, 1e3))


def _chosen(known: set[str], satellite: str | None) -> str:
    if satellite is None and len(known) == 1:
        return next(iter(known))
    if satellite not in known:
        raise ValueError(
            f"satellite: must be one of {', '.join(sorted(known))}; received {satellite!r}"
        )
    return satellite


def _rows(lines: list[str]) -> dict[tuple[str, str], list[_Row]]:
    """Positions ("P") and velocities ("V") of each satellite."""
    found: dict[tuple[str, str], list[_Row]] = {}
    stamp = None
    for line, text in enumerate(lines, start=1):
        if text.startswith("*"):
            stamp = _stamp(text, line)
        elif text[:1] in ("P", "V") and stamp is not None:
            numbers = read_numbers(text[_FIRST:_LAST].split(), 3, line)
            key = (text[0], text[1:4].strip())
            found.setdefault(key, []).append(_Row(line, stamp, numbers))
    if not found:
        raise ValueError("must hold positions (lines that begin with P); received none")
    return found


def _stamp(text: str, line: int) -> np.datetime64:
    year, month, day, hour, minute, second = read_numbers(text[1:].split()[:6], 6, line)
    try:
        midnight = np.datetime64(f"{int(year):04d}-{int(month):02d}-{int(day):02d}", "ns")
    except ValueError:
        raise ValueError(f"line {line}: must hold a date; received {text!r}") from None
    seconds = 3600.0 * hour + 60.0 * minute + second
    return midnight + np.timedelta64(round(1e9 * seconds), "ns")
