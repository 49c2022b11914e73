"""More than two campaigns side by side: one table, distribution functions, one HTML page."""

from collections.abc import Sequence
from pathlib import Path
from string import ascii_uppercase

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from torquer.campaign.checks import check_rows
from torquer.campaign.contents import missing_as_worst
from torquer.campaign.summary import percent, value_text, with_interval, with_unit
from torquer.report.campaign.interactive import cdf_figure
from torquer.report.campaign.shared import axis_label, in_words, is_wide, literal, steps
from torquer.report.campaign.tables import Grid, rate_text
from torquer.report.common.colours import RUNS
from torquer.report.common.figure import SMALL, legend, place, quiet, save_figures, sheet
from torquer.report.common.html import card, cards
from torquer.simulation.results.file import put


def several_labels(found: dict) -> list[str]:
    """Names of the campaigns: A, B and so on, and their scenarios'."""
    return [f"{ascii_uppercase[k]}: {name}" for k, name in enumerate(found["names"])]


def several_grid(found: dict) -> Grid:
    """Head and rows: members, success rate, each outcome in each campaign, and from A."""
    summaries = found["summaries"]
    rows: list[tuple[str, ...]] = [
        (label, *(str(each[label]) for each in summaries)) for label in ("members", "failed")
    ]
    if any(each["success"] for each in summaries):
        rows.append(("success rate", *(rate_text(each["success"]) for each in summaries)))
    told = [dict(check_rows(each)) for each in summaries]
    for label in {label: None for each in told for label in each}:
        rows.append((label, *(each.get(label, "") for each in told)))
    for name in found["outcomes"]:
        rows += _outcome_rows(found, name)
    return ("", *several_labels(found)), rows


def _outcome_rows(found: dict, name: str) -> list[tuple[str, ...]]:
    each, ours = found["outcomes"][name], [s["outcomes"][name] for s in found["summaries"]]
    empty = ("",) * len(ours)
    other = any(not one["same_definition"] for one in each["against_first"])
    label = with_unit(name, ours[0]["unit"]) + (" (not defined alike)" if other else "")
    rows = [(label, *empty)]
    rows.append(("  mean", *(with_interval(one["mean"], one["mean_interval"]) for one in ours)))
    for part, title in (("0.05", "5 %"), ("0.5", "median"), ("0.95", "95 %")):
        rows.append((f"  {title}", *(value_text(one["quantiles"][part]["value"]) for one in ours)))
    if any(one["missing"] for one in ours):
        rows.append(("  missing", *(str(one["missing"]) for one in ours)))
    differences = (with_interval(d["difference"], d["interval"]) for d in each["against_first"])
    rows.append(("  difference from A", "", *differences))
    adjusted = ("" if p is None else value_text(p) for p in each["adjusted_p"])
    rows.append(("  p against A, adjusted", "", *adjusted))
    if each["test"] is not None:
        test = each["test"]
        rows.append((f"  {test['name']}, all", f"p = {value_text(test['p'])}", *empty[1:]))
    return rows


def about_several(found: dict) -> str:
    """How to read the intervals and tests."""
    text = (
        f"In brackets: {percent(found['confidence'])} confidence intervals. p against A is "
        "adjusted to the number of campaigns (Holm), not to that of outcomes. A difference from A "
        "is that of the means of the members with a value. "
    )
    if all(found["pairs"]):
        return text + "Members had the same inputs in all campaigns: it is taken within pairs."
    return text + "Not all campaigns have members with the inputs of A; those are independent."


def write_several(results: Sequence[xr.Dataset], found: dict, folder: Path) -> list[Path]:
    """Write `report.html` and `plots/*.png` into a folder that is there; return the paths."""
    pictures = {f"cdf_{name}": _draw_cdf(results, found, name) for name in found["outcomes"]}
    made = save_figures(pictures, folder / "plots")
    labels = several_labels(found)
    table = card("table", "Side by side", about_several(found), {"grid": several_grid(found)})
    shown = [table, *(_distribution(results, found, name, labels) for name in found["outcomes"])]
    page = cards("Campaigns compared", shown, description="; ".join(labels))
    return [put(folder / "report.html", page), *made.values()]


def _distribution(results, found: dict, name: str, labels: list[str]) -> dict:
    each = found["summaries"][0]["outcomes"][name]
    figure = cdf_figure(results, labels, name, each["unit"])
    said = in_words(name, each["unit"])
    words = f"Distribution functions: {said}."
    shown = {"figure": figure, "words": words} if figure else {"line": "No member has a value."}
    return card(f"cdf_{name}", said, each["definition"], shown)


def _draw_cdf(results, found: dict, name: str) -> Figure | None:
    """Distribution functions in one picture; None if no member has a value."""
    unit = found["summaries"][0]["outcomes"][name]["unit"]
    return draw_cdf(results, several_labels(found), name, unit)


def draw_cdf(
    results: Sequence[xr.Dataset], labels: Sequence[str], name: str, unit: str
) -> Figure | None:
    """Distribution functions of an outcome in one picture; None if no member has a value."""
    values = [missing_as_worst(each, name) for each in results]
    known = np.concatenate([each[np.isfinite(each)] for each in values])
    if not len(known):
        return None
    figure = sheet(7.2, 3.6, in_words(name, unit))
    axes = place(figure, 0.75, 0.75, 6.2, 2.2)
    quiet(axes)
    handles = []
    for each, label, colour in zip(values, labels, RUNS, strict=False):
        if np.isfinite(each).any():
            handles += axes.plot(*steps(each), color=colour, lw=1.5, drawstyle="steps-post",
                                 label=literal(_short(label)))  # fmt: skip
    axes.set_xscale("log" if is_wide(known) else "linear")
    axes.set_ylim(0.0, 1.02)
    axes.set_ylabel("share of members", fontsize=SMALL)
    axes.set_xlabel(axis_label(name, unit), fontsize=SMALL)
    legend(axes, handles)
    return figure


def _short(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:39]}…"
