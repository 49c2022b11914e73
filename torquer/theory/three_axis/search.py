"""The greatest value of a function that need not be smooth, by grids that close in on it.

A degree of stability is the least of several rates: at its greatest value two or more of them meet,
and there it has a corner. Methods with gradients stop short of it; a grid does not.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_FINER = 11
#: Local maxima of the first grid that are followed.
_FOLLOWED = 3
_MOST_MOVES = 50


class Best(NamedTuple):
    """Greatest value found: point `[m]`, value, spacing `[m]` of the last grid around it, points
    evaluated. No point of the first grid over the box, nor of those around it, has a greater.

    `ends`: where the point lies at an end of the box, -1 at the low one and 1 at the high one, or 0
    `[m]`: beyond, values may be greater.
    """

    point: np.ndarray
    value: float
    spacing: np.ndarray
    evaluations: int
    ends: tuple[int, ...] = ()


def greatest(
    function: Callable[[np.ndarray], np.ndarray], low, high, count: int, spacing: float
) -> Best:
    """Greatest value within a box.

    `function` takes points `[n, m]` and returns values `[n]`, minus infinity where a point is not
    allowed. `count`: points of the first grid along each side; grids close in until their spacing
    is `spacing` or less.
    """
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    grid = _grid(low, high, count)
    values = function(grid.reshape(-1, len(low))).reshape(grid.shape[:-1])
    cell, used = (high - low) / (count - 1), values.size
    found = []
    for place in _local_maxima(values)[:_FOLLOWED]:
        start = Best(grid[place], float(values[place]), cell, 0)
        best = _follow(function, start, low, high, spacing)
        used += best.evaluations
        found.append(best)
    if not found:
        raise ArithmeticError("search: a point of the box must be allowed; none of the grid is")
    best = max(found, key=lambda best: best.value)
    ends = (best.point >= high - best.spacing).astype(int) - (best.point <= low + best.spacing)
    return best._replace(evaluations=used, ends=tuple(ends.tolist()))


def _follow(function, best: Best, low, high, spacing: float) -> Best:
    """Finer grids around a point; one whose best point is on its rim is moved, not made finer."""
    used, cell = 0, best.spacing
    for _ in range(_MOST_MOVES):
        if (cell <= spacing).all():
            break
        first, last = np.maximum(best.point - cell, low), np.minimum(best.point + cell, high)
        grid = _grid(first, last, _FINER).reshape(-1, len(low))
        values = function(grid)
        used += len(grid)
        top = int(np.argmax(values))
        if values[top] > best.value:
            best = best._replace(point=grid[top], value=float(values[top]))
        on_rim = (best.point == first) & (first > low) | (best.point == last) & (last < high)
        if not on_rim.any():
            cell = 2.0 * cell / (_FINER - 1)
    return best._replace(spacing=cell, evaluations=used)


def _grid(low, high, count: int) -> np.ndarray:
    """Points `[count, ..., count, m]` of an even grid."""
    rows = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)


def _local_maxima(values) -> list[tuple]:
    """Places of values that no neighbour exceeds, the greatest first."""
    padded = np.pad(values, 1, constant_values=-np.inf)
    top = np.isfinite(values)
    for shift in np.ndindex((3,) * values.ndim):
        window = tuple(slice(s, s + n) for s, n in zip(shift, values.shape, strict=True))
        top &= values >= padded[window]
    places = np.argwhere(top)
    order = np.argsort(-values[tuple(places.T)], kind="stable")
    return [tuple(place) for place in places[order]]


def first_crossing(function: Callable[[np.ndarray], np.ndarray], points) -> float:
    """Where a function of one variable, positive at the first of the points, first becomes negative
    between two of them; NaN if it does not. To a part in 1e6 of that interval."""
    points = np.asarray(points, dtype=float)
    for _ in range(4):
        below = ~(function(points) > 0.0)
        if not below.any():
            return float("nan")
        k = int(np.argmax(below))
        if k == 0:
            return float(points[0])
        points = np.linspace(points[k - 1], points[k], 33)
    return float(points[16])
