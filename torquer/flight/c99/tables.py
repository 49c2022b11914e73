"""Constants and first state of a computer as initialisers in C."""

from collections.abc import Callable
from typing import Any

import numpy as np

from torquer.computer.computer import Board
from torquer.flight.c99.precision import double_text, is_single
from torquer.flight.c99.print_c import wrap_line
from torquer.flight.c99.program import Program
from torquer.flight.c99.translation import FAILURES
from torquer.flight.c99.types import REAL, Array, Record, Rows, Static, Tuple, Type, number_text


def initialiser(value: Any, kind: Type, depth: int = 1) -> str:
    """A value in braces, a line for each field of a record."""
    if isinstance(kind, Tuple):
        inner = ", ".join(
            initialiser(v, k, depth + 1) for v, k in zip(value, kind.parts, strict=True)
        )
        return f"{{{{{inner}}}}}" if kind.is_array else f"{{{inner}}}"
    if isinstance(kind, Rows):
        return _rows(value, kind, depth)
    if isinstance(kind, Record):
        return _record(value, kind, depth)
    if isinstance(kind, Array):
        text = number_text if kind.is_real else double_text
        return _cells(np.asarray(value), text)
    return number_text(value)


def _store_field(value: Any, kind: Type, depth: int) -> str:
    """A field of a record, whose floats are doubles."""
    return double_text(float(value)) if kind == REAL else initialiser(value, kind, depth)


def _rows(rows: np.ndarray, kind: Rows, depth: int) -> str:
    if not len(rows):  # C has no arrays without a place
        rows = np.zeros(1, rows.dtype)
    texts = []
    for row in rows:
        fields = [(row[name], each) for name, each in kind.record.fields]
        texts.append("{" + ", ".join(_store_field(*each, depth + 1) for each in fields) + "}")
    return _lines(texts, depth)


def _record(values: Any, kind: Record, depth: int) -> str:
    of = values if isinstance(values, dict) else values._asdict()
    fields = [(name, each) for name, each in kind.fields if not isinstance(each, Static)]
    return _lines(
        [f"/* {name} */ {_store_field(of[name], each, depth + 1)}" for name, each in fields], depth
    )


def _cells(cells: np.ndarray, text: Callable[[float], str]) -> str:
    if not len(cells):  # C has no arrays without a place
        cells = np.zeros(1)
    if cells.ndim > 1:
        return "{" + ", ".join(_cells(each, text) for each in cells) + "}"
    return "{" + ", ".join(text(float(each)) for each in cells.tolist()) + "}"


def _lines(texts: list[str], depth: int) -> str:
    further = "    " * depth
    body = ",\n".join(wrap_line(further + text, depth) for text in texts)
    return f"{{\n{body}\n{'    ' * (depth - 1)}}}"


def constant_text(program: Program, kind: Record, name: str, value: Any) -> str:
    """The definition of a constant in a file of its own."""
    return f"static const {program.type_name(kind)} {name} = {initialiser(value, kind)};\n"


def state_numbers(board: Board) -> np.ndarray:
    """All numbers of a state, in the order in which its struct in C has them.

    An array of no length has one place there, which stays zero; nothing has failed.
    """
    failures = np.zeros(len(FAILURES.fields))
    return np.concatenate([*(numbers_in(part) for part in state_parts(board)), failures])


def first_state(board: Board) -> dict[str, Any]:
    """A state at the start, by the names of its parts: nothing has failed."""
    return board._asdict() | {"failures": {name: 0 for name, _ in FAILURES.fields}}


def state_parts(board: Board) -> list[np.ndarray]:
    """The arrays of a state, in the order in which its struct in C has them before the failures."""
    return [
        *(board.known, board.parameters, board.memory),
        *(*board.modes, board.chosen, board.selected),
    ]


def numbers_in(part: np.ndarray) -> np.ndarray:
    """The numbers of an array as its part of the struct has them."""
    if not len(part):
        return np.zeros(part.dtype.itemsize // 8)
    return np.ascontiguousarray(part).view(np.float64).reshape(-1)


def count_state_words(board: Board) -> int:
    """Words of 64 bits that a state has in C, where parameters may be floats."""
    words, parameters = len(state_numbers(board)), len(numbers_in(board.parameters))
    return words - parameters // 2 if is_single() else words
