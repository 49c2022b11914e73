"""The numbers of a campaign as rows of text for a page."""

import functools
import json

import numpy as np

from torquer.campaign.checks import check_rows
from torquer.campaign.spec import SUCCESS
from torquer.campaign.summary import (
    correlation_text,
    mean_rows,
    percent,
    settling_rows,
    test_text,
    value_text,
    with_interval,
    with_unit,
)

#: What to type to fly a member again.
FLY = "torquer campaign FILE --member"
#: Rows of a covariance that is shown as it is.
_MOST_ROWS = 4
#: Head and rows of a table.
Grid = tuple[tuple[str, ...], list[tuple[str, ...]]]


def outcome_grid(summary: dict) -> Grid:
    """Head and rows: each outcome's mean and quantiles."""
    head = ("outcome", "missing", "mean", "5 %", "median", "95 %")
    rows = []
    for name, each in summary["outcomes"].items():
        at = [value_text(each["quantiles"][part]["value"]) for part in ("0.05", "0.5", "0.95")]
        means = mean_rows(each)
        mean = "; ".join(f"{label} {value}" for label, value in means)
        mean = means[0][1] if not each["missing"] else mean
        rows.append((with_unit(name, each["unit"]), str(each["missing"]), mean, *at))
    return head, rows


def outcome_rows(each: dict) -> list[tuple[str, str]]:
    """Label and value of one outcome."""
    rows = [(label[0].upper() + label[1:], value) for label, value in mean_rows(each)]
    rows += [
        (f"{float(part):.0%} of members up to", with_interval(found["value"], found["interval"]))
        for part, found in each["quantiles"].items()
    ]
    rows += [(label[0].upper() + label[1:], value) for label, value in settling_rows(each)]
    return [*rows, ("Members without a value", str(each["missing"]))]


def worst_grid(summary: dict, table: dict) -> Grid:
    """Head and rows: members to fly again, and why; `table`: that of the campaign."""
    again = functools.partial(member_command, table)
    rows: list[tuple[str, ...]] = [
        (again(each["member"]), "failed", each["reason"]) for each in summary["failures"]
    ]
    success = summary["success"] or {"unsuccessful": []}
    rows += [(again(member), "unsuccessful", "") for member in success["unsuccessful"]]
    for name, each in summary["outcomes"].items():
        label = f"{each['worst_is']} {name}"
        rows += [
            (again(worst["member"]), label, append_unit(worst["value"], each["unit"]))
            for worst in each["worst"]
        ]
    return ("command", "why", "value"), rows


def member_command(table: dict, member: int) -> str:
    """The command that flies a member again; one of a Latin hypercube depends on all its runs."""
    runs = f" --runs {table['runs']}" if table.get("sampling") == "latin_hypercube" else ""
    return f"{FLY} {member}{runs}"


def append_unit(value: float | None, unit: str) -> str:
    """A value and its unit."""
    return value_text(value) if value is None else f"{value_text(value)} {unit}".strip()


def correlation_grid(summary: dict) -> Grid:
    """Head and rows: correlations above chance, the greatest first."""
    rows: list[tuple[str, ...]] = [
        (pair["outcome"], pair["input"], correlation_text(pair))
        for pair in summary["correlations"][:30]
    ]
    return ("outcome", "input", "rank correlation"), rows


def category_grid(found: dict) -> Grid:
    """Head and rows by category: members, success, medians (5 % to 95 %); the tests."""
    names = [*found["units"]]
    head = (found["input"], "members", "success", *(with_unit(n, found["units"][n]) for n in names))
    rows: list[tuple[str, ...]] = []
    for each in found["categories"]:
        of = [
            [each["outcomes"][n][part]["value"] for part in ("0.5", "0.05", "0.95")] for n in names
        ]
        medians = [
            f"{value_text(m)} ({value_text(low)} to {value_text(high)})" for m, low, high in of
        ]
        rows.append((each["value"], str(each["members"]), rate_text(each["success"]), *medians))
    tests = (SUCCESS, *names) if SUCCESS in found["tests"] else names
    told = [test_text(found["tests"][name]) for name in tests]
    return head, [*rows, ("", "", *([""] * (len(names) + 1 - len(told))), *told)]


def sensitivity_grid(summary: dict) -> Grid:
    """Head and rows: Sobol's indices of each outcome, the greatest total one first."""
    rows: list[tuple[str, ...]] = []
    for name, found in summary["sensitivity"]["outcomes"].items():
        points = str(found["points"])
        groups = sorted(found["groups"].items(), key=lambda each: -each[1]["total"])
        rows += [
            (name, points, key, with_interval(each["first"], each["first_interval"]),
             with_interval(each["total"], each["total_interval"]))
            for key, each in groups
        ] or [(name, points, "too few points, or no variance", "", "")]  # fmt: skip
    return ("outcome", "points", "input", "S1", "ST"), rows


def campaign_rows(table: dict) -> list[tuple[str, str]]:
    """Label and value of each setting: sampling, what varied, conditions."""
    rows = [("Runs", str(table.get("runs", ""))), ("Seed", str(table.get("seed", ""))),
            ("Sampling", str(table.get("sampling", "")))]  # fmt: skip
    rows += [("Listed for each member", key) for key in table.get("table") or ()]
    rows += [(f"Varied: {key}", inline(each)) for key, each in (table.get("vary") or {}).items()]
    for together in table.get("correlated") or ():
        rows.append(("Varied together", inline(_shorten(together))))
    success = table.get("success") or {}
    rows += [(f"Condition of {SUCCESS}: {name}", inline(each)) for name, each in success.items()]
    if table.get("stop"):
        rows.append(("Stop", inline(table["stop"])))
    return rows


