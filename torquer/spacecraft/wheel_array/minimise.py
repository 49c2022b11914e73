"""The least value of a maximum of smooth pieces within bounds, to a checked optimality.

A maximum of smooth functions has kinks, at which descent methods stall. It is solved as the minimax
problem that it is: least t with all pieces up to t, for which sequential quadratic programs find
the pieces that count, and Newton's method then the point where they are equal and their gradients
balance.
"""

from collections.abc import Callable
from itertools import compress
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize, nnls

#: Residual up to which a point is an optimum.
TOLERANCE = 1e-8
#: Part by which pieces that were left out may be above the others: in all descents, in the last.
ROUGH, FINE = 1e-6, 1e-12
#: Step below which an optimum has converged.
MOVED = 1e-10
#: Part by which optima that are as good may differ.
SAME = 1e-9
#: Step of differences, as a part of the range between bounds; their five points are in bounds.
STEP = 1e-4
#: Pieces are looked at from this part of the greatest on, and in a first round so many at most.
NEAR, MOST = 0.5, 100
#: Rounds of adding pieces that had been left out, and steps of Newton's method.
ROUNDS, STEPS = 30, 12
#: Pieces within this part of the greatest may be equal to it at the optimum.
ACTIVE = 1e-3
#: Replaces values that are infinite or NaN.
HUGE = 1e30


class Least(NamedTuple):
    """A local optimum: parts (p,) of the ranges from 0 to 1, the greatest piece, the residual.

    Residual: the least, over weights of the pieces that add up to 1, of the norm of the weighted
    gradient (as far as bounds do not hold it) and of the weighted distance to the greatest piece,
    per greatest piece and range of a parameter: 0 are the conditions of Karush, Kuhn and Tucker.
    And by how much the weighted gradient differs on either side of the point: pieces with kinks of
    their own are not smooth there, and the residual proves nothing.
    """

    parts: np.ndarray
    value: float
    residual: float


def least_greatest(pieces: Callable, points) -> Least:
    """The best of the local optima from points (s, p) in the unit cube; the first of equals.

    `pieces(parts, near)`: see `search`; all of them finite at some of the points.
    """
    ends = [_descend(pieces, point, ROUGH, False) for point in points]
    lowest = min(end.value for end in ends)
    good = [end for end in ends if end.value <= lowest * (1.0 + 10.0 * ROUGH)]
    new = [
        not any(np.abs(end.parts - other.parts).max() < STEP for other in good[:k])
        for k, end in enumerate(good)
    ]
    optima = [_descend(pieces, end.parts, FINE, True) for end in compress(good, new)]
    lowest = min(end.value for end in optima)
    return next(end for end in optima if end.value <= lowest * (1.0 + SAME))


def _descend(pieces, x, close: float, refine: bool) -> Least:
    """One local optimum: rounds with more and more of the pieces, until none is left out."""
    chosen: list[tuple[np.ndarray, np.ndarray]] = []

    def some(x):
        return np.concatenate([_finite(pieces(x, near))[which] for near, which in chosen])

    level, moving = 0.0, refine
    for _ in range(ROUNDS):
        values = _finite(pieces(x, x))
        if values.max() == 0.0:  # no demand
            return Least(x, 0.0, 0.0)
        left_out = values.max() > level * (1.0 + close)
        if not left_out and not moving:
            break
        which = np.flatnonzero(values > NEAR * values.max())
        chosen.append((x, which[np.argsort(-values[which], kind="stable")[:MOST]]))
        before, x = x, _sequential(some, x) if left_out else _refine(some, x)
        moving = refine and (left_out or np.abs(x - before).max() > MOVED)
        level = some(x).max()
    value, balance = float(_finite(pieces(x, x)).max()), _balance(some, x)
    above = max(value / level - 1.0, 0.0) if left_out else 0.0
    return Least(x, value, balance.residual + above + _kinks(some, x, balance.weights))


def _finite(values) -> np.ndarray:
    return np.minimum(np.nan_to_num(values, nan=HUGE, posinf=HUGE), HUGE)


def _sequential(some, x) -> np.ndarray:
    """Least t with all pieces up to t, by sequential quadratic programs."""
    scale, last = some(x).max(), np.append(np.zeros(len(x)), 1.0)
    ones = np.ones((len(some(x)), 1))
    constraint = {
        "type": "ineq",
        "fun": lambda z: z[-1] - some(z[:-1]) / scale,
        "jac": lambda z: np.hstack([-_slopes(some, z[:-1]) / scale, ones]),
    }
    found = minimize(
        lambda z: z[-1], np.append(x, 1.0), jac=lambda z: last, method="SLSQP",
        bounds=[(0.0, 1.0)] * len(x) + [(None, None)], constraints=[constraint],
        options={"ftol": 1e-15, "maxiter": 200},
    )  # fmt: skip
    end = np.clip(found.x[:-1], 0.0, 1.0)
    return end if some(end).max() <= scale else x


