"""Mode tables as diagrams: a picture, or the text that Mermaid draws."""

import re
from xml.sax.saxutils import escape, quoteattr

from torquer.computer.modes.layout import ANY, INSET, MARGIN, ROW, Path, StateBox, layout
from torquer.computer.modes.spec import Modes, Region
from torquer.computer.modes.wording import state_in_words, transition_in_words

_STYLE = """<style>
text { font: 12px system-ui, sans-serif; fill: #222; }
.name { font-weight: 600; }
.region { font-style: italic; fill: #666; }
.label { font-size: 11px; }
rect { fill: #f3f6fa; stroke: #456; }
.any { fill: none; stroke-dasharray: 4 3; }
.inner { fill: none; }
path { fill: none; stroke-width: 1.3; }
.rule { stroke: #bbb; stroke-dasharray: 2 4; }
</style>"""
#: Colours of the lines, in turn, to distinguish lines that cross.
_COLOURS = ("#1b5e9b", "#b5521b", "#2e7d4f", "#8a3f8f", "#7a6a00", "#a02c3c")


def svg(modes: Modes) -> str:
    """The diagram as a self-contained SVG picture."""
    found = layout(modes)
    size = f"{found.width:g} {found.height:g}"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" '
        f'width="{found.width:g}" height="{found.height:g}">',
        _STYLE,
        '<path d="M0 0 H{} V{} H0 Z" style="fill: white"/>'.format(*size.split()),
        *(
            f'<path class="rule" d="M{MARGIN / 2:g} {y:g} H{found.width - MARGIN / 2:g}"/>'
            for y in found.rules
        ),
        *(_text(MARGIN / 2, y, title, "region") for y, title in found.titles),
        *(_drawn_path(path, number) for number, path in enumerate(found.paths)),
        *map(_drawn_box, found.boxes),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _text(x: float, y: float, text: str, kind: str = "") -> str:
    shown = f' class="{kind}"' if kind else ""
    return f'<text x="{x:g}" y="{y:g}"{shown}>{escape(text)}</text>'


def _drawn_box(box: StateBox) -> str:
    kind = "state" if box.state else "any"
    parts = [_rectangle(box, 0.0, kind)]
    if box.final:
        parts.append(_rectangle(box, 3.0, "inner"))
    if box.initial:
        y = box.y + 0.65 * ROW
        parts.append(f'<circle cx="{box.x - 20:g}" cy="{y:g}" r="4"/>')
        parts.append(f'<path d="M{box.x - 20:g} {y:g} H{box.x - 6:g}" style="stroke: black"/>')
        parts.append(f'<path d="M{box.x:g} {y:g} l-7 -3.5 v7 Z" style="fill: black"/>')
    for i, line in enumerate(box.lines):
        y = box.y + (i + 0.7) * ROW
        parts.append(_text(box.x + INSET, y, line, "name" if i == 0 else ""))
    return "\n".join(parts)


def _rectangle(box: StateBox, inside: float, kind: str) -> str:
    names = ""
    if kind == "state":  # by which a page finds it
        names = f" data-region={quoteattr(box.region)} data-state={quoteattr(box.state)}"
    return (
        f'<rect class="{kind}"{names} x="{box.x + inside:g}" y="{box.y + inside:g}" rx="6" '
        f'width="{box.width - 2 * inside:g}" height="{box.height - 2 * inside:g}"/>'
    )


def _drawn_path(path: Path, number: int) -> str:
    colour = _COLOURS[number % len(_COLOURS)]
    (x, y), *rest = path.corners
    line = f"M{x:g} {y:g} " + " ".join(f"L{a:g} {b:g}" for a, b in rest)
    end_x, end_y = path.corners[-1]
    return "\n".join((
        f'<path d="{line}" style="stroke: {colour}"/>',
        f'<path d="M{end_x:g} {end_y:g} l7 -3.5 v7 Z" style="fill: {colour}"/>',
        _text(*path.label_at, path.label, "label"),
    ))  # fmt: skip


def mermaid(modes: Modes) -> str:
    """The diagram as text of Mermaid (`stateDiagram-v2`), regions side by side."""
    ids = _ids(modes)
    blocks = [_block(name, region, ids) for name, region in modes.regions.items()]
    if len(blocks) == 1:
        lines = blocks[0]
    else:
        inner = [line for block in blocks for line in (*block, "--")][:-1]
        lines = ["state modes {", *(f"  {line}" for line in inner), "}"]
    return "\n".join(("stateDiagram-v2", *(f"  {line}" for line in lines))) + "\n"


def _ids(modes: Modes) -> dict[tuple[str, str | None], str]:
    """Identifiers of regions' states, and of any state (None); equal ones get a number."""
    found = {}
    for name, region in modes.regions.items():
        for state in (None, *region.states):
            plain = re.sub(r"\W", "_", f"{name}_{state or ANY}")
            taken = plain in found.values() or not plain.isidentifier()
            found[name, state] = f"_{len(found)}_{plain}" if taken else plain
    return found


def _block(name: str, region: Region, ids: dict) -> list[str]:
    """A region's states and transitions."""
    lines = [f'state "{state}" as {ids[name, state]}' for state in region.states]
    for state, spec in region.states.items():
        lines += [f"{ids[name, state]} : {line}" for line in state_in_words(spec)]
    lines.append(f"[*] --> {ids[name, region.initial]}")
    sources = {state: spec.transitions for state, spec in region.states.items()}
    if region.transitions:
        lines.append(f'state "{ANY}" as {ids[name, None]}')
        sources[None] = region.transitions
    for source, transitions in sources.items():
        lines += [
            f"{ids[name, source]} --> {ids[name, one.to]} : {transition_in_words(one)}"
            for one in transitions
        ]
    return lines + [f"{ids[name, s]} --> [*]" for s, spec in region.states.items() if spec.final]