def _shorten(together: dict) -> dict:
    """Correlated keys, with standard deviations in place of a large covariance."""
    covariance = np.array(together["covariance"])
    if len(covariance) <= _MOST_ROWS:
        return together
    sigma = [float(f"{each:.3g}") for each in np.sqrt(np.diag(covariance))]
    return {key: each for key, each in together.items() if key != "covariance"} | {"sigma": sigma}


def inline(value) -> str:
    """Plain data as TOML in one line, without keys not given; a single key without braces."""
    text = _inline(value)
    one_key = isinstance(value, dict) and len([v for v in value.values() if v is not None]) == 1
    return text[2:-2] if one_key else text


def _inline(value) -> str:
    if isinstance(value, dict):
        given = {key: each for key, each in value.items() if each is not None}
        return f"{{ {', '.join(f'{key} = {_inline(each)}' for key, each in given.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_inline, value))}]"
    return json.dumps(value, ensure_ascii=False)


# ------------------------------------------------------------------ two campaigns


def campaign_labels(found: dict) -> list[str]:
    """Names of the campaigns: A and B, and their scenarios'."""
    return [f"{letter}: {name}" for letter, name in zip("AB", found["names"], strict=True)]


def comparison_grid(found: dict) -> Grid:
    """Head and rows: members, success rate, each outcome; in A, in B, the difference."""
    a, b = found["summaries"]
    rows: list[tuple[str, ...]] = [
        (label, str(a[label]), str(b[label]), "") for label in ("members", "failed")
    ]
    rows += _success_rows(found)
    told = [dict(check_rows(each)) for each in (a, b)]
    rows += [
        (label, *(each.get(label, "") for each in told), "") for label in {**told[0], **told[1]}
    ]
    for name in found["outcomes"]:
        rows += _compared_rows(found, name)
    return ("", *campaign_labels(found), "B - A"), rows


def _success_rows(found: dict) -> list[tuple[str, ...]]:
    rates = [rate_text(each["success"]) for each in found["summaries"]]
    if (success := found["success"]) is None:
        return [("success rate", *rates, "")] if any(rates) else []
    low, high = success["interval"]
    difference = f"{success['difference']:+.2%} ({low:+.2%} to {high:+.2%})"
    return [("success rate", *rates, difference), _test_row(success["test"])]


def rate_text(success: dict | None) -> str:
    """A success rate with its interval; "" where there is none."""
    if success is None or success["rate"] is None:
        return ""
    low, high = success["interval"]
    return f"{success['rate']:.2%} ({low:.2%} to {high:.2%})"


def _compared_rows(found: dict, name: str) -> list[tuple[str, ...]]:
    """Mean, quantiles and missing values of an outcome, and the test."""
    each, ours = found["outcomes"][name], [s["outcomes"][name] for s in found["summaries"]]
    label = with_unit(name, ours[0]["unit"])
    label += "" if each["same_definition"] else " (defined differently in B)"
    missing = any(one["missing"] for one in ours)
    mean = "  mean of those with a value" if missing else "  mean"
    rows = [(label, "", "", ""), _means_row(mean, ours, each)]
    if missing and (both := each["restricted"]) is not None:
        label = f"  restricted mean (B - A: at most {both['end_s']:g})"
        rows.append(_means_row(label, [one["restricted_mean"] for one in ours], both))
    for part, title in (("0.05", "5 %"), ("0.5", "median"), ("0.95", "95 %")):
        at = [with_interval(**one["quantiles"][part]) for one in ours]
        rows.append((f"  {title}", *at, ""))
    if missing:
        rows.append(("  missing", *(str(one["missing"]) for one in ours), ""))
    return [*rows, _test_row(each["test"])]


def _means_row(label: str, means: list[dict], difference: dict) -> tuple[str, ...]:
    """Means in A and in B, and their difference."""
    both = [with_interval(each["mean"], each["mean_interval"]) for each in means]
    return (label, *both, with_interval(difference["difference"], difference["interval"]))


def _test_row(test: dict | None) -> tuple[str, ...]:
    if test is None:
        return ("  no test", "", "", "")
    return (f"  {test['name']}", "", "", f"p = {value_text(test['p'])}")


def about_comparison(found: dict) -> str:
    """How to read the intervals and tests of a comparison."""
    text = (
        f"In brackets: {percent(found['confidence'])} confidence intervals. p applies to each "
        "test alone, whatever the number of tests. "
    )
    if any(each["missing"] for one in found["summaries"] for each in one["outcomes"].values()):
        text += "In restricted means a time that a member did not reach counts as the run's end. "
    if not found["pairs"]:
        return text + "Members of A and B are assumed to be independent."
    text += (
        f"{found['pairs']} members had the same inputs in A and in B: differences of means and "
        "tests are those within pairs."
    )
    if found["success"]:
        gained, lost = found["success"]["gained"], found["success"]["lost"]
        text += f" {gained} succeeded in B only, {lost} in A only."
    return text
