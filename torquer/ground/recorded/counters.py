"""Space packets that are missing, by the counters of those that are there.

Each application process counts its packets up by one (CCSDS 133.0-B, 4.1.3.4.3), modulo 2^14. In
the order of on-board time, whatever the order of the recordings and however often a packet came, a
step of more than one is a gap. Where most steps are none of one, the counters count something else,
or the times are no order: nothing is told. Nor is a gap counted in so short a time that the counter
must have begun again, or in so long a one that it may have gone around.
"""

from __future__ import annotations

from array import array
from collections import defaultdict

import numpy as np

from torquer.flight.packets.space_packets import COUNTS, IDLE_APID

#: The share of steps of one from which counters are taken for such; least steps to judge by.
_MOST, _LEAST = 0.75, 4
#: Least time of a gap, as a share of the usual time in which so many packets come.
_FASTEST = 0.1


class SequenceCounters:
    """Counters and times of packets, by application process."""

    def __init__(self) -> None:
        self._found: dict[int, array] = defaultdict(lambda: array("q"))

    def add(self, raw: bytes, time_ms: int) -> None:
        """Note a packet. `time_ms`: its on-board time."""
        apid = (raw[0] << 8 | raw[1]) & IDLE_APID
        count = (raw[2] << 8 | raw[3]) % COUNTS
        self._found[apid].extend((time_ms, count))

    def lost(self) -> int:
        """How many packets are missing between those that are there."""
        return sum(map(_missing, self._found.values()))


def _missing(found: array) -> int:
    """How many counts are passed over in the order of time, where the time is one for so many."""
    apart_ms, steps = np.diff(_in_order(np.frombuffer(found, np.int64).reshape(-1, 2)), axis=0).T
    steps = steps % COUNTS
    follow = steps == 1
    if len(steps) < _LEAST or np.count_nonzero(follow) < _MOST * len(steps):
        return 0
    usual_ms = apart_ms[follow].mean()
    has_room = apart_ms >= _FASTEST * usual_ms * steps  # else they began again
    may_wrap = apart_ms > COUNTS * usual_ms
    return int((steps - 1)[(steps > 1) & has_room & ~may_wrap].sum())


def _in_order(rows: np.ndarray) -> np.ndarray:
    """(time, count) in their order, each packet once; at one time those after a wrap come last."""
    rows = np.unique(rows, axis=0)
    begins = np.flatnonzero(np.diff(rows[:, 0], prepend=rows[0, 0] - 1))
    sizes = np.diff(begins, append=len(rows))
    spans = np.maximum.reduceat(rows[:, 1], begins) - rows[begins, 1]
    is_after = np.repeat(spans > COUNTS // 2, sizes) & (rows[:, 1] < COUNTS // 2)
    return rows[np.lexsort((rows[:, 1] + COUNTS * is_after, rows[:, 0]))]
