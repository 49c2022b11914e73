"""Time series made ready to draw: units of the axes, fewer points, shaded bands, angles.

Plain numpy, no drawing: the PNG pictures and the interactive ones are made from the same.
"""

from typing import NamedTuple

import numpy as np

#: Longest span [s] for which a time axis is labelled in this unit, and the unit's length [s].
_CLOCKS = ((600.0, "s", 1.0), (1500 * 60.0, "min", 60.0), (6 * 86400.0, "h", 3600.0))
_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


class Clock(NamedTuple):
    """Unit of a time axis and its length in seconds."""

    unit: str
    seconds: float


def clock_for(span_s: float) -> Clock:
    """The unit in which a span of time reads well."""
    for longest, unit, seconds in _CLOCKS:
        if span_s <= longest:
            return Clock(unit, seconds)
    return Clock("d", 86400.0)


def prefixed(values, unit: str) -> tuple[float, str]:
    """Factor and unit with the SI prefix that suits the greatest of the values."""
    finite = np.abs(np.asarray(values)[np.isfinite(values)])
    greatest = finite.max() if finite.size else 0.0
    if greatest == 0.0:
        return 1.0, unit
    fitting = (pair for pair in _PREFIXES if greatest >= 0.1 * pair[0])
    size, prefix = next(fitting, _PREFIXES[-1])
    return 1.0 / size, prefix + unit


class Course(NamedTuple):
    """A series made short: means, and the least and greatest values around them.

    `low` and `high` are None where every value is kept; `stretch_s` is then 0. `fast` marks
    where the series swings so far within a stretch that a mean says nothing: there `y` has gaps.
    """

    t: np.ndarray
    y: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None
    fast: np.ndarray | None = None
    stretch_s: float = 0.0


