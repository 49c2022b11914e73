"""The report as one self-contained page: it opens anywhere and loads nothing."""

import base64
import json
from html import escape
from pathlib import Path

from torquer.report import panel as drawn
from torquer.report import view as seen
from torquer.report.interactive import panel_figure, track_figure
from torquer.report.page import CSS, SCRIPT
from torquer.report.scene import chapters, scene_figure
from torquer.report.setting import setting
from torquer.report.summary import rows_of
from torquer.report.view import View

#: The browser itself is told to load nothing. (plotly.js compiles its shaders' glue by itself.)
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; worker-src blob:"
)


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
            *(_picture(view, picture) for picture in pictures),
            _track(view),
            _scene(view),
            _scenario(view),
        ],
    )


def document(title: str, sections) -> str:
    """A whole page around its sections, with all that it needs inside; the title is escaped."""
    from plotly.offline import get_plotlyjs

    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
            f"<title>{escape(title)} · torquer</title>",
            f"<style>{CSS}</style></head><body><main>",
            *sections,
            "</main>",
            f"<script>{get_plotlyjs()}</script>",
            f"<script>{SCRIPT}</script>",
            "</body></html>",
        ]
    )


def _head(view: View) -> str:
    scenario = view.scenario
    told = "".join(f"<li>{escape(note)}</li>" for note in seen.notes(view))
    notes = f'<section class="notes"><h2>Notes</h2><ul>{told}</ul></section>' if told else ""
    summary = _table(rows_of(view.summary))
    return (
        f"<header><h1>{escape(scenario.name)}</h1><p>{escape(scenario.description)}</p></header>"
        f'{notes}<div class="columns"><section><h2>Summary</h2>{summary}</section>'
        f"<section><h2>The run</h2>{_table(setting(view))}</section></div>"
    )


def _table(rows) -> str:
    cells = (
        f"<tr><th{' class=inset' if label.startswith(' ') else ''}>{escape(label.strip())}</th>"
        f"<td>{escape(value)}</td></tr>"
        for label, value in rows
    )
    return f"<table>{''.join(cells)}</table>"


def _without_scripts(overview_png: Path | None) -> str:
    if overview_png is None:
        return ""
    data = base64.b64encode(overview_png.read_bytes()).decode("ascii")
    return (
        "<noscript><p>The pictures below need scripts; this one does not.</p>"
        f'<img alt="Overview" src="data:image/png;base64,{data}"></noscript>'
    )


def _picture(view: View, picture: drawn.Picture) -> str:
    plots = [
        f"<h3>{escape(panel.title)}</h3>"
        + figure_box(panel_figure(view, panel), "" if panel.window else " data-linked")
        for panel in picture.panels
    ]
    caption = " ".join(text for text in (picture.caption, drawn.about_ranges(picture)) if text)
    return _section(picture.name, picture.title, caption, "".join(plots))


def _track(view: View) -> str:
    field = view.scenario.environment.field
    tied = not hasattr(field, "b_earth_fixed")
    caption = (
        f"The {field.kind} field is tied to the orbit and has no map."
        if tied
        else f"Behind it |B| of the scenario's own field ({field.kind}) at the orbit's mean height."
    )
    return _section("ground_track", "Ground track", caption, figure_box(track_figure(view)))


def _scene(view: View) -> str:
    told = "; ".join(f"{part.name}: {part.told}" for part in chapters(view))
    caption = (
        "Directions seen from the satellite, in the inertial frame: body axes x, y, z and a box "
        "with the body's inertia, the field B, the angular momentum L with its path over the whole "
        "run (grey), the Sun (grey in eclipse), and down to the Earth. Lengths mean nothing. "
        f"{told}."
    )
    return _section("motion", "Motion in space", caption, figure_box(scene_figure(view)))


def _section(name: str, title: str, caption: str, body: str) -> str:
    return (
        f'<section class="card" id="{name}"><h2>{escape(title)}</h2>'
        f"<p>{escape(caption)}</p>{body}</section>"
    )


def figure_box(figure: dict, attribute: str = "") -> str:
    """A place for a figure; the page's script draws it once it comes into view."""
    text = json.dumps(figure, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    safe = text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    height = figure["layout"]["height"]
    return (
        f'<div class="plot"{attribute} style="min-height:{height}px">'
        f'<script type="application/json">{safe}</script></div>'
    )


def _scenario(view: View) -> str:
    text = toml_of(json.loads(view.result.attrs["scenario"]))
    versions = json.loads(view.result.attrs["versions"]).items()
    return (
        '<section class="card" id="scenario"><h2>Scenario</h2>'
        "<p>Save this text as a .toml file to run the same again.</p>"
        f"<pre>{escape(text)}</pre>{_law_texts(view)}<h2>Versions</h2>{_table(versions)}</section>"
    )


def _law_texts(view: View) -> str:
    """The text of the laws that are not the package's own, as it was flown."""
    attrs = view.result.attrs
    texts = {attrs.get(f"{key}_text", ""): attrs.get(key) for key in ("wheel_law", "law")}
    return "".join(
        f"<h2>Law {escape(name)}</h2><pre>{escape(text)}</pre>"
        for text, name in reversed(texts.items())
        if text
    )


def toml_of(data: dict, place: tuple[str, ...] = ()) -> str:
    """A scenario's plain data as TOML text: plain keys first, then tables."""
    plain = {k: v for k, v in data.items() if not isinstance(v, dict) and v is not None}
    lines = [f"{_key(key)} = {_toml_value(value)}" for key, value in plain.items()]
    if place and (lines or not data):
        lines.insert(0, f"[{'.'.join(map(_key, place))}]")
    blocks = ["\n".join(lines)] if lines else []
    blocks += [toml_of(v, (*place, k)) for k, v in data.items() if isinstance(v, dict)]
    return "\n\n".join(blocks)


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else json.dumps(name)


def _toml_value(value) -> str:
    if isinstance(value, list):
        parts = [_toml_value(item) for item in value]
        if sum(map(len, parts)) < 80:
            return f"[{', '.join(parts)}]"
        return "[\n" + "".join(f"  {part},\n" for part in parts) + "]"
    # JSON writes text, numbers and truth values as TOML does, all but DEL in text
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
