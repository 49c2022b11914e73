"""A codec that goes through the fields bit by bit, without `struct` and generated code."""

import math

import numpy as np


def is_whole(field):
    return field.type[0] in "ui"


def width_of(field):
    return {"bytes": 8, "pad": 1}.get(field.type) or int(field.type[1:])


def range_of(field):
    bits = width_of(field)
    return (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if field.type[0] == "i" else (0, 2**bits - 1)


def float_type(field):
    return np.dtype(f"<f{width_of(field) // 8}")


def raw_of(field, value):
    """Whole raw number of a value: rounded, saturated, NaN the least."""
    low, high = range_of(field)
    if value != value:
        return low
    if abs(value) > 1e100:  # more than any type holds at any scale
        return (high if value > 0 else low) if field.scale > 0 else (low if value > 0 else high)
    if field.scale == 1.0 and field.offset == int(field.offset):
        return min(max(round(value - int(field.offset)), low), high)
    return min(max(round((value - field.offset) / field.scale), low), high)


def place_of(field, at, k, width):
    """(byte, bit from the lowest on) of bit k of a number, k from the lowest on."""
    if field.byte_order == "little":
        return divmod(at + k, 8)
    byte, bit = divmod(at + width - 1 - k, 8)
    return byte, 7 - bit


def put(data, field, at, raw):
    width = width_of(field)
    for k in range(width):
        byte, bit = place_of(field, at, k, width)
        data[byte] |= (raw >> k & 1) << bit


def taken(data, field, at):
    width = width_of(field)
    places = [place_of(field, at, k, width) for k in range(width)]
    return sum((data[byte] >> bit & 1) << k for k, (byte, bit) in enumerate(places))


def encode(packet, values):
    data, values, at = bytearray(packet.size), list(values), 0
    for field in packet.fields:
        if field.type == "bytes":
            part = bytes(values.pop(0))[: field.count].ljust(field.count, b"\0")
            data[at // 8 : at // 8 + field.count] = part
            at += 8 * field.count
            continue
        for _ in range(field.count):
            if field.type != "pad":
                put(data, field, at, unsigned_of(field, values.pop(0)))
            at += width_of(field)
    assert not values
    return bytes(data)


def unsigned_of(field, value):
    """The bits of a number that are packed."""
    if is_whole(field):
        return raw_of(field, value) % 2 ** width_of(field)
    kind = float_type(field)
    greatest = float(np.finfo(kind).max)
    if value == value and abs(value) != math.inf:
        value = min(max(value, -greatest), greatest)
    return int.from_bytes(np.array(value, kind).tobytes(), "little")


def decode(packet, data):
    values, at = [], 0
    for field in packet.fields:
        if field.type == "bytes":
            values.append(bytes(data[at // 8 : at // 8 + field.count]))
            at += 8 * field.count
            continue
        for _ in range(field.count):
            if field.type != "pad":
                values.append(value_of(field, taken(data, field, at)))
            at += width_of(field)
    assert at == 8 * len(data)
    return tuple(values)


def value_of(field, raw):
    width = width_of(field)
    if not is_whole(field):
        return float(np.frombuffer(raw.to_bytes(width // 8, "little"), float_type(field))[0])
    if field.type[0] == "i" and raw >= 2 ** (width - 1):
        raw -= 2**width
    if field.polynomial:
        return sum(c * float(raw) ** k for k, c in enumerate(field.polynomial))
    if field.scale == 1.0 and field.offset == int(field.offset):
        return raw + int(field.offset)
    return raw * field.scale + field.offset
