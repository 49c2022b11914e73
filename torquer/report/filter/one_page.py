"""What stands on the page of a filter check."""

from torquer.analysis.citations import select_sources
from torquer.analysis.filters.filter_check import FilterCheck
from torquer.report.common.models import model_rows
from torquer.report.common.one_page import Page, Plot
from torquer.report.filter.page import check_row, check_rows
from torquer.report.filter.pictures import draw_consistency, draw_errors


def filter_page(found: FilterCheck) -> Page:
    """Question, verdict, plots, numbers, models and sources of a filter check."""
    verdict = found.verdict.text
    plots = [
        Plot(lambda part: draw_errors(found, "attitude", 0, part), 2.0),
        Plot(lambda part: draw_consistency(found, 1, part), 1.0),
    ]
    return Page(
        title=found.scenario.name,
        question=f"Does the filter know its own error, over {found.runs} runs?",
        verdict=verdict[:1].upper() + verdict[1:],
        look="done" if found.consistent else "missed",
        plots=plots if found.flown.started.any() else [],
        numbers=[*check_rows(found), *map(_checked, found.checks)],
        models=model_rows(found.scenario),
        notes=[*found.flown.steps],
        sources=[source.in_words() for source in select_sources(found.scenario)],
    )


def _checked(check) -> tuple[str, str]:
    """A statistic as a row: value, band, result."""
    name, value, band, inside, passed = check_row(check)
    told = [f"{value} (band {band})", inside and f"{inside} of instants inside", passed]
    return name[:1].upper() + name[1:], ", ".join(filter(None, told))
