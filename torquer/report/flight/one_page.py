"""What stands on the page of a run."""

from functools import partial

import xarray as xr
from matplotlib.figure import SubFigure

from torquer.analysis.citations import select_sources
from torquer.analysis.goals import find_goals
from torquer.analysis.summary import summary_rows
from torquer.analysis.verdict import clock_text
from torquer.base.language import message
from torquer.report.common.figure import place
from torquer.report.common.models import model_rows
from torquer.report.common.one_page import Page, Plot
from torquer.report.flight.notes import notes
from torquer.report.flight.panels import overview
from torquer.report.flight.panels.panel import Panel
from torquer.report.flight.png import draw_panel
from torquer.report.flight.verdict import LOOKS
from torquer.report.flight.view import View, make_view
from torquer.scenario.spec import Scenario

#: Space around a plot [inch]: at its left, above, at its right, below.
_LEFT, _ABOVE, _RIGHT, _BELOW = 0.75, 0.28, 0.6, 0.42


def run_page(result: xr.Dataset) -> Page:
    """Question, verdict, plots, numbers, models and sources of a run."""
    view = make_view(result)
    verdict = view.summary["verdict"]
    first, _, last = overview(view)
    return Page(
        title=view.scenario.name,
        question=_question(view.scenario),
        verdict=verdict["headline"],
        look=LOOKS[verdict["done"]],
        plots=[Plot(partial(_draw, view=view, panel=panel)) for panel in (first, last)],
        numbers=summary_rows(view.summary)[1:],  # the verdict is told above
        models=model_rows(view.scenario),
        sources=[source.in_words() for source in select_sources(result)],
        notes=notes(view),
    )


def _question(scenario: Scenario) -> str:
    """What the scenario describes, and what it is judged by."""
    about, asked = scenario.description.strip().rstrip("."), _asked(scenario)
    if not about:
        return message("{asked}.", asked=asked)
    return message("{about}. {asked}.", about=about, asked=asked)


def _asked(scenario: Scenario) -> str:
    found = find_goals(scenario)
    if not found:
        return message("The scenario gives no limits")
    goals: str = found[0].in_words
    for goal in found[1:]:
        goals = message("{first} and {second}", first=goals, second=goal.in_words)
    if scenario.mission is None:
        return message("Judged by: {goals} ({why})", goals=goals, why=found[0].why)
    if within_s := scenario.mission.within_s:
        time = clock_text(within_s)
        return message("Required: {goals} within {time}", goals=goals, time=time)
    return message("Required: {goals}", goals=goals)


def _draw(part: SubFigure, view: View, panel: Panel) -> None:
    """A panel on a part of the page."""
    wide, tall = part.bbox.width / part.figure.dpi, part.bbox.height / part.figure.dpi
    axes = place(part, _LEFT, _ABOVE, wide - _LEFT - _RIGHT, tall - _ABOVE - _BELOW)
    draw_panel(axes, view, panel)
