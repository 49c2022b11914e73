"""The report on a campaign as one self-contained page."""

import json
from collections.abc import Mapping
from pathlib import Path

import xarray as xr

from torquer.campaign.contents import campaign_table, member_outcomes
from torquer.campaign.spec import SUCCESS
from torquer.campaign.summary import headline_rows, percent
from torquer.report.campaign.bands import series_by_signal, signal_title
from torquer.report.campaign.convergence import estimates
from torquer.report.campaign.interactive import (
    bands_figure,
    category_figure,
    convergence_figure,
    correlations_figure,
    distribution_figure,
    scatter_figure,
    sobol_figure,
)
from torquer.report.campaign.shared import outcome_in_words
from torquer.report.campaign.tables import (
    campaign_rows,
    category_grid,
    correlation_grid,
    outcome_grid,
    outcome_rows,
    sensitivity_grid,
    worst_grid,
)
from torquer.report.common.html import card, cards
from torquer.report.common.sources import sources_data
from torquer.scenario.toml_text import to_toml
from torquer.simulation.results.file import put


def write_page(result: xr.Dataset, summary: dict, pictures: Mapping[str, Path], path: Path) -> Path:
    """Write the page; `pictures` of the same by name, for the signals over time that have one."""
    made = [
        _outcomes(summary),
        *_each_outcome(result, summary),
        *_over_time(result, summary, pictures),
        *_dependence(result, summary),
        *_by_category(summary),
        *_sensitivity(summary),
        *_convergence(result, summary),
        *_worst(result, summary),
        card("sources", "Sources to cite", "", {"sources": sources_data(result)}),
        _scenario(result),
    ]
    description = str(json.loads(result.attrs["scenario"]).get("description") or "")
    columns = [
        ("Summary", headline_rows(summary)),
        ("The campaign", campaign_rows(campaign_table(result))),
    ]
    title = f"{summary['name']}: campaign"
    text = cards(title, made, description=description, columns=columns)
    return put(path, text)


def _as_title(words: str) -> str:
    """Words that begin a heading."""
    return words[:1].upper() + words[1:]


def _outcomes(summary: dict) -> dict:
    caption = (
        f"In brackets: {percent(summary['confidence'])} confidence intervals for independent "
        "members. Missing values are left out of means and count as the worst in percentiles and "
        "ranks."
    )
    return card("outcomes", "Outcomes", caption, {"grid": outcome_grid(summary)})


def _each_outcome(result: xr.Dataset, summary: dict) -> list[dict]:
    return [
        card(
            f"outcome_{name}",
            _as_title(outcome_in_words(summary, name)),
            each["definition"],
            _plot(
                distribution_figure(result, summary, name),
                f"Distribution of {outcome_in_words(summary, name)}",
            )
            if each["mean"] is not None
            else {},
            {"pairs": outcome_rows(each)},
        )
        for name, each in summary["outcomes"].items()
    ]


def _plot(figure: dict | None, words: str) -> dict:
    """A part of a card; empty if there is no figure."""
    return {} if figure is None else {"figure": figure, "words": f"{words}."}


def _over_time(result: xr.Dataset, summary: dict, pictures: Mapping[str, Path]) -> list[dict]:
    found = []
    for names in series_by_signal(result):
        name = f"series_{names[0]}"
        if name in pictures:
            title = f"{_as_title(signal_title(result, names))} over time"
            worst = ", ".join(outcome_in_words(summary, name) for name in names)
            caption = (
                "Percentiles at each instant over the members that did not fail, and the members "
                f"with the worst {worst}."
            )
            figure = bands_figure(result, summary, names)
            found.append(card(name, title, caption, _plot(figure, title)))
    return found


