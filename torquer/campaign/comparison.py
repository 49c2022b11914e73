"""How two campaigns differ: means, quantiles and success rates, with intervals and tests.

Members are paired if those of the same number had the same inputs: the difference of means is then
taken within pairs, and its interval is narrower. A mean is that of the members with a value; for
times that some members never reach there is the difference of restricted means, too, in which these
count as the end of the shorter run. The p of a test is the probability of a difference
at least as great if A and B were alike; in its ranks a missing value is worse than any other.
"""

import math

import numpy as np
import xarray as xr
from scipy import stats

from torquer.base.strict_json import finite_or_none
from torquer.campaign.contents import (
    definition,
    end_s,
    independent,
    member_inputs,
    member_numbers,
    member_outcomes,
    missing_as_worst,
    restrict_times,
    scenario_name,
    succeeded_in,
)
from torquer.campaign.statistics import Interval, mean_interval, plain, rate_interval
from torquer.campaign.summary import campaign_summary


def comparison(a: xr.Dataset, b: xr.Dataset, confidence: float = 0.95) -> dict:
    """Differences b - a as plain data; ValueError without a common outcome."""
    summaries = campaign_summary(a, confidence), campaign_summary(b, confidence)
    a, b = independent(a), independent(b)
    names = [name for name in summaries[0]["outcomes"] if name in summaries[1]["outcomes"]]
    if not names:
        raise ValueError(
            f"campaigns: must have a common outcome; received {', '.join(member_outcomes(a))} and "
            f"{', '.join(member_outcomes(b))}"
        )
    rows = paired_rows(a, b)
    return {
        "names": [scenario_name(a), scenario_name(b)],
        "confidence": confidence,
        "pairs": 0 if rows is None else len(rows[0]),
        "summaries": list(summaries),
        "outcomes": {name: _outcome(a, b, name, rows, confidence) for name in names},
        "success": _success(a, b, rows, confidence),
    }


def paired_rows(a: xr.Dataset, b: xr.Dataset) -> tuple[np.ndarray, np.ndarray] | None:
    """Rows of the members in both campaigns; None unless they had the same inputs in both."""
    _, first, second = np.intersect1d(member_numbers(a), member_numbers(b), return_indices=True)
    ours, theirs = member_inputs(a), member_inputs(b)
    if not ours and "seed" in a and "seed" in b:  # members differ by their noise only
        ours, theirs = {"seed": a["seed"].values}, {"seed": b["seed"].values}
    if len(first) < 2 or not ours or ours.keys() != theirs.keys():
        return None
    same = (
        np.array_equal(np.asarray(ours[key])[first], np.asarray(theirs[key])[second])
        for key in ours
    )
    return (first, second) if all(same) else None


def _outcome(a, b, name: str, rows, confidence: float) -> dict:
    """The difference of the means, and of the restricted means of times."""
    return {
        "same_definition": definition(a, name) == definition(b, name),
        **_difference(member_outcomes(a)[name], member_outcomes(b)[name], rows, confidence),
        "restricted": _restrict(a, b, name, rows, confidence),
        "test": _rank_test(missing_as_worst(a, name), missing_as_worst(b, name), rows),
    }


def _difference(one: np.ndarray, other: np.ndarray, rows, confidence: float) -> dict:
    """The difference of the means and its interval; within pairs if there are any."""
    if rows is None:
        difference, interval = mean_difference(one, other, confidence)
    else:
        within = other[rows[1]] - one[rows[0]]
        known = within[np.isfinite(within)]
        difference = float(known.mean()) if len(known) else math.nan
        interval = mean_interval(within, confidence)
    return {"difference": finite_or_none(difference), "interval": plain(interval)}


def _restrict(a, b, name: str, rows, confidence: float) -> dict | None:
    """The difference of the restricted means; None for an outcome that is not a time in both."""
    ends = [end for end in (end_s(a), end_s(b)) if end is not None]
    end = min(ends) if len(ends) == 2 else None
    one, other = restrict_times(a, name, end), restrict_times(b, name, end)
    if one is None or other is None:
        return None
    return {"end_s": end, **_difference(one, other, rows, confidence)}


def _rank_test(one: np.ndarray, other: np.ndarray, rows) -> dict | None:
    """Name and p of the test that two outcomes [n] have one distribution; None without members."""
    if not len(one) or not len(other):
        return None
    if rows is None:
        p = stats.mannwhitneyu(one, other).pvalue
        return {"name": "Mann-Whitney", "p": finite_or_none(p)}
    one, other = one[rows[0]], other[rows[1]]
    within = np.zeros(len(one))
    np.subtract(other, one, out=within, where=one != other)  # missing in both: no difference
    p = stats.wilcoxon(within).pvalue if within.any() else 1.0
    return {"name": "Wilcoxon signed-rank", "p": finite_or_none(p)}


def mean_difference(one, other, confidence: float = 0.95) -> tuple[float, Interval]:
    """Difference of the means, other - one, of independent members. B. Welch (1947)."""
    first, second = (np.asarray(each)[np.isfinite(each)] for each in (one, other))
    if len(first) < 2 or len(second) < 2:
        known = len(first) and len(second)
        difference = float(second.mean() - first.mean()) if known else math.nan
        return difference, Interval(-math.inf, math.inf)
    spread = first.var(ddof=1) / len(first), second.var(ddof=1) / len(second)
    total, difference = sum(spread), float(second.mean() - first.mean())
    if total == 0.0:
        return difference, Interval(difference, difference)
    freedom = total**2 / (spread[0] ** 2 / (len(first) - 1) + spread[1] ** 2 / (len(second) - 1))
    half = float(stats.t.isf(0.5 * (1.0 - confidence), freedom)) * math.sqrt(total)
    return difference, Interval(difference - half, difference + half)


def _success(a, b, rows, confidence: float) -> dict | None:
    one, other = succeeded_in(a), succeeded_in(b)
    if one is None or other is None or not len(one) or not len(other):
        return None
    difference, interval = rate_difference(
        (int(one.sum()), len(one)), (int(other.sum()), len(other)), confidence
    )
    found: dict = {"difference": difference, "interval": plain(interval)}
    if rows is None:
        counts = [[int(each.sum()), int((~each).sum())] for each in (one, other)]
        return found | {
            "test": {"name": "Fisher", "p": finite_or_none(stats.fisher_exact(counts).pvalue)}
        }
    gained = int((~one[rows[0]] & other[rows[1]]).sum())
    lost = int((one[rows[0]] & ~other[rows[1]]).sum())
    p = stats.binomtest(gained, gained + lost).pvalue if gained + lost else 1.0
    return found | {"gained": gained, "lost": lost, "test": {"name": "McNemar", "p": float(p)}}


def rate_difference(
    one: tuple[int, int], other: tuple[int, int], confidence: float = 0.95
) -> tuple[float, Interval]:
    """Difference of rates, other - one, each (successes, members), of independent members.

    R. Newcombe's hybrid of score intervals (1998), method 10; of paired members it is too wide.
    """
    first, second = one[0] / one[1], other[0] / other[1]
    low1, high1 = rate_interval(*one, confidence)
    low2, high2 = rate_interval(*other, confidence)
    difference = second - first
    return difference, Interval(
        difference - math.hypot(second - low2, high1 - first),
        difference + math.hypot(high2 - second, first - low1),
    )
