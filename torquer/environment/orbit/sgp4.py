"""SGP4/SDP4 orbit of a two-line element set, in TEME (true equator, mean equinox of date).

The element set is checked column by column before it is used: a shifted or mistyped line gives
a one-line error instead of a wrong orbit.
"""

import math
import re
from datetime import datetime, timedelta
from typing import ClassVar, Literal

import numpy as np
from pydantic import field_validator, model_validator
from sgp4.api import SGP4_ERRORS, Satrec
from sgp4.conveniences import sat_epoch_datetime

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.time import DAY_S, julian_dates, leap_seconds_between, parse_utc
from torquer.environment.orbit.kepler import TWO_PI, Extent, Orbit, check_farthest

_LENGTH = 69
_CATALOGUE = r"[ 0-9A-Z][ 0-9]{3}[0-9]"
#: As published, or with a digit before the point, as in lists of amateurs; SGP4 does not use it.
_DECIMAL = r"(?=.{10}$) *[+-]?[0-9]?\.[0-9]+ *"
_EXPONENT = r"[ +-][ 0-9][0-9]{4}[+-][0-9]"
_COUNT = r"[ 0-9]{3}[0-9]"

#: Part of the semi-major axis by which a place may lie outside perigee and apogee. The Moon and the
#: Sun change them by a tenth in years; all places of SGP4's own test cases are within it.
_SLACK = 0.2
#: Part of what drag moves a satellite along its orbit by that SGP4 does not know: the air's density
#: is forecast no better. The rest of its error grows by some kilometres a day.
_DRAG_UNKNOWN, _GROWTH_M_DAY = 0.1, 3e3
#: Places between the epoch and the times asked for at which the orbit must be there, too.
_PLACES = 100

#: Fields of each line: name, first and last column (from 1), pattern.
_FIELDS = {
    1: (
        ("line number", 1, 1, "1"),
        ("catalogue number", 3, 7, _CATALOGUE),
        ("classification", 8, 8, "[A-Z ]"),
        ("designator", 10, 17, r"[0-9]{5}[A-Z ]{3}| {8}"),
        ("epoch", 19, 32, r"[0-9]{2}[ 0-3][ 0-9][0-9]\.[0-9]{8}"),
        ("mean motion derivative", 34, 43, _DECIMAL),
        ("second derivative", 45, 52, _EXPONENT),
        ("drag term", 54, 61, _EXPONENT),
        ("ephemeris type", 63, 63, "[ 0-9]"),
        ("element set number", 65, 68, _COUNT),
        ("checksum", 69, 69, "[0-9]"),
    ),
    2: (
        ("line number", 1, 1, "2"),
        ("catalogue number", 3, 7, _CATALOGUE),
        ("inclination", 9, 16, r"[ 0-9]{2}[0-9]\.[0-9]{4}"),
        ("right ascension of the node", 18, 25, r"[ 0-9]{2}[0-9]\.[0-9]{4}"),
        ("eccentricity", 27, 33, "[0-9]{7}"),
        ("argument of perigee", 35, 42, r"[ 0-9]{2}[0-9]\.[0-9]{4}"),
        ("mean anomaly", 44, 51, r"[ 0-9]{2}[0-9]\.[0-9]{4}"),
        ("mean motion", 53, 63, r"[ 0-9][0-9]\.[0-9]{8}"),
        ("revolution number", 64, 68, r"[ 0-9]{4}[0-9]"),
        ("checksum", 69, 69, "[0-9]"),
    ),
}


def checksum(line: str) -> int:
    """Checksum of a line's first 68 columns: the sum of digits, a minus counting one, modulo 10."""
    head = line[: _LENGTH - 1]
    return (sum(int(c) for c in head if c.isdigit()) + head.count("-")) % 10


