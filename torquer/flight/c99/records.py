"""Types of the records of an on-board computer: of its constants, and of what changes on board."""

from typing import Any

import numpy as np

from torquer.computer import computer as on_board
from torquer.computer.interface import KNOWN
from torquer.computer.modes.table import ModeState
from torquer.flight.c99.translation import FAILURES
from torquer.flight.c99.types import INT, REAL, Array, Record, Rows, Static, Type, find_type


def make_record(
    name: str, dtype: np.dtype, rows: np.ndarray | None = None, with_floats: bool = False
) -> Record:
    """The record of a structured dtype; `rows`: constants, whose whole numbers are bounded, floats
    if they are to be written down where they are the same in all rows.
    """
    assert dtype.names is not None
    fields, bounds = [], []
    for each in dtype.names:
        base, shape = dtype[each].base, dtype[each].shape
        fields.append((each, Array(shape) if shape else INT if base.kind == "i" else REAL))
        if rows is not None and len(rows) and (base.kind == "i" or with_floats):
            of = int if base.kind == "i" else float
            bounds.append((each, (of(rows[each].min()), of(rows[each].max()))))
    return Record(name, tuple(fields), rows is not None, tuple(bounds))


def constants_type(name: str, values: dict[str, Any], with_floats: bool = False) -> Record:
    """The type of constants: arrays of records, records, numbers, functions; see `make_record`."""
    kinds = (int, float) if with_floats else (int,)
    bounds = tuple((k, (v, v)) for k, v in values.items() if type(v) in kinds and k != "host")
    fields = tuple((key, _constant_type(key, v, with_floats)) for key, v in values.items())
    return Record(name, fields, True, bounds)


def _constant_type(name: str, value, with_floats: bool = False) -> Type:
    word = "".join(part.capitalize() for part in name.rstrip("s").split("_"))
    if isinstance(value, np.ndarray) and value.dtype.names is None:
        return Array(value.shape, const=True)
    if isinstance(value, np.ndarray):
        return Rows(make_record(word, value.dtype, value, with_floats), len(value))
    if hasattr(value, "_fields") and any(isinstance(part, np.ndarray) for part in value):
        return constants_type(type(value).__name__, value._asdict())
    if isinstance(value, tuple) and value and not callable(value[0]):
        kind = find_type(value)
        assert kind is not None
        return kind
    if isinstance(value, int) and name != "host":
        return INT
    return REAL if isinstance(value, float) else Static(value)


def board_type(board: on_board.Board) -> Record:
    """The type of all that changes on board."""
    modes = tuple(
        (name, _changing(f"{name.capitalize().rstrip('s')}Now", part))
        for name, part in zip(ModeState._fields, board.modes, strict=True)
    )
    return Record("Board", (
        ("known", Rows(make_record("Known", KNOWN), 1)),
        ("parameters", Array((len(board.parameters),), is_real=True)),
        ("memory", Array((len(board.memory),))),
        ("modes", Record("ModesNow", modes)),
        ("chosen", Rows(make_record("Chosen", on_board.CHOSEN), 1)),
        ("selected", Array(board.selected.shape)),
        ("failures", FAILURES),
    ))  # fmt: skip


def _changing(name: str, part: np.ndarray) -> Type:
    if part.dtype.names is None:
        return Array(part.shape)
    return Rows(make_record(name, part.dtype), len(part))
