"""The page of a filter's statistics: self-contained HTML."""

import json
import math
from pathlib import Path

from torquer.analysis.filters.filter_check import (
    Check,
    FilterCheck,
    as_plain,
    drawn_in_words,
    rejected_in_words,
    replaced_in_words,
    restarts_in_words,
)
from torquer.report.common.html import card, cards
from torquer.report.common.sources import sources_data
from torquer.report.filter.interactive import make_figures
from torquer.scenario.toml_text import to_toml
from torquer.simulation.results.file import put

HEAD = ("Statistic", "Value", "95 % band", "Instants inside", "Result")
_WORDS = {
    "errors": "Grey: single runs. Where the solid line (scatter of the runs) follows the "
    "dashed one (linear covariance analysis), the filter is as accurate as its sensors allow; with "
    "200 runs, sampling alone makes them differ by about 5 %.",
    "consistency": "Squared errors (NEES) and innovations (NIS), normalised by the covariance that "
    "the filter states and averaged over the runs: 1 if it is consistent. Above the band it is "
    "overconfident, below it too conservative.",
    "whiteness": "The innovations of a consistent filter are white noise: correlation between "
    "successive ones points to something that the filter does not model.",
}


def write_page(found: FilterCheck, path: Path) -> Path:
    """Write the page, its plots within it."""
    text = to_toml(json.loads(found.scenario.model_dump_json(exclude_none=True)))
    rows = list(map(check_row, found.checks))
    verdict = found.verdict.text[:1].upper() + found.verdict.text[1:]
    notes = [("Notes", note) for note in found.flown.steps]
    made = [
        card("verdict", verdict, "", {"pairs": [*check_rows(found), *notes]}),
        card("checks", "Checks", "", {"grid": (HEAD, rows)}),
        *(_draw(key, figure) for key, figure in make_figures(found).items()),
        card("sources", "Sources to cite", "", {"sources": sources_data(found.scenario)}),
        card("scenario", "Scenario", "", {"text": text}, folded=True),
    ]
    return put(path, cards(f"{found.scenario.name}: filter check", made))


def check_rows(found: FilterCheck) -> list[tuple[str, str]]:
    """Findings of a check, as labels and values."""
    plain = as_plain(found)
    rows = [
        ("Estimator", plain["estimator"]),
        ("Runs", str(found.runs)),
        ("Each run draws", drawn_in_words(found)),
        ("Of the scenario, not flown", replaced_in_words(found) or "nothing"),
        ("Readings rejected", rejected_in_words(plain)),
        ("Restarts", restarts_in_words(plain)),
    ]
    if not found.flown.started.any():
        return rows
    return [
        *rows,
        ("Error per axis, RMS over the runs", f"{plain['error_deg']:.3g} deg"),
        ("Stated by the filter", f"{plain['sigma_deg']:.3g} deg"),
        ("Expected by linear covariance", f"{plain['expected_deg']:.3g} deg"),
        ("Total error, 95th percentile", f"{plain['error_95_deg']:.3g} deg"),
    ]


def check_row(check: Check) -> tuple[str, ...]:
    """A check as texts of a row."""
    inside = "" if math.isnan(check.inside) else f"{check.inside:.0%}"
    band = f"{check.low:.3f} to {check.high:.3f}"
    return check.name, f"{check.value:.3f}", band, inside, "ok" if check.passed else "FAIL"


def _draw(key: str, figure: dict) -> dict:
    kind, _, state = key.partition("_")
    title = f"{state.replace('_', ' ')} error".capitalize() if state else key.capitalize()
    return card(key, title, _WORDS[kind], {"figure": figure, "words": f"{title}."})
