"""Sobol's sensitivity indices: the share of an outcome's variance that is due to each varied key.

A campaign with sampling 'saltelli' has, for each point of a Sobol sequence, a member A, an
independent one B, and one for each group of numbers (a key, or keys that are correlated), which is
A with that group's numbers of B. All of them but B have the same noise.

The design and the estimators are those of `scipy.stats.sobol_indices`, which requires a power of 2
of points and draws its bootstrap without a seed. Here a time that has not come by the end of the
run counts as the end, points of which another outcome is missing are left out, and one file always
has the same intervals.
"""

import numpy as np
import xarray as xr

from torquer.campaign.contents import (
    end_s,
    groups_in,
    is_design,
    member_outcomes,
    restrict_times,
    succeeded_in,
)
from torquer.campaign.spec import SUCCESS
from torquer.campaign.statistics import Interval, plain, varies

#: Least number of points for which indices are computed: fewer give no useful intervals.
LEAST_POINTS = 16
_RESAMPLES = 500
#: Part of the mean square below which a variance is rounding.
_ROUNDING = 1e-12


def sobol_indices(f_a, f_b, f_ab) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices [g] of values at A [n], at B [n] and at A with a group of B.

    `f_ab`: [g, n]. A. Saltelli et al. (2010), table 2, (b) and, by M. Jansen, (f).
    """
    first, total = np.split(_indices_from_means(_terms(f_a, f_b, f_ab).mean(axis=1)), 2)
    return first, total


def _terms(f_a: np.ndarray, f_b: np.ndarray, f_ab: np.ndarray) -> np.ndarray:
    """The terms averaged over the points: sums and squares of A and B, products of all groups."""
    f_a, f_b = np.asarray(f_a, dtype=float), np.asarray(f_b, dtype=float)
    mean = 0.5 * (f_a.mean() + f_b.mean())
    f_a, f_b, f_ab = f_a - mean, f_b - mean, np.asarray(f_ab, dtype=float) - mean
    change = f_ab - f_a
    both = [0.5 * (f_a + f_b), 0.5 * (f_a**2 + f_b**2)]
    return np.vstack([*both, f_b * change, 0.5 * change**2])


def _indices_from_means(means: np.ndarray) -> np.ndarray:
    """Indices, first-order ones and then total ones [..., 2 g], from the means of the terms."""
    variance = means[..., 1] - means[..., 0] ** 2
    varies = variance > _ROUNDING * means[..., 1]
    return means[..., 2:] / np.where(varies, variance, np.nan)[..., None]


def intervals(f_a, f_b, f_ab, confidence: float = 0.95) -> list[Interval]:
    """Intervals of all indices, first-order ones and then total ones: bootstrap over the points."""
    terms, rng = _terms(f_a, f_b, f_ab), np.random.default_rng(0)
    points = terms.shape[1]
    drawn = (rng.integers(points, size=points) for _ in range(_RESAMPLES))
    counts = (np.bincount(each, minlength=points) for each in drawn)
    found = _indices_from_means(np.array([terms @ each / points for each in counts]))
    tail = 0.5 * (1.0 - confidence)
    low, high = np.nanquantile(found, (tail, 1.0 - tail), axis=0)
    return [Interval(*ends) for ends in zip(low.tolist(), high.tolist(), strict=True)]


def sensitivity(result: xr.Dataset, confidence: float = 0.95) -> dict | None:
    """Indices of each outcome, and of success, as plain data; None without such a design."""
    if not is_design(result):
        return None
    names, outcomes, end = groups_in(result), member_outcomes(result), end_s(result)
    for name in outcomes:
        if (times := restrict_times(result, name, end)) is not None:
            outcomes[name] = times
    succeeded = succeeded_in(result)
    if succeeded is not None:
        outcomes[SUCCESS] = succeeded.astype(float)
    return {
        "points": result.sizes["member"] // (len(names) + 2),
        "outcomes": {key: _indices(each, names, confidence) for key, each in outcomes.items()},
    }


def _indices(values: np.ndarray, names: list[str], confidence: float) -> dict:
    """Indices of an outcome [members] by group; none with too few points or no variance."""
    rows = len(names) + 2
    points = values[: len(values) // rows * rows].reshape(-1, rows)
    known = points[np.isfinite(points).all(axis=1)].T
    found: dict = {"points": known.shape[1], "groups": {}}
    if known.shape[1] < LEAST_POINTS or not varies(known[:2].ravel()):
        return found
    parts = known[0], known[1], known[2:]
    first, total = sobol_indices(*parts)
    ends = intervals(*parts, confidence)
    for k, name in enumerate(names):
        found["groups"][name] = {
            "first": float(first[k]),
            "first_interval": plain(ends[k]),
            "total": float(total[k]),
            "total_interval": plain(ends[len(names) + k]),
        }
    return found
