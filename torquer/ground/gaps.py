"""Gaps of the telemetry that is archived, and the orders that have a satellite send what it stored.

A packet that comes in a period lacks rows where two are farther apart than is usual about them. It
may lack some after a reboot as well: the clock has gone on from where it was kept, so that rows of
both flights lie side by side and none are far apart.

The satellite keeps a record of its main packet; replayed, it comes as a packet of its own, each row
once whatever is asked for twice.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from torquer.base.dates import iso_ms, iso_s
from torquer.base.limits import RequestError
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import CLOCK_SAVED_S
from torquer.ground.archive import EPOCH_MS, RECORDED, ArchiveError
from torquer.ground.bins import usual_steps

#: The command by which the satellite sends its record, its fields, and the packet in which it does.
REPLAY, _FIELDS, STORED = "replay", ("from_s", "to_s", "every"), "stored"
#: The packet of which the record is.
MAIN = "extended"
#: Rows are missing where the next one comes later than so many usual times between two.
_GAP = 1.5
#: Last second that a satellite counts from its epoch.
_LAST_S = 2**32 - 1
#: Share of steps that must be close to the usual one, and how close, in a packet with a period.
_REGULAR, _CLOSE = 0.5, 0.2
#: Fewest rows of which a period is told, and rows that are looked at at a time.
_FEWEST, _PART = 10, 100_000
#: How far a reboot sets the clock back at most [ms].
_KEPT_MS = round(1000 * CLOCK_SAVED_S)
#: Most gaps that are listed, the latest; time before the last row that is looked at [ms].
MOST, SPAN_MS = 200, 7 * 86_400_000


class Gap(NamedTuple):
    """Rows that are missing between two; times are on-board, in ms since 1970.

    `stored`: rows of the satellite's record in between that have come since. `went_back`: the
    clock went back before the row at the end, as at a reboot or when it is set; `missing`: the most
    rows that may have been made from there on.
    """

    packet: str
    start_ms: int
    end_ms: int
    every_ms: int
    missing: int
    stored: int
    went_back: bool = False


def find_gaps(
    db: sqlite3.Connection,
    dictionary: Dictionary,
    packets: Iterable[str] | None = None,
    start_ms: int | None = None,
    end_ms: int | None = None,
) -> list[Gap]:
    """The latest gaps of packets with a period, by time: of all, within a week before their end.

    ArchiveError for an archive that cannot be read.
    """
    wanted = [*dictionary.down] if packets is None else [*packets]
    found: list[Gap] = []
    try:
        for packet in wanted:
            if packets is not None or packet not in RECORDED:
                found += _of_packet(db, packet, start_ms, end_ms)
        found = sorted(found, key=lambda gap: (gap.start_ms, gap.packet))[-MOST:]
        if STORED not in dictionary.down:
            return found
        return [gap._replace(stored=_count_stored(db, gap)) for gap in found]
    except sqlite3.Error as error:
        line = " ".join(str(error).split())
        raise ArchiveError(f"archive: must be readable; received {line}") from None


def _of_packet(
    db: sqlite3.Connection, packet: str, start_ms: int | None, end_ms: int | None
) -> list[Gap]:
    end_ms = 2**62 if end_ms is None else end_ms
    if start_ms is None:
        last = f'SELECT max(_time_ms) FROM "{packet}" WHERE _time_ms <= ?'
        ((last_ms,),) = db.execute(last, (end_ms,))
        start_ms = end_ms if last_ms is None else last_ms - SPAN_MS
    found: list[Gap] = []
    for at, received in _times(db, packet, start_ms, end_ms):
        steps = np.diff(at)
        usual = usual_steps(steps)
        if len(at) < _FEWEST or np.mean(np.abs(steps - usual) < _CLOSE * usual) < _REGULAR:
            continue
        for k in np.flatnonzero(steps > _GAP * usual).tolist():
            every_ms, step = int(usual[k]), int(steps[k])
            missing = round(step / every_ms) - 1
            found.append(Gap(packet, int(at[k]), int(at[k + 1]), every_ms, missing, 0))
        found += _reboots(packet, at[received >= 0], received[received >= 0])
        found = sorted(found, key=lambda gap: gap.start_ms)[-MOST:]
    return found


def _reboots(packet: str, at: np.ndarray, received: np.ndarray) -> Iterator[Gap]:
    """Where the clock goes back, in the order of reception, and on in steps as usual.

    Rows that a link has handed over late do not go on so: rows before theirs have come already.
    """
    at = at[np.argsort(received, kind="stable")]
    steps = np.diff(at)
    usual = usual_steps(steps)[1:]
    goes_on = np.abs(steps[1:] - usual) < _CLOSE * usual
    for k in np.flatnonzero((steps[:-1] < 0) & goes_on).tolist():
        start_ms, end_ms, every_ms = int(at[k]) - _KEPT_MS, int(at[k + 1]), int(usual[k])
        if start_ms < end_ms:
            most = -((start_ms - end_ms) // every_ms)
            yield Gap(packet, start_ms, end_ms, every_ms, most, 0, went_back=True)


def _times(
    db: sqlite3.Connection, packet: str, start_ms: int, end_ms: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Times of rows and of their reception, -1: unknown [ms], some at a time, by time.

    Each part begins with the last row of the part before.
    """
    rows = db.execute(
        f'SELECT _time_ms, coalesce(min(_received_ms), -1) FROM "{packet}" '
        "WHERE _time_ms BETWEEN ? AND ? GROUP BY _time_ms ORDER BY _time_ms",
        (start_ms, end_ms),
    )
    before: list[tuple[int, int]] = []
    while part := rows.fetchmany(_PART):
        at, received = np.array(before + part, np.int64).T
        yield at, received
        before = part[-1:]


def _count_stored(db: sqlite3.Connection, gap: Gap) -> int:
    between = f"SELECT count(*) FROM {STORED} WHERE _time_ms > ? AND _time_ms < ?"
    ((count,),) = db.execute(between, (gap.start_ms, gap.end_ms))
    return count


def can_fill(dictionary: Dictionary) -> bool:
    """Whether the satellite has a record, and a command that has it sent."""
    command = dictionary.up.get(REPLAY)
    return command is not None and set(_FIELDS) <= set(command.names) and STORED in dictionary.down


def is_on_board(start_ms: int, end_ms: int) -> bool:
    """Whether the satellite's count of seconds has an interval of on-board time, or some of it."""
    return end_ms > EPOCH_MS and start_ms < EPOCH_MS + 1000 * _LAST_S


def fill(start_ms: int, end_ms: int) -> Sent:
    """The order to send what is stored of an interval of on-board time, and of the minute before.

    A satellite that has rebooted within it goes on from a time before it. RequestError for an
    interval in which the satellite counts no seconds, so that none is of it.
    """
    if not is_on_board(start_ms, end_ms):
        text = f"{iso_ms(start_ms)} to {iso_ms(end_ms)}"
        first, last = iso_s(EPOCH_MS), iso_s(EPOCH_MS + 1000 * _LAST_S)
        raise RequestError("gap", f"must be within {first} to {last}; received {text}")
    seconds = (start_ms - _KEPT_MS - EPOCH_MS) // 1000, -((EPOCH_MS - end_ms) // 1000)
    from_s, to_s = (min(max(each, 0), _LAST_S) for each in seconds)
    values = {"from_s": from_s, "to_s": to_s, "every": 1}
    return Sent(at_s=0.0, command=REPLAY, values=values)
