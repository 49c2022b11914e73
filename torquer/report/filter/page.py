"""The page of a filter's statistics: self-contained HTML."""

import json
import math
from collections.abc import Mapping
from pathlib import Path

from torquer.analysis.filter_check import Check, FilterCheck, as_plain
from torquer.report.common.html import card, cards, picture
from torquer.scenario.toml_text import toml_of

HEAD = ("statistic", "value", "band", "instants inside", "")
_WORDS = {
    "errors": "Thin lines: single runs. A filter is as good as the linear analysis says where the "
    "blue and the dashed red lines agree, within 3 % at an instant for 200 runs.",
    "consistency": "Mean over the runs of the errors' squares over the covariance that the filter "
    "states, 1 for an honest filter. Above the band: it is too sure of itself; below: too modest.",
    "whiteness": "What a reading tells that the ones before did not is white noise in an honest "
    "filter. Correlation means that something is not modelled.",
}


def write_page(found: FilterCheck, pictures: Mapping[str, Path], path: Path) -> Path:
    """Write the page, its pictures within it."""
    text = toml_of(json.loads(found.scenario.model_dump_json(exclude_none=True)))
    rows = list(map(check_row, found.checks))
    made = [
        card("verdict", verdict_in_words(found), "", {"pairs": rows_of(found)}),
        card("checks", "Checks", "", {"grid": (HEAD, rows)}),
        *(_pictured(key, pictures[key]) for key in pictures if key != "report"),
        card("scenario", "Scenario", "", {"text": text}),
    ]
    title = f"{found.scenario.name}: filter"
    path.write_text(cards(title, made, interactive=False), encoding="utf-8")
    return path


def verdict_in_words(found: FilterCheck) -> str:
    """Whether the filter is consistent."""
    return "consistent" if found.consistent else "not consistent"


def rows_of(found: FilterCheck) -> list[tuple[str, str]]:
    """What a check has found, as labels and values."""
    plain = as_plain(found)
    return [
        ("estimator", plain["estimator"]),
        ("runs", str(found.runs)),
        ("error about each axis", f"{plain['error_deg']:.3g} deg rms over the runs"),
        ("as the filter stated", f"{plain['sigma_deg']:.3g} deg"),
        ("by linear covariance", f"{plain['expected_deg']:.3g} deg"),
        ("whole error", f"below {plain['error_95_deg']:.3g} deg in 95 %"),
    ]


def check_row(check: Check) -> tuple[str, ...]:
    """A check as texts of a row."""
    inside = "" if math.isnan(check.inside) else f"{check.inside:.0%}"
    band = f"{check.low:.3f} to {check.high:.3f}"
    return check.name, f"{check.value:.3f}", band, inside, "ok" if check.passed else "FAIL"


def _pictured(key: str, path: Path) -> dict:
    title = key.replace("_", " ").capitalize()
    return card(key, title, _WORDS[key.partition("_")[0]], picture(path, title))
