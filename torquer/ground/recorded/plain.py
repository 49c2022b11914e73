"""Frames without protection in recordings, as `frames.Stream` finds them, many at a time.

A frame is clear if no sync mark stands within it and no frame before it could reach into it: of
these NumPy finds all at once. The stretches between them are left to a `Stream`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import FRAMESYNC, HEADER_BYTES, STATUS, Stream
from torquer.ground.archive import SUSPECT, UNCHECKED
from torquer.ground.recorded.authentic import Data
from torquer.ground.recorded.left_out import Tally

_MARK = FRAMESYNC.to_bytes(4, "little")
#: Bytes that are searched, or handed to a stream, at a time.
_PART = 2**20
_NONE = 2**62


class Found(NamedTuple):
    """A frame, its place, and how far it can be trusted."""

    at: int
    raw: bytes
    quality: int


class _Marks(NamedTuple):
    """Sync marks with whole headers: their places, where the frame ends that each begins (0: none
    does), and whether this frame is clear.
    """

    places: np.ndarray
    ends: np.ndarray
    clear: np.ndarray


class PlainFrames:
    """Frames without protection; `lost_bytes`: bytes that belong to none."""

    def __init__(self, dictionary: Dictionary, tally: Tally):
        self._dictionary, self._tally = dictionary, tally
        self._by_id = {packet.id: packet for packet in dictionary.down.values()}
        self._sizes = np.full(256, -1)
        for packet in self._by_id.values():
            self._sizes[packet.id] = packet.size
        self.lost_bytes = 0

    def read(self, data: Data) -> Iterator[Found]:
        """All frames of a recording, those that come twice as well."""
        places, ends, clear = self._marks(data)
        ready = np.flatnonzero(clear)
        k, done = 0, 0
        while k < len(places):
            if clear[k]:
                at, end = int(places[k]), int(ends[k])
                yield Found(at, data[at:end], SUSPECT if at > done else UNCHECKED)
                self.lost_bytes += at - done
                k, done = k + 1, end
                continue
            later = int(np.searchsorted(ready, k))
            last = int(ready[later]) if later < len(ready) else len(places)
            begin = int(places[k])
            stop = int(ends[last]) if last < len(places) else len(data)
            self.lost_bytes += begin - done
            yield from self._by_stream(data, begin, stop, begin > done)
            k, done = last + 1, stop
        self.lost_bytes += len(data) - done

    def _marks(self, data: Data) -> _Marks:
        all_bytes = np.frombuffer(data, np.uint8)
        places = find_marks(all_bytes, _MARK)
        whole = places[places + HEADER_BYTES <= len(all_bytes)]
        number, code = all_bytes[whole + 8], all_bytes[whole + 9]
        size = self._sizes[number]
        stated = all_bytes[whole + 14] | all_bytes[whole + 15].astype(np.int64) << 8
        valid = (size == stated) & (code <= max(STATUS))
        ends = np.where(valid, whole + HEADER_BYTES + stated, 0)
        following = np.append(places, _NONE)[1 : len(whole) + 1]
        reached = np.maximum.accumulate(np.concatenate([[0], ends]))[:-1]
        clear = valid & (ends <= np.minimum(following, len(all_bytes))) & (reached <= whole)
        # headers that are cut off by the end of the data close the last stretch
        more = places[len(whole) :]
        return _Marks(
            places,
            np.concatenate([ends, np.zeros(len(more), int)]),
            np.concatenate([clear, np.zeros(len(more), bool)]),
        )

    def _by_stream(self, data: Data, begin: int, stop: int, is_suspect: bool) -> Iterator[Found]:
        """Frames of a stretch, one by one."""
        stream, lost = Stream(self._dictionary, "down"), -is_suspect
        for at in [*range(begin, stop, _PART), None]:
            piece = b"" if at is None else data[at : min(at + _PART, stop)]
            frames = stream.finish() if at is None else stream.feed(piece)
            for frame in frames:
                before, lost = lost, stream.lost_bytes + sum(stream.rejected.values())
                quality = UNCHECKED if lost == before else SUSPECT
                yield Found(begin, frame.raw, quality)
        self.lost_bytes += stream.lost_bytes
        for reason, count in stream.rejected.items():
            at, example = self._first(data, begin, stop, reason)
            self._tally.add(reason, at, example, count)

    def _first(self, data: Data, begin: int, stop: int, reason: str) -> tuple[int, str]:
        """The first header of a stretch with a fault, and what was found and looked for."""
        at = begin
        while 0 <= at < stop - HEADER_BYTES:
            number, code, stated = data[at + 8], data[at + 9], data[at + 14] | data[at + 15] << 8
            if text := self._fault(reason, number, code, stated):
                return at, text
            at = data.find(_MARK, at + 1)
        return begin, ""

    def _fault(self, reason: str, number: int, code: int, stated: int) -> str:
        packet = self._by_id.get(number)
        if packet is None:
            known = ", ".join(map(str, sorted(self._by_id)))
            return f"id {number}, must be one of {known}" if reason == "unknown" else ""
        if reason == "length" and stated != packet.size:
            swapped = int.from_bytes(stated.to_bytes(2, "big"), "little") == packet.size
            end = ", its two bytes are swapped" if swapped else ""
            return f"{stated} bytes of {packet.name}, must be {packet.size}{end}"
        if reason == "status" and code not in STATUS:
            return f"status {code} of {packet.name}, must be 0 to {max(STATUS)}"
        return ""


def find_marks(all_bytes: np.ndarray, mark: bytes) -> np.ndarray:
    """Places of a mark in an array of bytes."""
    found = []
    for first in range(0, max(len(all_bytes) - len(mark) + 1, 0), _PART):
        part = all_bytes[first : first + _PART + len(mark) - 1]
        places = np.flatnonzero(part[: len(part) - len(mark) + 1] == mark[0])
        for k, byte in enumerate(mark[1:], 1):
            places = places[part[places + k] == byte]
        found.append(places + first)
    return np.concatenate(found) if found else np.zeros(0, int)
