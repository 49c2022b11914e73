"""Constants and first state of a computer as initialisers in C."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from torquer.computer.computer import Board
from torquer.flight.c99.computer import Export
from torquer.flight.c99.precision import double_text, is_single
from torquer.flight.c99.print_c import kept_fields, wrap_line
from torquer.flight.c99.program import Program
from torquer.flight.c99.translation import FAILURES
from torquer.flight.c99.types import REAL, Array, Record, Rows, Tuple, Type, number_text


def initialiser(program: Program, value: Any, kind: Type, depth: int = 1) -> str:
    """A value in braces, a line for each field of a record."""
    if isinstance(kind, Tuple):
        inner = ", ".join(
            initialiser(program, v, k, depth + 1) for v, k in zip(value, kind.parts, strict=True)
        )
        return f"{{{{{inner}}}}}" if kind.is_array else f"{{{inner}}}"
    if isinstance(kind, Rows):
        return _rows(program, value, kind, depth)
    if isinstance(kind, Record):
        return _record(program, value, kind, depth)
    if isinstance(kind, Array):
        text = number_text if kind.is_real else double_text
        cells = np.asarray(value)[tuple(map(slice, kind.in_c))]
        return _cells(cells, text)
    return number_text(value)


def _store_field(program: Program, value: Any, kind: Type, depth: int) -> str:
    """A field of a record, whose floats are doubles."""
    return double_text(float(value)) if kind == REAL else initialiser(program, value, kind, depth)


def _rows(program: Program, rows: np.ndarray, kind: Rows, depth: int) -> str:
    if not len(rows):  # C has no arrays without a place
        rows = np.zeros(1, rows.dtype)
    fields, texts = kept_fields(program, kind.record), []
    for row in rows:
        cells = [_store_field(program, row[name], each, depth + 1) for name, each in fields]
        texts.append("{" + ", ".join(cells) + "}")
    return _lines(texts, depth)


def _record(program: Program, values: Any, kind: Record, depth: int) -> str:
    of = values if isinstance(values, dict) else values._asdict()
    texts = [
        f"/* {name} */ {_store_field(program, of[name], each, depth + 1)}"
        for name, each in kept_fields(program, kind)
    ]
    return _lines(texts, depth)


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
    return f"static const {program.type_name(kind)} {name} = {initialiser(program, value, kind)};\n"


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
    """The numbers of an array."""
    return np.ascontiguousarray(part).view(np.float64).reshape(-1)


def all_numbers(board: Board) -> np.ndarray:
    """All numbers of a state, whether they are in C or not."""
    return np.concatenate([numbers_in(part) for part in state_parts(board)])


def state_numbers(made: Export) -> Callable[[Board], np.ndarray]:
    """What gives all numbers that a board has in C, in the order of its struct; nothing failed."""
    places, failures = kept_places(made.program, made.board), np.zeros(_failures(made))
    return lambda board: np.concatenate([all_numbers(board)[places], failures])


def _failures(made: Export) -> int:
    """How many numbers a state has of what has failed."""
    return len(FAILURES.fields) if made.program.keeps(made.board, "failures") else 0


def count_state_words(board: Board, made: Export) -> int:
    """Words of 64 bits that the board has in C, where parameters may be floats."""
    words = len(kept_places(made.program, made.board)) + _failures(made)
    return words - len(board.parameters) // 2 if is_single() else words


def kept_places(program: Program, board: Record) -> np.ndarray:
    """Which of all numbers of a state are in C, in their order there."""
    return np.array(_places(program, board, 0), dtype=np.int64)


def _places(program: Program, kind: Type, at: int) -> list[int]:
    """Places, from one on, of the numbers of a type that are in C."""
    if isinstance(kind, Rows):
        size = _size(kind.record)
        return [p for k in range(kind.count) for p in _places(program, kind.record, at + k * size)]
    if isinstance(kind, Record):
        found, kept = [], dict(kept_fields(program, kind))
        for name, each in kind.fields:
            found += _places(program, kept[name], at) if name in kept and each != FAILURES else []
            at += _size(each)
        return found
    if isinstance(kind, Array):
        cells = np.arange(_size(kind)).reshape(_shape(kind))[tuple(map(slice, kind.in_c))]
        return [at + int(each) for each in cells.reshape(-1)]
    return [at]


def _size(kind: Type) -> int:
    """How many numbers a type has in the simulation."""
    if isinstance(kind, Rows):
        return kind.count * _size(kind.record)
    if isinstance(kind, Record):
        return sum(_size(each) for _, each in kind.fields)
    return math.prod(_shape(kind)) if isinstance(kind, Array) else 1


def _shape(kind: Array) -> list[int]:
    """Its shape in the simulation, where all lengths are known."""
    return [n or 0 for n in kind.shape]
