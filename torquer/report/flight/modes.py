"""The section of a report on the modes: state diagram, use of every state."""

import base64
from html import escape

from torquer.control.modes.diagram import svg
from torquer.control.modes.spec import MAIN, Modes
from torquer.report.common.html import grid, section
from torquer.report.flight.summary_rows import time_or_never
from torquer.report.flight.view import View

_CAPTION = (
    "In every state the laws named in its box work, their commands added; a transition is taken "
    "when its condition holds. The strips above the plots show when each state was active."
)


def modes_section(view: View, modes: Modes) -> str:
    """The section, as HTML. (As an image the diagram keeps its style to itself.)"""
    data = base64.b64encode(svg(modes).encode()).decode("ascii")
    picture = f'<img alt="State diagram" src="data:image/svg+xml;base64,{data}">'
    return section("modes", "Modes", _CAPTION, picture + _tables(view))


def _tables(view: View) -> str:
    """Entries and shares of the states, a table for each region."""
    header = ("State", "Entered", "Last entered at", "Share of the time")
    tables = []
    for region, uses in view.summary["modes"].items():
        rows = [
            (
                state,
                f"{use['entries']} times" if use["entries"] != 1 else "once",
                time_or_never(use["last_entered_s"]),
                f"{use['share']:.1%}",
            )
            for state, use in uses.items()
        ]
        title = "" if region == MAIN else f"<h3>{escape(region)}</h3>"
        tables.append(title + grid(header, rows))
    return "".join(tables)
