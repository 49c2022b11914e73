"""Packets that are missing by their counters: gaps are told, what is none is not."""

import random
import struct

import pytest

from torquer.ground.recorded.counters import SequenceCounters


def lost(packets):
    """Of (time [s], counter) or (time, counter, APID)."""
    counters = SequenceCounters()
    for time_s, count, *apid in packets:
        header = struct.pack(">HHH", *(apid or [1025]), 0xC000 | count % 2**14, 0)
        counters.add(header, 1000 * time_s)
    return counters.lost()


WHOLE = [(7 + k, 16300 + k) for k in range(200)]  # goes around
GAP = WHOLE[:50] + WHOLE[80:]


@pytest.mark.parametrize(
    ("packets", "expected"),
    [
        (WHOLE, 0),
        (GAP, 30),
        (GAP[::-1], 30),
        (random.Random(1).sample(GAP, len(GAP)), 30),
        (GAP + GAP, 30),
        (GAP + WHOLE[45:85], 0),
        (WHOLE[:80] + WHOLE[90:], 10),  # the gap across the end of the counter
        ([*GAP, *((t, c, 5) for t, c in WHOLE[:20] + WHOLE[22:])], 32),
        ([(t // 9, c) for t, c in WHOLE], 0),  # several at one time, around the end as well
        ([(t, 0) for t, _ in WHOLE], 0),
        ([(t, 3 * c) for t, c in WHOLE], 0),
        (WHOLE[:100] + [(t, c + 5000) for t, c in WHOLE[100:]], 0),  # began again
        ([(t, c + 16379 * (t > 99)) for t, c in WHOLE], 0),
        ([*WHOLE, (10**9, 7000)], 0),  # a clock that was wrong
        ([(1, 1), (2, 5)], 0),
        ([], 0),
    ],
)
def test_gaps_are_counted_where_counters_go_up_by_one(packets, expected):
    assert lost(packets) == expected
