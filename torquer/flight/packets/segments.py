"""Frames in segments for a CAN bus with 29-bit identifiers, and back.

A segment is what one CAN frame carries, at most eight bytes. Its identifier has the meaning: bit 16
the direction (0: uplink, which therefore wins the arbitration), bits 8 to 15 the id of the packet,
bits 0 to 7 the number of the segment. Segment 0 holds time stamp u32, status or module u8, a
counter of the packet's frames u8 and a CRC-16 u16 of all this and the data; the others hold the
data in order. No number crosses from one segment into the next, so that each has a layout of its
own, which a DBC file states (`dbc`).

Anything else, protected frames and numbered commands above all, goes as a stream of bytes under the
id 0, which no packet has; there the number of the segment counts on. So do packets whose numbers
would cross from one segment into the next, or that an identifier has no room for. A numbered
command has no checksum: it begins with a segment of its own, and the receiver hands it on whole or,
where one of its segments is missing, not at all. The identifiers of a direction are one node's: CAN
knows no two senders of one identifier.
"""

import struct
from binascii import crc_hqx
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import NamedTuple

from torquer.flight.packets.dictionary import Dictionary, Packet
from torquer.flight.packets.frames import FRAMESYNC, HEADER, HEADER_BYTES, Direction

#: Greatest id of a packet, and greatest number of a segment, in an identifier.
MOST_ID = 255
#: Bytes of a CAN frame's data.
SEGMENT_BYTES = 8
_DIRECTIONS = {"up": 0, "down": 1}
#: With what a frame begins.
_MARK = struct.pack("<I", FRAMESYNC)
#: time_stamp, status or module, counter, checksum
_FIRST = struct.Struct("<IBBH")
_CHECKED = struct.Struct("<IBB")


class Segment(NamedTuple):
    """Identifier (29 bits) and data of a CAN frame."""

    can_id: int
    data: bytes


def can_id(direction: Direction, packet_id: int, number: int) -> int:
    """Identifier of a segment."""
    return _DIRECTIONS[direction] << 16 | packet_id << 8 | number


def places(packet: Packet) -> tuple[slice, ...]:
    """Which bytes of the data the segments 1, 2, ... hold."""
    found: list[slice] = []
    start = cut = 0
    for place in packet.places:
        if place.bit % 8 == 0:
            cut = place.bit // 8
            start = _fill(found, start, cut)  # with padding
        if place.field.type == "bytes":
            start = _fill(found, start, place.end)
        if place.end - start > SEGMENT_BYTES:
            found.append(slice(start, cut))
            start = cut
        if not start < place.end <= start + SEGMENT_BYTES:
            raise ValueError(
                f"{packet.name}: must have numbers that begin at whole bytes, at least one in "
                f"{SEGMENT_BYTES}, for segments on a CAN bus; received {place.name} after others"
            )
    start = _fill(found, start, packet.size)
    return (*found, slice(start, packet.size))


def checked_places(packet: Packet) -> tuple[slice, ...]:
    """As `places`; ValueError with one line for a packet that an identifier has no room for."""
    if not 0 < packet.id <= MOST_ID:
        raise ValueError(f"{packet.name}: must have an id from 1 to {MOST_ID}, as identifiers of "
                         f"segments have one byte for it; received {packet.id}")  # fmt: skip
    found = places(packet)
    if len(found) > MOST_ID:
        raise ValueError(f"{packet.name}: must have at most {MOST_ID} segments; received "
                         f"{len(found)}")  # fmt: skip
    return found


def _fill(found: list[slice], start: int, end: int) -> int:
    """Where the rest begins once whole segments hold the bytes from start to end."""
    while end - start > SEGMENT_BYTES:
        found.append(slice(start, start + SEGMENT_BYTES))
        start += SEGMENT_BYTES
    return start


def _checksum(time_s: int, code: int, counter: int, data: bytes) -> int:
    return crc_hqx(data, crc_hqx(_CHECKED.pack(time_s, code, counter), 0xFFFF))


def find_direction(identifier: int) -> Direction:
    """Direction of a segment by its identifier."""
    return "down" if identifier >> 16 & 1 else "up"


class Splitter:
    """Segments of frames, or of any bytes."""

    def __init__(self, dictionary: Dictionary, direction: Direction):
        self._places = _by_id(dictionary, direction)
        self._direction: Direction = direction
        self._counters: dict[int, int] = {}

    def frame(self, frame: bytes) -> Iterator[Segment]:
        """The segments of a historical frame."""
        _, time_s, number, code, _, _ = HEADER.unpack_from(frame)
        data, counter = frame[HEADER_BYTES:], self._counters.get(number, 0)
        self._counters[number] = counter + 1 & 0xFF
        check = _checksum(time_s, code, counter, data)
        first = _FIRST.pack(time_s, code, counter, check)
        parts = (data[place] for place in self._places[number])
        return (
            Segment(can_id(self._direction, number, i), part)
            for i, part in enumerate((first, *parts))
        )

    def split(self, data: bytes) -> Iterator[Segment]:
        """The segments of what is sent at once: of frames, and of a stream where none begins."""
        while 0 < (size := _frame_size(data, self._places)) <= len(data):
            frame, data = data[:size], data[size:]
            yield from self.stream(frame) if _is_numbered(frame) else self.frame(frame)
        yield from self.stream(data)

    def stream(self, data: bytes) -> Iterator[Segment]:
        """The segments of any bytes."""
        counter = self._counters.get(0, 0)
        starts = range(0, len(data), SEGMENT_BYTES)
        self._counters[0] = counter + len(starts) & 0xFF
        return (
            Segment(can_id(self._direction, 0, counter + i & 0xFF), data[at : at + SEGMENT_BYTES])
            for i, at in enumerate(starts)
        )


