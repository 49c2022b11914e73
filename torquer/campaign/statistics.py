"""Statistics over members: confidence intervals, rank correlations, when to stop.

A missing value (NaN: never settled) is left out of means, which are then those of the other members
only. In quantiles and ranks it counts as greater than any other. Intervals are those of independent
members; for a Latin hypercube or Sobol points the estimates are usually better, and the intervals
too wide.
"""

import math
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import NamedTuple

import numpy as np
from scipy import stats

from torquer.base.strict_json import finite_or_none
from torquer.campaign.spec import SUCCESS, Stop
from torquer.campaign.variation import ATTITUDE
from torquer.maths.geometry.attitudes import dcm_body_to_reference

#: Spread up to which numbers differ by rounding alone: of what was drawn, in units in the last
#: place; of what was flown, where each step is rounded, as a part of the greatest.
_ULPS, _FLOWN = 16, 1e-9


class Interval(NamedTuple):
    """A confidence interval; an end may be infinite if the members do not bound it."""

    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Half its width; infinite where there is none."""
        half = 0.5 * (self.high - self.low)
        return math.inf if math.isnan(half) else half


def plain(interval: Interval) -> list[float | None]:
    """An interval's ends; None where it has none."""
    return [finite_or_none(interval.low), finite_or_none(interval.high)]


def rate_interval(successes: int, members: int, confidence: float = 0.95) -> Interval:
    """Wilson's score interval of a success rate. E. Wilson (1927)."""
    if members == 0:
        return Interval(0.0, 1.0)
    z, n, rate = float(stats.norm.isf(0.5 * (1.0 - confidence))), members, successes / members
    centre = (rate + 0.5 * z * z / n) / (1.0 + z * z / n)
    half = z / (1.0 + z * z / n) * math.sqrt(rate * (1.0 - rate) / n + 0.25 * (z / n) ** 2)
    # at a rate of 0 or 1 that end is met exactly, rounding apart
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    return Interval(low, 1.0 if successes == members else min(1.0, centre + half))


def mean_interval(
    values, confidence: float = 0.95, bounds: tuple[float, float] = (-math.inf, math.inf)
) -> Interval:
    """Student's interval of the mean of the values that are not missing, within their bounds."""
    known = _finite(values)
    if len(known) < 2:
        return Interval(-math.inf, math.inf)
    t = float(stats.t.isf(0.5 * (1.0 - confidence), len(known) - 1))
    mean, half = float(known.mean()), t * float(known.std(ddof=1)) / math.sqrt(len(known))
    return Interval(max(mean - half, bounds[0]), min(mean + half, bounds[1]))


def _finite(values) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    return values[np.isfinite(values)]


def _order(values) -> np.ndarray:
    """The values in order, those that are missing as infinite."""
    values = np.asarray(values, dtype=float)
    return np.sort(np.where(np.isnan(values), np.inf, values))


def quantile(values, part: float) -> float:
    """The least value that a fraction (0..1) of all values does not exceed: one of the values."""
    ordered = _order(values)
    if not len(ordered):
        return math.nan
    place = math.ceil(part * len(ordered) - 1e-9) - 1
    return float(ordered[min(max(place, 0), len(ordered) - 1)])


def quantile_interval(values, part: float, confidence: float = 0.95) -> Interval:
    """Interval of a quantile between order statistics, right for every distribution.

    The number of values below the quantile is binomial, whatever their distribution. An end is
    infinite if there are too few members for one. H. David, H. Nagaraja, 'Order Statistics', 7.1.
    """
    ordered = _order(values)
    n, tail = len(ordered), 0.5 * (1.0 - confidence)
    # order statistics from 1: the lower one is above the quantile if so few values are below it
    low = int(stats.binom.ppf(tail, n, part)) if n else 0
    high = int(stats.binom.ppf(1.0 - tail, n, part)) + 1 if n else 1
    return Interval(
        float(ordered[low - 1]) if low >= 1 else -math.inf,
        float(ordered[high - 1]) if high <= n else math.inf,
    )


def success_table(succeeded, confidence: float = 0.95) -> dict:
    """How many of members [n] succeeded, the rate and its interval, as plain data."""
    count, members = int(np.sum(succeeded)), len(succeeded)
    return {
        "succeeded": count,
        "rate": count / members if members else None,
        "interval": plain(rate_interval(count, members, confidence)),
    }


def quantile_table(values, parts: Sequence[float], confidence: float = 0.95) -> dict:
    """Quantiles of values [n] and their intervals by the parts, as plain data."""
    return {
        f"{part:g}": {
            "value": finite_or_none(quantile(values, part)),
            "interval": plain(quantile_interval(values, part, confidence)),
        }
        for part in parts
    }


def is_enough(stop: Stop, values) -> bool:
    """Whether the members so far make the confidence interval as narrow as required.

    `values`: of the outcome that `stop` names; for 'success' whether each member succeeded. A mean
    without the members that have no value is not that of the campaign: it is never enough. An
    interval that is checked repeatedly errs somewhat more often than its confidence states.
    """
    values = np.asarray(values, dtype=float)
    if len(values) < stop.least or np.isnan(values).any():
        return False
    if stop.outcome == SUCCESS:
        interval = rate_interval(int(np.sum(values)), len(values), stop.confidence)
    else:
        interval = mean_interval(values, stop.confidence)
    return interval.half_width <= stop.half_width


