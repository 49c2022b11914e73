"""What was known at an instant of the past: the last row of each packet until then, with its age.

By on-board time: what the satellite had measured until then. By reception: what the ground had
received until then, whatever it tells of; recordings have no time of reception and are left out.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from typing import Any

import numpy as np

from torquer.computer.names import Names
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.ground.archive import ArchiveError
from torquer.ground.bins import TIMES
from torquer.ground.columns import as_numbers, fitting, packet_columns
from torquer.ground.history import latest

#: A row is stale after so many usual times between two, and at the earliest after so long [ms].
STALE_AFTER, STALE_MS = 3, 10_000
#: Rows by which the usual time between two is known.
_ROWS = 11
_LEAST = -(2**63)
#: The packets that tell of the satellite's state, and what of the main one comes first.
MODES, MAIN = "modes", "extended"
_FIRST = ("flags", "isolated", "q_orbital", "q_inertial", "omega", "sigma")


def last_known(
    db: sqlite3.Connection, dictionary: Dictionary, at_ms: int, by: str = "time"
) -> list[dict[str, Any]]:
    """The last row of each packet until an instant [ms since 1970], packets without one left out.

    `age_ms`: from the row to the instant, by the same time; `every_ms`: usual time between rows
    before, None if there are too few; `stale`: whether the row is older than is usual. `by`: of
    `TIMES`. ArchiveError for an archive that cannot be read.
    """
    try:
        found = [
            (packet, latest(db, packet.name, packet.names, _LEAST, at_ms, _ROWS, by))
            for packet in dictionary.down.values()
        ]
    except sqlite3.Error as error:
        line = " ".join(str(error).split())
        raise ArchiveError(f"archive: must be readable; received {line}") from None
    return [_last(packet, rows, at_ms, by) for packet, rows in found if rows]


def _last(packet: Packet, rows: list[tuple], at_ms: int, by: str) -> dict[str, Any]:
    times = [int(row[TIMES[by] == "_received_ms"]) for row in rows]
    time, received, good, _, *numbers = packet_columns(packet)
    time_ms, received_ms, quality, *values = (
        fitting(column, as_numbers(column, [value]))[0][0]
        for column, value in zip((time, received, good, *numbers), rows[-1], strict=True)
    )
    age_ms, steps = at_ms - times[-1], np.diff(times)
    steps = steps[steps > 0]
    every_ms = int(np.quantile(steps, 0.5, method="lower")) if len(steps) > 1 else None
    return {
        "packet": packet.name,
        "time_ms": time_ms,
        "received_ms": received_ms,
        "quality": quality,
        "age_ms": age_ms,
        "every_ms": every_ms,
        "stale": age_ms > max(STALE_MS, STALE_AFTER * (every_ms or 0)),
        "values": dict(zip(packet.names, values, strict=True)),
    }


def state_in_words(known: list[dict], dictionary: Dictionary, names: Names) -> dict[str, str]:
    """Modes, flags and estimated attitude of what was known, in words, by their names."""
    by_name = {each["packet"]: each["values"] for each in known}
    found = _regions(by_name.get(MODES, {}), names)
    packet, values = dictionary.down.get(MAIN), by_name.get(MAIN)
    if packet is None or values is None:
        return found
    for field in packet.fields:
        if field.name in _FIRST or (field.labels and field.name.endswith("_mode")):
            unit = f" {field.unit}" if field.unit else ""
            texts = [in_words(field, values[name]) for name in field.names]
            found[field.name] = " ".join(texts) + unit
    return found


def _regions(states: Mapping[str, Any], names: Names) -> dict[str, str]:
    """The state of each region of the mode table."""
    pairs = zip(names.regions.items(), states.values(), strict=False)
    return {
        region: list(known)[state] if state in range(len(known)) else "unknown"
        for (region, (_, known)), state in pairs
    }


def in_words(field: Field, value: Any) -> str:
    """A value: its label, the names of its bits, or its number."""
    if value is None:
        return "unknown"
    if field.labels and value in field.texts:
        return field.texts[value]
    if field.bits and isinstance(value, int):
        names = [
            field.bits[place] if place < len(field.bits) else str(place)
            for place in range(value.bit_length())
            if value >> place & 1
        ]
        return f"{', '.join(names) or 'none'} ({value})"
    return f"{value:.7g}" if isinstance(value, float) else str(value)