def course(t, y, limit: int = 3000, swing: float = 0.3) -> Course:
    """A series [n] by at most `limit` numbers: as it is, or mean and range of equal stretches.

    Fast oscillation (more than `swing` of the whole range within a stretch) becomes a band with
    a smooth edge, slow motion stays a line, and no spike is lost.
    """
    t, y = np.asarray(t, dtype=float), np.asarray(y, dtype=float)
    if len(t) <= limit:
        return Course(t, y)
    length = -(-len(t) // (limit // 3))
    first = np.arange(0, len(t), length)
    last = np.minimum(first + length, len(t)) - 1
    count = np.add.reduceat(np.isfinite(y).astype(float), first)
    total = np.add.reduceat(np.nan_to_num(y), first)
    mean = np.divide(total, count, out=np.full(len(first), np.nan), where=count > 0)
    low, high = np.fmin.reduceat(y, first), np.fmax.reduceat(y, first)
    wide = np.nan_to_num(high - low) > swing * _spread(y)
    fast = _around(wide.astype(float), np.mean, 10) > 0.5
    low, high = np.where(fast, -_hull(-low), low), np.where(fast, _hull(high), high)
    middle, stretch_s = 0.5 * (t[first] + t[last]), length * float(t[1] - t[0])
    return Course(middle, np.where(fast, np.nan, mean), low, high, fast, stretch_s)


def _spread(y) -> float:
    finite = y[np.isfinite(y)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _hull(high) -> np.ndarray:
    """A line over all peaks that follows them closely: never below `high`."""
    return _around(_around(high, np.fmax.reduce, 3), np.fmin.reduce, 3)


def _around(values, reduce, neighbours: int) -> np.ndarray:
    """A value from each element and its neighbours on both sides."""
    padded = np.pad(values, neighbours, mode="edge")
    return reduce(np.lib.stride_tricks.sliding_window_view(padded, 2 * neighbours + 1), axis=1)


def thinned(t, y, limit: int = 3000) -> Course:
    """Every so many-th point of a cloud, its least and its greatest: at most `limit` of them."""
    t, y = np.asarray(t, dtype=float), np.asarray(y, dtype=float)
    if len(t) <= limit:
        return Course(t, y)
    rows = np.arange(0, len(t), -(-len(t) // (limit - 2)))
    kept = np.union1d(rows, [np.nanargmin(y), np.nanargmax(y)])
    return Course(t[kept], y[kept])


def bands_where(t, inside) -> list[tuple[float, float]]:
    """Spans of time [s] in which a series (1: inside, 0: outside) is above one half.

    Edges lie where the line between two samples crosses one half.
    """
    t, inside = np.asarray(t, dtype=float), np.asarray(inside, dtype=float) - 0.5
    above = inside > 0.0
    change = np.flatnonzero(above[1:] != above[:-1])
    before, after = inside[change], inside[change + 1]
    edges = t[change] + (t[change + 1] - t[change]) * before / (before - after)
    if above[0]:
        edges = np.concatenate([[t[0]], edges])
    if above[-1]:
        edges = np.concatenate([edges, [t[-1]]])
    return [(float(a), float(b)) for a, b in edges.reshape(-1, 2) if b > a]


def angle_deg(a, b) -> np.ndarray:
    """Angle [deg] between the rows of a and b [n, 3]; not a number where either is zero."""
    across, along = np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1)
    angle = np.degrees(np.arctan2(across, along))
    zero = (np.linalg.norm(a, axis=-1) == 0.0) | (np.linalg.norm(b, axis=-1) == 0.0)
    return np.where(zero, np.nan, angle)


def orbital_axes(position, velocity):
    """Attitudes of the orbital frame X to the inertial one, as scipy's `Rotation` [n]."""
    from scipy.spatial.transform import Rotation

    up, normal = np.asarray(position, dtype=float), np.cross(position, velocity)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack([np.cross(normal, up), normal, up], axis=2))


def attitude_error_deg(q_body_to_inertial, wanted, reference=None) -> np.ndarray:
    """Turn vectors [deg] (n, 3), in body axes, from the wanted attitude to the body's.

    `wanted`: quaternion from the body to the reference; `reference`: attitudes of that frame to
    the inertial one (`Rotation`), None for the inertial frame itself.
    """
    from scipy.spatial.transform import Rotation

    target = Rotation.from_quat(wanted)
    if reference is not None:
        target = reference * target
    return np.degrees((target.inv() * Rotation.from_quat(q_body_to_inertial)).as_rotvec())


def quiet_from(t, size) -> float | None:
    """Time from which a size stays below a tenth of its greatest, if a good part is left then."""
    loud = np.flatnonzero(size > 0.1 * np.max(size))
    first = int(loud[-1]) + 1 if loud.size else len(t)
    return float(t[first]) if first < 0.9 * len(t) and len(t) - first > 20 else None


def usual_size(values, part: float = 0.02) -> float:
    """Size that at most a part of the values exceeds."""
    sizes = np.abs(np.asarray(values))
    finite = sizes[np.isfinite(sizes)]
    return float(np.quantile(finite, 1.0 - part)) if finite.size else 0.0


def settled_from(t, size, within: float = 3.0) -> float | None:
    """Time at which a size first comes to `within` times its median over the second half.

    A 300th of its first value is little enough. None where it was there from the start, or where
    that takes more than a fifth of the time.
    """
    size = np.asarray(size)
    level = max(within * np.median(size[len(size) // 2 :]), size[0] / 300.0)
    first = int(np.argmax(size <= level))
    began, ended = float(t[0]), float(t[-1])
    return float(t[first]) if first and t[first] - began < 0.2 * (ended - began) else None


def log_floor(values, decades: float = 6.0) -> float | None:
    """Least value worth showing on a logarithmic axis; None if nothing is above zero."""
    values = np.asarray(values)
    positive = values[np.isfinite(values) & (values > 0.0)]
    if positive.size == 0:
        return None
    return float(max(positive.min(), positive.max() * 10.0**-decades))


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
    """Left edge and row, from 0, of labels beside ascending places, all in parts of the width.

    A label stands to the right of its place, or to its left where it would run over the edge; in
    the first row in which it covers no other.
    """
    ends: list[float] = []
    found = []
    for place, width in zip(places, widths, strict=True):
        left = place if place + width <= 1.0 else max(0.0, place - width)
        row = next((i for i, end in enumerate(ends) if end <= left), len(ends))
        ends[row : row + 1] = [max(place, left + width)]
        found.append((left, row))
    return found


def split_at_dateline(lon, *others) -> tuple[np.ndarray, ...]:
    """Longitudes [deg, -180..180] and series along them, broken where a track crosses +-180.

    At a crossing three points go in: on the edge, a gap (not a number), on the other edge.
    """
    lon = np.asarray(lon, dtype=float)
    step = np.diff(lon)
    at = np.flatnonzero(np.abs(step) > 180.0)
    ways = step[at] - 360.0 * np.sign(step[at])
    edge = np.where(ways > 0.0, 180.0, -180.0)
    part = np.where(ways == 0.0, 0.0, (edge - lon[at]) / np.where(ways == 0.0, 1.0, ways))
    gap = np.full(at.size, np.nan)
    where = np.repeat(at + 1, 3)

    def opened(values, triples):
        return np.insert(values, where, np.stack(triples, axis=1).ravel())

    split = [opened(lon, (edge, gap, -edge))]
    for series in others:
        series = np.asarray(series, dtype=float)
        crossing = series[at] + part * (series[at + 1] - series[at])
        split.append(opened(series, (crossing, gap, crossing)))
    return tuple(split)


def only_where(mask, *series) -> tuple[np.ndarray, ...]:
    """The series with gaps wherever the line leaves the mask; joints belong to both sides."""
    mask = np.asarray(mask, dtype=bool)
    kept = mask | np.concatenate([[False], mask[:-1]])
    return tuple(np.where(kept, s, np.nan) for s in series)
