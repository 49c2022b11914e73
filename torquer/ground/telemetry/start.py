"""Start of the calibration of a magnetometer: least trimmed squares on a linear problem.

With one scale and a bias the square of the field's strength is linear in the unknowns:
F^2 = a |m|^2 + p . m + c, where the bias is -p / (2 a) and the scale sqrt(a). Of many fits to a few
rows drawn at random, and improved by refitting the rows they fit best, the best is kept. So 40 %
of the rows may be anything.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: Part of the rows that the trimmed fit relies on.
KEPT = 0.55
_SAMPLES, _STEPS = 200, 2
_UNKNOWNS = 5


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
    rows = np.column_stack([np.einsum("ij,ij->i", x, x), x, np.ones(len(x))]) / f[:, None]
    rng, kept = np.random.default_rng(0), max(_UNKNOWNS + 1, int(KEPT * len(m)))
    drawn = np.array([rng.choice(len(m), _UNKNOWNS + 1, replace=False) for _ in range(samples)])
    costs, tries = _improve(rows, f, _fits(rows, f, drawn), kept, _STEPS)
    _, everything = _improve(rows, f, _fits(rows, f, np.arange(len(m))[None]), kept, _STEPS)
    best = np.concatenate([tries[np.argsort(costs)[:3]], everything])
    costs, tries = _improve(rows, f, best, kept, 12)
    k = tries[np.argmin(costs)]
    a = max(float(k[0]), 1e-12)
    return Start(-0.5 * k[1:4] / a * size * unit, float(np.sqrt(a) / size))


def _fits(rows, f, chosen) -> np.ndarray:
    """Least squares of many choices of rows [s, k]: unknowns [s, 5]."""
    some = rows[chosen]
    normal = np.einsum("ski,skj->sij", some, some)
    pull = np.einsum("ski,sk->si", some, f[chosen])
    normal += 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(_UNKNOWNS)
    return np.linalg.solve(normal, pull[:, :, None])[:, :, 0]


def _improve(rows, f, fits, kept: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Fits refitted to the rows that they fit best, some times: costs [s] and unknowns [s, 5]."""
    for step in range(steps + 1):
        off = np.abs(fits @ rows.T - f)
        nearest = np.argpartition(off, kept - 1, axis=1)[:, :kept]
        if step < steps:
            fits = _fits(rows, f, nearest)
    return np.sum(np.take_along_axis(off, nearest, axis=1) ** 2, axis=1), fits
