"""Sensor parameters that make |A (m - bias)| the strength of a field, for many fields at once.

Bias, scale and non-orthogonality have priors, as have the further columns of a hypothesis: without
them a short or still pass buys any field with bias. Gauss and Newton's method with damping, from
the linear problem in which the square of the strength is a quadric of the readings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: Standard deviations of what a sensor may have: bias [nT], scale, non-orthogonality [rad].
SENSOR = np.array([15e3] * 3 + [0.03] * 3 + [0.02] * 3)
#: Noise of the strength that no magnetometer in orbit falls below [nT].
LEAST_NT = 5.0
#: What leaves more [nT] fits nothing, whatever a free field leaves.
WORST_NT = 3000.0
#: Residual with which the linear start weighs its prior [nT], and its rounds.
_FIRST_NT, _ROUNDS = 3000.0, 3
#: Tukey-like weights of a robust fit: where they have fallen to a quarter, and where rows are cut.
_BEND, _CUT = 3.0, 5.0


class Tried(NamedTuple):
    """Hypotheses side by side: readings [h, n, 3] nT, strengths [h, n] nT, columns [h, n, q] that
    may be added to the strength, and the standard deviations [h, q] of their factors (0: none)."""

    m: np.ndarray
    strength: np.ndarray
    columns: np.ndarray
    sigma: np.ndarray

    def take(self, which) -> Tried:
        """Some of the hypotheses."""
        return Tried(*(each[which] for each in self))

    def rows(self, which) -> Tried:
        """Some of the rows."""
        return Tried(self.m[:, which], self.strength[:, which], self.columns[:, which], self.sigma)

    @property
    def precision(self) -> np.ndarray:
        """Prior precision [h, 9 + q] of all parameters."""
        count = len(self.m)
        there = np.where(self.sigma > 0.0, self.sigma, 1e-6)
        return np.hstack([np.tile(SENSOR**-2.0, (count, 1)), there**-2.0])


class Fit(NamedTuple):
    """Of each hypothesis: parameters [h, 9 + q], residuals [h, n] nT (whitened where a correlation
    was given), their size [h] nT, parameters that the rows set [h], log likelihood [h], and what
    the parameters cost [h]: half the sum of their squares and of the determinant."""

    values: np.ndarray
    residual: np.ndarray
    size: np.ndarray
    used: np.ndarray
    likelihood: np.ndarray
    cost: np.ndarray

    @property
    def evidence(self) -> np.ndarray:
        """Marginal log likelihood [h] by Laplace's method."""
        return self.likelihood - self.cost

    @property
    def sigma(self) -> np.ndarray:
        """Residual [h] nT by the freedoms that are left."""
        rows = self.residual.shape[1]
        return np.sqrt((self.residual**2).sum(axis=1) / np.maximum(rows - self.used, 1.0))


def fit(
    tried: Tried,
    steps: int,
    start: np.ndarray | None = None,
    whitening: np.ndarray | None = None,
    robust: bool = False,
) -> Fit:
    """The most probable parameters of each hypothesis.

    `whitening` [n, n] makes residuals white; `robust`: gross rows lose their weight on the way.
    """
    values = _linear_start(tried) if start is None else start.copy()
    prior, rows = tried.precision, tried.m.shape[1]
    residual, slopes = _model(tried, values, whitening)
    damping = np.full(len(values), 1e-2 if start is None else 1e-4)
    weight = np.ones(residual.shape)
    for step in range(steps):
        if robust:
            residual, slopes = _model(tried, values, whitening)
            weight = _weights(residual, final=3 * step >= 2 * steps)
        root = np.sqrt(weight)
        pulled, bent = residual * root, slopes * root[:, :, None]
        before = _price(pulled, values, prior)
        square = (pulled**2).sum(axis=1) / weight.sum(axis=1) + LEAST_NT**2
        normal = np.matmul(bent.transpose(0, 2, 1), bent) / square[:, None, None]
        pull = np.einsum("hnp,hn->hp", bent, pulled) / square[:, None] + prior * values
        _add_diagonal(normal, prior * (1.0 + damping[:, None]) + damping[:, None] * _diag(normal))
        new = values - np.linalg.solve(normal, pull[:, :, None])[:, :, 0]
        moved, turned = _model(tried, new, whitening)
        better = _price(moved * root, new, prior) <= before + 1e-9
        values = np.where(better[:, None], new, values)
        residual = np.where(better[:, None], moved, residual)
        slopes = np.where(better[:, None, None], turned, slopes)
        damping = np.where(better, 0.2 * damping, 10.0 * damping).clip(1e-8, 1e6)
    return _found(values, residual * np.sqrt(weight), slopes, prior, rows)


