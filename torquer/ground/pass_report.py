"""What an archive holds of a pass: packets and gaps, commands, log, values at both ends.

A pass goes by the satellite's clock, commands by the ground's. Where the two differ (a simulation
runs in another epoch), the ground's span is that in which the rows of the pass were received.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.ground.archive import RECORDED, SUSPECT, quoted
from torquer.ground.commands import list_commands
from torquer.ground.history import latest, log

#: Entries of the log, commands, and gaps of a packet that a report has at most.
MOST_ENTRIES, MOST_COMMANDS, MOST_GAPS = 2000, 1000, 20
#: Rows that come regularly: so many at least, most of them within a part of the usual step.
_LEAST, _PART = 5, 0.2
#: How long before and after the rows of a pass commands still belong to it [ms].
_AROUND_MS = 60_000
_ALARM = 1


class Received(NamedTuple):
    """Rows of a packet in a pass.

    `suspect`: after lost bytes; `alarms`: rows in frames with status ALARM or STOP; `step_s`: usual
    time between two, None where they come irregularly; `missing`: rows that are not there by it, in
    `gaps` (from, to) of which the first are listed.
    """

    packet: str
    rows: int
    first_ms: int
    last_ms: int
    suspect: int
    alarms: int
    step_s: float | None
    missing: int
    gaps: list[tuple[int, int]]


class Ends(NamedTuple):
    """A number at the beginning and end of a pass: the first and last known values."""

    packet: str
    number: str
    unit: str
    first: str
    last: str


class PassReport(NamedTuple):
    """A pass as the archive has it; times in ms since 1970, UTC. `ground_ms`: the span by the
    ground's clock, in which commands were sent."""

    start_ms: int
    end_ms: int
    ground_ms: tuple[int, int]
    received: list[Received]
    commands: list[dict]
    log: list[dict]
    values: list[Ends]

    @property
    def rows(self) -> int:
        """Packets received."""
        return sum(each.rows for each in self.received)

    @property
    def missing(self) -> int:
        """Packets that are missing in gaps."""
        return sum(each.missing for each in self.received)


def report_pass(
    db: sqlite3.Connection, dictionary: Dictionary, start_ms: int, end_ms: int
) -> PassReport:
    """What an archive has of a pass from AOS to LOS, by on-board time."""
    span = start_ms, end_ms
    found = [_received(db, packet, *span) for packet in dictionary.down.values()]
    received = [each for each in found if each is not None]
    ground_ms = _ground_span(db, [each.packet for each in received], *span)
    commands = [
        each
        for each in list_commands(db, MOST_COMMANDS)
        if ground_ms[0] <= (each["sent_ms"] or each["made_ms"]) <= ground_ms[1]
    ]
    values = [
        ends
        for each in received
        if each.packet not in RECORDED
        for ends in _ends(db, dictionary.down[each.packet], *span)
    ]
    entries = log(db, dictionary, *span, MOST_ENTRIES)
    return PassReport(*span, ground_ms, received, commands[::-1], entries, values)


def _received(db: sqlite3.Connection, packet: Packet, start_ms: int, end_ms: int):
    """Rows of a packet in an interval; None for none."""
    rows = db.execute(
        f"SELECT _time_ms, _quality, _status FROM {quoted(packet.name)} "
        "WHERE _time_ms BETWEEN ? AND ? ORDER BY _time_ms",
        (start_ms, end_ms),
    ).fetchall()
    if not rows:
        return None
    times, qualities, statuses = (np.array(column) for column in zip(*rows, strict=True))
    step_ms = None if packet.name in RECORDED else usual_step(times)
    missing, gaps = (0, []) if step_ms is None else find_gaps(times, step_ms)
    return Received(
        packet.name,
        len(rows),
        int(times[0]),
        int(times[-1]),
        int(np.count_nonzero(qualities == SUSPECT)),
        int(np.count_nonzero(statuses >= _ALARM)),
        None if step_ms is None else 1e-3 * step_ms,
        missing,
        gaps[:MOST_GAPS],
    )


def usual_step(times_ms: np.ndarray) -> float | None:
    """Usual time between rows [ms] that come regularly; None for others."""
    steps = np.diff(np.unique(times_ms))
    if steps.size < _LEAST - 1:
        return None
    usual = float(np.median(steps))
    near = np.abs(steps - usual) <= _PART * usual
    return usual if 2 * np.count_nonzero(near) > steps.size else None


def find_gaps(times_ms: np.ndarray, step_ms: float) -> tuple[int, list[tuple[int, int]]]:
    """How many rows are missing by their usual step, and between which (from, to)."""
    times = np.unique(times_ms)
    lacks = np.rint(np.diff(times) / step_ms).astype(int) - 1
    rows = np.flatnonzero(lacks > 0)
    gaps = [(int(times[row]), int(times[row + 1])) for row in rows]
    return int(lacks[rows].sum()), gaps


def _ground_span(
    db: sqlite3.Connection, packets: Sequence[str], start_ms: int, end_ms: int
) -> tuple[int, int]:
    """The pass by the ground's clock: where its rows were received, else as it is."""
    ends: list[int] = []
    for name in packets:
        found = db.execute(
            f"SELECT min(_received_ms), max(_received_ms) FROM {quoted(name)} "
            "WHERE _time_ms BETWEEN ? AND ?",
            (start_ms, end_ms),
        ).fetchone()
        ends += [each for each in found if each is not None]
    if not ends:
        return start_ms, end_ms
    return min(ends) - _AROUND_MS, max(ends) + _AROUND_MS


def _ends(db: sqlite3.Connection, packet: Packet, start_ms: int, end_ms: int) -> list[Ends]:
    """First and last row of a packet in an interval, number by number."""
    names = packet.names
    (first_ms,) = db.execute(
        f"SELECT min(_time_ms) FROM {quoted(packet.name)} WHERE _time_ms BETWEEN ? AND ?",
        (start_ms, end_ms),
    ).fetchone()
    (first,) = latest(db, packet.name, names, start_ms, first_ms)
    (last,) = latest(db, packet.name, names, start_ms, end_ms)
    return [
        Ends(packet.name, name, field.unit, _text(field, one), _text(field, other))
        for (name, field, _), one, other in zip(packet.numbers(), first[3:], last[3:], strict=True)
    ]


def _text(field: Field, value) -> str:
    """A value as people read it: labels by name, numbers with seven digits."""
    if value is None:
        return "unknown"
    if value in field.texts:
        return field.texts[value]
    if isinstance(value, str):
        return value if len(value) <= 32 else f"{value[:32]}..."
    return str(value) if isinstance(value, int) else f"{value:.7g}"
