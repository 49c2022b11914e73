"""What stands on the page of a campaign."""

from functools import partial

import xarray as xr
from matplotlib.figure import SubFigure

from torquer.analysis.citations import select_sources
from torquer.campaign.contents import campaign_table, independent
from torquer.campaign.summary import campaign_summary, rate_text, summary_rows
from torquer.report.campaign.bands import draw_bands_on, has_bands, series_by_signal, signal_title
from torquer.report.campaign.distribution import draw_shares, name_marks
from torquer.report.campaign.shared import in_words
from torquer.report.campaign.tables import campaign_rows
from torquer.report.common.figure import INK, SMALL, place
from torquer.report.common.models import model_rows
from torquer.report.common.one_page import Page, Plot
from torquer.simulation.results.dataset import flown_scenario

#: Space around a plot [inch]: at its left, above, at its right, below.
_LEFT, _ABOVE, _RIGHT, _BELOW = 0.75, 0.52, 0.2, 0.62
#: Plots of a page.
_PLOTS = 2


def campaign_page(result: xr.Dataset) -> Page:
    """Question, verdict, plots, numbers, models and sources of a campaign."""
    summary, table = campaign_summary(result), campaign_table(result)
    scenario = flown_scenario(result)
    varied = ("Runs", "Seed", "Sampling", "Varied", "Stop")
    settings = [row for row in campaign_rows(table) if row[0].startswith(varied)]
    return Page(
        title=summary["name"],
        question=_question(scenario.description, summary, table),
        verdict=_verdict(summary),
        look="open",
        plots=_plots(independent(result), summary),
        numbers=summary_rows(summary),
        models=[*settings, *model_rows(scenario)],
        sources=[source.in_words() for source in select_sources(result)],
    )


def _question(about: str, summary: dict, table: dict) -> str:
    """What the scenario describes, and what is asked of its runs."""
    asked = f"{summary['members']} runs: what are {', '.join(summary['outcomes'])}?"
    if conditions := table.get("success"):
        limits = [
            f"{name} {side} {limit:g} {summary['outcomes'][name]['unit']}".strip()
            for name, each in conditions.items()
            for side, limit in each.items()
            if limit is not None
        ]
        asked = f"{summary['members']} runs: how many have {' and '.join(limits)}?"
    about = about.strip().rstrip(".")
    return f"{about}. {asked}" if about else asked


def _verdict(summary: dict) -> str:
    if summary["success"] is None:
        return "No verdict: the campaign gives no conditions of success."
    rate = rate_text(summary["success"], summary["confidence"])
    failed = f"; {summary['failed']} runs failed" if summary["failed"] else ""
    return f"Success rate {rate}{failed}."


def _plots(result: xr.Dataset, summary: dict) -> list[Plot]:
    """The first signal over time, and the distributions of the first outcomes."""
    drawn = []
    if has_bands(result):
        drawn = [
            partial(_draw_bands, result=result, summary=summary, names=names)
            for names in series_by_signal(result)
            if f"series.{names[0]}" in result
        ]
    drawn = drawn[:1] + [
        partial(_draw_shares, result=result, summary=summary, name=name)
        for name, each in summary["outcomes"].items()
        if each["mean"] is not None
    ]
    return [Plot(each) for each in drawn[:_PLOTS]]


def _axes(part: SubFigure, title: str):
    wide, tall = part.bbox.width / part.figure.dpi, part.bbox.height / part.figure.dpi
    part.text(_LEFT / wide, 1.0 - 0.13 / tall, title, fontsize=9.5, color=INK, parse_math=False)
    return place(part, _LEFT, _ABOVE, wide - _LEFT - _RIGHT, tall - _ABOVE - _BELOW)


def _draw_bands(part: SubFigure, result: xr.Dataset, summary: dict, names: list[str]) -> None:
    draw_bands_on(_axes(part, signal_title(result, names)), result, summary, names)


def _draw_shares(part: SubFigure, result: xr.Dataset, summary: dict, name: str) -> None:
    axes = _axes(part, f"Distribution of {in_words(name, summary['outcomes'][name]['unit'])}")
    words = draw_shares(axes, result, summary, name)
    name_marks(axes, result, summary, name)
    tall = part.bbox.height / part.figure.dpi
    part.text(0.0, 0.07 / tall, words, fontsize=SMALL - 0.5, color=INK, va="bottom")