def _line_faults(number: int, line: str) -> list[str]:
    """What keeps a line from having the published layout and its checksum, a text each."""
    where = f"tle line {number}"
    if len(line) > _LENGTH and line.isascii():
        beyond = (
            f"{where}: must have {_LENGTH} columns; received {len(line)}, with "
            f"{line[_LENGTH : _LENGTH + 40].strip()!r} beyond them"
        )
        return [beyond, *_line_faults(number, line[:_LENGTH])]
    if len(line) != _LENGTH or not line.isascii():
        missing = _missing_part(number, line) if line.isascii() else ""
        return [f"{where}: must have {_LENGTH} columns; received {len(line)}{missing}"]
    faults, blank = [], set(range(1, _LENGTH + 1))
    for name, first, last, pattern in _FIELDS[number]:
        text = line[first - 1 : last]
        blank -= set(range(first, last + 1))
        if not re.fullmatch(pattern, text):
            columns = _columns(first, last)
            faults.append(f"{where}: {columns} must hold the {name}; received {text!r}")
    faults += [
        f"{where}: column {column} must be blank; received {line[column - 1]!r}"
        for column in sorted(blank)
        if line[column - 1] != " "
    ]
    if line[-1].isdigit() and int(line[-1]) != checksum(line):
        faults.append(f"{where}: checksum must be {checksum(line)}; received {line[-1]}")
    return faults


def _missing_part(number: int, line: str) -> str:
    """What a line that is too short lacks: fields at its end, or a column before a field."""
    for name, first, last, pattern in _FIELDS[number]:
        text = line[first - 1 : last]
        if last <= len(line) and not re.fullmatch(pattern, text):
            return f", and {_columns(first, last)} are not the {name}: {text!r}"
    fields = {name: _columns(first, last) for name, first, last, _ in _FIELDS[number]
              if last > len(line)}  # fmt: skip
    parts = " and ".join(f"the {name} ({place})" for name, place in fields.items())
    would = ""
    if len(line) == _LENGTH - 1:
        would = f", which would be {checksum(line)}; orbit.without_checksums = true does without"
    return f", without {parts}{would}"


def _columns(first: int, last: int) -> str:
    return f"column {first}" if first == last else f"columns {first}-{last}"


def _range_faults(first: str, second: str) -> list[str]:
    """Which numbers of two well-formed lines cannot describe an orbit, a text each."""
    faults = []
    if first[2:7] != second[2:7]:
        faults.append(
            "tle: catalogue number must be the same in both lines; received "
            f"{first[2:7]!r} and {second[2:7]!r}"
        )
    ranged = (
        ("tle line 1: epoch day", float(first[20:32]), 1.0, 367.0),
        ("tle line 2: inclination", float(second[8:16]), 0.0, 180.0),
        ("tle line 2: right ascension of the node", float(second[17:25]), 0.0, 360.0),
        ("tle line 2: argument of perigee", float(second[34:42]), 0.0, 360.0),
        ("tle line 2: mean anomaly", float(second[43:51]), 0.0, 360.0),
    )
    for name, value, low, high in ranged:
        if not low <= value <= high:
            faults.append(f"{name} must lie in {low:g}..{high:g}; received {value:.12g}")
    rev_per_day = float(second[52:63])
    if not rev_per_day > 0.0:
        faults.append(f"tle line 2: mean motion must be positive; received {rev_per_day:g} rev/day")
    return faults


def _check_size(second: str) -> None:
    """Raise `ValueError` for an orbit beyond the Hill sphere."""
    try:
        check_farthest(_extent(second).apogee_m)
    except ValueError as error:  # of the key that an element set has
        raise ValueError(str(error).replace("orbit: ", "tle: its orbit ", 1)) from None


def _extent(second: str) -> Extent:
    """Where the mean elements of a second line lie."""
    rate, eccentricity = float(second[52:63]) * TWO_PI / DAY_S, float(f"0.{second[26:33]}")
    axis = (MU_EARTH_M3_S2 / rate**2) ** (1.0 / 3.0)
    tilt = math.radians(float(second[8:16]))
    return Extent(axis * (1.0 - eccentricity), axis * (1.0 + eccentricity), tilt)


def _lines(value) -> tuple[str, ...] | None:
    """Lines of a text or a list that hold something; None for what are no lines of text."""
    lines = value.splitlines() if isinstance(value, str) else value
    if not isinstance(lines, list | tuple) or not all(isinstance(x, str) for x in lines):
        return None
    return tuple(line.rstrip() for line in lines if line.strip())


