"""SGP4/SDP4 orbit of a two-line element set, in TEME (true equator, mean equinox of date).

The element set is checked column by column before it is used: a shifted or mistyped line gives
a one-line error instead of a wrong orbit.
"""

import math
import re
from datetime import datetime, timedelta
from typing import ClassVar, Literal

import numpy as np
from pydantic import field_validator
from sgp4.api import SGP4_ERRORS, Satrec

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.time import DAY_S, julian_dates, parse_utc
from torquer.environment.orbit.kepler import TWO_PI, Orbit, check_farthest

_LENGTH = 69
_CATALOGUE = r"[ 0-9A-Z][ 0-9]{3}[0-9]"
_DECIMAL = r"[ +-]\.[0-9]{8}"
_EXPONENT = r"[ +-][ 0-9][0-9]{4}[+-][0-9]"
_COUNT = r"[ 0-9]{3}[0-9]"

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
        return [f"{where}: must have {_LENGTH} columns; received {len(line)}"]
    faults, blank = [], set(range(1, _LENGTH + 1))
    for name, first, last, pattern in _FIELDS[number]:
        text = line[first - 1 : last]
        blank -= set(range(first, last + 1))
        if not re.fullmatch(pattern, text):
            columns = f"column {first}" if first == last else f"columns {first}-{last}"
            faults.append(f"{where}: {columns} must hold the {name}; received {text!r}")
    faults += [
        f"{where}: column {column} must be blank; received {line[column - 1]!r}"
        for column in sorted(blank)
        if line[column - 1] != " "
    ]
    if line[-1].isdigit() and int(line[-1]) != checksum(line):
        faults.append(f"{where}: checksum must be {checksum(line)}; received {line[-1]}")
    return faults


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
    rev_per_day = float(second[52:63])
    axis = (MU_EARTH_M3_S2 / (rev_per_day * TWO_PI / DAY_S) ** 2) ** (1.0 / 3.0)
    check_farthest(axis * (1.0 + float(f"0.{second[26:33]}")))


class Sgp4(Orbit):
    """Orbit of a two-line element set by SGP4."""

    kind: Literal["sgp4"] = "sgp4"
    frame: ClassVar = "TEME"
    tle: tuple[str, str]
    """The two lines, or three with a name before them."""

    @field_validator("tle", mode="before")
    @classmethod
    def _two_lines(cls, value):
        lines = value.splitlines() if isinstance(value, str) else value
        if not isinstance(lines, (list, tuple)) or not all(isinstance(x, str) for x in lines):
            raise ValueError(f"tle: must be lines of text; received {value!r}")
        lines = tuple(line.rstrip() for line in lines if line.strip())
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

    def state(
        self, t_s, start_utc: str | datetime, dut1_s: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s in TEME at times [n] s after the start.

        The epoch of the elements is UTC, so UT1 - UTC does not matter. A time that SGP4 rejects
        (decay, for instance) is a `ValueError` with SGP4's reason.
        """
        t_s = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
        (day, fraction), _ = julian_dates(start_utc, t_s)
        codes, r_km, v_km_s = Satrec.twoline2rv(*self.tle).sgp4_array(
            np.full_like(fraction, day), np.ascontiguousarray(fraction)
        )
        if np.any(codes):
            _refuse(t_s, codes, parse_utc(start_utc))
        return r_km * 1e3, v_km_s * 1e3


def _refuse(t_s: np.ndarray, codes: np.ndarray, start: datetime) -> None:
    """Raise `ValueError` for the first time at which SGP4 gave an error code."""
    row = int(np.flatnonzero(codes)[0])
    code = int(codes[row])
    meaning = SGP4_ERRORS.get(code, "unknown error")
    moment = (start + timedelta(seconds=math.floor(t_s[row]))).isoformat()
    raise ValueError(f"sgp4: no orbit at t = {t_s[row]:.6g} s ({moment}): error {code}, {meaning}")
