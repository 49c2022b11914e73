"""Errors of a pointing budget: absolute, and relative to the mean over a window.

Terms of ECSS-E-ST-60-10C and ESSB-HB-E-003: APE, the error of the attitude at an instant (absolute
performance error); AKE, that of what is known of it; RPE, APE less its mean over the window that
the instant is in (relative performance error: stability). The statistical interpretation is the
mixed one: over all instants that count and over the ensemble of flights.
"""

from typing import NamedTuple

import numpy as np

from torquer.analysis.pointing.predicted import Part
from torquer.theory.three_axis.effects import relative_to_mean

#: Instants at which the distribution of a predicted error is drawn, and numbers drawn at each.
_INSTANTS, _DRAWN = 400, 200


class Errors(NamedTuple):
    """An error [rad] over instants and flights: root mean squares about the body's axes (3,) and of
    the angle; the angle that a part of them (the confidence) does not exceed."""

    axes_rad: np.ndarray
    rms_rad: float
    quantile_rad: float


class Measured(NamedTuple):
    """Errors of flights; `relative_sigma`: standard error of the rms of the angle, relative, as the
    flights differ."""

    errors: Errors
    relative_sigma: float


def predicted_errors(part: Part, first: int, size: int, confidence: float) -> Errors:
    """Errors of a predicted part from command `first` on."""
    covariance = None if part.spread is None else part.spread.turns[first:]
    return _errors(part.mean[first:], part.units[first:], covariance, confidence)


def predicted_stability(part: Part, first: int, size: int, confidence: float) -> Errors:
    """The same less the means over windows of `size` commands."""
    covariance = None
    if part.spread is not None:
        covariance = np.repeat(part.spread.within()[first // size :], size, axis=0)
    mean, units = (relative_to_mean(each[first:], size) for each in (part.mean, part.units))
    return _errors(mean, units, covariance, confidence)


def _errors(mean, units, covariance, confidence: float) -> Errors:
    squares = np.mean(mean**2 + np.sum(units**2, axis=2), axis=0)
    if covariance is not None:
        squares = squares + np.diagonal(covariance, axis1=1, axis2=2).mean(axis=0)
    quantile = _quantile(mean, units, covariance, confidence)
    return Errors(np.sqrt(squares), float(np.sqrt(squares.sum())), quantile)


def _quantile(mean, units, covariance, confidence: float) -> float:
    """Of normally distributed turns at instants spread evenly, one sample for all parts."""
    at = np.unique(np.linspace(0, len(mean) - 1, _INSTANTS).astype(int))
    each = units[at] @ units[at].transpose(0, 2, 1)
    if covariance is not None:
        each = each + covariance[at]
    values, vectors = np.linalg.eigh(each)
    roots = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    drawn = np.random.default_rng(0).normal(size=(len(at), _DRAWN, 3))
    turns = mean[at][:, None, :] + drawn @ roots.transpose(0, 2, 1)
    return float(np.quantile(np.linalg.norm(turns, axis=2), confidence))


class Tally:
    """Errors of flights, taken one by one, so that none need stay in memory."""

    def __init__(self):
        self._squares: list[np.ndarray] = []
        self._angles: list[np.ndarray] = []

    def add(self, turns: np.ndarray) -> None:
        """Take the turns (n, 3) [rad] of a flight."""
        self._squares.append(np.mean(turns**2, axis=0))
        at = np.unique(np.linspace(0, len(turns) - 1, _INSTANTS).astype(int))
        self._angles.append(np.linalg.norm(turns[at], axis=1))

    def measured(self, confidence: float) -> Measured:
        """What the flights amount to."""
        squares, count = np.array(self._squares), len(self._squares)
        mean, whole = squares.mean(axis=0), squares.sum(axis=1)
        rms = float(np.sqrt(mean.sum()))
        spread = float(whole.std(ddof=1)) / np.sqrt(count) if count > 1 else 0.0
        quantile = float(np.quantile(self._angles, confidence))
        errors = Errors(np.sqrt(mean), rms, quantile)
        return Measured(errors, 0.5 * spread / rms**2 if rms > 0.0 else 0.0)
