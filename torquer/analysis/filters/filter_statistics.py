"""Is a filter consistent? Statistics of its errors in many runs against its stated covariance.

The error e of a consistent filter has the covariance P that the filter states, so that e P^-1 e
(normalised estimation error squared, NEES) is chi-square distributed with as many degrees of
freedom as there are states; so is the normalised innovation squared (NIS), with those of the
measurement; and whitened innovations are not correlated in time. Y. Bar-Shalom, X. Li, T.
Kirubarajan, 'Estimation with applications to tracking and navigation' (2001), 5.4.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri  # scipy.stats takes half a second of importing

from torquer.analysis.filters.linear_covariance import Motion


class FilterRuns(NamedTuple):
    """Errors of a filter in many runs; NaN while it has no estimate.

    `t_s` (samples,); `errors` (runs, samples, n): attitude error in body axes [rad], then the
    other states; `covariance` (runs, samples, n, n): as stated; `innovations` of each sensor
    (runs, samples, 3): whitened (of Sun cells one for each), NaN where there was no reading or no
    such component. `rejected`, `starts` (runs, samples): readings rejected and starts so far;
    `why_not_started` (runs, samples): the filter's number for the reason, 0 for none. `motions`: of
    each run, at the same instants. `steps`: what the steps of RK4 did by themselves, the worst of
    all runs.
    """

    t_s: np.ndarray
    errors: np.ndarray
    covariance: np.ndarray
    innovations: dict[str, np.ndarray]
    rejected: np.ndarray
    starts: np.ndarray
    why_not_started: np.ndarray
    motions: list[Motion]
    steps: tuple[str, ...] = ()

    @property
    def started(self) -> np.ndarray:
        """Whether the filter had an estimate at some instant (runs,)."""
        return np.isfinite(self.errors[..., 0]).any(axis=1)


class Consistency(NamedTuple):
    """A statistic over runs against its chi-square band.

    `mean` (samples,) over the runs, per degree of freedom: 1 in a consistent filter; `low` and
    `high`: the band in which it lies at an instant with the given probability; `inside`: share of
    the instants at which it does; `overall`: mean over the instants.
    """

    mean: np.ndarray
    low: float
    high: float
    inside: float
    overall: float

    @property
    def consistent(self) -> bool:
        """Whether the mean over all instants lies in the band of a single one."""
        return self.low <= self.overall <= self.high


def nees(runs: FilterRuns, states: int | None = None) -> np.ndarray:
    """Normalised estimation error squared (runs, samples) of the first `states` states (or all)."""
    e, p = runs.errors[..., :states], runs.covariance[..., :states, :states]
    out = np.full(e.shape[:2], np.nan)
    known = np.isfinite(e[..., 0])
    # states differ in size by many orders: scaled by their standard deviations
    sigma = np.sqrt(np.einsum("kii->ki", p[known]))
    scaled, ratio = e[known] / sigma, p[known] / (sigma[:, :, None] * sigma[:, None, :])
    out[known] = np.einsum("ki,ki->k", scaled, np.linalg.solve(ratio, scaled[..., None])[..., 0])
    return out


def nis(innovations: np.ndarray) -> tuple[np.ndarray, int]:
    """Normalised innovation squared (runs, samples), NaN without a reading; degrees of freedom.

    Where fewer components are there, as with Sun cells, the square is scaled to as many.
    """
    there = np.isfinite(innovations)
    count = there.sum(axis=-1)
    freedoms = int(count.max())
    square = np.sum(np.where(there, innovations, 0.0) ** 2, axis=-1)
    return np.where(count > 0, square * freedoms / np.maximum(count, 1), np.nan), freedoms


def consistency(values: np.ndarray, freedoms: int, probability: float = 0.95) -> Consistency:
    """Mean over runs (runs, samples) of a chi-square statistic against its band.

    Instants at which fewer than half of the runs have a value are left out.
    """
    there = np.isfinite(values).sum(axis=0)
    used = there >= 0.5 * len(values)
    mean = mean_over_runs(values[:, used]) / freedoms
    low, high = band(freedoms, len(values), probability)
    inside = float(np.mean((mean >= low) & (mean <= high)))
    return Consistency(mean, low, high, inside, float(np.nanmean(mean)))


def mean_over_runs(values: np.ndarray) -> np.ndarray:
    """Mean (samples,) of values (runs, samples) that are known; NaN where none is."""
    there = np.isfinite(values)
    total, count = np.where(there, values, 0.0).sum(axis=0), there.sum(axis=0)
    return np.where(count > 0, total, np.nan) / np.maximum(count, 1)


def band(freedoms: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """Band of the mean over runs of chi-square variables divided by their degrees of freedom."""
    tail, total = 0.5 * (1.0 - probability), freedoms * runs
    return float(chdtri(total, 1.0 - tail) / total), float(chdtri(total, tail) / total)


def autocorrelation(innovations: np.ndarray, lag: int = 1) -> tuple[float, float]:
    """Correlation of whitened innovations (runs, samples, 3) `lag` readings apart, and its sigma.

    The sigma is what white noise would show.
    """
    product = square = 0.0
    pairs = 0
    for run in innovations:
        there = np.isfinite(run)
        readings = run[there.any(axis=1)][:, there.any(axis=0)]
        product += float(np.sum(readings[lag:] * readings[:-lag]))
        square += 0.5 * float(np.sum(readings[lag:] ** 2) + np.sum(readings[:-lag] ** 2))
        pairs += readings[lag:].size
    if not pairs:
        return math.nan, math.nan
    return product / square, 1.0 / math.sqrt(pairs)