def rank_correlations(
    inputs: Mapping[str, Sequence | np.ndarray], outcomes: Mapping[str, np.ndarray]
) -> dict[str, dict[str, float]]:
    """Spearman's rank correlation of each outcome with each number of the inputs: [outcome][input].

    `inputs`: what `draw` gives; for the names of their numbers see `as_columns`. Outcomes and
    inputs that do not vary, or by rounding alone, are left out.
    """
    columns = {name: _ranks(values) for name, values in as_columns(inputs).items()}
    columns = {name: ranks for name, ranks in columns.items() if ranks.any()}
    found = {}
    for name, values in outcomes.items():
        ranks = ranks_of(values)
        if ranks.any():
            found[name] = {key: float(column @ ranks) for key, column in columns.items()}
    return found


def varies(values: np.ndarray) -> bool:
    """Whether numbers that were flown differ by more than rounding; missing ones do from others."""
    values = np.asarray(values, dtype=float)
    known = values[np.isfinite(values)]
    if len(known) < len(values):
        return len(np.unique(values[~np.isfinite(values)])) + bool(len(known)) > 1
    return len(known) > 0 and bool(np.ptp(known) > _FLOWN * np.abs(known).max())


def ranks_of(values) -> np.ndarray:
    """`_ranks` of an outcome; zeros if it does not vary, or by rounding alone."""
    values = np.asarray(values, dtype=float)
    return _ranks(values) if varies(values) else np.zeros(len(values))


def _rounded_off(values: np.ndarray, scale) -> np.ndarray:
    """Numbers [n], or the first in all places if they differ by the rounding of `scale` alone."""
    if len(values) and np.ptp(values) <= _ULPS * np.spacing(np.abs(scale).max()):
        return np.full(len(values), values[0])
    return values


def _ranks(values: np.ndarray) -> np.ndarray:
    """Ranks about their mean, scaled to length one; zeros for values that are all the same."""
    if not len(values):
        return np.zeros(0)
    ranks = stats.rankdata(np.where(np.isnan(values), np.inf, values))
    ranks -= ranks.mean()
    length = np.linalg.norm(ranks)
    return ranks / length if length > 0.0 else np.zeros(len(ranks))


def chance_correlation(members: int, confidence: float = 0.95) -> float:
    """The rank correlation that independent numbers exceed in size only by chance.

    Of n members it is t / sqrt(n - 2 + t^2) for Student's t, to a good approximation.
    """
    if members < 4:
        return 1.0
    t = float(stats.t.isf(0.5 * (1.0 - confidence), members - 2))
    return t / math.sqrt(members - 2 + t * t)


def as_columns(inputs: Mapping[str, Sequence | np.ndarray]) -> dict[str, np.ndarray]:
    """Numbers [n] by name of what members drew.

    For a vector its components `key[0]`, ..., its magnitude `|key|` and its direction cosines
    `key.direction[0]`, ...; for an attitude the direction cosines of body axis j to axis i of its
    reference, `initial.attitude[i][j]`; for a matrix its size. Times count in seconds. Texts,
    tables and lists of different lengths have none. What differs by rounding alone is the same.
    """
    columns: dict[str, np.ndarray] = {}
    for key, values in inputs.items():
        numbers = _as_numbers(values)
        if numbers is not None:
            columns |= (
                _direction_cosines(key, numbers) if key == ATTITUDE else _columns(key, numbers)
            )
    return columns


def _as_numbers(values) -> np.ndarray | None:
    """Values as an array of numbers, None if they are none."""
    if isinstance(values, np.ndarray):
        return values.astype(float)
    if values and all(isinstance(value, datetime) for value in values):
        return np.array([value.timestamp() for value in values])
    try:
        numbers = np.array(values)
    except ValueError:  # lists of different lengths
        return None
    return numbers.astype(float) if numbers.dtype.kind in "biuf" else None


def _columns(key: str, numbers: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of numbers [n], vectors [n, k] or matrices."""
    if numbers.ndim == 1:
        return {key: _rounded_off(numbers, numbers)}
    size = np.linalg.norm(numbers.reshape(len(numbers), -1), axis=1)
    sizes = {f"|{key}|": _rounded_off(size, size)}
    if numbers.ndim > 2:
        return sizes
    directions = numbers / np.where(size > 0.0, size, 1.0)[:, None]
    components = {f"{key}[{k}]": _rounded_off(x, size) for k, x in enumerate(numbers.T)}
    cosines = {f"{key}.direction[{k}]": _rounded_off(x, 1.0) for k, x in enumerate(directions.T)}
    return components | sizes | cosines


def _direction_cosines(key: str, quaternions: np.ndarray) -> dict[str, np.ndarray]:
    """Direction cosines: unlike a quaternion's components they have one sign only."""
    matrices = dcm_body_to_reference(quaternions)
    return {
        f"{key}[{i}][{j}]": _rounded_off(matrices[:, i, j], 1.0) for i in range(3) for j in range(3)
    }
