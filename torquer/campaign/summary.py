"""Summary of a campaign, as plain data and as rows of text.

Statistics are those of independent members. A missing value counts as worse than any other in
quantiles and ranks, and is left out of means; of times there is the restricted mean, too, in which
one that has not come by the end of the run counts as the end. Numbers that do not exist are None: a
quantile among missing values, the end of an interval that so few members do not bound.
"""

import numpy as np
import xarray as xr

from torquer.analysis.citations import cited_in_words
from torquer.base.strict_json import finite_or_none
from torquer.campaign.categories import by_category
from torquer.campaign.checks import check_rows, check_summary
from torquer.campaign.contents import (
    NAMED,
    campaign_table,
    end_s,
    failed_in,
    in_words,
    independent,
    least_is_worst,
    member_inputs,
    member_numbers,
    member_outcomes,
    missing_as_worst,
    outcome_bounds,
    outcome_unit,
    restrict_times,
    scenario_name,
    succeeded_in,
)
from torquer.campaign.sensitivity import sensitivity
from torquer.campaign.settling import settling, settling_in_words
from torquer.campaign.spec import SUCCESS
from torquer.campaign.statistics import (
    chance_correlation,
    mean_interval,
    plain,
    quantile_table,
    rank_correlations,
    success_table,
)

#: Parts of all members at which quantiles are taken.
PARTS = (0.01, 0.05, 0.5, 0.95, 0.99)
#: How many categories are named in a row.
_CATEGORIES = 8
#: What a correlation is of that has no sign.
CATEGORIES = "categories"


def campaign_summary(result: xr.Dataset, confidence: float = 0.95) -> dict:
    """Members, success rate, statistics of each outcome, correlations above chance."""
    failed, own = failed_in(result), independent(result)
    pairs, categories = correlations(own), by_category(own, confidence)
    chance = chance_correlation(own.sizes["member"], confidence)
    return {
        "name": scenario_name(result),
        "runs": campaign_table(result).get("runs"),
        "members": len(failed),
        "independent": own.sizes["member"],
        "failed": int(failed.sum()),
        "failures": _failures(result, failed),
        "confidence": confidence,
        "success": _success(own, confidence),
        "checks": check_summary(result),
        "stop": _stop(own),
        "outcomes": {name: _outcome(own, name, confidence) for name in member_outcomes(own)},
        "chance_correlation": chance,
        "correlations_computed": sum(map(len, pairs.values()))
        + sum(len(each["tests"]) for each in categories),
        "correlations": _above(pairs, chance, categories),
        "categories": categories,
        "sensitivity": sensitivity(result, confidence),
        "cite": cited_in_words(result),
    }


def _failures(result: xr.Dataset, failed: np.ndarray) -> list[dict]:
    """The first members that failed, and why."""
    members, reasons = member_numbers(result), result["ended"].values
    rows = np.flatnonzero(failed)[:NAMED].tolist()
    return [{"member": int(members[row]), "reason": str(reasons[row])} for row in rows]


def _success(result: xr.Dataset, confidence: float) -> dict | None:
    succeeded = succeeded_in(result)
    if succeeded is None:
        return None
    others = member_numbers(result)[~succeeded & ~failed_in(result)]
    return {
        **success_table(succeeded, confidence),
        "unsuccessful": [int(member) for member in others[:NAMED]],
    }


def _stop(result: xr.Dataset) -> str | None:
    """Why all runs were flown although the campaign has a stopping rule; None if that is plain."""
    name = (campaign_table(result).get("stop") or {}).get("outcome")
    values = member_outcomes(result).get(name, np.zeros(0))
    missing = int(np.isnan(values).sum())
    if not missing:
        return None
    return f"not while members have no {name} ({missing} of {len(values)}): their mean is not known"


def _outcome(result: xr.Dataset, name: str, confidence: float) -> dict:
    values, ranked = member_outcomes(result)[name], missing_as_worst(result, name)
    return {
        "definition": in_words(result, name),
        "unit": outcome_unit(result, name),
        "members": len(values),
        "missing": int(np.isnan(values).sum()),
        **_mean(values, confidence, outcome_bounds(result, name)),
        "restricted_mean": _restricted_mean(result, name, confidence),
        "quantiles": quantile_table(ranked, PARTS, confidence),
        "settling": settling(result, name),
        "worst_is": "least" if least_is_worst(result, name) else "greatest",
        "worst": worst_members(result, name),
    }


def _mean(values: np.ndarray, confidence: float, bounds: tuple[float, float]) -> dict:
    """Mean of the members that have a value, and its interval."""
    known = values[np.isfinite(values)]
    return {
        "mean": finite_or_none(known.mean()) if len(known) else None,
        "mean_interval": plain(mean_interval(known, confidence, bounds)),
    }