class Joiner:
    """Frames, or a stream of bytes, from segments; packets may be interleaved.

    `lost_frames`: frames that never became complete, by their counters, and numbered commands of
    which a part is missing; `lost_segments`: those
    missing in a stream of bytes; both up to 255 in a row. `rejected`: segments by reason: 'unknown'
    (id), 'length', 'order' (the one before it is missing), 'checksum', 'repeated'.
    """

    def __init__(self, dictionary: Dictionary, direction: Direction):
        self._places = _by_id(dictionary, direction)
        self._direction: Direction = direction
        self.lost_frames = self.lost_segments = 0
        self.rejected: Counter[str] = Counter()
        #: By packet: segments so far of a frame that is not complete; counter of the latest one.
        self._parts: dict[int, list[bytes]] = {}
        self._latest: dict[int, int] = {}
        #: Data of the latest segment of a stream; a numbered command in it that is not complete.
        self._latest_data = b""
        self._held = b""

    def feed(self, identifier: int, data: bytes) -> bytes:
        """The frame that is complete with this segment; b"" if none is.

        Of a stream of bytes: these bytes.
        """
        number, packet_id = identifier & 0xFF, identifier >> 8 & 0xFF
        if packet_id == 0 and identifier == can_id(self._direction, 0, number):
            return self._of_stream(number, data)
        layout = self._places.get(packet_id, ())
        is_known = identifier == can_id(self._direction, packet_id, number) and layout
        if not is_known or number > len(layout):
            return self._reject("unknown")
        place = layout[number - 1] if number else slice(0, SEGMENT_BYTES)
        if len(data) != place.stop - place.start:
            return self._reject("length")
        parts = self._parts.setdefault(packet_id, [])
        if number and number == len(parts) - 1 and parts[-1] == data:
            return self._reject("repeated")
        if number == 0 or number != len(parts):
            parts.clear()
        if number and not parts:
            return self._reject("order")
        parts.append(bytes(data))
        return self._joined(packet_id) if len(parts) == 1 + len(layout) else b""

    def _joined(self, packet_id: int) -> bytes:
        """The frame of all segments, if they belong together."""
        first, *rest = self._parts.pop(packet_id)
        time_s, code, counter, check = _FIRST.unpack(first)
        data = b"".join(rest)
        if check != _checksum(time_s, code, counter, data):
            return self._reject("checksum")
        if self._latest.get(packet_id) == counter:
            return self._reject("repeated")
        self.lost_frames += counter - self._latest.get(packet_id, counter - 1) - 1 & 0xFF
        self._latest[packet_id] = counter
        return HEADER.pack(FRAMESYNC, time_s, packet_id, code, 0, len(data)) + data

    def _of_stream(self, number: int, data: bytes) -> bytes:
        if self._latest.get(0) == number and self._latest_data == data:
            return self._reject("repeated")
        self._latest_data = bytes(data)
        missing = number - self._latest.get(0, number - 1) - 1 & 0xFF
        self.lost_segments += missing
        self._latest[0] = number
        if missing and self._held:
            self.lost_frames, self._held = self.lost_frames + 1, b""
        return self._whole(bytes(data))

    def _whole(self, data: bytes) -> bytes:
        """The next bytes of a stream; those of a numbered command once all are there."""
        begins = not self._held and len(data) == SEGMENT_BYTES and data.startswith(_MARK)
        if not self._held and not begins:
            return data
        found = self._held + data
        is_whole = len(found) >= HEADER_BYTES
        if is_whole and _is_numbered(found):
            is_whole = len(found) >= _frame_size(found, self._places)
        self._held = b"" if is_whole else found
        return found if is_whole else b""

    def _reject(self, reason: str) -> bytes:
        self.rejected[reason] += 1
        return b""


def _frame_size(data: bytes, known: Mapping[int, tuple[slice, ...]]) -> int:
    """Bytes of the historical frame whose header is at the beginning, 0 if there is none."""
    if len(data) < HEADER_BYTES:
        return 0
    mark, _, number, _, _, length = HEADER.unpack_from(data)
    layout = known.get(number)
    is_frame = mark == FRAMESYNC and layout and layout[-1].stop == length
    return HEADER_BYTES + length if is_frame else 0


def _is_numbered(frame: bytes) -> bool:
    """Whether a historical frame has what segments of its own have no room for."""
    return HEADER.unpack_from(frame)[4] != 0


def _by_id(dictionary: Dictionary, direction: Direction) -> dict[int, tuple[slice, ...]]:
    """Places of the segments of every packet that can be sent in segments."""
    packets, found = dictionary.down if direction == "down" else dictionary.up, {}
    for packet in packets.values():
        with suppress(ValueError):
            found[packet.id] = checked_places(packet)
    return found
