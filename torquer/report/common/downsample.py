"""Downsampling of long series: averages with their ranges, thinned point clouds."""

from typing import NamedTuple

import numpy as np


class Downsampled(NamedTuple):
    """A downsampled series: averages with the minimum and maximum around them.

    `low` and `high` are None where every value is kept; `stretch_s` is then 0. `fast` marks
    where the series oscillates too fast for an average to mean anything: there `y` has gaps.
    """

    t: np.ndarray
    y: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None
    fast: np.ndarray | None = None
    stretch_s: float = 0.0


def downsample(t, y, limit: int = 3000, swing: float = 0.3) -> Downsampled:
    """A series [n] as at most `limit` numbers: unchanged, or average and range of equal stretches.

    Fast oscillation (more than `swing` of the whole range within a stretch) becomes a band with
    smooth edges, slow motion stays a line, and no spike is lost.
    """
    t, y = np.asarray(t, dtype=float), np.asarray(y, dtype=float)
    if len(t) <= limit:
        return Downsampled(t, y)
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
    return Downsampled(middle, np.where(fast, np.nan, mean), low, high, fast, stretch_s)


def _spread(y) -> float:
    finite = y[np.isfinite(y)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _hull(high) -> np.ndarray:
    """Smooth envelope of the peaks, never below `high`."""
    return _around(_around(high, np.fmax.reduce, 3), np.fmin.reduce, 3)


def _around(values, reduce, neighbours: int) -> np.ndarray:
    """Reduction over each element and its neighbours on both sides."""
    padded = np.pad(values, neighbours, mode="edge")
    return reduce(np.lib.stride_tricks.sliding_window_view(padded, 2 * neighbours + 1), axis=1)


def thin(t, y, limit: int = 3000) -> Downsampled:
    """Evenly thinned points with their minimum and maximum: at most `limit`."""
    t, y = np.asarray(t, dtype=float), np.asarray(y, dtype=float)
    if len(t) <= limit:
        return Downsampled(t, y)
    rows = np.arange(0, len(t), -(-len(t) // (limit - 2)))
    kept = np.union1d(rows, [np.nanargmin(y), np.nanargmax(y)])
    return Downsampled(t[kept], y[kept])
