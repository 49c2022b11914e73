"""The section of a report on the modes: state diagram, use of every state."""

from torquer.control.modes.diagram import svg
from torquer.control.modes.spec import MAIN, Modes
from torquer.report.common.html import encoded
from torquer.report.flight.summary_rows import time_or_never
from torquer.report.flight.view import View

_CAPTION = (
    "Each state runs the laws named in its box and adds their commands; a transition is taken "
    "when its condition holds. The strips above the plots show when each state was active; a "
    "region that never changed has none."
)
_HEAD = ("State", "Entered", "Last entered at", "Share of time")


def modes_data(view: View, modes: Modes) -> dict:
    """The section as the page's template takes it: diagram, a table for each region."""
    regions = [
        {"title": "" if region == MAIN else region, "rows": _rows(uses)}
        for region, uses in view.summary["modes"].items()
    ]
    diagram = encoded(svg(modes).encode())  # as an image it keeps its style to itself
    return {"caption": _CAPTION, "diagram": diagram, "head": _HEAD, "regions": regions}


def _rows(uses: dict) -> list[tuple[str, ...]]:
    """Entries into the states of a region, and their shares of the time."""
    return [
        (
            state,
            f"{use['entries']} times" if use["entries"] != 1 else "once",
            time_or_never(use["last_entered_s"]),
            f"{use['share']:.1%}",
        )
        for state, use in uses.items()
    ]
