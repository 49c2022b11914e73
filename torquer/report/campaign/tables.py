"""The numbers of a campaign as rows of text for a page."""

import json

from torquer.campaign.spec import SUCCESS
from torquer.campaign.summary import value_text, with_interval, with_unit

#: What to type to fly a member again.
FLY = "torquer campaign FILE --member"
#: Head and rows of a table.
Grid = tuple[tuple[str, ...], list[tuple[str, ...]]]


def outcome_grid(summary: dict) -> Grid:
    """Head and rows: each outcome's mean and quantiles."""
    head = ("outcome", "missing", "mean", "5 %", "median", "95 %")
    rows = []
    for name, each in summary["outcomes"].items():
        at = [value_text(each["quantiles"][part]["value"]) for part in ("0.05", "0.5", "0.95")]
        mean = with_interval(each["mean"], each["mean_interval"])
        rows.append((with_unit(name, each["unit"]), str(each["missing"]), mean, *at))
    return head, rows


def outcome_rows(each: dict) -> list[tuple[str, str]]:
    """Label and value of one outcome."""
    mean = "Mean of members with a value" if each["missing"] else "Mean"
    rows = [(mean, with_interval(each["mean"], each["mean_interval"]))]
    rows += [
        (f"{float(part):.0%} of members up to", with_interval(found["value"], found["interval"]))
        for part, found in each["quantiles"].items()
    ]
    return [*rows, ("Members without a value", str(each["missing"]))]


def worst_grid(summary: dict) -> Grid:
    """Head and rows: members to fly again, and why."""
    rows: list[tuple[str, ...]] = [
        (again(each["member"]), "failed", each["reason"]) for each in summary["failures"]
    ]
    success = summary["success"] or {"unsuccessful": []}
    rows += [(again(member), "unsuccessful", "") for member in success["unsuccessful"]]
    for name, each in summary["outcomes"].items():
        label = f"{each['worst_is']} {name}"
        rows += [
            (again(worst["member"]), label, with_unit_of(worst["value"], each["unit"]))
            for worst in each["worst"]
        ]
    return ("command", "why", "value"), rows


def again(member: int) -> str:
    """The command that flies a member again."""
    return f"{FLY} {member}"


def with_unit_of(value: float | None, unit: str) -> str:
    """A value and its unit."""
    return value_text(value) if value is None else f"{value_text(value)} {unit}".strip()


def correlation_grid(summary: dict) -> Grid:
    """Head and rows: correlations above chance, the greatest first."""
    rows: list[tuple[str, ...]] = [
        (pair["outcome"], pair["input"], f"{pair['correlation']:+.3f}")
        for pair in summary["correlations"][:30]
    ]
    return ("outcome", "input", "rank correlation"), rows


def campaign_rows(table: dict) -> list[tuple[str, str]]:
    """Label and value of what was asked for: sampling, what varied, conditions."""
    rows = [("Runs", str(table.get("runs", ""))), ("Seed", str(table.get("seed", ""))),
            ("Sampling", str(table.get("sampling", "")))]  # fmt: skip
    rows += [(f"Varied: {key}", inline(each)) for key, each in (table.get("vary") or {}).items()]
    for together in table.get("correlated") or ():
        rows.append(("Varied together", inline(together)))
    success = table.get("success") or {}
    rows += [(f"Condition of {SUCCESS}: {name}", inline(each)) for name, each in success.items()]
    if table.get("stop"):
        rows.append(("Stop", inline(table["stop"])))
    return rows


def inline(value) -> str:
    """Plain data as TOML in one line, without what is not given; of one key without braces."""
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
