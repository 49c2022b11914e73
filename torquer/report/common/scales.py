"""Units and limits of axes, and the placement of labels along them."""

from typing import NamedTuple

import numpy as np

#: Longest span [s] for which a time axis is labelled in this unit, and the unit's length [s].
_CLOCKS = ((600.0, "s", 1.0), (3 * 3600.0, "min", 60.0), (6 * 86400.0, "h", 3600.0))
#: Part of a logarithmic axis that is left free beyond the greatest value, over the rest of it.
_ROOM = 0.04
_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


class Clock(NamedTuple):
    """Unit of a time axis and its length in seconds."""

    unit: str
    seconds: float


def clock_for(span_s: float) -> Clock:
    """The time unit suited to a span."""
    for longest, unit, seconds in _CLOCKS:
        if span_s <= longest:
            return Clock(unit, seconds)
    return Clock("d", 86400.0)


def choose_prefix(values, unit: str) -> tuple[float, str]:
    """Factor and unit with the SI prefix suited to the largest value."""
    finite = np.abs(np.asarray(values)[np.isfinite(values)])
    greatest = finite.max() if finite.size else 0.0
    if greatest == 0.0:
        return 1.0, unit
    fitting = (pair for pair in _PREFIXES if greatest >= 0.1 * pair[0])
    size, prefix = next(fitting, _PREFIXES[-1])
    return 1.0 / size, prefix + unit


def log_floor(values, decades: float = 6.0) -> float | None:
    """Lower end of a logarithmic axis; None if no value is positive."""
    values = np.asarray(values)
    positive = values[np.isfinite(values) & (values > 0.0)]
    if positive.size == 0:
        return None
    return float(max(positive.min(), positive.max() * 10.0**-decades))


def log_ends(values, decades: float, least: float, others=()) -> tuple[float, float] | None:
    """Ends of a logarithmic axis, with room beyond the greatest; None if no value is positive.

    `decades` of the values are shown at most; it begins at this `least` part of the greatest, or
    below; `others` are marks beside the values: the axis reaches beyond them, too.
    """
    floor = log_floor(values, decades)
    if floor is None:
        return None
    low = min(0.7 * floor, least * float(np.nanmax(values)))
    greatest = float(np.nanmax(np.append(values, others)))
    return low, greatest * (greatest / low) ** _ROOM


def level_places(levels, y_range, log: bool, gap: float) -> tuple[list[float], list[float]]:
    """Heights (0..1) of ascending levels within a range, and of their labels, moved as little
    as needed to lie `gap` apart."""
    scale = np.log10 if log else np.asarray
    low, high = (float(scale(y)) for y in y_range)
    places = [(float(scale(y)) - low) / (high - low) for y in levels]
    moved = list(places)
    for _ in range(50):
        for i in range(1, len(moved)):
            lack = max(0.0, gap - (moved[i] - moved[i - 1]))
            moved[i - 1] -= 0.5 * lack
            moved[i] += 0.5 * lack
    return places, moved


def label_places(places, widths) -> list[tuple[float, int]]:
    """Left edge and row, from 0, of labels next to ascending places, as fractions of the width.

    A label stands to the right of its place, or to its left near the edge; in the
    first row in which it overlaps no other.
    """
    ends: list[float] = []
    found = []
    for place, width in zip(places, widths, strict=True):
        left = place if place + width <= 1.0 else max(0.0, place - width)
        row = next((i for i, end in enumerate(ends) if end <= left), len(ends))
        ends[row : row + 1] = [max(place, left + width)]
        found.append((left, row))
    return found


def split_where_wrapped(angle_deg, *others, low: float = -180.0) -> tuple[np.ndarray, ...]:
    """Angles [deg] from `low` to 360 deg more and series along them, broken where they jump.

    At a crossing three points go in: on the edge, a gap (not a number), on the other edge.
    """
    angles, high = np.asarray(angle_deg, dtype=float), low + 360.0
    step = np.diff(angles)
    at = np.flatnonzero(np.abs(step) > 180.0)
    ways = step[at] - 360.0 * np.sign(step[at])
    edge = np.where(ways > 0.0, high, low)
    part = np.where(ways == 0.0, 0.0, (edge - angles[at]) / np.where(ways == 0.0, 1.0, ways))
    gap = np.full(at.size, np.nan)
    where = np.repeat(at + 1, 3)

    def opened(values, triples):
        return np.insert(values, where, np.stack(triples, axis=1).ravel())

    split = [opened(angles, (edge, gap, low + high - edge))]
    for series in others:
        series = np.asarray(series, dtype=float)
        crossing = series[at] + part * (series[at + 1] - series[at])
        split.append(opened(series, (crossing, gap, crossing)))
    return tuple(split)
