"""Packets out of frames in any order: those that lie across frames are joined by the counters.

What is whole within a frame needs no other frame. Of the rest, a frame keeps the beginning of its
last packet (a tail) and the end of its first one (a head); the tail of counter n belongs to the
head of counter n + 1. Where a satellite has counted from 0 again, there may be several of each.
Then those belong together that came one after the other, else those whose times are next to each
other; and if that does not decide, none: a packet of two sessions is worse than none.
"""

from __future__ import annotations

import itertools
import struct
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from torquer.flight.packets.frames import FRAMESYNC
from torquer.flight.packets.protected import TM_NO_START, data_field, packets_in

#: How far the times of parts may lie apart where counters came twice [s].
_APART_S = 3600
_MARK = struct.pack("<I", FRAMESYNC)
_TIME = struct.Struct("<I")
#: Bytes of the headers of encapsulation packets.
_HEADERS = {0xFD: 2, 0xFE: 4}


class Part(NamedTuple):
    """A part of a packet at an edge of a frame.

    `number`: counter of the frame; `order`: when it came, for parts of the same import; `time_s`:
    time stamp of what is next to it, None if there is none; `ends`: of a head, whether the packet
    ends with it; `at`: place of the frame.
    """

    spi: int
    number: int
    data: bytes
    order: int
    time_s: int | None
    ends: bool
    at: int


class Missing(NamedTuple):
    """Counters of frames that are not there: lost, and passed over at so many reboots."""

    lost: int
    passed_over: int
    reboots: int