class Sgp4(Orbit):
    """Orbit of a two-line element set by SGP4."""

    kind: Literal["sgp4"] = "sgp4"
    frame: ClassVar = "TEME"
    tle: tuple[str, str]
    """The two lines, or three with a name before them."""
    without_checksums: bool = False
    """Whether the lines end before their checksums, in column 68: nothing then shows a slip."""

    @model_validator(mode="before")
    @classmethod
    def _add_checksums(cls, data):
        if not (isinstance(data, dict) and data.get("without_checksums") is True):
            return data
        lines = _lines(data.get("tle"))
        if lines is None:
            return data
        ends = [len(line) for line in lines[-2:]]
        if ends == [_LENGTH - 1] * 2:
            return data | {"tle": [line + str(checksum(line)) for line in lines[-2:]]}
        if ends != [_LENGTH] * 2:  # with checksums they come from a result
            raise ValueError(
                f"tle: must have lines of {_LENGTH - 1} columns with without_checksums; received "
                f"{' and '.join(map(str, ends))}"
            )
        return data

    @field_validator("tle", mode="before")
    @classmethod
    def _two_lines(cls, value):
        lines = _lines(value)
        if lines is None:
            raise ValueError(f"tle: must be lines of text; received {value!r}")
        if len(lines) not in (2, 3):
            raise ValueError(
                f"tle: must have two lines, or three with a name; received {len(lines)}"
            )
        return lines[-2:]

    @field_validator("tle")
    @classmethod
    def _check(cls, tle):
        """All faults at once, a line each; those of the numbers in well-formed lines only."""
        numbered = enumerate(tle, start=1)
        faults = [fault for number, line in numbered for fault in _line_faults(number, line)]
        if faults := faults or _range_faults(*tle):
            raise ValueError("\n".join(faults))
        _check_size(tle[1])
        return tle

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean motion [rad/s] of the element set at its epoch."""
        return float(self.tle[1][52:63]) * TWO_PI / DAY_S

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination of the mean elements at their epoch."""
        return _extent(self.tle[1])

    def state(
        self, t_s, start_utc: str | datetime, dut1_s: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s in TEME at times [n] s after the start.

        The epoch of the elements is UTC, so UT1 - UTC does not matter. A time that SGP4 rejects
        (decay, for instance) is a `ValueError` with SGP4's reason.
        """
        return propagate(Satrec.twoline2rv(*self.tle), self.extent(), t_s, start_utc)


def propagate(
    satellite: Satrec, extent: Extent, t_s, start_utc: str | datetime
) -> tuple[np.ndarray, np.ndarray]:
    """Position [n, 3] m and velocity [n, 3] m/s in TEME at times [n] s after the start.

    `extent`: of the mean elements, beyond which no place is the satellite's. Seconds count from
    the epoch, leap seconds included: an instant of UTC is one place, whenever the run began.
    """
    t_s = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
    day, fraction = _dates(satellite, t_s, start_utc)
    codes, r_km, v_km_s = satellite.sgp4_array(
        np.full_like(fraction, day), np.ascontiguousarray(fraction)
    )
    if reason := _first_fault(extent, codes, r_km):
        row, why = reason
        raise ValueError(f"sgp4: no orbit at {_moment(start_utc, t_s[row])}: {why}")
    ends = [t_s[k] for k in {int(t_s.argmin()), int(t_s.argmax())}] if t_s.size else []
    for end_s in ends:
        _check_way(satellite, extent, start_utc, end_s)
    return r_km * 1e3, v_km_s * 1e3


def _dates(satellite: Satrec, t_s, start_utc) -> tuple[float, np.ndarray]:
    """Days and their fractions that SGP4 takes for times [s] after the start.

    It knows no leap seconds: those from the epoch to the start are added.
    """
    (day, fraction), _ = julian_dates(
        start_utc, t_s + leap_seconds_since_epoch(satellite, start_utc)
    )
    return day, fraction


def leap_seconds_since_epoch(satellite: Satrec, start_utc: str | datetime) -> int:
    """Leap seconds between the epoch of elements and the start of a run."""
    return leap_seconds_between(sat_epoch_datetime(satellite), start_utc)


def _check_way(satellite: Satrec, extent: Extent, start_utc, end_s: float) -> None:
    """ValueError for a time [s] after the orbit has ended on the way there from the epoch.

    SGP4's polynomials in time pass through an axis of zero, and beyond it may look like an orbit.
    """
    day, fraction = _dates(satellite, np.array([end_s]), start_utc)
    epoch, whole = satellite.jdsatepochF, float(day - satellite.jdsatepoch)
    away_days = whole + float(fraction[0]) - epoch
    days = np.linspace(0.0, away_days, _PLACES)
    codes, r_km, _ = satellite.sgp4_array(np.full(_PLACES, satellite.jdsatepoch), epoch + days)
    if reason := _first_fault(extent, codes, r_km):
        row, why = reason
        ended_s = end_s + (days[row] - away_days) * DAY_S
        raise ValueError(
            f"sgp4: no orbit at {_moment(start_utc, end_s)}: on the way from the epoch of the "
            f"elements there is none at {_moment(start_utc, ended_s)}: {why}"
        )
    _check_age(satellite, extent, away_days, _moment(start_utc, end_s))


def _check_age(satellite: Satrec, extent: Extent, age_days: float, when: str) -> None:
    """ValueError for an age at which the error is half a revolution: the place may be any."""
    moved = _moved_by_drag(satellite, age_days)
    if _error_in_revolutions(moved, extent, age_days) < 0.5:
        return
    raise ValueError(
        f"sgp4: no orbit at {when}: {abs(age_days):.0f} days from the epoch of the elements their "
        f"error is half a revolution or more (drag moves the satellite by {moved:.2g} revolutions, "
        "of which a tenth is not known): take elements of about this time"
    )


def _error_in_revolutions(moved: float, extent: Extent, age_days: float) -> float:
    """Likely error along the orbit of elements of an age, by which drag has moved a satellite."""
    axis_m = 0.5 * (extent.perigee_m + extent.apogee_m)
    return _DRAG_UNKNOWN * moved + _GROWTH_M_DAY * abs(age_days) / (TWO_PI * axis_m)


def likely_error_s(satellite: Satrec, extent: Extent, age_days: float) -> float:
    """By how much a satellite may be early or late [s] at an age of its elements, by a rule:
    3 km a day, and a tenth of what drag has moved it."""
    revolutions = _error_in_revolutions(_moved_by_drag(satellite, age_days), extent, age_days)
    return revolutions * TWO_PI / satellite.no_kozai * 60.0


def _moved_by_drag(satellite: Satrec, age_days: float) -> float:
    """Revolutions by which drag has moved a satellite of low orbit; none in deep space."""
    if satellite.method != "n":
        return 0.0
    days, rates = np.linspace(0.0, age_days, _PLACES), []
    for day in days.tolist():
        satellite.sgp4(satellite.jdsatepoch, satellite.jdsatepochF + day)
        rates.append(satellite.nm)
    gained = np.array(rates) - rates[0]
    return abs(float(np.trapezoid(gained, days))) * 1440.0 / TWO_PI


def _first_fault(extent: Extent, codes: np.ndarray, r_km: np.ndarray) -> tuple[int, str] | None:
    """(Row, reason) of the first place that is not on the orbit of the elements.

    SGP4's codes do not show all: far from their epoch elements with much drag have any place.
    """
    near, far = (1e-3 * radius for radius in extent[:2])
    slack = _SLACK * 0.5 * (near + far)
    radius_km = np.linalg.norm(r_km, axis=1)
    is_on_it = (radius_km > near - slack) & (radius_km < far + slack)
    rows = np.flatnonzero((codes != 0) | ~is_on_it)
    if rows.size == 0:
        return None
    row = int(rows[0])
    code = int(codes[row])
    if code != 0:
        return row, f"error {code}, {SGP4_ERRORS.get(code, 'unknown error')}"
    return row, (
        f"it would be {radius_km[row]:.6g} km from the Earth's centre, and the orbit of the "
        f"elements has {near:.6g} to {far:.6g} km: they do not hold at this time"
    )


def _moment(start_utc: str | datetime, t_s: float) -> str:
    """A time of the run, as seconds and as a date."""
    date = parse_utc(start_utc) + timedelta(seconds=math.floor(t_s))
    return f"t = {t_s:.6g} s ({date.isoformat()})"
