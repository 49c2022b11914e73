"""CCSDS Orbit Ephemeris Message (502.0-B), in keyword-value notation: positions and velocities."""

import numpy as np

from torquer.environment.orbit.files.naming import first_line, is_called
from torquer.environment.orbit.files.stamps import (
    at_line,
    by_line,
    read_numbers,
    read_stamp,
    scale_named,
)
from torquer.environment.orbit.files.states import States, axes_named, rounding

_START = "CCSDS_OEM_VERS"
#: Numbers of a row: position and velocity, or acceleration, too.
_COUNTS = (6, 9)


def is_oem(text: str) -> bool:
    """Whether a file begins as one, after comments."""
    return first_line(text, ("COMMENT",)).startswith(_START)


def read_oem(text: str, satellite: str | None) -> States:
    """The states of an object, which is named by its name or designator where there are several.

    Segments of one object follow one another without a jump: a manoeuvre between them would lie
    between two positions as any other, so a file with several is refused.
    """
    segments = _segments(text)
    if not segments:
        raise ValueError("must hold a segment (META_START); received none")
    named = [each for each in segments if is_called(satellite, *each.names())]
    if len(named) > 1 and len({frozenset(each.names()) for each in named}) == 1:
        raise ValueError(
            f"must hold one segment of an object, as segments are not joined; received {len(named)}"
        )
    if len(named) != 1:
        known = ", ".join(sorted({name for each in segments for name in each.names()}))
        raise ValueError(
            f"satellite: must name the object of one segment of {len(segments)} ({known}); "
            f"received {satellite!r}"
        )
    return named[0].states()


class _Segment:
    """A segment: keywords with their lines, rows of numbers with theirs."""

    def __init__(self):
        self.keys: dict[str, tuple[str, int]] = {}
        self.rows: list[tuple[int, list[str]]] = []

    def names(self) -> set[str]:
        """Name and designator of its object."""
        return {self.keys[k][0] for k in ("OBJECT_NAME", "OBJECT_ID") if k in self.keys}

    def value(self, key: str) -> tuple[str, int]:
        """A keyword's value and line."""
        if key not in self.keys:
            at = self.rows[0][0] if self.rows else 1
            raise ValueError(
                f"line {at}: {key} must stand before the first position; received none"
            )
        return self.keys[key]

    def states(self) -> States:
        """Its positions and velocities."""
        centre, line = self.value("CENTER_NAME")
        if centre.upper() != "EARTH":
            raise ValueError(f"line {line}: CENTER_NAME must be EARTH; received {centre!r}")
        axes, scale = self._axes(), self._scale()
        if not self.rows:
            raise ValueError("must hold positions; received a segment without any")
        lines, words = zip(*self.rows, strict=True)
        tai = by_line(lambda row: read_stamp(row[0], scale), lines, words)
        km = by_line(_numbers, lines, words)
        rounded = rounding(km[:, :3], 1e3)
        return States(tai, 1e3 * km[:, :3], 1e3 * km[:, 3:6], axes, np.array(lines), rounded)

    def _axes(self) -> str:
        name, line = self.value("REF_FRAME")
        with at_line(line):
            axes = axes_named(name)
        if axes == "TEME" and "REF_FRAME_EPOCH" in self.keys:
            epoch, line = self.keys["REF_FRAME_EPOCH"]
            raise ValueError(
                f"line {line}: REF_FRAME_EPOCH must be left out, as TEME is read as that of date; "
                f"received {epoch!r}"
            )
        return axes

    def _scale(self) -> str:
        name, line = self.value("TIME_SYSTEM")
        with at_line(line):
            return scale_named(name)


def _numbers(words: list[str]) -> list[float]:
    """Position and velocity of a row, in km and km/s; an acceleration behind them is left."""
    if len(words) - 1 not in _COUNTS:
        raise ValueError(
            f"must hold {_COUNTS[0]} numbers after the time, or {_COUNTS[1]} with accelerations; "
            f"received {len(words) - 1}"
        )
    return read_numbers(words[1:], len(words) - 1)[:6]


def _segments(text: str) -> list[_Segment]:
    segments, skipping = [], False
    for line, whole in enumerate(text.splitlines(), start=1):
        words = whole.split()
        if not words or words[0] == "COMMENT":
            continue
        if words[0] == "META_START":
            segments.append(_Segment())
        skipping = words[0] == "COVARIANCE_START" or (skipping and words[0] != "COVARIANCE_STOP")
        key, is_keyword, value = whole.partition("=")
        if skipping or words[0].endswith(("_START", "_STOP")) or not segments:
            continue
        if is_keyword:
            segments[-1].keys[key.strip()] = value.strip(), line
        else:
            segments[-1].rows.append((line, words))
    return segments