def _dependence(result: xr.Dataset, summary: dict) -> list[dict]:
    if not summary["correlations_computed"]:
        return []
    chance, pairs = summary["chance_correlation"], summary["correlations_computed"]
    caption = (
        f"Spearman's rank correlations. Between independent quantities, one in "
        f"{1.0 / (1.0 - summary['confidence']):.3g} exceeds {chance:.3g} in magnitude by chance: "
        f"about {pairs * (1.0 - summary['confidence']):.2g} of the {pairs} here. "
        f"{len(summary['correlations'])} do. Menus select the input over which an outcome is "
        "drawn, with its correlation."
    )
    if any("][" in each["input"] for each in summary["correlations"]):
        caption += " KEY[i][j] of an attitude: element of the matrix from body to reference axes."
    bars = correlations_figure(result, summary)
    parts = (
        _plot(bars, "Rank correlations of outcomes with inputs"),
        {"grid": correlation_grid(summary)} if summary["correlations"] else {},
        *(
            _plot(
                scatter_figure(result, summary, name),
                f"{outcome_in_words(summary, name)} over inputs",
            )
            for name in member_outcomes(result)
        ),
    )
    return [card("dependence", "Dependence on what varied", caption, *parts)]


def _by_category(summary: dict) -> list[dict]:
    caption = (
        "Of each outcome the median, and in brackets the range of 90 % of the members. Kruskal and "
        "Wallis's test: p is the probability of such a difference in ranks if the categories do "
        "not differ, for each test alone."
    )
    return [
        card(
            f"by_{n}",
            f"By {found['input']}",
            caption,
            {"grid": category_grid(found)},
            *(
                _plot(
                    category_figure(found, name),
                    f"{outcome_in_words(summary, name)} by {found['input']}",
                )
                for name in found["units"]
            ),
        )
        for n, found in enumerate(summary["categories"])
    ]


def _sensitivity(summary: dict) -> list[dict]:
    if summary["sensitivity"] is None:
        return []
    points = summary["sensitivity"]["points"]
    caption = (
        f"Sobol's indices, from the {points} points of Saltelli's design: the share of an "
        "outcome's variance due to a key alone (S1) and with all its interactions (ST). The "
        "components of a vector, and keys that vary together, count as one input. Noise is a "
        "further input, without an index here. Points with a missing value are left out. In "
        f"brackets and as thin lines: {percent(summary['confidence'])} confidence intervals."
    )
    parts: list[dict] = []
    for name, found in summary["sensitivity"]["outcomes"].items():
        if found["groups"]:
            said = outcome_in_words(summary, name)
            figure = _plot(sobol_figure(found["groups"]), f"Sobol indices of {said}")
            parts += [{"title": _as_title(said)}, figure]
    grid = {"grid": sensitivity_grid(summary)}
    return [card("sensitivity", "Sensitivity", caption, *parts, grid)]


def _convergence(result: xr.Dataset, summary: dict) -> list[dict]:
    counts, found = estimates(result, summary)
    parts = [
        _plot(
            convergence_figure(name, counts, each, result, summary),
            "Convergence of "
            + ("the success rate" if name == SUCCESS else outcome_in_words(summary, name)),
        )
        for name, each in found.items()
    ]
    caption = "Estimates from more and more members, in the order of the file."
    return [card("convergence", "Convergence", caption, *parts)] if parts else []


def _worst(result: xr.Dataset, summary: dict) -> list[dict]:
    grid = worst_grid(summary, campaign_table(result))
    if not grid[1]:
        return []
    caption = "Commands to fly a member again; FILE is the scenario file of the campaign."
    return [card("worst", "Members to look at", caption, {"grid": grid})]


def _scenario(result: xr.Dataset) -> dict:
    text = to_toml(json.loads(result.attrs["scenario"]))
    versions = json.loads(result.attrs.get("versions", "{}"))
    rows = [(str(name), str(version)) for name, version in versions.items()]
    parts = ({"text": text}, {"title": "Versions"}, {"pairs": rows})
    return card("scenario", "Scenario", "What all members share.", *parts, folded=True)
