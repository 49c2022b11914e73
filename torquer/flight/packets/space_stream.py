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
    is_telecommand,
    packet_size,
)

_LENGTH = struct.Struct(">H")
#: Bytes of the longest packet.
_LONGEST = PRIMARY_BYTES + 2**16


class SpaceStream(Rejections):
    """Frames from a stream of space packets, which may arrive in parts of any size.

    `lost_bytes`: how many belong to no packet; `rejected`: packets that the dictionary does not
    have ('unknown'), and those whose end is missing when a recording ends ('cut').

        frames = list(SpaceStream(dictionary).feed(data))
    """

    def __init__(self, dictionary: Dictionary):
        super().__init__()
        self._known = {
            packet.id: (packet, decoder(packet), _time_of(packet))
            for packet in dictionary.down.values()
        }
        self._header = re.compile(b"|".join(map(_pattern, dictionary.down.values())), re.DOTALL)
        self.lost_bytes = 0
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[Frame]:
        """The frames that are complete with these bytes."""
        self._buffer += data
        return self._frames()

    def finish(self) -> Iterator[Frame]:
        """The rest of a recording: no bytes can follow."""
        yield from self._frames()
        if self._header.match(self._buffer):
            self._reject(self._buffer, "cut")
            self.lost_bytes += len(self._buffer)
        else:
            self._pass_over(bytes(self._buffer))
        self._buffer.clear()

    def _frames(self) -> Iterator[Frame]:
        buffer = self._buffer
        while found := self._header.search(buffer):
            begin = found.start()
            size = packet_size(buffer[begin : begin + PRIMARY_BYTES])
            if begin:
                self._pass_over(bytes(buffer[:begin]))
                del buffer[:begin]
            if len(buffer) < size:
                return
            raw = bytes(buffer[:size])
            del buffer[:size]
            yield self._frame(raw)
        if len(buffer) > _LONGEST:  # a header may have begun at the end
            self._pass_over(bytes(buffer[: 1 - PRIMARY_BYTES]))
            del buffer[: 1 - PRIMARY_BYTES]

    def _frame(self, raw: bytes) -> Frame:
        packet, decode, time_s = self._known[_apid(raw)]
        values = decode(raw, PRIMARY_BYTES)
        return Frame(packet, time_s(values), INFO, values, raw)

    def _pass_over(self, data: bytes) -> None:
        """Count what no packet of the dictionary is in: whole packets of others, or lost bytes."""
        others, at = [], 0
        while at + PRIMARY_BYTES <= len(data) and not (data[at] >> 5 or is_telecommand(data[at:])):
            others.append(data[at : at + PRIMARY_BYTES])
            at += packet_size(others[-1])
        if at != len(data):
            self.lost_bytes += len(data)
            return
        for header in others:
            if not is_idle(header):
                self._reject(header, "unknown")

    def _reject(self, header: bytes | bytearray, reason: str) -> None:
        self.note_rejected(Rejected(reason, _apid(header), 0, INFO, packet_size(header)))


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
