"""Columns of exported packets, and which values of an archive fit them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import chain, count
from typing import Any, NamedTuple

import numpy as np

from torquer.flight.packets.dictionary import Field, Packet
from torquer.flight.packets.received import field_attributes
from torquer.ground.archive import SUSPECT

_LEAST, _GREATEST = -(2**63), 2**63 - 1
#: The dates that 64 bits of ns since 1970 tell, as readers of the files have them: 1677 to 2262.
FIRST_MS, LAST_MS = -(2**63 // 10**6), 2**63 // 10**6
_DATE = {"units": "milliseconds since 1970-01-01", "calendar": "proleptic_gregorian"}
_QUALITY = {
    "long_name": "trust in the frame",
    "flag_values": [0, 1, 2],
    "flag_meanings": "suspect unchecked authentic",
}
_HEX = re.compile(r"(?:[0-9a-f]{2})*")


class Column(NamedTuple):
    """A column of a file: its name there, in the archive, its type, what stands for no number.

    `is_whole`: whether its numbers are whole; `low`, `high`: the least and greatest of these;
    `wrong`: what stands for a value that does not fit, where that is not None.
    """

    name: str
    source: str
    type: str
    fill: Any
    attributes: dict
    is_whole: bool = True
    low: float = _LEAST
    high: float = _GREATEST
    wrong: Any = None

    @property
    def as_float(self) -> Column:
        """The same for numbers of which some are missing."""
        return self._replace(type="f8", fill=np.nan)


def packet_columns(packet: Packet) -> list[Column]:
    """The columns of a packet: of its frames, then its numbers with their units."""
    return [
        *_frame_columns(packet.names),
        *(Column(name, name, *_kind(field), *_range(field)) for name, field, _ in packet.numbers()),
    ]


def found_columns(kinds: dict[str, str]) -> list[Column]:
    """Columns of a table of which only the names and SQL's types are known; numbers are floats."""
    names = [name for name in kinds if name[0] != "_"]
    return [
        *_frame_columns(names),
        *(
            Column(name, name, "str", None, {}, False)
            if kinds[name] == "TEXT"
            else Column(name, name, "f8", np.nan, {}, False)
            for name in names
        ),
    ]


def _frame_columns(names: Iterable[str]) -> list[Column]:
    end = _free_ending(set(names))
    time, received = ({"long_name": name, **_DATE} for name in ("on-board time", "reception"))
    status = {"long_name": "0 INFO, 1 ALARM, 2 STOP"}
    return [
        Column(f"time{end}", "_time_ms", "i8", None, time),
        Column(f"received{end}", "_received_ms", "i8", _LEAST, received, True, FIRST_MS, LAST_MS),
        Column(f"quality{end}", "_quality", "u1", None, _QUALITY, True, 0, 2, SUSPECT),
        Column(f"status{end}", "_status", "u1", None, status, True, 0, 255, 255),
    ]


def _free_ending(taken: set[str]) -> str:
    """What the names of our columns end with, so that no field has them: mostly nothing."""
    ours = ("time", "received", "quality", "status")
    endings = chain(["", "_of_frame"], (f"_of_frame_{number}" for number in count(2)))
    return next(end for end in endings if taken.isdisjoint(name + end for name in ours))


def _kind(field: Field) -> tuple[str, Any, dict]:
    """Type of a column, what stands for a number that was not known, attributes."""
    about = {key: value for key, value in field_attributes(field).items() if key != "unknown"}
    if field.type == "bytes":
        return "str", None, about
    return field.dtype, field.unknown_value if field.is_whole else np.nan, about


def _range(field: Field) -> tuple[bool, float, float]:
    """Whether numbers are whole, the least and the greatest."""
    return field.is_whole, *field.range


def as_numbers(column: Column, values: Sequence) -> Sequence:
    """Values in which large whole numbers, which the archive has as texts, are numbers again."""
    if column.type != "u8":
        return values
    return [int(v) if isinstance(v, str) and v.isdecimal() else v for v in values]


def fitting(column: Column, values: Sequence) -> tuple[list, list]:
    """(values with what stands for those that do not fit, those that do not)."""
    if _all_fit(column, values):
        return list(values), []
    fits = [value is None or _fits(column, value) for value in values]
    kept = [v if fit else column.wrong for v, fit in zip(values, fits, strict=True)]
    return kept, [v for v, fit in zip(values, fits, strict=True) if not fit]


def _all_fit(column: Column, values: Sequence) -> bool:
    kinds = set(map(type, values)) - {type(None)}
    if column.type == "str":
        return kinds <= {str} and all(v is None or _HEX.fullmatch(v) for v in values)
    if not column.is_whole:
        return kinds <= {int, float}
    known = [value for value in values if value is not None] if kinds <= {int} else []
    return not kinds or bool(known and column.low <= min(known) and max(known) <= column.high)


def _fits(column: Column, value: Any) -> bool:
    if column.type == "str":
        return isinstance(value, str) and _HEX.fullmatch(value) is not None
    if not column.is_whole:
        return isinstance(value, int | float)
    return isinstance(value, int) and column.low <= value <= column.high
