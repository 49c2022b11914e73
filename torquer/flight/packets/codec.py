"""Encoder and decoder of a packet: source text generated from its fields, compiled once.

One expression packs all numbers. If it fails, by NaN or a number out of range, a second one with
limits does; values that are not numbers, or too large for a float, are left to a loop.
"""

import math
import struct
from collections.abc import Callable, Sequence
from functools import cache, partial
from operator import index
from typing import Any

import numpy as np

from torquer.flight.packets.bit_layout import BitLayout
from torquer.flight.packets.dictionary import Field, Packet
from torquer.flight.packets.number_types import TYPES

_ENCODER = """
def encode(values):
    try:
        {raw} = values
        return pack({numbers})
    except FAILED:
        try:
            {raw} = values
            return pack({limited})
        except FAILED:
            return pack(*saturated(values))
"""
_DECODER = """
def decode(data, at=0):
    try:
        {raw} = unpack(data, at)
    except FAILED:
        raise ValueError(short(data, at)) from None
    return ({numbers})
"""
#: What packing or rounding a number out of range, or a value that is not a number, raises.
_FAILED = (struct.error, ArithmeticError, TypeError, ValueError)


@cache
def encoder(packet: Packet) -> Callable[[Sequence], bytes]:
    """The function (values in the order of `packet.names`) -> data.

    Values are rounded and saturated, NaN is the least raw number of a whole type; bytes are filled
    with zeros, or cut. Never an exception for numbers; ValueError for another count of values, or
    for a value that is not a number.
    """
    return _compile_template(
        packet, _ENCODER, "encode", numbers=_pack_expression, limited=_limit_expression
    )


@cache
def decoder(packet: Packet) -> Callable[..., tuple]:
    """The function (data, at=0) -> values in the order of `packet.names`.

    `at`: place of the first byte. ValueError if the data are too short.
    """
    return _compile_template(packet, _DECODER, "decode", numbers=_value)


def _compile_template(
    packet: Packet, template: str, name: str, **expressions: Callable
) -> Callable:
    """The function of a template; `expressions`: text of a number by its name and field."""
    fields = [field for _, field, _ in packet.numbers()]
    made = {
        key: ", ".join(of(f"n{i}", field) for i, field in enumerate(fields)) + ","
        for key, of in expressions.items()
    }
    raw = ", ".join(f"n{i}" for i in range(len(fields))) + ","
    source = template.format(raw=raw, **made)
    letters = packet.struct_format
    layout = BitLayout(packet) if letters is None else struct.Struct(letters)
    space: dict[str, Any] = {
        "plain": _plain,
        **{f"raw_{f.name}": f.raw_of for f in packet.fields if f.polynomial},
        "FAILED": _FAILED,
        "pack": layout.pack,
        "unpack": layout.unpack_from,
        "saturated": partial(saturate, packet),
        "short": lambda data, at: (
            f"{packet.name}: must have {layout.size} bytes; received {len(data) - at}"
        ),
    }
    exec(compile(source, f"<{name} {packet.name}>", "exec"), space)
    return space[name]


def _plain(value):
    """A number of Python: with NumPy's small ones an offset would overflow."""
    return value.item() if isinstance(value, np.generic) else value


def _raw_expression(number: str, field: Field) -> str:
    """The raw number of a value, not rounded."""
    if field.offset:
        number = f"(plain({number}) - {int(field.offset) if field.is_whole else field.offset!r})"
    return number if field.scale == 1.0 else f"{number} / {field.scale!r}"


def _pack_expression(number: str, field: Field) -> str:
    if not field.kind.is_whole:
        return number
    if field.polynomial:
        return f"raw_{field.name}({number})"
    return f"round({_raw_expression(number, field)})"


def _limit_expression(number: str, field: Field) -> str:
    """A number in its range; NaN is in none and above none, and so becomes the least."""
    kind = field.kind
    if not kind.is_whole or field.polynomial:
        return _pack_expression(number, field)
    inside = f"{kind.low} <= (x := {_raw_expression(number, field)}) <= {kind.high}"
    return f"(round(x) if {inside} else {kind.high} if x > {kind.high} else {kind.low})"


def _value(number: str, field: Field) -> str:
    """The value of a raw number, as `Field.value` computes it."""
    if field.is_whole:
        return f"{number} + {int(field.offset)}" if field.offset else number
    if field.polynomial:
        text = repr(field.polynomial[-1])
        for coefficient in field.polynomial[-2::-1]:
            text = f"({text} * {number} + {coefficient!r})"
        return text
    scaled = number if field.scale == 1.0 else f"{number} * {field.scale!r}"
    return f"{scaled} + {field.offset!r}" if field.offset else scaled


def saturate(packet: Packet, values: Sequence) -> list:
    """Raw numbers of any values, in the range of their types."""
    values, numbers = list(values), list(packet.numbers())
    if len(values) != len(numbers):
        raise ValueError(f"{packet.name}: must have {len(numbers)} values; received {len(values)}")
    named = zip(numbers, values, strict=True)
    return [_raw(f"{packet.name}.{name}", field, value) for (name, field, _), value in named]


def _raw(name: str, field: Field, value):
    """The raw number of one value."""
    if field.type == "bytes":
        if not isinstance(value, bytes | bytearray | memoryview):
            raise ValueError(f"{name}: must be bytes; received {value!r}")
        return bytes(value)
    number, kind = _as_number(name, field, value), field.kind
    if field.polynomial:
        return field.raw_of(number)
    if field.is_whole:
        number -= int(field.offset)
    elif kind.is_whole:
        number = (number - field.offset) / field.scale
    if number != number:
        return kind.low if kind.is_whole else number
    if kind.is_whole:
        return round(min(max(number, kind.low), kind.high))
    return min(max(number, kind.low), kind.high) if math.isfinite(number) else number


def _as_number(name: str, field: Field, value) -> float:
    """A float; of whole values that are whole already an integer, which has all its digits."""
    try:
        if isinstance(value, str | bytes):
            raise TypeError
        return index(value) if field.is_whole and hasattr(value, "__index__") else float(value)
    except OverflowError:  # a longer integer
        return TYPES["f64"].high if value > 0 else TYPES["f64"].low
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be a number; received {value!r}") from None
