"""The report on a campaign as one self-contained page."""

import base64
import json
from collections.abc import Mapping
from html import escape
from pathlib import Path

import xarray as xr

from torquer.campaign.contents import table_of
from torquer.campaign.summary import headline_rows, percent
from torquer.report.campaign.bands import series_by_signal
from torquer.report.campaign.tables import (
    campaign_rows,
    correlation_grid,
    outcome_grid,
    outcome_rows,
    sensitivity_grid,
    worst_grid,
)
from torquer.report.common.html import document, grid, section, table
from torquer.scenario.toml_text import toml_of


def write_page(result: xr.Dataset, summary: dict, pictures: Mapping[str, Path], path: Path) -> Path:
    """Write the page, its pictures within it."""
    sections = [
        _head(result, summary),
        _outcomes(summary),
        *_each_outcome(summary, pictures),
        *_over_time(result, pictures),
        _dependence(summary, pictures),
        _sensitivity(summary, pictures),
        _convergence(pictures),
        _worst(result, summary),
        _scenario(result),
    ]
    text = document(f"{summary['name']}: campaign", sections, interactive=False)
    path.write_text(text, encoding="utf-8")
    return path


def picture(pictures: Mapping[str, Path], name: str, words: str) -> str:
    """A picture within the page; nothing if there is none."""
    if name not in pictures:
        return ""
    data = base64.b64encode(pictures[name].read_bytes()).decode("ascii")
    return f'<p><img alt="{escape(words)}" src="data:image/png;base64,{data}"></p>'


def _head(result: xr.Dataset, summary: dict) -> str:
    description = json.loads(result.attrs["scenario"]).get("description") or ""
    return (
        f"<header><h1>{escape(summary['name'])}: campaign</h1>"
        f"<p>{escape(str(description))}</p></header>"
        f'<div class="columns"><section><h2>Summary</h2>{table(headline_rows(summary))}</section>'
        f"<section><h2>The campaign</h2>{table(campaign_rows(table_of(result)))}</section></div>"
    )


def _outcomes(summary: dict) -> str:
    caption = (
        f"In brackets: {percent(summary['confidence'])} confidence intervals of independent "
        "members. A missing value has no part in a mean; in quantiles and ranks it counts as worse "
        "than any other."
    )
    return section("outcomes", "Outcomes", caption, grid(*outcome_grid(summary)))


def _each_outcome(summary: dict, pictures: Mapping[str, Path]) -> list[str]:
    return [
        section(
            f"outcome_{name}",
            name,
            each["definition"],
            picture(pictures, f"distribution_{name}", f"Distribution of {name}")
            + table(outcome_rows(each)),
        )
        for name, each in summary["outcomes"].items()
    ]


def _over_time(result: xr.Dataset, pictures: Mapping[str, Path]) -> list[str]:
    found = []
    for names in series_by_signal(result):
        name = f"series_{names[0]}"
        if name in pictures:
            title = str(result[f"series.{names[0]}"].attrs.get("long_name", names[0]))
            caption = (
                "At each instant by itself: the values between which parts of the members that "
                f"did not fail are. Worst members are those of {', '.join(names)}."
            )
            body = picture(pictures, name, f"{title} over time")
            found.append(section(name, f"{title} over time", caption, body))
    return found


def _dependence(summary: dict, pictures: Mapping[str, Path]) -> str:
    if not summary["correlations_computed"]:
        return ""
    chance, pairs = summary["chance_correlation"], summary["correlations_computed"]
    caption = (
        f"Spearman's rank correlations. Of independent numbers one in "
        f"{1.0 / (1.0 - summary['confidence']):.3g} exceeds {chance:.3g} in size by chance: of the "
        f"{pairs} here about {pairs * (1.0 - summary['confidence']):.2g}. "
        f"{len(summary['correlations'])} do."
    )
    body = picture(pictures, "correlations", "Rank correlations")
    body += picture(pictures, "scatter", "Outcomes over inputs")
    if summary["correlations"]:
        body += grid(*correlation_grid(summary))
    return section("dependence", "Dependence on what varied", caption, body)


def _sensitivity(summary: dict, pictures: Mapping[str, Path]) -> str:
    if summary["sensitivity"] is None:
        return ""
    points = summary["sensitivity"]["points"]
    caption = (
        f"Sobol's indices, from the {points} points of Saltelli's design: the part of an outcome's "
        "variance that is due to a key alone (S1), and with all its interactions (ST). The numbers "
        "of a vector, and keys that are correlated, count as one. The noise counts as a further "
        "input, which has no index here. Where a member has no value its point is left out. In "
        f"brackets: {percent(summary['confidence'])} confidence intervals."
    )
    body = picture(pictures, "sobol", "Sobol indices") + grid(*sensitivity_grid(summary))
    return section("sensitivity", "Sensitivity", caption, body)


def _convergence(pictures: Mapping[str, Path]) -> str:
    if "convergence" not in pictures:
        return ""
    caption = "Estimates of the first members, in the order of the file."
    body = picture(pictures, "convergence", "Convergence")
    return section("convergence", "Convergence", caption, body)


def _worst(result: xr.Dataset, summary: dict) -> str:
    head, rows = worst_grid(summary, table_of(result))
    if not rows:
        return ""
    caption = "Commands that fly a member again; FILE is the scenario file of the campaign."
    return section("worst", "Members to look at", caption, grid(head, rows))


def _scenario(result: xr.Dataset) -> str:
    text = toml_of(json.loads(result.attrs["scenario"]))
    versions = json.loads(result.attrs.get("versions", "{}"))
    body = f"<pre>{escape(text)}</pre><h2>Versions</h2>"
    body += table((str(name), str(version)) for name, version in versions.items())
    return section("scenario", "Scenario", "What all members share.", body)
