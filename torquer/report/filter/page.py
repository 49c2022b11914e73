"""The page of a filter's statistics: self-contained HTML."""

import json
import math
from collections.abc import Mapping
from html import escape
from pathlib import Path

from torquer.analysis.filter_check import Check, FilterCheck, as_plain
from torquer.report.campaign.page import picture
from torquer.report.common.html import document, grid, section, table
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
    name = f"{found.scenario.name}: filter"
    text = toml_of(json.loads(found.scenario.model_dump_json(exclude_none=True)))
    sections = [
        f"<header><h1>{escape(name)}</h1></header>",
        section("verdict", verdict_in_words(found), "", table(rows_of(found))),
        section("checks", "Checks", "", grid(HEAD, map(check_row, found.checks))),
        *(_pictured(key, pictures) for key in pictures if key != "report"),
        section("scenario", "Scenario", "", f"<pre>{escape(text)}</pre>"),
    ]
    path.write_text(document(name, sections, interactive=False), encoding="utf-8")
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


def _pictured(key: str, pictures: Mapping[str, Path]) -> str:
    title = key.replace("_", " ").capitalize()
    words = _WORDS[key.partition("_")[0]]
    return section(key, title, words, picture(pictures, key, title))
