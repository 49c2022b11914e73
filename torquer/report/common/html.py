"""Self-contained HTML pages: they open anywhere and load nothing."""

import json
from html import escape

from torquer.report.common.style import CSS, SCRIPT

#: Forbids the browser to load anything. (plotly.js compiles its shaders' glue by itself.)
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; worker-src blob:"
)


def document(title: str, sections, interactive: bool = True) -> str:
    """A whole page around its sections, style included; the title is escaped.

    Scripts are included unless the page has no interactive figures.
    """
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
            *(_scripts() if interactive else ()),
            "</body></html>",
        ]
    )


def _scripts() -> tuple[str, str]:
    from plotly.offline import get_plotlyjs

    return f"<script>{get_plotlyjs()}</script>", f"<script>{SCRIPT}</script>"


def table(rows) -> str:
    """A table of label and value; a label that begins with a space is indented."""
    cells = (
        f"<tr><th{' class=inset' if label.startswith(' ') else ''}>{escape(label.strip())}</th>"
        f"<td>{escape(value)}</td></tr>"
        for label, value in rows
    )
    return f"<table>{''.join(cells)}</table>"


def grid(header, rows) -> str:
    """A table with a header and any number of columns."""
    first = "".join(f"<th>{escape(text)}</th>" for text in header)
    others = ("".join(f"<td>{escape(text)}</td>" for text in row) for row in rows)
    return f"<table><tr>{first}</tr>{''.join(f'<tr>{row}</tr>' for row in others)}</table>"


def section(name: str, title: str, caption: str, body: str) -> str:
    """A card with its title, its caption unless that is empty, and its body (HTML)."""
    words = f"<p>{escape(caption)}</p>" if caption else ""
    return f'<section class="card" id="{name}"><h2>{escape(title)}</h2>{words}{body}</section>'


def figure_box(figure: dict, attribute: str = "") -> str:
    """Placeholder of a figure, which the page's script draws when it scrolls into view."""
    text = json.dumps(figure, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    safe = text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    height = figure["layout"]["height"]
    return (
        f'<div class="plot"{attribute} style="min-height:{height}px">'
        f'<script type="application/json">{safe}</script></div>'
    )
