"""How a combination of states can come about, as a strip of lines: a step each."""

from torquer.computer.modes.explore import Explored, Step
from torquer.computer.modes.graph import Edge
from torquer.computer.modes.wording import transition_in_words


def draw_strip(explored: Explored, path: list[Step]) -> tuple[str, ...]:
    """The states of all regions along a path, side by side, and why each step is taken."""
    rows = [("", *explored.regions, "because")]
    rows.append(("0", *explored.joints[path[0].start if path else 0], "start"))
    for number, step in enumerate(path, start=1):
        rows.append((str(number), *explored.joints[step.end], _reasons(explored, step)))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return tuple(
        "  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _reasons(explored: Explored, step: Step) -> str:
    several = len(explored.regions) > 1
    taken = zip(explored.regions, step.edges, strict=True)
    reasons = [_reason(name if several else "", edge) for name, edge in taken if edge]
    return "; ".join(reasons) or "command"


def _reason(name: str, edge: Edge) -> str:
    words = transition_in_words(edge.transition)
    return f"{name}: {words}" if name else words
