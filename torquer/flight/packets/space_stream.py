"""Space packets of any satellite (CCSDS 133.0-B) from a stream of bytes: telemetry, one by one.

The packets follow each other directly; whatever is around them on the way down (transfer frames,
codes) is taken off before. They have no mark to begin with, and need not have a checksum: a packet
is found by a header that a packet of the dictionary has, which is right by chance once in some 2^29
places. What lies before it is passed over: packets that the dictionary does not have, idle ones,
and bytes that are lost.
"""

import math
import re
import struct
from collections.abc import Iterator
from functools import partial

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.dictionary import Dictionary, Packet
from torquer.flight.packets.frames import INFO, Frame, Rejected, Rejections
from torquer.flight.packets.space_packets import (
    IDLE_APID,
    PRIMARY_BYTES,
    is_idle,
    packet_size,
)

_LENGTH = struct.Struct(">H")
#: Bytes of the longest packet.
_LONGEST = PRIMARY_BYTES + 2**16

#: Sequence flags of a packet that is no segment; how many APIDs are listed at most.
_WHOLE, _LISTED = 3, 10


class SpaceStream(Rejections):
    """Frames from a stream of space packets, which may arrive in parts of any size.

    `lost_bytes`: how many belong to no packet; `rejected`: packets that the dictionary does not
    have ('unknown'), has with another length ('length') or in one piece ('segmented'), and those
    whose end is missing when a recording ends ('cut'). `first`: the place of the first one of each
    reason in a recording, and what was found and looked for.

        frames = list(SpaceStream(dictionary).feed(data))
    """

    def __init__(self, dictionary: Dictionary):
        super().__init__()
        self._known = {
            packet.id: (packet, decoder(packet), _time_of(packet))
            for packet in dictionary.down.values()
        }
        self._header = re.compile(b"|".join(map(_pattern, dictionary.down.values())), re.DOTALL)
        numbers = [str(number) for number in sorted(self._known)]
        self._listed = ", ".join([*numbers[:_LISTED], *["..."] * (len(numbers) > _LISTED)])
        self.lost_bytes = self._place = 0
        self.first: dict[str, tuple[int, str]] = {}
        self._buffer = bytearray()

    def begin_recording(self) -> None:
        """Let places count from here on."""
        self._place = 0
        self.first.clear()

    def feed(self, data: bytes) -> Iterator[Frame]:
        """The frames that are complete with these bytes."""
        self._buffer += data
        return self._frames()

    def finish(self) -> Iterator[Frame]:
        """The rest of a recording: no bytes can follow."""
        yield from self._frames()
        if self._header.match(self._buffer):
            size = packet_size(self._buffer)
            self._reject(self._buffer, "cut", 0, f"{len(self._buffer)} bytes, must be {size}")
            self.lost_bytes += len(self._buffer)
        else:
            self._pass_over(bytes(self._buffer))
        self._drop(len(self._buffer))

    def _frames(self) -> Iterator[Frame]:
        buffer = self._buffer
        while found := self._header.search(buffer):
            begin = found.start()
            size = packet_size(buffer[begin : begin + PRIMARY_BYTES])
            if begin:
                self._pass_over(bytes(buffer[:begin]))
                self._drop(begin)
            if len(buffer) < size:
                return
            raw = bytes(buffer[:size])
            self._drop(size)
            yield self._frame(raw)
        if len(buffer) > _LONGEST:  # a header may have begun at the end
            self._drop(self._pass_over(bytes(buffer[: 1 - PRIMARY_BYTES]), goes_on=True))

    def _drop(self, size: int) -> None:
        """Forget the beginning of what waits."""
        del self._buffer[:size]
        self._place += size

    def _frame(self, raw: bytes) -> Frame:
        packet, decode, time_s = self._known[_apid(raw)]
        values = decode(raw, PRIMARY_BYTES)
        return Frame(packet, time_s(values), INFO, values, raw)

    def _pass_over(self, data: bytes, goes_on: bool = False) -> int:
        """Count what no packet of the dictionary is in: whole packets of others, or lost bytes.

        `goes_on`: the last packet may end later. How many bytes were counted.
        """
        others, at = [], 0
        while at + PRIMARY_BYTES <= len(data) and data[at] >> 4 == 0:  # telemetry of version 0
            header = data[at : at + PRIMARY_BYTES]
            size = packet_size(header)
            if goes_on and at + size > len(data):
                break
            others.append((at, header))
            at += size
        is_chain = goes_on and at and (at + PRIMARY_BYTES > len(data) or data[at] >> 4 == 0)
        if at != len(data) and not is_chain:
            self.lost_bytes += len(data)
            return len(data)
        for place, header in others:
            if not is_idle(header):
                self._reject(header, *self._why(header, place))
        return at

    def _why(self, header: bytes, place: int) -> tuple[str, int, str]:
        """Why a packet is none of the dictionary: (reason, place, example)."""
        apid = _apid(header)
        if apid not in self._known:
            return "unknown", place, f"APID {apid}, must be one of {self._listed}"
        packet, *_ = self._known[apid]
        if header[2] >> 6 != _WHOLE:
            return (
                "segmented",
                place,
                f"sequence flags {header[2] >> 6} of {packet.name}, must be 3",
            )
        stated, size = packet_size(header), PRIMARY_BYTES + packet.size
        return "length", place, f"{stated} bytes of {packet.name}, must be {size}"

    def _reject(self, header: bytes | bytearray, reason: str, place: int, example: str) -> None:
        self.note_rejected(Rejected(reason, _apid(header), 0, INFO, packet_size(header)))
        self.first.setdefault(reason, (self._place + place, example))


def _apid(header: bytes | bytearray) -> int:
    return (header[0] << 8 | header[1]) & IDLE_APID


def _pattern(packet: Packet) -> bytes:
    """The primary header of a packet: with a secondary header or without, not segmented."""
    first, second = packet.id >> 8, packet.id & 0xFF
    ends = re.escape(bytes([second])), re.escape(_LENGTH.pack(packet.size - 1))
    flags = re.escape(bytes([first])), re.escape(bytes([first | 8]))
    return b"(?:%b|%b)%b[\xc0-\xff].%b" % (*flags, *ends)


def _time_of(packet: Packet):
    """The function from values to the whole second of their time [s since 2010-01-01]."""
    return partial(_second, packet.names.index(packet.time_ms)) if packet.time_ms else lambda _: 0


def _second(place: int, values: tuple) -> int:
    """0 for what is no time."""
    time_ms = values[place]
    return math.floor(time_ms / 1e3) if abs(time_ms) < 2.0**53 else 0