class PacketJoiner:
    """Packets of frames that come in any order.

    `foreign`: places of frames that hold something else than packets; `unclear`: of parts that
    could belong to several, unless they were joined in the end.
    """

    def __init__(
        self,
        tails: Iterable[Part] = (),
        heads: Iterable[Part] = (),
        apart_s: Callable[[bytes], float | None] = lambda packet: None,
    ):
        """`tails`, `heads`: parts that earlier recordings left.

        `apart_s`: how far times within a packet lie apart, where it has several.
        """
        self._apart_s = apart_s
        self._tails: dict[tuple[int, int], list[Part]] = defaultdict(list)
        self._heads: dict[tuple[int, int], list[Part]] = defaultdict(list)
        for part in tails:
            self._tails[part[:2]].append(part)
        for part in heads:
            self._heads[part[:2]].append(part)
        self._latest: Part | None = None
        self._order = itertools.count()
        self._numbers: dict[int, set[int]] = defaultdict(set)
        self._last = (0, 0)
        self._first_after_reboot: set[tuple[int, int]] = set()
        self._came_twice = False
        self.unclear: set[int] = set()
        self.foreign: list[int] = []

    def feed(self, frame: bytes, at: int) -> list[bytes]:
        """The packets that are whole within an authentic frame; its parts are kept."""
        spi, number, first, field = data_field(frame)
        order, numbers = next(self._order), self._numbers[spi]
        self._last = (spi, number)
        self._came_twice = self._came_twice or number in numbers
        numbers.add(number)
        begin = len(field) if first == TM_NO_START else min(first, len(field))
        rest = field[begin:]
        found, end = packets_in(rest)
        tail = rest[end:] if end >= 0 else b""
        if end < 0:
            self.foreign.append(at)
        first_s = last_s = _time(tail[_HEADERS.get(tail[0], 0) :]) if tail else None
        if found:
            first_s = _time(found[0])
            last_s = _time(found[-1]) if last_s is None else last_s
        if begin:
            ends = first != TM_NO_START
            head = Part(spi, number, field[:begin], order, first_s, ends, at)
            if joined := self._joined_at_once(head):
                found = [*joined, *found]
            else:
                _put(self._heads[spi, number], head)
        self._latest = Part(spi, number, tail, order, last_s, False, at) if tail else None
        if self._latest is not None:
            _put(self._tails[spi, number], self._latest)
        return found

    def _joined_at_once(self, head: Part) -> list[bytes]:
        """The packet that ends with a head, if it began in the frame just before it.

        Nothing if another part could belong there: recordings as they come need little memory so.
        """
        tail = self._latest
        before = (head.spi, head.number - 1)
        if tail is None or tail[:2] != before or self._heads.get(head[:2]):
            return []
        found = _packet(tail, head) if len(self._tails[before]) == 1 else []
        if found:
            del self._tails[before]
        return found or []

    def note_reboot(self) -> None:
        """Say that the satellite had just started when it sent the frame that was fed last."""
        self._first_after_reboot.add(self._last)

    def missing(self) -> Missing:
        """Which counters are missing between the first and the last one.

        Those before the first frame after a reboot are passed over: the satellite goes on from a
        counter that it keeps ahead of the frames sent.
        """
        lost, passed_over = 0, []
        for spi, numbers in self._numbers.items():
            for before, after in itertools.pairwise(sorted(numbers)):
                gap = after - before - 1
                if gap and (spi, after) in self._first_after_reboot:
                    passed_over.append(gap)
                else:
                    lost += gap
        return Missing(lost, sum(passed_over), len(passed_over))

    def join(self) -> Iterator[tuple[bytes, int]]:
        """(packet, place of the frame in which it begins) of those that lie across frames.

        What is joined is taken away; the rest waits, and may be kept for later recordings.
        """
        for spi, number in sorted(self._heads):
            heads, tails = self._heads[spi, number], self._tails.get((spi, number - 1))
            if not tails:
                continue
            for tail, head, found in self._pairs(tails, heads):
                tails.remove(tail)
                heads.remove(head)
                if not found:  # it goes on in the next frame
                    longer = head._replace(
                        data=tail.data + head.data, time_s=tail.time_s, at=tail.at
                    )
                    self._tails[spi, number].append(longer)
                for packet in found:
                    self._tell_time(head, _time(packet))
                    yield packet, tail.at

    def _tell_time(self, head: Part, time_s: int | None) -> None:
        """Give the time of a packet to the tail of the frame in which it ends, if that has none."""
        tails = self._tails.get(head[:2], [])
        for k, tail in enumerate(tails):
            if tail.time_s is None and tail.at == head.at:
                tails[k] = tail._replace(time_s=time_s)

    def left(self) -> tuple[list[Part], list[Part]]:
        """Tails and heads of which the other part is missing."""
        tails = [part for parts in self._tails.values() for part in parts]
        return tails, [part for parts in self._heads.values() for part in parts]

    def _pairs(self, tails: list[Part], heads: list[Part]) -> list[_Pair]:
        """The tails and heads that belong together."""
        fitting = [
            (rank, _Pair(tail, head, found))
            for tail in tails
            for head in heads
            if (found := _packet(tail, head)) is not None
            and (rank := self._rank(tail, head, found)) is not None
        ]
        if len(fitting) == 1:
            return [fitting[0][1]]
        ranked = itertools.groupby(sorted(fitting, key=_rank_of), key=_rank_of)
        together: list[_Pair] = []
        for _, same in ranked:
            taken = {id(part) for pair in together for part in pair[:2]}
            free = [pair for _, pair in same if taken.isdisjoint(map(id, pair[:2]))]
            together += self._decided(free)
        return together

    def _decided(self, free: list[_Pair]) -> Iterator[_Pair]:
        """Those pairs of one rank of which neither part has another partner."""
        times = Counter(id(part) for pair in free for part in pair[:2])
        for pair in free:
            if times[id(pair.tail)] == times[id(pair.head)] == 1:
                yield pair
            else:
                self.unclear |= {pair.tail.at, pair.head.at}

    def _rank(self, tail: Part, head: Part, found: list[bytes]) -> tuple[bool, float] | None:
        """The lower, the rather do they belong together; None: they do not, as far as is known."""
        is_next, apart_s = abs(head.order - tail.order) == 1, None
        if tail.time_s is not None and head.time_s is not None:
            apart_s = float(abs(head.time_s - tail.time_s))
        if is_next:
            return False, _APART_S if apart_s is None else apart_s
        if apart_s is None and found:
            apart_s = self._apart_s(found[0])
        if apart_s is None and self._came_twice:
            self.unclear |= {tail.at, head.at}
            return None
        may_differ = self._came_twice or min(tail.at, head.at) < 0  # of another import
        if may_differ and apart_s is not None and apart_s > _APART_S:
            return None
        return True, _APART_S if apart_s is None else apart_s


class _Pair(NamedTuple):
    """A tail and a head that fit, and the packet they make, if it ends with the head."""

    tail: Part
    head: Part
    found: list[bytes]


def _rank_of(fitting: tuple) -> tuple[bool, float]:
    return fitting[0]


def _put(parts: list[Part], part: Part) -> None:
    """Add a part, in place of the same one that an earlier recording had left."""
    if parts:
        parts[:] = [each for each in parts if each.data != part.data or each.at >= 0]
    parts.append(part)


def _packet(tail: Part, head: Part) -> list[bytes] | None:
    """The packet of a tail and a head, by the length that it states; None if they do not fit.

    Empty if it goes on after the head.
    """
    whole = tail.data + head.data
    found, end = packets_in(whole)
    if len(found) == 1 and end == len(whole):
        return found
    return [] if not head.ends and not found and end == 0 else None


def _time(packet: bytes) -> int | None:
    """Time stamp of a frame, None if it shows none."""
    if packet[:4] == _MARK and len(packet) >= 8:
        return _TIME.unpack_from(packet, 4)[0]
    return None
