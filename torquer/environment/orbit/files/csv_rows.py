"""CSV of positions or states, such as a GNSS log: columns by names that carry their units."""

import csv
import io
from typing import NamedTuple

import numpy as np

from torquer.environment.orbit.files.naming import first_line
from torquer.environment.orbit.files.stamps import (
    SCALES,
    by_line,
    gps_instant,
    read_numbers,
    read_stamp,
)
from torquer.environment.orbit.files.states import States, rounding
from torquer.maths.geometry.frames import ecef_from_geodetic

#: What may divide columns; how a comment begins.
_BETWEEN, _COMMENT = ",;\t", "#"
#: A degree on the ground, and a little more at the height of satellites [m].
_DEGREE_M = 1.3e5
_PLACES = {"x_m": 1.0, "x_km": 1e3}
_SPEEDS = {"vx_m_s": 1.0, "vx_km_s": 1e3}
_GEODETIC = ("lat_deg", "lon_deg", "height_m")
#: Where latitude and longitude lie [deg].
_RANGES = {"lat_deg": (-90.0, 90.0), "lon_deg": (-180.0, 360.0)}
_TIMES = tuple(scale.lower() for scale in SCALES)


def is_csv(text: str) -> bool:
    """Whether the first line that is no comment names columns."""
    return any(c in first_line(text, (_COMMENT,)) for c in _BETWEEN)


def table_rows(text: str) -> list[tuple[int, list[str]]]:
    """Rows of a table with their lines, without comments; the first, of names, has as many columns.

    Columns are divided by what the line of their names has most of.
    """
    divider = max(_BETWEEN, key=first_line(text, (_COMMENT,)).count)
    try:
        reader = csv.reader(io.StringIO(text), delimiter=divider)
        found = [(reader.line_num, [word.strip() for word in row]) for row in reader]
    except csv.Error as error:
        raise ValueError(f"must be a table that can be read; received {error}") from None
    found = [(line, row) for line, row in found if any(row) and not row[0].startswith(_COMMENT)]
    head, names = found[0]
    if len({name.lower() for name in names}) < len(names):
        raise ValueError(f"line {head}: must name each column once; received {','.join(names)}")
    for line, row in found[1:]:
        if len(row) != len(names):
            raise ValueError(
                f"line {line}: must have {len(names)} columns as line {head} has; "
                f"received {len(row)}"
            )
    return found


def read_csv(text: str, axes: str | None) -> States:
    """The states of a table whose first line names its columns.

    Time: a column named by its scale (`utc`, `tai`, `gps`, `tt`) of ISO texts, or `gps_week` and
    `gps_s`. Place: `x_m` or `x_km` with y and z, or `lat_deg`, `lon_deg`, `height_m` on WGS84.
    Velocity, if known: `vx_m_s` or `vx_km_s` with y and z. Columns are divided by commas,
    semicolons or tabs. `axes`: of places, which the file does not say.
    """
    table = _table(text)
    tai, places = _times(table), _geodetic(table)
    if places is not None and axes not in (None, "ECEF"):
        raise ValueError(
            f"axes: must be left out, or 'ECEF', for latitude and longitude; received {axes!r}"
        )
    axes = "ECEF" if places is not None else axes
    places = places or _vectors(table, _PLACES)
    if places is None:
        raise ValueError(
            f"line {table.head}: must name the columns of a place, {', '.join(_PLACES)} with y and "
            f"z or {', '.join(_GEODETIC)}; received {', '.join(table.columns)}"
        )
    if axes is None:
        raise ValueError("axes: must be given for a CSV file, which says none; received none")
    speeds = _vectors(table, _SPEEDS)
    v = None if speeds is None else speeds[0]
    return States(tai, places[0], v, axes, np.array(table.lines), places[1])


class _Table(NamedTuple):
    """Numbers of columns by name, the line of these names; rows, their lines."""

    columns: dict[str, int]
    head: int
    rows: list[list[str]]
    lines: list[int]

    def has(self, *names: str) -> bool:
        """Whether it has all of these columns."""
        return all(name in self.columns for name in names)

    def numbers(self, *names: str) -> np.ndarray:
        """The numbers of columns (n, k)."""
        places = [self.columns[name] for name in names]
        return by_line(
            lambda row: read_numbers([row[k] for k in places], len(places)), self.lines, self.rows
        )


def _table(text: str) -> _Table:
    (head, names), *found = table_rows(text)
    columns = {name.lower(): k for k, name in enumerate(names)}
    if not found:
        raise ValueError("must hold rows below the names of its columns; received none")
    return _Table(columns, head, [row for _, row in found], [line for line, _ in found])


def _times(table: _Table) -> np.ndarray:
    """Instants in TAI."""
    named = [name for name in _TIMES if name in table.columns]
    if len(named) == 1:
        place, scale = table.columns[named[0]], named[0].upper()
        return by_line(lambda row: read_stamp(row[place], scale), table.lines, table.rows)
    if not named and table.has("gps_week", "gps_s"):
        return by_line(gps_instant, table.lines, *table.numbers("gps_week", "gps_s").T.tolist())
    raise ValueError(
        f"line {table.head}: must name one column of times, {', '.join(_TIMES)}, or gps_week and "
        f"gps_s; received {', '.join(table.columns)}"
    )


def _geodetic(table: _Table) -> tuple[np.ndarray, float] | None:
    """Earth-fixed places [m] and their rounding [m]."""
    if not table.has(*_GEODETIC):
        return None
    numbers = table.numbers(*_GEODETIC)
    for (name, (low, high)), column in zip(_RANGES.items(), numbers.T, strict=False):
        outside = np.flatnonzero((column < low) | (column > high))
        if outside.size:
            raise ValueError(
                f"line {table.lines[outside[0]]}: {name} must lie in {low:g}..{high:g}; "
                f"received {column[outside[0]]:.12g}"
            )
    lat, lon, height = numbers.T
    r = ecef_from_geodetic(np.radians(lat), np.radians(lon), height)
    return r, max(rounding(numbers[:, :2], _DEGREE_M), rounding(numbers[:, 2:]))


def _vectors(table: _Table, first: dict[str, float]) -> tuple[np.ndarray, float] | None:
    """Vectors [SI] of columns, the first of which is one of these, and their rounding; or None."""
    for name, unit in first.items():
        names = [name.replace("x", c) for c in "xyz"]
        if table.has(*names):
            numbers = table.numbers(*names)
            return unit * numbers, rounding(numbers, unit)
    return None
