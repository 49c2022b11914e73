"""The report as one self-contained page: it opens anywhere and loads nothing."""

import base64
import json
from html import escape
from pathlib import Path

from torquer.report.common.html import document, figure_box, grid, section, table
from torquer.report.flight.budget_rows import HEAD, budget_table, reach_in_words
from torquer.report.flight.ground_track import track_figure
from torquer.report.flight.interactive import panel_figure
from torquer.report.flight.modes import modes_section
from torquer.report.flight.notes import notes
from torquer.report.flight.panels.panel import Picture, about_ranges
from torquer.report.flight.scene import chapters, scene_figure
from torquer.report.flight.setting import setting
from torquer.report.flight.summary_rows import rows_of
from torquer.report.flight.view import View
from torquer.scenario.toml_text import toml_of


def write_page(view: View, pictures, path: Path, overview_png: Path | None = None) -> Path:
    """Write the page; `overview_png` is shown where scripts are not run."""
    path.write_text(page(view, pictures, overview_png), encoding="utf-8")
    return path


def page(view: View, pictures, overview_png: Path | None = None) -> str:
    """The page's text."""
    return document(
        view.scenario.name,
        [
            _head(view),
            _without_scripts(overview_png),
            _modes(view),
            *(_picture(view, picture) for picture in pictures),
            _budget(view),
            _track(view),
            _scene(view),
            _scenario(view),
        ],
    )


def _head(view: View) -> str:
    scenario = view.scenario
    items = "".join(f"<li>{escape(note)}</li>" for note in notes(view))
    box = f'<section class="notes"><h2>Notes</h2><ul>{items}</ul></section>' if items else ""
    summary = table(rows_of(view.summary))
    return (
        f"<header><h1>{escape(scenario.name)}</h1><p>{escape(scenario.description)}</p></header>"
        f'{box}<div class="columns"><section><h2>Summary</h2>{summary}</section>'
        f"<section><h2>The run</h2>{table(setting(view))}</section></div>"
    )


def _without_scripts(overview_png: Path | None) -> str:
    if overview_png is None:
        return ""
    data = base64.b64encode(overview_png.read_bytes()).decode("ascii")
    return (
        "<noscript><p>The interactive plots below need JavaScript; this picture does not.</p>"
        f'<img alt="Overview" src="data:image/png;base64,{data}"></noscript>'
    )


def _modes(view: View) -> str:
    modes = view.scenario.control.named().modes
    return modes_section(view, modes) if modes else ""


def _picture(view: View, picture: Picture) -> str:
    plots = [
        f"<h3>{escape(panel.title)}</h3>"
        + figure_box(panel_figure(view, panel), "" if panel.window else " data-linked")
        for panel in picture.panels
    ]
    caption = " ".join(text for text in (picture.caption, about_ranges(picture)) if text)
    return section(picture.name, picture.title, caption, "".join(plots))


def _budget(view: View) -> str:
    if not view.budget.disturbance:
        return ""
    unit, rows = budget_table(view.budget)
    caption = f"In {unit}, over the recorded motion. {reach_in_words(view.budget)}"
    return section("torque_budget", "Torque budget", caption, grid(HEAD, rows))


def _track(view: View) -> str:
    field = view.scenario.environment.field
    along_orbit_only = not hasattr(field, "b_earth_fixed")
    caption = (
        f"The {field.kind} field is defined along the orbit only and has no map."
        if along_orbit_only
        else f"Background: |B| of the scenario's field model ({field.kind}) at the mean altitude."
    )
    return section("ground_track", "Ground track", caption, figure_box(track_figure(view)))


def _scene(view: View) -> str:
    spacing = "; ".join(f"{part.name}: {part.description}" for part in chapters(view))
    caption = (
        "Directions from the satellite in the inertial frame: body axes x, y, z with a box of the "
        "same inertia, the magnetic field B, the angular momentum L with its path over the run "
        f"(grey), the Sun (grey in eclipse) and nadir. Lengths are not to scale. {spacing}."
    )
    return section("motion", "Motion in space", caption, figure_box(scene_figure(view)))


def _scenario(view: View) -> str:
    text = toml_of(json.loads(view.result.attrs["scenario"]))
    versions = json.loads(view.result.attrs["versions"]).items()
    return (
        '<section class="card" id="scenario"><h2>Scenario</h2>'
        "<p>Save this text as a .toml file to repeat the run.</p>"
        f"<pre>{escape(text)}</pre>{_law_texts(view)}<h2>Versions</h2>{table(versions)}</section>"
    )


def _law_texts(view: View) -> str:
    """Source text of user laws, as flown, each once."""
    texts = {law["text"]: (key, law["name"]) for key, law in view.laws.items() if law["text"]}
    return "".join(
        f"<h2>{view.kind_of(key).capitalize()} {escape(name)}</h2><pre>{escape(text)}</pre>"
        for text, (key, name) in texts.items()
    )
