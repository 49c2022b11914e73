"""The section of a report on the modes: state diagram, use of every state."""

from torquer.analysis.summary import time_or_never, unchanged_in_words
from torquer.computer.modes.diagram import svg
from torquer.computer.modes.layout import layout
from torquer.computer.modes.spec import MAIN, Modes
from torquer.report.common.html import encode
from torquer.report.flight.view import View

_CAPTION = (
    "Each state runs the laws named in its box and adds their commands; a transition is taken "
    "when its condition holds. The strips above the plots show when each state was active; a "
    "region that never changed has none."
)
#: Height of a diagram from which it is folded.
_TALL_PX = 700
_HEAD = ("State", "Entered", "Last entered at", "Share of time")


def modes_data(view: View, modes: Modes) -> dict:
    """The section as the page's template takes it: diagram, a table for each region."""
    uses = view.summary["modes"]
    changed = [name for name, states in uses.items() if name == MAIN or _entered(states) > 1]
    return {
        "caption": _CAPTION,
        "diagram": encode(svg(modes).encode()),  # as an image it keeps its style to itself
        "tall": layout(modes).height > _TALL_PX,
        "head": _HEAD,
        "regions": [
            {"title": "" if name == MAIN else name, "rows": _rows(uses[name])} for name in changed
        ],
        "unchanged": unchanged_in_words({k: v for k, v in uses.items() if k not in changed}),
    }


def _entered(states: dict) -> int:
    """Number of states of a region that were entered."""
    return sum(use["entries"] > 0 for use in states.values())


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