def _found(values, residual, slopes, prior, rows: int) -> Fit:
    square = (residual**2).sum(axis=1) / rows + LEAST_NT**2
    normal = np.matmul(slopes.transpose(0, 2, 1), slopes) / square[:, None, None]
    _add_diagonal(normal, prior)
    determinant = np.linalg.slogdet(normal)[1] - np.log(prior).sum(axis=1)
    used = values.shape[1] - np.einsum("hp,hpp->h", prior, np.linalg.inv(normal))
    cost = 0.5 * ((prior * values**2).sum(axis=1) + determinant)
    return Fit(values, residual, np.sqrt(square), used, -0.5 * rows * (np.log(square) + 1.0), cost)


def left_out(tried: Tried, values: np.ndarray) -> np.ndarray:
    """Residuals [h, n] nT of each row by parameters [h, 9 + q] refitted to all others."""
    residual, slopes = _model(tried, values, None)
    square = np.median(residual**2, axis=1) / 0.6745**2 + LEAST_NT**2
    normal = np.matmul(slopes.transpose(0, 2, 1), slopes) / square[:, None, None]
    _add_diagonal(normal, tried.precision)
    reach = np.matmul(slopes, np.linalg.inv(normal))
    leverage = np.einsum("hnp,hnp->hn", reach, slopes) / square[:, None]
    return residual / np.maximum(1.0 - leverage, 1e-3)


def _price(residual, values, prior) -> np.ndarray:
    rows = residual.shape[1]
    square = (residual**2).sum(axis=1) / rows + LEAST_NT**2
    return 0.5 * (rows * np.log(square) + (prior * values**2).sum(axis=1))


def _weights(residual, final: bool) -> np.ndarray:
    z = residual / (1.4826 * np.median(np.abs(residual), axis=1)[:, None] + 1.0)
    return (np.abs(z) < _CUT) * 1.0 if final else (1.0 + (z / _BEND) ** 2) ** -2.0


def _diag(matrices) -> np.ndarray:
    return np.einsum("hpp->hp", matrices)


def _add_diagonal(matrices, values) -> None:
    index = np.arange(matrices.shape[1])
    matrices[:, index, index] += values


def matrix_of(values: np.ndarray) -> np.ndarray:
    """Matrices A [h, 3, 3] of parameters [h, 9 or more]."""
    found = np.tile(np.eye(3), (len(values), 1, 1))
    for k, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1))):
        found[:, row, column] += values[:, 3 + k]
    return found


def _model(tried: Tried, values, whitening) -> tuple[np.ndarray, np.ndarray]:
    """Residuals [h, n] nT and their derivatives [h, n, 9 + q]."""
    a = matrix_of(values)
    x = tried.m - values[:, None, :3]
    y = np.matmul(x, a.transpose(0, 2, 1))
    length = np.maximum(np.linalg.norm(y, axis=2), 1e-9)
    unit = y / length[:, :, None]
    residual = length - tried.strength - np.matmul(tried.columns, values[:, 9:, None])[:, :, 0]
    skewed = unit[:, :, (1, 2, 2)] * x[:, :, (0, 0, 1)]
    slopes = np.concatenate([-np.matmul(unit, a), unit * x, skewed, -tried.columns], axis=2)
    if whitening is None:
        return residual, slopes
    return residual @ whitening.T, np.matmul(whitening, slopes)


def _linear_start(tried: Tried) -> np.ndarray:
    """Bias and one scale by F^2 = (1 + 2 s) |m|^2 - 2 m . b + c, with the priors of each."""
    m, f = tried.m, tried.strength
    square = np.einsum("hni,hni->hn", m, m)
    target = (f**2 - square) / (2.0 * f)
    rows = np.concatenate([square[..., None], -m, np.full((*f.shape, 1), 0.5)], axis=2)
    rows = rows / f[:, :, None]
    prior = np.array([SENSOR[3], *SENSOR[:3], SENSOR[0] ** 2]) ** -2.0
    normal = np.matmul(rows.transpose(0, 2, 1), rows)
    pull = np.einsum("hnp,hn->hp", rows, target)
    noise = np.full(len(m), _FIRST_NT)
    for _ in range(_ROUNDS):
        full = normal / noise[:, None, None] ** 2
        _add_diagonal(full, prior)
        found = np.linalg.solve(full, (pull / noise[:, None] ** 2)[:, :, None])[:, :, 0]
        off = target - np.einsum("hnp,hp->hn", rows, found)
        noise = np.sqrt(np.mean(off**2, axis=1)).clip(LEAST_NT, None)
    values = np.zeros((len(m), 9 + tried.columns.shape[2]))
    values[:, :3] = found[:, 1:4] / (1.0 + 2.0 * found[:, :1].clip(-0.2, 0.2))
    values[:, 3:6] = found[:, :1].clip(-0.2, 0.2)
    return values
