"""Outcomes by category: members grouped by a key whose values are no numbers, such as its law.

The test is that of W. Kruskal and W. Wallis (1952), with ties: whether ranks differ between groups
more than by chance. H over its greatest value is the part of the ranks' variance that lies between
groups; its root is what a rank correlation is for a number, and for two groups it is just that.
"""

import json
import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy import stats

from torquer.campaign.contents import (
    member_inputs,
    member_outcomes,
    missing_as_worst,
    outcome_unit,
    succeeded_in,
)
from torquer.campaign.spec import SUCCESS
from torquer.campaign.statistics import as_columns, quantile_table, ranks_of, success_table

#: Parts of the members of a category at which quantiles are taken.
PARTS = (0.05, 0.5, 0.95)


def categories_of(inputs: Mapping[str, Sequence | np.ndarray]) -> dict[str, dict[str, np.ndarray]]:
    """Rows of the members of each value, by the key; of keys that are no numbers and do vary."""
    found = {}
    for key, values in inputs.items():
        if not as_columns({key: values}) and len(values):
            texts = np.array(
                [each if isinstance(each, str) else json.dumps(each) for each in values]
            )
            names, which = np.unique(texts, return_inverse=True)
            if 1 < len(names) < len(texts):
                found[key] = {str(name): np.flatnonzero(which == k) for k, name in enumerate(names)}
    return found


def kruskal_wallis(values: np.ndarray, groups: Sequence[np.ndarray], confidence: float) -> dict:
    """The test of values [n], the missing ones as infinite, of groups of rows; as plain data.

    `between`: root of the part of the ranks' variance between the groups, 0..1; `chance`: what it
    exceeds only by chance where the groups do not differ. None for values that are all the same.
    """
    ranks, free = ranks_of(values), len(groups) - 1
    tail = float(stats.chi2.isf(1.0 - confidence, free))
    found = {"name": "Kruskal-Wallis", "chance": min(1.0, math.sqrt(tail / (len(values) - 1)))}
    if not ranks.any():
        return found | {"h": None, "p": None, "between": None}
    part = float(sum(len(rows) * np.mean(ranks[rows]) ** 2 for rows in groups))
    h = (len(values) - 1) * part
    return found | {"h": h, "p": float(stats.chi2.sf(h, free)), "between": math.sqrt(part)}


def by_category(result: xr.Dataset, confidence: float = 0.95) -> list[dict]:
    """Number, success and quantiles of outcomes by category, and the tests; [] without any."""
    ranked = {name: missing_as_worst(result, name) for name in member_outcomes(result)}
    succeeded, found = succeeded_in(result), []
    for key, groups in categories_of(member_inputs(result)).items():
        values = ranked if succeeded is None else {**ranked, SUCCESS: succeeded.astype(float)}
        tests = {n: kruskal_wallis(v, [*groups.values()], confidence) for n, v in values.items()}
        each = [
            {
                "value": value,
                "members": len(rows),
                "success": None
                if succeeded is None
                else success_table(succeeded[rows], confidence),
                "outcomes": {
                    n: quantile_table(v[rows], PARTS, confidence) for n, v in ranked.items()
                },
            }
            for value, rows in groups.items()
        ]
        units = {name: outcome_unit(result, name) for name in ranked}
        found.append({"input": key, "categories": each, "tests": tests, "units": units})
    return found
