"""How more than two campaigns differ: each from the first, and one test of all for each outcome.

The test of all is Friedman's if members of the same numbers had the same inputs in all campaigns,
else Kruskal and Wallis's; its p is the probability of ranks at least as far apart if all were
alike. The tests against the first are adjusted to their number by S. Holm (1979).
"""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy import stats

from torquer.base.strict_json import finite_or_none
from torquer.campaign.comparison import comparison
from torquer.campaign.contents import independent, member_numbers, missing_as_worst

#: Campaigns that have letters and colours of their own.
MOST = 6


def compare_several(results: Sequence[xr.Dataset], confidence: float = 0.95) -> dict:
    """Summaries, differences from the first campaign and tests, as plain data.

    ValueError for fewer than two or more than `MOST`, and without an outcome that all have.
    """
    if not 2 <= len(results) <= MOST:
        raise ValueError(f"campaigns: must be 2 to {MOST}; received {len(results)}")
    each = [comparison(results[0], other, confidence) for other in results[1:]]
    names = [name for name in each[0]["outcomes"] if all(name in one["outcomes"] for one in each)]
    if not names:
        raise ValueError("campaigns: must have an outcome that all of them have; received none")
    together = [independent(result) for result in results]
    return {
        "names": [each[0]["names"][0], *(one["names"][1] for one in each)],
        "confidence": confidence,
        "summaries": [each[0]["summaries"][0], *(one["summaries"][1] for one in each)],
        "pairs": [one["pairs"] for one in each],
        "outcomes": {name: _outcome(together, each, name) for name in names},
        "success": [one["success"] for one in each],
    }


def _outcome(results: list[xr.Dataset], each: list[dict], name: str) -> dict:
    of_pairs = [one["outcomes"][name] for one in each]
    values = [None if one["test"] is None else one["test"]["p"] for one in of_pairs]
    return {
        "against_first": of_pairs,
        "adjusted_p": holm(values),
        "test": _test_of_all(results, [one["pairs"] for one in each], name),
    }


def holm(values: Sequence[float | None]) -> list[float | None]:
    """p adjusted to the number of tests that are known, in the same order."""
    known = [k for k, p in enumerate(values) if p is not None]
    known.sort(key=lambda k: values[k])
    adjusted: list[float | None] = [None] * len(values)
    least = 0.0
    for rank, k in enumerate(known):
        least = max(least, min(1.0, (len(known) - rank) * values[k]))
        adjusted[k] = least
    return adjusted


def _test_of_all(results: list[xr.Dataset], pairs: list[int], name: str) -> dict | None:
    """Name and p of the test that an outcome has one distribution in all; None without members."""
    ranked = [missing_as_worst(result, name) for result in results]
    rows = _common_rows(results) if all(pairs) and len(results) > 2 else None
    if rows is not None:
        ranked = [values[own] for values, own in zip(ranked, rows, strict=True)]
    if min(map(len, ranked)) == 0:
        return None
    test = stats.kruskal if rows is None else stats.friedmanchisquare
    same = len(np.unique(np.concatenate(ranked))) == 1
    p = 1.0 if same or _are_equal(ranked) else finite_or_none(test(*ranked).pvalue)
    return {"name": "Kruskal-Wallis" if rows is None else "Friedman", "p": p}


def _are_equal(ranked: list[np.ndarray]) -> bool:
    return all(np.array_equal(ranked[0], values) for values in ranked[1:])


def _common_rows(results: list[xr.Dataset]) -> list[np.ndarray] | None:
    """Rows of the members that all campaigns have; None for fewer than two."""
    numbers = [member_numbers(result) for result in results]
    common = numbers[0]
    for own in numbers[1:]:
        common = np.intersect1d(common, own)
    if len(common) < 2:
        return None
    return [np.flatnonzero(np.isin(own, common))[np.argsort(own[np.isin(own, common)])]
            for own in numbers]  # fmt: skip