def _restricted_mean(result: xr.Dataset, name: str, confidence: float) -> dict | None:
    """Restricted mean of a time, None for other outcomes."""
    end = end_s(result)
    values = restrict_times(result, name, end)
    if values is None:
        return None
    return {"end_s": end, **_mean(values, confidence, outcome_bounds(result, name))}


def worst_members(result: xr.Dataset, name: str, count: int = NAMED) -> list[dict]:
    """Members whose runs did not fail with the worst values of an outcome, the worst first."""
    rows = np.flatnonzero(~failed_in(result))
    members, ranked = member_numbers(result)[rows], missing_as_worst(result, name)[rows]
    badness = -ranked if least_is_worst(result, name) else ranked
    order = np.argsort(-badness, kind="stable")[:count]
    return [{"member": int(members[k]), "value": finite_or_none(ranked[k])} for k in order]


def correlations(result: xr.Dataset) -> dict[str, dict[str, float]]:
    """Rank correlations [outcome][input], of success too; see `rank_correlations`.

    None with so few members that any value might be due to chance.
    """
    if chance_correlation(result.sizes["member"]) >= 1.0:
        return {}
    outcomes = {name: missing_as_worst(result, name) for name in member_outcomes(result)}
    succeeded = succeeded_in(result)
    if succeeded is not None:
        outcomes[SUCCESS] = succeeded.astype(float)
    return rank_correlations(member_inputs(result), outcomes)


def _above(pairs: dict[str, dict[str, float]], chance: float, categories: list[dict]) -> list[dict]:
    """Correlations above chance, the greatest in size first; of categories that between them."""
    found = [
        {"outcome": outcome, "input": key, "correlation": value, "of": "ranks"}
        for outcome, inputs in pairs.items()
        for key, value in inputs.items()
        if abs(value) > chance
    ]
    found += [
        {"outcome": name, "input": each["input"], "correlation": test["between"], "of": CATEGORIES}
        for each in categories
        for name, test in each["tests"].items()
        if (test["between"] or 0.0) > test["chance"]
    ]
    return sorted(found, key=lambda each: -abs(each["correlation"]))


def correlation_text(pair: dict) -> str:
    """A rank correlation; one between categories has no sign."""
    if pair["of"] == CATEGORIES:
        return f"{pair['correlation']:.2f} between {CATEGORIES}"
    return f"{pair['correlation']:+.2f}"


# ------------------------------------------------------------------ in words


def summary_rows(summary: dict) -> list[tuple[str, str]]:
    """Label and value of the most important numbers."""
    rows = headline_rows(summary) + _failure_rows(summary)
    for name, each in summary["outcomes"].items():
        rows += [(with_unit(name, each["unit"]), _line(each)), *settling_rows(each)]
    for name in (*summary["outcomes"], SUCCESS):
        found = [pair for pair in summary["correlations"] if pair["outcome"] == name][:NAMED]
        if found:
            text = ", ".join(f"{pair['input']} {correlation_text(pair)}" for pair in found)
            rows.append((f"Rank correlation: {name}", text))
    return [*rows, *_category_rows(summary), *_sensitivity_rows(summary)]


def _category_rows(summary: dict) -> list[tuple[str, str]]:
    """By category: members and success; medians of outcomes, and whether the categories differ."""
    rows = []
    for found in summary["categories"]:
        shown = found["categories"][:_CATEGORIES]
        more = [f"{left} more"] if (left := len(found["categories"]) - len(shown)) else []
        rows.append((f"By {found['input']}", ", ".join([*map(category_text, shown), *more])))
        for name, test in found["tests"].items():
            medians = [] if name == SUCCESS else [_median_text(each, name) for each in shown]
            text = "; ".join(
                [", ".join([*medians, *more]), test_text(test)] if medians else [test_text(test)]
            )
            rows.append((f"  {with_unit(name, found['units'].get(name, ''))}", text))
    return rows


def category_text(category: dict) -> str:
    """A category, its members and, with conditions, the part of them that succeeded."""
    success = category["success"]
    rate = "" if success is None else f", {success['rate']:.0%} successful"
    return f"{category['value']} ({category['members']} members{rate})"


def _median_text(category: dict, name: str) -> str:
    at = [value_text(category["outcomes"][name][part]["value"]) for part in ("0.5", "0.05", "0.95")]
    if at == [at[0]] * 3:  # as where no member has a value
        return f"{category['value']} median {at[0]}"
    return f"{category['value']} median {at[0]} ({at[1]} to {at[2]})"


