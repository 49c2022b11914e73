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


def corrected(start: Start, m: np.ndarray) -> np.ndarray:
    """Strength [n] T after the correction of readings [n, 3] T."""
    return start.factor * np.linalg.norm(m - start.bias, axis=1)


def trimmed(m: np.ndarray, strength: np.ndarray, samples: int = _SAMPLES, seed: int = 0) -> Start:
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
    rng, kept = np.random.default_rng(seed), max(_UNKNOWNS + 1, int(KEPT * len(m)))
    tries = [_steps(rows, f, _drawn(rng, len(m)), kept, _STEPS) for _ in range(samples)]
    tries.append(_steps(rows, f, np.arange(len(m)), kept, _STEPS))
    best = sorted(tries, key=lambda each: each[0])[:3]
    _, k = min((_steps(rows, f, each[2], kept, 30)[:2] for each in best), key=lambda each: each[0])
    a = max(float(k[0]), 1e-12)
    return Start(-0.5 * k[1:4] / a * size * unit, float(np.sqrt(a) / size))


def _drawn(rng, count: int) -> np.ndarray:
    return rng.choice(count, min(count, _UNKNOWNS + 1), replace=False)


def _steps(rows, f, chosen, kept: int, steps: int):
    """Fits to the rows that the fit before fits best: (cost, unknowns, rows)."""
    cost, k = np.inf, np.zeros(_UNKNOWNS)
    for _ in range(steps):
        new = np.linalg.lstsq(rows[chosen], f[chosen], rcond=1e-10)[0]
        off = np.abs(rows @ new - f)
        nearest = np.argpartition(off, kept - 1)[:kept]
        total = float(np.sum(off[nearest] ** 2))
        if not total < cost:
            break
        cost, k, chosen = total, new, nearest
    return cost, k, chosen
