"""The exported computer as the simulation calls it: a file of C between their two memories."""

from collections.abc import Sequence
from string import Template

import numpy as np

from torquer.computer.computer import Board
from torquer.computer.interface import PLACES
from torquer.flight.c99.calls import failure_bit
from torquer.flight.c99.computer import Export
from torquer.flight.c99.interface import Input, handed_in
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.tables import kept_places, numbers_in, state_parts
from torquer.flight.c99.texts import fill_template

#: The parameters among the arrays of the simulation; in place of one where there is none.
_PARAMETERS, _NONE = 1, 255

#: Parameters are floats; those that C has not set keep all digits in the simulation.
_PUT_FLOATS = """\
    for (size_t n = 0; n < $count; n++) {
        own.board.parameters[n] = (float)parameters[n];
    }
"""
_GET_FLOATS = """\
    for (size_t n = 0; n < $count; n++) {
        const float held = own.board.parameters[n];
        parameters[n] = (held == (float)parameters[n]) ? parameters[n] : (double)held;
    }
"""
#: What an estimator isolates that has failed, as the simulation knows it; estimators follow laws.
_FAILED = """\
        if (own.board.failures.blocks >= INT64_C($bit)) {
            known[$place] = (double)NAN;
        }
"""
_FIRST = """\
    for (size_t n = 0; n < $count; n++) {
        numbers[$at + n] = ${cast}own->board.$part[n];
    }
"""


def in_the_loop_text(
    name: str, board: Board, made: Export, inputs: Sequence[Input], fresh: str, laws: int
) -> str:
    """The file `test/in_the_loop.c` of a computer with so many laws."""
    starts = np.cumsum([0, *(len(numbers_in(part)) for part in state_parts(board))])
    kept, floats = kept_places(made.program, made.board), len(board.parameters) * is_single()
    rows = [_pair(starts, place) for place in kept.tolist()]
    if floats:  # words of two floats, which are copied apart
        at = next(k for k, (part, _) in enumerate(rows) if part == _PARAMETERS)
        rows[at : at + floats] = [(_NONE, 0)] * ((floats + 1) // 2)
    given = handed_in(inputs)
    places = {
        "name": name, "fresh": fresh, "count": str(len(rows)),
        "rows": ", ".join(f"{{{part}, {place}}}" for part, place in rows),
        "places": ", ".join(map(str, given.values())), "given": str(len(given)),
        "put_floats": Template(_PUT_FLOATS).substitute(count=floats) if floats else "",
        "get_floats": Template(_GET_FLOATS).substitute(count=floats) if floats else "",
        "first": _first_text(board), "failed": _failed_text(made, laws),
    }  # fmt: skip
    return fill_template("in_the_loop.c", places)


def _pair(starts: np.ndarray, place: int) -> tuple[int, int]:
    """The array of the simulation in which one of all numbers stands, and its place there."""
    part = int(np.searchsorted(starts, place, side="right")) - 1
    return part, place - int(starts[part])


def _failed_text(made: Export, laws: int) -> str:
    """Statements that tell the simulation of an estimator that has failed."""
    if not made.program.keeps(made.board, "failures"):
        return ""
    place = PLACES["isolated"].start
    return Template(_FAILED).substitute(bit=failure_bit(laws), place=place)


def _first_text(board: Board) -> str:
    """Statements that copy parameters, then memory; an array of no length has one place."""
    parts = (
        ("parameters", board.parameters, 0),
        ("memory", board.memory, max(len(board.parameters), 1)),
    )
    return "".join(
        Template(_FIRST).substitute(
            count=len(of), at=at, part=part,
            cast="(double)" if is_single() and part == "parameters" else "",
        )
        for part, of, at in parts
        if len(of)
    )  # fmt: skip
