"""Rows for the archive out of many frames at once: the same as `RowMaker` makes one by one.

Numbers are taken out of the bytes of all frames of a packet by NumPy, where the packet is a plain
row of numbers and bytes; the others go through the codec.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from hashlib import blake2b
from itertools import repeat
from typing import NamedTuple

import numpy as np

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.frames import FRAMESYNC, HEADER, HEADER_BYTES, STATUS, Frame
from torquer.ground.archive import EPOCH_MS, RECORDED, RowMaker

#: What the letters of `struct` are for NumPy.
_TYPES = {
    "B": "u1", "H": "<u2", "I": "<u4", "Q": "<u8", "b": "i1", "h": "<i2", "i": "<i4", "q": "<i8",
    "f": "<f4", "d": "<f8",
}  # fmt: skip
_HEADER = [("mark", "<u4"), ("time", "<u4"), ("id", "u1"), ("code", "u1"), ("rest", "V6")]
#: Bytes with which a packet is tried: counting up, all that mean 'not known', and zeros.
_TRIALS = (bytes(range(1, 256)) * 9, b"\x80" * 2300, b"\x00\x00\x00\x80" * 600, bytes(2300))
#: A double that is a whole number of milliseconds.
_EXACT = 2.0**53


class Batch(NamedTuple):
    """Rows of a packet, in the order of the archive's columns and of its keys."""

    packet: str
    rows: list[tuple]


class Batches:
    """Frames that wait to be rows; `bytes`: how many they have."""

    def __init__(self, dictionary: Dictionary):
        make = RowMaker(dictionary)
        self._kinds = {packet.id: _Kind(packet, make) for packet in dictionary.down.values()}
        self._sizes = {number: kind.packet.size for number, kind in self._kinds.items()}
        self.bytes = 0

    def takes(self, raw: bytes) -> bool:
        """Whether bytes are exactly one frame."""
        if len(raw) < HEADER_BYTES:
            return False
        mark, _, number, code, _, length = HEADER.unpack_from(raw)
        size = self._sizes.get(number)
        is_whole = size == length == len(raw) - HEADER_BYTES
        return is_whole and mark == FRAMESYNC and code in STATUS

    def apart_s(self, raw: bytes) -> float | None:
        """How far the time of the values lies from the time stamp [s]; None where none is told."""
        return self._kinds[raw[8]].apart_s(raw) if self.takes(raw) else None

    def add(self, raw: bytes, quality: int) -> None:
        """Keep a whole frame until it is taken."""
        kind = self._kinds[raw[8]]
        kind.frames.append(raw)
        kind.qualities.append(quality)
        self.bytes += len(raw)

    def take(self) -> Iterator[Batch]:
        """All rows, a packet at a time."""
        self.bytes = 0
        for kind in self._kinds.values():
            if kind.frames:
                yield Batch(kind.packet.name, kind.take())


class _Kind:
    """The frames of a packet that wait."""

    def __init__(self, packet: Packet, make: RowMaker):
        self.packet, self._make = packet, make
        self.frames: list[bytes] = []
        self.qualities: list[int] = []
        self._decode = decoder(packet)
        self._type = _numpy_type(packet)
        if self._type is not None and not self._agrees():
            self._type = None

    def apart_s(self, raw: bytes) -> float | None:
        """How far the time of the values lies from the time stamp, where that must be near."""
        if not self.packet.time_ms or self.packet.name in RECORDED:
            return None
        _, time_s, *_ = HEADER.unpack_from(raw)
        values = self._decode(raw, HEADER_BYTES)
        return abs(time_s - values[self.packet.names.index(self.packet.time_ms)] / 1000.0)

    def take(self) -> list[tuple]:
        """The rows, by time."""
        frames, qualities = self.frames, self.qualities
        self.frames, self.qualities = [], []
        if self._type is None:
            return sorted(map(self._row, frames, qualities), key=lambda row: (row[0], row[4]))
        return self._together(frames, qualities)

    def _agrees(self) -> bool:
        """Whether rows that are made together are those that are made one by one."""
        head = HEADER.pack(FRAMESYNC, 7, self.packet.id, 1, 0, self.packet.size)
        frames = [head + trial[: self.packet.size] for trial in _TRIALS]
        alone = sorted(map(self._row, frames, repeat(1)), key=lambda row: (row[0], row[4]))
        return repr(alone) == repr(self._together(frames, [1] * len(frames)))

    def _row(self, raw: bytes, quality: int) -> tuple:
        _, time_s, _, code, _, _ = HEADER.unpack_from(raw)
        frame = Frame(self.packet, time_s, code, self._decode(raw, HEADER_BYTES), raw)
        row = self._make.row(frame, None, quality)
        return (*row[1:6], *row.values)

    def _together(self, frames: list[bytes], qualities: list[int]) -> list[tuple]:
        table = np.frombuffer(b"".join(frames), self._type)
        time_ms = self._times(table)
        digests = b"".join(blake2b(raw, digest_size=8).digest() for raw in frames)
        digest = np.frombuffer(digests, ">i8")
        order = np.lexsort((digest, time_ms))
        table = table[order]
        columns = (
            time_ms[order].tolist(),
            repeat(None, len(frames)),
            np.array(qualities)[order].tolist(),
            table["code"].tolist(),
            digest[order].tolist(),
        )
        fields = [field for _, field, _ in self.packet.numbers()]
        numbers = (_column(table[f"n{k}"], field) for k, field in enumerate(fields))
        return list(zip(*columns, *numbers, strict=True))

    def _times(self, table: np.ndarray) -> np.ndarray:
        """On-board times [ms since 1970]: of the field, unless that is none."""
        stamps = EPOCH_MS + 1000 * table["time"].astype(np.int64)
        if not self.packet.time_ms:
            return stamps
        place = self.packet.names.index(self.packet.time_ms)
        field = [field for _, field, _ in self.packet.numbers()][place]
        at = table[f"n{place}"].astype(float) * field.scale
        is_time = (at >= 0.0) & (at < _EXACT)
        own = EPOCH_MS + np.rint(np.where(is_time, at, 0.0)).astype(np.int64)
        return np.where(is_time, own, stamps)


def _numpy_type(packet: Packet) -> np.dtype | None:
    """A frame as NumPy has it; None for a packet that is no plain row of numbers and bytes."""
    try:
        fields = [(f"n{k}", _field_type(f)) for k, (_, f, _) in enumerate(packet.numbers())]
        found = np.dtype([*_HEADER, *fields])
        size = struct.calcsize(packet.format)
    except (KeyError, ValueError, TypeError, struct.error):
        return None
    is_plain = packet.format[0] == "<" and size == packet.size == found.itemsize - HEADER_BYTES
    return found if is_plain else None


def _field_type(field: Field) -> str:
    letters = field.format
    return f"V{field.count}" if letters.endswith("s") else _TYPES[letters[0]]


def _column(raw: np.ndarray, field: Field) -> list:
    """Values of a number; None for those that were not known."""
    if raw.dtype.kind == "V":
        digits, size = raw.tobytes().hex(), 2 * raw.dtype.itemsize
        return [digits[at : at + size] for at in range(0, len(digits), size)]
    if raw.dtype.kind == "f":
        unknown = np.isnan(raw)
    elif field.unknown_value is not None:
        unknown = raw == np.iinfo(raw.dtype).min
    else:
        unknown = np.zeros(0, bool)
    values = (raw if field.scale == 1.0 else raw * float(field.scale)).tolist()
    for k in np.flatnonzero(unknown).tolist():
        values[k] = None
    return values