def test_text(test: dict) -> str:
    """Whether categories differ: the probability of such a difference by chance."""
    if test["between"] is None:
        return "all the same"
    return f"{test['name']} p = {test['p']:.2g}"


def _failure_rows(summary: dict) -> list[tuple[str, str]]:
    """Why members failed: each reason once, with the first of those that it is known of."""
    first = {each["reason"]: each["member"] for each in reversed(summary["failures"])}
    found = [(f"  member {member}", reason) for reason, member in first.items()]
    return sorted(found, key=lambda row: int(row[0].split()[1]))


def settling_rows(each: dict) -> list[tuple[str, str]]:
    """When members are first below the limit of a settling time, where some come back above it."""
    found = each["settling"]
    if found is None or not found["again"]:
        return []
    words = settling_in_words(found, each["members"], found["unit"])
    return [(f"first below {found['below']:g} [s]", words)]


def _sensitivity_rows(summary: dict) -> list[tuple[str, str]]:
    """Sobol's indices of each outcome, the greatest total one first."""
    rows = []
    for name, found in (summary["sensitivity"] or {"outcomes": {}})["outcomes"].items():
        groups = sorted(found["groups"].items(), key=lambda each: -each[1]["total"])[:NAMED]
        parts = [f"{key} {each['first']:.2f}, {each['total']:.2f}" for key, each in groups]
        if parts:
            rows.append((f"Sobol indices S1, ST: {name}", "; ".join(parts)))
    return rows


def headline_rows(summary: dict) -> list[tuple[str, str]]:
    """Members, failures, success rate."""
    members, runs = summary["members"], summary["runs"]
    of_runs = f" of {runs} runs" if runs is not None and runs != members else ""
    rows = [("Members", f"{members}{of_runs}"), ("Failed", str(summary["failed"]))]
    if summary["independent"] != members:
        rows.append(("Independent members", f"{summary['independent']}, used for the statistics"))
    if summary["stop"] is not None:
        rows.append(("Stop", summary["stop"]))
    if summary["success"] is not None:
        rows.append(("Success rate", rate_text(summary["success"], summary["confidence"])))
    return rows + check_rows(summary)


def rate_text(success: dict, confidence: float) -> str:
    """Success rate with its interval."""
    if success["rate"] is None:
        return "none"
    low, high = success["interval"]
    return f"{success['rate']:.2%} ({percent(confidence)} interval {low:.2%} to {high:.2%})"


def percent(confidence: float) -> str:
    """A confidence in percent."""
    return f"{100.0 * confidence:.4g} %"


def with_unit(name: str, unit: str) -> str:
    """A name and its unit in brackets."""
    return f"{name} [{unit}]" if unit else name


def _line(each: dict) -> str:
    if mean_rows(each) == [_NO_MEAN]:  # quantiles are missing, too
        return _NO_VALUE
    at = {part: value_text(found["value"]) for part, found in each["quantiles"].items()}
    parts = [" ".join(row) for row in mean_rows(each)]
    parts.append(f"5 %: {at['0.05']}, median {at['0.5']}, 95 %: {at['0.95']}")
    if each["worst"]:
        worst = each["worst"][0]
        parts.append(f"worst {value_text(worst['value'])} (member {worst['member']})")
    return "; ".join(parts)


#: Of an outcome that no member has.
_NO_VALUE = "no member has a value"
_NO_MEAN = ("mean", f"unknown: {_NO_VALUE}")


def mean_rows(each: dict) -> list[tuple[str, str]]:
    """Label and value of an outcome's mean; with missing values of whom, and of all if known."""
    mean = with_interval(each["mean"], each["mean_interval"])
    if not each["missing"]:
        return [("mean", mean)]
    known = each["members"] - each["missing"]
    rows = [(f"mean of {known} of {each['members']}", mean) if known else _NO_MEAN]
    if (found := each["restricted_mean"]) is not None and found["mean"] is not None:
        label = f"restricted mean (at most {found['end_s']:g})"
        rows.append((label, with_interval(found["mean"], found["mean_interval"])))
    return rows


def value_text(value: float | None) -> str:
    """A value, or that it is missing."""
    return "missing" if value is None else f"{value:.4g}"


def with_interval(value: float | None, interval: list[float | None]) -> str:
    """A value and the interval around it, if there is one."""
    if interval == [None, None]:
        return value_text(value)
    low, high = interval
    if low is None:
        return f"{value_text(value)} (up to {high:.4g})"
    if high is None:
        return f"{value_text(value)} (from {low:.4g})"
    return f"{value_text(value)} ({low:.4g} to {high:.4g})"
