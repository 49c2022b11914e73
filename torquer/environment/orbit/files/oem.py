"""CCSDS Orbit Ephemeris Message (502.0-B), in keyword-value notation: positions and velocities."""

import math

import numpy as np

from torquer.environment.orbit.files.states import States, axes_named, rounding, to_tai

_STARTS = ("CCSDS_OEM_VERS",)


def is_oem(text: str) -> bool:
    """Whether a file begins as one."""
    return text.lstrip().startswith(_STARTS)


def read_oem(text: str, satellite: str | None) -> States:
    """The states of an object, which is named by its name or designator where there are several.

    Segments of one object follow one another without a jump: a manoeuvre between them would lie
    between two positions as any other, so a file with several is refused.
    """
    segments = _segments(text)
    named = [each for each in segments if satellite is None or satellite in each.names()]
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
        axes = axes_named(*self.value("REF_FRAME"))
        if not self.rows:
            raise ValueError("must hold positions; received a segment without any")
        scale, line = self.value("TIME_SYSTEM")
        lines = np.array([line for line, _ in self.rows])
        stamps = np.array([read_stamp(words[0], at) for at, words in self.rows])
        km = np.array([read_numbers(words[1:7], 6, at) for at, words in self.rows])
        tai, rounded = to_tai(stamps, scale, line), rounding(km[:, :3], 1e3)
        return States(tai, 1e3 * km[:, :3], 1e3 * km[:, 3:], axes, lines, rounded)


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


def read_stamp(word: str, line: int) -> np.datetime64:
    """The instant of an ISO 8601 text, calendar or day of year: of UTC, or without a zone."""
    bare = word.removesuffix("Z").removesuffix("+00:00").replace(" ", "T", 1)
    try:
        date, _, time = bare.partition("T")
        if "+" in time or "-" in time:
            raise ValueError(
                f"line {line}: must be a time of no other zone than UTC; received {word!r}"
            )
        if date.count("-") == 1:  # day of the year
            year, day = date.split("-")
            first = np.datetime64(f"{year}-01-01", "D")
            date = str(first + (int(day) - 1))
        return np.datetime64(f"{date}T{time}", "ns")
    except ValueError as error:
        if str(error).startswith("line "):
            raise
        raise ValueError(f"line {line}: must begin with a time; received {word!r}") from None


def read_numbers(words: list[str], count: int, line: int) -> list[float]:
    """So many finite numbers of a line."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(
            f"line {line}: must hold {count} numbers; received {' '.join(words)[:80]!r}"
        )
    return numbers
