"""Packets that a ground station has received, as one table each over the frames' time stamps.

What came down is in a file; frames are made of it once it is asked for tables, and only a few at a
time are there as frames.
"""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from torquer.flight.packets.dictionary import Field, Packet
from torquer.flight.packets.frames import Frame
from torquer.flight.packets.station import Station

if TYPE_CHECKING:
    import xarray as xr

#: Frames of a packet that are there at a time.
_AT_ONCE = 1024
#: Time of reception [s] and number of bytes.
_PIECE = struct.Struct("<dI")


class Downlink(AbstractContextManager):
    """A file with all that comes down, and when it came.

    with Downlink(path) as downlink:
        downlink.take(t_s, data)
    frames = downlink.frames(Station(software))
    """

    def __init__(self, path: Path):
        self._path, self._file = path, open(path, "wb")  # noqa: SIM115, closed by `__exit__`
        self._pieces = tempfile.TemporaryFile()  # noqa: SIM115

    def __enter__(self) -> Self:
        return self

    def __exit__(self, error: object, *_: object) -> None:
        self._file.close()
        if error is not None:
            self._pieces.close()

    def take(self, at_s: float, data: bytes) -> None:
        """What came down at a time of the run [s]."""
        if data:
            self._file.write(data)
            self._pieces.write(_PIECE.pack(at_s, len(data)))

    def frames(self, station: Station) -> Iterator[tuple[float, Frame]]:
        """All frames with the times of their reception, as a station finds them, once."""
        with self._pieces, open(self._path, "rb") as file:
            self._pieces.seek(0)
            while piece := self._pieces.read(_PIECE.size):
                at_s, size = _PIECE.unpack(piece)
                for frame in station.receive(file.read(size)):
                    yield at_s, frame


def as_tables(received: Iterable[tuple[float, Frame]]) -> dict[str, xr.Dataset]:
    """A dataset for each packet of the downlink that was received, by its name, in the order in
    which they first came.

    `received`: times of reception [s] and frames. Over `frame`: `received_s`, `time_s` (time stamp
    by the on-board clock, since 2010-01-01), `status` and each number of the packet,
    with unit and description; labelled numbers and those of bits have `flag_meanings`, signed ones
    `unknown`, the lowest value, which stands for a number that was not known.
    """
    columns: dict[str, _Columns] = {}
    for at_s, frame in received:
        name = frame.packet.name
        if name not in columns:
            columns[name] = _Columns(frame.packet)
        columns[name].add(at_s, frame)
    return {name: each.table() for name, each in columns.items()}


class _Columns:
    """The numbers of a packet's frames, as arrays but for the latest frames."""

    def __init__(self, packet: Packet):
        self._packet = packet
        self._latest: list[tuple[float, Frame]] = []
        self._arrays: list[list[np.ndarray]] = []

    def add(self, at_s: float, frame: Frame) -> None:
        """One more frame."""
        self._latest.append((at_s, frame))
        if len(self._latest) == _AT_ONCE:
            self._pack()

    def table(self) -> xr.Dataset:
        """All frames."""
        import xarray as xr

        if self._latest:
            self._pack()
        at_s, time_s, status, *numbers = map(np.concatenate, zip(*self._arrays, strict=True))
        seconds = {"units": "s", "long_name": "time stamp of the frame, since 2010-01-01"}
        variables: dict[str, Any] = {
            "received_s": ("frame", at_s, {"units": "s", "long_name": "time of reception"}),
            "time_s": ("frame", time_s, seconds),
            "status": ("frame", status, {}),
        }
        for (name, field, _), column in zip(self._packet.numbers(), numbers, strict=True):
            variables[name] = ("frame", column, field_attributes(field))
        attributes = {"packet": self._packet.name, "description": self._packet.description}
        return xr.Dataset(variables, attrs=attributes)

    def _pack(self) -> None:
        at_s, frames = zip(*self._latest, strict=True)
        values = zip(*(frame.values for frame in frames), strict=True)
        fields = [field for _, field, _ in self._packet.numbers()]
        self._arrays.append(
            [
                np.array(at_s),
                np.array([frame.time_s for frame in frames], np.uint32),
                np.array([frame.code for frame in frames], np.uint8),
                *(
                    np.array(column, "u8" if field.dtype == "u8" else None)
                    for field, column in zip(fields, values, strict=True)
                ),
            ]
        )
        self._latest.clear()


def field_attributes(field: Field) -> dict:
    """Attributes of a variable with the numbers of a field: unit, description, labels, bits."""
    found: dict = {"units": field.unit or "1", "long_name": field.description}
    if field.unknown_value is not None:
        found["unknown"] = field.unknown_value
    if field.bits:
        found["flag_masks"] = [1 << place for place in range(len(field.bits))]
    if field.labels:
        found["flag_values"] = list(field.texts)
    if names := tuple(field.texts.values()) or field.bits:
        found["flag_meanings"] = " ".join(name.replace(" ", "_") for name in names)
    return found
