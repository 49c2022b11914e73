"""A codec that goes through the fields one by one, without `struct` and generated code."""

import math

import numpy as np


def is_whole(field):
    return field.type[0] in "ui"


def size_of(field):
    return 1 if field.type == "bytes" else int(field.type[1:]) // 8


def range_of(field):
    bits = 8 * size_of(field)
    return (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if field.type[0] == "i" else (0, 2**bits - 1)


def float_type(field):
    return np.dtype("<f4") if field.type == "f32" else np.dtype("<f8")


def raw_of(field, value):
    """Whole raw number of a value: rounded, saturated, NaN the least."""
    low, high = range_of(field)
    if value != value:
        return low
    if abs(value) > 1e100:  # more than any type holds at any scale
        return high if value > 0 else low
    return min(max(round(value / field.scale), low), high)


def encode(packet, values):
    data, values = b"", list(values)
    for field in packet.fields:
        if field.type == "bytes":
            data += bytes(values.pop(0))[: field.count].ljust(field.count, b"\0")
            continue
        for value in (values.pop(0) for _ in range(field.count)):
            if is_whole(field):
                raw, signed = raw_of(field, value), field.type[0] == "i"
                data += raw.to_bytes(size_of(field), "little", signed=signed)
            else:
                kind = float_type(field)
                greatest = float(np.finfo(kind).max)
                if value == value and abs(value) != math.inf:
                    value = min(max(value, -greatest), greatest)
                data += np.array(value, kind).tobytes()
    assert not values
    return data


def decode(packet, data):
    values, at = [], 0
    for field in packet.fields:
        if field.type == "bytes":
            values.append(data[at : at + field.count])
            at += field.count
            continue
        for _ in range(field.count):
            part = data[at : at + size_of(field)]
            at += size_of(field)
            if is_whole(field):
                raw = int.from_bytes(part, "little", signed=field.type[0] == "i")
                values.append(raw * field.scale if field.scale != 1.0 else raw)
            else:
                values.append(float(np.frombuffer(part, float_type(field))[0]))
    assert at == len(data)
    return tuple(values)
