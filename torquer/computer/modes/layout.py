"""Where the parts of a diagram of modes stand: one column of states, lanes next to it.

Regions stand one below the other. Every transition leaves its state on the right in a row of its
own, along which it is labelled, goes up or down in a lane, and enters its state from the right.
No two labels share a row, and no two overlapping transitions a lane.
"""

import itertools
from typing import NamedTuple

from torquer.computer.modes.spec import MAIN, Modes, Region
from torquer.computer.modes.wording import state_in_words, transition_in_words

ROW, LETTER, GAP, LANE, MARGIN, INSET = 22.0, 6.8, 26.0, 12.0, 30.0, 10.0
#: Title of the box from which transitions from any state leave.
ANY = "any state"


class StateBox(NamedTuple):
    """A state, or the source of transitions from any state (`state` is ""); `lines`: its name, what
    it does.
    """

    x: float
    y: float
    width: float
    height: float
    lines: tuple[str, ...]
    region: str
    state: str
    final: bool
    initial: bool


class Path(NamedTuple):
    """A transition: corners of its line, its label and where that begins."""

    corners: tuple[tuple[float, float], ...]
    label: str
    label_at: tuple[float, float]


class DiagramLayout(NamedTuple):
    """Everything to be drawn; `titles`: names of regions; `rules`: heights of lines between."""

    width: float
    height: float
    boxes: tuple[StateBox, ...]
    paths: tuple[Path, ...]
    titles: tuple[tuple[float, str], ...]
    rules: tuple[float, ...]


class _Transition(NamedTuple):
    """A transition by the numbers of rows: where it leaves and where it enters."""

    leaves: int
    enters: int
    label: str


class _Column(NamedTuple):
    """Boxes of a region as (first row, rows, lines, name) from the top, and its transitions."""

    boxes: tuple[tuple, ...]
    transitions: tuple[_Transition, ...]
    rows: int


def layout(modes: Modes) -> DiagramLayout:
    """The diagram of a mode table."""
    columns = {name: _column(region) for name, region in modes.regions.items()}
    texts = [line for c in columns.values() for box in c.boxes for line in box[2]]
    labels = [transition.label for c in columns.values() for transition in c.transitions]
    width = 2 * INSET + _width(texts)
    lanes_x = MARGIN + width + 2 * INSET + _width(labels)
    boxes, paths, titles, rules, y = [], [], [], [], MARGIN / 2
    for name, column in columns.items():
        if name != MAIN:
            titles.append((y + 0.75 * ROW, name))
            y += 1.5 * ROW
        boxes += _boxes(column, name, modes.regions[name], y, width)
        paths += _paths(column, y, MARGIN + width, lanes_x)
        y += column.rows * ROW + GAP / 2
        rules.append(y)
        y += GAP / 2
    right = max([lanes_x, *(x for path in paths for x, _ in path.corners)])
    return DiagramLayout(right + MARGIN, y, *map(tuple, (boxes, paths, titles, rules[:-1])))


def _width(texts: list[str]) -> float:
    return LETTER * max(map(len, texts), default=0)


def _column(region: Region) -> _Column:
    """Boxes one below the other, a row between them."""
    sources = {None: ((ANY,), region.transitions)} if region.transitions else {}
    for name, state in region.states.items():
        sources[name] = ((name, *state_in_words(state)), state.transitions)
    entered = {transition.to for _, transitions in sources.values() for transition in transitions}
    boxes, starts, row = [], {}, 0
    for name, (lines, transitions) in sources.items():
        rows = max(len(lines), (name in entered) + len(transitions))
        boxes.append((row, rows, lines, name))
        starts[name] = row
        row += rows + 1
    found = [
        _Transition(starts[name] + (name in entered) + i, starts[one.to], transition_in_words(one))
        for name, (_, transitions) in sources.items()
        for i, one in enumerate(transitions)
    ]
    return _Column(tuple(boxes), tuple(found), row - 1)


def _boxes(column: _Column, name: str, region: Region, y: float, width: float) -> list[StateBox]:
    return [
        StateBox(
            *(MARGIN, y + row * ROW, width, rows * ROW, lines, name, state or ""),
            final=state is not None and region.states[state].final,
            initial=state == region.initial,
        )
        for row, rows, lines, state in column.boxes
    ]


def _paths(column: _Column, y: float, left: float, lanes_x: float) -> list[Path]:
    def height(row):
        return y + (row + 0.65) * ROW

    found = []
    for transition, lane in zip(column.transitions, _lanes(column.transitions), strict=True):
        out, into, x = height(transition.leaves), height(transition.enters), lanes_x + lane * LANE
        corners = ((left, out), (x, out), (x, into), (left, into))
        found.append(Path(corners, transition.label, (left + INSET, out - 4.0)))
    return found


def _lanes(transitions: tuple[_Transition, ...]) -> list[int]:
    """A lane for each transition, the shortest next to the labels."""
    spans = [sorted((one.leaves, one.enters)) for one in transitions]
    lanes, taken = [0] * len(spans), []
    for i in sorted(range(len(spans)), key=lambda i: spans[i][1] - spans[i][0]):
        low, high = spans[i]
        lanes[i] = next(
            lane
            for lane in itertools.count()
            if all(lane != one or high < a or b < low for one, a, b in taken)
        )
        taken.append((lanes[i], low, high))
    return lanes