def _refine(some, x) -> np.ndarray:
    """Newton's method for pieces that are equal and weighted gradients that add up to zero."""
    best, least = x, np.inf
    for _ in range(STEPS):
        balance = _balance(some, x)
        if not balance.residual < least:
            break
        best, least = x, balance.residual
        ends = [np.clip(x + _newton_step(some, x, part), 0.0, 1.0)
                for part in _with_fewer(balance, some(x))]  # fmt: skip
        x = min(ends, key=lambda end: _balance(some, end).residual, default=x)
    return best


def _with_fewer(balance, values):
    """The balance, and again without one more of its pieces, the lowest first.

    Where a measure is smooth in some direction, many pieces touch it, and no step makes all equal.
    """
    weights = balance.weights.copy()
    for k in sorted(np.flatnonzero(weights), key=lambda k: values[k]):
        yield balance._replace(weights=weights.copy())
        weights[k] = 0.0


class _Balance(NamedTuple):
    """Weights (m,) of the pieces that balance best, parameters (p,) that no bound holds."""

    weights: np.ndarray
    free: np.ndarray
    residual: float


def _balance(some, x) -> _Balance:
    values = some(x)
    slopes, count = _slopes(some, x) / values.max(), len(values)
    low, high = np.flatnonzero(x <= 0.0), np.flatnonzero(x >= 1.0)
    unit, bounds = np.eye(len(x)), np.zeros(len(low) + len(high))
    forces = np.hstack([slopes.T, -unit[:, low], unit[:, high]])
    gaps = np.append(1.0 - values / values.max(), bounds)
    ones = np.append(np.ones(count), bounds)
    pushes, _ = nnls(np.vstack([forces, gaps, ones]), np.append(np.zeros(len(x) + 1), 1.0))
    pushes /= max(pushes[:count].sum(), 1e-300)
    free = np.ones(len(x), dtype=bool)
    free[np.append(low, high)[pushes[count:] > 0.0]] = False
    residual = np.hypot(np.linalg.norm(forces @ pushes), gaps @ pushes)
    return _Balance(np.where(gaps[:count] < ACTIVE, pushes[:count], 0.0), free, float(residual))


def _newton_step(some, x, balance) -> np.ndarray:
    weights, free = balance.weights, balance.free
    active, step = weights > 0.0, np.zeros(len(x))
    values = some(x)
    scale = values.max()
    slopes = (_slopes(some, x) / scale)[np.ix_(active, free)]
    bend = _slopes(lambda at: weights @ _slopes(some, at), x)[np.ix_(free, free)] / scale
    k, m = free.sum(), active.sum()
    none, ones = np.zeros((m, m)), np.ones((m, 1))
    # unknowns: the step, weights, and by how much the greatest piece shrinks
    matrix = np.block([
        [bend, slopes.T, np.zeros((k, 1))],
        [slopes, none, ones],
        [np.zeros((1, k)), ones.T, np.zeros((1, 1))],
    ])  # fmt: skip
    right = np.concatenate([np.zeros(k), 1.0 - values[active] / scale, [1.0]])
    step[free] = np.linalg.lstsq(matrix, right, rcond=1e-11)[0][:k]  # pieces may be the same
    return step


def _kinks(some, x, weights) -> float:
    """By how much weighted gradients, per greatest piece, differ before and behind a point."""
    change = weights @ (_slopes(some, x, 0.0) - _slopes(some, x, -4.0))
    return float(np.linalg.norm(change) / some(x).max())


def _slopes(function, x, first: float = -2.0) -> np.ndarray:
    """Derivatives (m, p) by differences over five points, all of them between 0 and 1.

    `first`: the first of the points, in steps, where bounds allow it.
    """
    columns = []
    for k, at in enumerate(x):
        start = min(max(first, -np.floor(at / STEP)), np.floor((1.0 - at) / STEP) - 4.0)
        offsets = start + np.arange(5.0)
        weights = np.linalg.solve(np.vander(offsets, increasing=True).T, [0.0, 1.0, 0.0, 0.0, 0.0])
        points = np.tile(x, (5, 1))
        points[:, k] = np.clip(at + offsets * STEP, 0.0, 1.0)
        columns.append(weights @ np.array([function(point) for point in points]) / STEP)
    return np.column_stack(columns)
