"""Packets that a ground station has received, as one table each over the frames' time stamps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.frames import Frame

if TYPE_CHECKING:
    import xarray as xr


def as_tables(
    received: Iterable[tuple[float, Frame]], dictionary: Dictionary
) -> dict[str, xr.Dataset]:
    """A dataset for each packet of the downlink that was received, by its name.

    `received`: times of reception [s] and frames. Over `frame`: `received_s`, `time_s` (time stamp
    by the on-board clock, since 2010-01-01), `status` and each number of the packet,
    with unit and description; labelled numbers and those of bits have `flag_meanings`, signed ones
    `unknown`, the lowest value, which stands for a number that was not known.
    """
    rows: dict[str, list[tuple[float, Frame]]] = {}
    for at_s, frame in received:
        rows.setdefault(frame.packet.name, []).append((at_s, frame))
    return {
        name: _table(packet, rows[name]) for name, packet in dictionary.down.items() if name in rows
    }


def _table(packet: Packet, received: list[tuple[float, Frame]]) -> xr.Dataset:
    import xarray as xr

    at_s, frames = zip(*received, strict=True)
    seconds = {"units": "s", "long_name": "time stamp of the frame, since 2010-01-01"}
    variables = {
        "received_s": ("frame", np.array(at_s), {"units": "s", "long_name": "time of reception"}),
        "time_s": ("frame", np.array([f.time_s for f in frames], np.uint32), seconds),
        "status": ("frame", np.array([f.code for f in frames], np.uint8), {}),
    }
    columns = zip(*(frame.values for frame in frames), strict=True)
    for (name, field, _), column in zip(packet.numbers(), columns, strict=True):
        values = np.array(column, "u8" if field.dtype == "u8" else None)
        variables[name] = ("frame", values, field_attributes(field))
    return xr.Dataset(variables, attrs={"packet": packet.name, "description": packet.description})


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
