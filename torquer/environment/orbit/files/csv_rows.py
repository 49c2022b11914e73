"""CSV of positions or states, such as a GNSS log: columns by names that carry their units."""

import csv
import io

import numpy as np

from torquer.environment.orbit.files.oem import read_numbers, read_stamp
from torquer.environment.orbit.files.states import SCALES, States, rounding, to_tai
from torquer.maths.geometry.frames import ecef_from_geodetic

_GPS_EPOCH = np.datetime64("1980-01-06", "ns")
_WEEK_S = 604800
#: A degree on the ground, and a little more at the height of satellites [m].
_DEGREE_M = 1.3e5
_PLACES = {"x_m": 1.0, "x_km": 1e3}
_SPEEDS = {"vx_m_s": 1.0, "vx_km_s": 1e3}
_GEODETIC = ("lat_deg", "lon_deg", "height_m")
_TIMES = tuple(scale.lower() for scale in SCALES)


def is_csv(text: str) -> bool:
    """Whether the first line that is no comment names columns."""
    lines = (line.strip() for line in text.splitlines())
    return "," in next((line for line in lines if line and not line.startswith("#")), "")


def read_csv(text: str, axes: str | None) -> States:
    """The states of a table whose first line names its columns.

    Time: a column named by its scale (`utc`, `tai`, `gps`, `tt`) of ISO texts, or `gps_week` and
    `gps_s`. Place: `x_m` or `x_km` with y and z, or `lat_deg`, `lon_deg`, `height_m` on WGS84.
    Velocity, if known: `vx_m_s` or `vx_km_s` with y and z. `axes`: of places, which the file does
    not say.
    """
    columns, rows, lines = _table(text)
    stamps, scale = _times(columns, rows, lines)
    places = _geodetic(columns, rows, lines)
    if places is not None and axes not in (None, "ECEF"):
        raise ValueError(
            f"axes: must be left out, or 'ECEF', for latitude and longitude; received {axes!r}"
        )
    axes = "ECEF" if places is not None else axes
    places = places or _vectors(columns, rows, lines, _PLACES)
    if places is None:
        raise ValueError(
            f"line 1: must name the columns of a place, {', '.join(_PLACES)} with y and z or "
            f"{', '.join(_GEODETIC)}; received {', '.join(columns)}"
        )
    if axes is None:
        raise ValueError("axes: must be given for a CSV file, which says none; received none")
    speeds = _vectors(columns, rows, lines, _SPEEDS)
    v = None if speeds is None else speeds[0]
    return States(to_tai(stamps, scale, 1), places[0], v, axes, lines, places[1])


def _table(text: str) -> tuple[dict[str, int], list[list[str]], np.ndarray]:
    """Numbers of columns by name; rows; their lines."""
    reader = csv.reader(io.StringIO(text))
    columns: dict[str, int] = {}
    rows, lines = [], []
    for row in reader:
        if not any(word.strip() for word in row) or row[0].lstrip().startswith("#"):
            continue
        if not columns:
            columns = {name.strip().lower(): k for k, name in enumerate(row)}
            if len(columns) < len(row):
                raise ValueError(
                    f"line {reader.line_num}: must name each column once; received {','.join(row)}"
                )
            continue
        if len(row) != len(columns):
            raise ValueError(
                f"line {reader.line_num}: must have {len(columns)} columns as the first line has; "
                f"received {len(row)}"
            )
        rows.append([word.strip() for word in row])
        lines.append(reader.line_num)
    if not rows:
        raise ValueError("must hold rows below the names of its columns; received none")
    return columns, rows, np.array(lines)


def _times(columns, rows, lines) -> tuple[np.ndarray, str]:
    named = [name for name in _TIMES if name in columns]
    if len(named) == 1:
        place = columns[named[0]]
        stamps = [read_stamp(row[place], line) for row, line in zip(rows, lines, strict=True)]
        return np.array(stamps), named[0].upper()
    if "gps_week" in columns and "gps_s" in columns:
        week, seconds = _numbers(columns, rows, lines, ("gps_week", "gps_s")).T
        since = week.astype(np.int64) * np.timedelta64(_WEEK_S, "s")
        return _GPS_EPOCH + since + np.rint(1e9 * seconds).astype("timedelta64[ns]"), "GPS"
    raise ValueError(
        f"line 1: must name one column of times, {', '.join(_TIMES)}, or gps_week and gps_s; "
        f"received {', '.join(columns)}"
    )


def _geodetic(columns, rows, lines) -> tuple[np.ndarray, float] | None:
    """Earth-fixed places [m] and their rounding [m]."""
    if not all(name in columns for name in _GEODETIC):
        return None
    numbers = _numbers(columns, rows, lines, _GEODETIC)
    lat, lon, height = numbers.T
    r = ecef_from_geodetic(np.radians(lat), np.radians(lon), height)
    return r, max(rounding(numbers[:, :2], _DEGREE_M), rounding(numbers[:, 2:]))


def _vectors(columns, rows, lines, first: dict[str, float]) -> tuple[np.ndarray, float] | None:
    """Vectors [SI] of columns, the first of which is one of these, and their rounding; or None."""
    for name, unit in first.items():
        names = [name.replace("x", c) for c in "xyz"]
        if all(each in columns for each in names):
            numbers = _numbers(columns, rows, lines, names)
            return unit * numbers, rounding(numbers, unit)
    return None


def _numbers(columns, rows, lines, names) -> np.ndarray:
    places = [columns[name] for name in names]
    pairs = zip(rows, lines, strict=True)
    return np.array([read_numbers([row[k] for k in places], len(places), at) for row, at in pairs])
