"""Self-contained HTML pages: they open anywhere and load nothing.

Pages are made from the templates in `torquer/report/templates`, which receive plain data. All text
is escaped there, except the style, the scripts and the numbers of figures.
"""

import base64
import json
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from torquer.base.language import language, told

#: Type of a script that holds a packed text.
PACKED = "application/gzip"
#: gzip's format, which every browser since 2023 unpacks (`DecompressionStream`).
_GZIP = 16 + zlib.MAX_WBITS
_TEMPLATES = Path(__file__).parents[1] / "templates"
#: Forbids the browser to load anything. (plotly.js compiles its shaders' glue by itself.)
_POLICY = Markup(
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; worker-src blob:"
)


def page(template: str, title: str, interactive: bool = True, **data) -> str:
    """A whole page of a template, with its style; scripts unless no figure is interactive."""
    data = {"language": language(), "told": told} | data
    data |= {"css": _file("page.css"), "policy": _POLICY, "title": title}
    data |= {"library": _library() if interactive else "", "packed_type": PACKED}
    data["script"] = _file("page.js")
    return _environment().get_template(template).render(data)


def cards(title: str, given: Sequence[Mapping], **data) -> str:
    """A page of cards one below the other; see `card`."""
    interactive = any("figure" in part for each in given for part in each["parts"])
    shown = _told(data | {"cards": given})
    return page("cards.html", told(title), interactive, **shown)


#: What of a card is for programs, or its author's own words.
_AS_IT_IS = ("id", "text", "picture", "folded", "bibtex", "description")


def _told(part, key: str = ""):
    """Plain data for a page with its texts in the language of the reader."""
    if key in _AS_IT_IS:
        return part
    if key == "figure":
        return _told_figure(part)
    if isinstance(part, dict):
        return {name: _told(each, name) for name, each in part.items()}
    if isinstance(part, list | tuple):
        return [_told(each) for each in part]
    return told(part) if isinstance(part, str) else part


def card(
    id: str, title: str, caption: str, *parts: Mapping[str, Any], folded: bool = False
) -> dict:
    """A card and its parts, to open if it is folded; each part a dictionary with one of these keys.

    "figure" (a plotly figure) or "picture" (base64 of a PNG), with "words" that describe it;
    "pairs" (labels and values), "grid" (head and rows), "text" (as it is), "sources"
    (`sources_data`), "title", "line".
    """
    shown = [part for part in parts if part]
    return {"id": id, "title": title, "caption": caption, "parts": shown, "folded": folded}


def encode(data: bytes) -> str:
    """Bytes as base64."""
    return base64.b64encode(data).decode("ascii")


def picture(path: Path | None, words: str) -> dict[str, str]:
    """A PNG file as a part of a card; empty if there is none."""
    return {} if path is None else {"picture": encode(path.read_bytes()), "words": words}


@cache
def _environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["embedded"] = embed
    return made


def _file(name: str) -> Markup:
    return Markup((_TEMPLATES / name).read_text(encoding="utf-8"))


def _library() -> Markup:
    """plotly.js, packed."""
    return Markup(encode((_TEMPLATES / "plotly.min.js.gz").read_bytes()))


def embed(figure: dict) -> Markup:
    """A figure as packed JSON, for a script of a page."""
    text = json.dumps(figure, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return _pack(text)


#: What holds texts for people in a figure of plotly.
_TEXTS = ("name", "text", "title", "label", "ticktext", "legendgroup")


def _told_figure(part, key: str = ""):
    """A figure of plotly with its texts in the language of the reader."""
    if isinstance(part, str):
        return told(part) if key in _TEXTS else part
    if isinstance(part, dict):
        return {name: _told_figure(each, name) for name, each in part.items()}
    return [_told_figure(each, key) for each in part] if isinstance(part, list | tuple) else part


def _pack(text: str) -> Markup:
    """A text, compressed, as base64; the page's script unpacks it."""
    return Markup(encode(zlib.compress(text.encode("utf-8"), level=4, wbits=_GZIP)))
