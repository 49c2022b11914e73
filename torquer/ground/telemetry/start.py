"""Start of the calibration of a magnetometer: least trimmed squares on a linear problem.

With one scale and a bias the square of the field's strength is linear in the unknowns:
F^2 = a |m|^2 + p . m + c, where the bias is -p / (2 a) and the scale sqrt(a). Of many fits to a few
rows drawn at random, and improved by refitting the rows they fit best, the best is kept. So 40 %
of the rows may be anything.

A strength that is constant, as at a place on the ground, is fitted best by a = 0 and p = 0. There a
sphere is fitted to the readings, |m|^2 = -p . m - c, and its radius makes the scale.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: Part of the rows that the trimmed fit relies on.
KEPT = 0.55
_SAMPLES, _STEPS = 200, 2
#: The strength is constant where it varies by less than this part of it. Of a sphere a centre is
#: not sought where readings vary by less than this part of the strength.
_CONSTANT, _TURNED = 1e-4, 1e-2


class Start(NamedTuple):
    """Bias [3] T and the factor of all axes."""

    bias: np.ndarray
    factor: float


def correct_readings(start: Start, m: np.ndarray) -> np.ndarray:
    """Strength [n] T after the correction of readings [n, 3] T."""
    return start.factor * np.linalg.norm(m - start.bias, axis=1)


def trim_squares(m: np.ndarray, strength: np.ndarray, samples: int = _SAMPLES) -> Start:
    """Least trimmed squares of readings `m` [n, 3] T and the field's strength [n] T.

    ValueError for fewer than 8 rows.
    """
    if len(m) < 8:
        raise ValueError(f"FILE: must hold 8 rows of b_measured or more; received {len(m)}")
    unit = float(np.median(strength))
    x, f = m / unit, strength / unit
    size = float(np.median(np.linalg.norm(x, axis=1))) or 1.0
    x = x / size
    is_constant = bool(np.ptp(f) < _CONSTANT)
    square, ones = np.einsum("ij,ij->i", x, x), np.ones(len(x))
    if is_constant:
        rows, aim = np.column_stack([x, ones]), -square
        ridge = _TURNED**2 * np.array([1.0, 1.0, 1.0, 0.0])
    else:
        rows, aim = np.column_stack([square, x, ones]) / f[:, None], f
        ridge = np.zeros(5)
    k = _trimmed(rows, aim, ridge, samples)
    if is_constant:
        k = np.append(1.0, k)
        k[:4] /= max(0.25 * float(k[1:4] @ k[1:4]) - k[4], 1e-6)
    a = max(float(k[0]), 1e-12)
    return Start(-0.5 * k[1:4] / a * size * unit, float(np.sqrt(a) / size))


def _trimmed(rows, aim, ridge, samples: int) -> np.ndarray:
    """Least trimmed squares of `aim` [n] by `rows` [n, p]: unknowns [p]; `ridge` [p]: the square
    of each in units of the mean square of a residual."""
    count, unknowns = rows.shape
    problem = _Problem(rows, aim, ridge)
    rng, kept = np.random.default_rng(0), max(unknowns + 1, int(KEPT * count))
    drawn = np.array([rng.choice(count, unknowns + 1, replace=False) for _ in range(samples)])
    costs, tries = _improve(problem, _fits(problem, drawn), kept, _STEPS)
    _, everything = _improve(problem, _fits(problem, np.arange(count)[None]), kept, _STEPS)
    best = np.concatenate([tries[np.argsort(costs)[:3]], everything])
    costs, tries = _improve(problem, best, kept, 12)
    return tries[np.argmin(costs)]


class _Problem(NamedTuple):
    """Linear least squares: `aim` [n] by `rows` [n, p], with a penalty `ridge` [p] a row."""

    rows: np.ndarray
    aim: np.ndarray
    ridge: np.ndarray


def _fits(problem: _Problem, chosen) -> np.ndarray:
    """Least squares of many choices of rows [s, k]: unknowns [s, p]."""
    some, unknowns = problem.rows[chosen], problem.rows.shape[1]
    normal = np.einsum("ski,skj->sij", some, some)
    pull = np.einsum("ski,sk->si", some, problem.aim[chosen])
    normal += 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(unknowns)
    normal += chosen.shape[1] * np.diag(problem.ridge)
    return np.linalg.solve(normal, pull[:, :, None])[:, :, 0]


def _improve(problem: _Problem, fits, kept: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Fits refitted to the rows that they fit best, some times: costs [s] and unknowns [s, p]."""
    for step in range(steps + 1):
        off = np.abs(fits @ problem.rows.T - problem.aim)
        nearest = np.argpartition(off, kept - 1, axis=1)[:, :kept]
        if step < steps:
            fits = _fits(problem, nearest)
    return np.sum(np.take_along_axis(off, nearest, axis=1) ** 2, axis=1), fits
