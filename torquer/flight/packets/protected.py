"""Protected frames: CCSDS TC and TM transfer frames around data of any kind, with MAC and counter.

Commands go up in TC frames (CCSDS 232.0-B) of type BD, which no retransmission procedure watches
over: their frame sequence number is 0, and there is one virtual channel. A frame follows its start
mark directly, without the block code of CCSDS 231.0-B. Telemetry comes down in TM frames (CCSDS
132.0-B) of one length after a sync mark, without the codes of CCSDS 131.0-B; the data travel in
encapsulation packets (CCSDS 133.1-B), so that they need no structure of their own to be found.
Space packets (CCSDS 133.0-B) have one, and travel as they are.
`torquer.flight.packets.security` has what the two directions have in common.
"""

import struct
from collections.abc import Mapping

from torquer.flight.packets.security import (
    OVERHEAD,
    SECURITY,
    TRAILER,
    Receiver,
    check_link,
    close_frame,
    next_number,
)
from torquer.flight.packets.space_packets import PRIMARY_BYTES, packet_size

#: Start mark, then the header of a TC frame (flags and spacecraft, channel and length, sequence
#: number) with the security header.
_TC = struct.Struct(">HHBHI")
_TC_MARK = b"\xeb\x90"
_TC_HEADER = 5
_TC_LONGEST = 1024
#: Flags of a TC frame: version 0, bypass of the acceptance check, data.
_TC_BYPASS = 0x2000
#: Greatest size of the data of a command.
COMMAND_BYTES = _TC_LONGEST - _TC_HEADER - OVERHEAD

#: Header of a TM frame (version and spacecraft, two counts, status of the data) with the security
#: header.
_TM = struct.Struct(">HBBHHI")
_TM_MARK = b"\x1a\xcf\xfc\x1d"
_TM_HEADER = 6
#: Status of the data: packets, in order; with the place of the first packet, or that none begins.
_TM_PACKETS, TM_NO_START = 0x1800, 0x7FF
#: Encapsulation packets: of one byte without content; for private use with a length (header
#: included) of one byte, and of two.
_IDLE, _SHORT, _LONG = b"\xe0", 0xFD, 0xFE
_SHORT_HEADER, _LONG_HEADER = struct.Struct(">BB"), struct.Struct(">BBH")
#: Bits of the first byte of a packet that state its version: 0 is that of space packets.
_VERSION = 0xE0
#: Greatest size of the data of one telemetry packet.
TELEMETRY_BYTES = 65535 - _LONG_HEADER.size


class CommandSender:
    """Makes TC frames. `counter`: that of the last frame, to be kept as long as the key."""

    def __init__(self, key: bytes, spi: int, spacecraft: int, counter: int = 0):
        """Key of 32 bytes; SPI from 1 to 65534; spacecraft id from 0 to 1023."""
        check_link({spi: key}, spacecraft)
        self.key, self.spi, self.spacecraft, self.counter = key, spi, spacecraft, counter

    def wrap(self, data: bytes) -> bytes:
        """Start mark and frame of at most 995 bytes of data; ValueError for more."""
        if len(data) > COMMAND_BYTES:
            raise ValueError(f"data: at most {COMMAND_BYTES} bytes; received {len(data)}")
        self.counter = next_number(self.counter)
        length = _TC_HEADER + OVERHEAD + len(data) - 1
        head = _TC.pack(_TC_BYPASS | self.spacecraft, length, 0, self.spi, self.counter)
        return _TC_MARK + close_frame(self.key, head + data)


class CommandReceiver(Receiver):
    """Accepts TC frames of this spacecraft, by the keys of its SPIs."""

    mark, header = _TC_MARK, _TC_HEADER

    def __init__(
        self,
        keys: Mapping[int, bytes],
        spacecraft: int,
        window: int = 64,
        counters: Mapping[int, int] | None = None,
    ):
        """`window`: how far a counter may leap, that is, how many frames in a row may be lost."""
        check_link(keys, spacecraft)
        super().__init__(keys, _TC_BYPASS | spacecraft, window, counters)

    def contents(self, frames: list[bytes]) -> list[bytes]:
        return [frame[_TC.size : -TRAILER] for frame in frames]

    def size_at(self, at: int) -> int:
        if len(self._buffer) < at + _TC_HEADER:
            return 0
        size = ((self._buffer[at + 2] & 3) << 8 | self._buffer[at + 3]) + 1
        return size if size >= _TC_HEADER + OVERHEAD else -1


class TelemetrySender:
    """Makes TM frames. `counter`: that of the last frame, to be kept as long as the key.

    No number may be used twice, but numbers may be left out: it is enough to keep, now and then,
    one that lies ahead, and to go on from it after a reboot.
    """

    def __init__(
        self, key: bytes, spi: int, spacecraft: int, counter: int = 0, frame_bytes: int = 256
    ):
        """As `CommandSender`; `frame_bytes`: of each frame without its mark, 64 to 2048."""
        check_link({spi: key}, spacecraft)
        self.key, self.spi, self.spacecraft, self.counter = key, spi, spacecraft, counter
        self.room = room_in(frame_bytes)
        self._field = bytearray()
        self._first = TM_NO_START

    def wrap(self, data: bytes) -> bytes:
        """Marks and frames that the data fill, b"" if none; ValueError for over 65531 bytes.

        The rest waits for more data, or for `flush`.
        """
        size = len(data)
        if size > TELEMETRY_BYTES:
            raise ValueError(f"data: at most {TELEMETRY_BYTES} bytes; received {size}")
        whole = encapsulated_bytes(size)
        if whole - size == _SHORT_HEADER.size:
            return self._put(_SHORT_HEADER.pack(_SHORT, whole) + data)
        return self._put(_LONG_HEADER.pack(_LONG, 0, whole) + data)

    def wrap_packet(self, packet: bytes) -> bytes:
        """As `wrap`, of a space packet; ValueError for what does not have the length it states."""
        is_whole = len(packet) >= PRIMARY_BYTES and len(packet) == packet_size(packet)
        if not is_whole or packet[0] & _VERSION:
            raise ValueError(f"packet: must be a space packet; received {packet[:8].hex()}...")
        return self._put(packet)

    def _put(self, packet: bytes) -> bytes:
        """Marks and frames that are full with a packet."""
        if self._first == TM_NO_START:
            self._first = len(self._field)
        self._field += packet
        made = b""
        while len(self._field) >= self.room:
            made += self._frame()
        return made

    def flush(self) -> bytes:
        """Mark and frame with the waiting data, padded with idle packets; b"" if none waits."""
        if not self._field:
            return b""
        if self._first == TM_NO_START:
            self._first = len(self._field)
        self._field += _IDLE * (self.room - len(self._field))
        return self._frame()

    def _frame(self) -> bytes:
        self.counter = next_number(self.counter)
        count, status = self.counter & 0xFF, _TM_PACKETS | self._first
        head = _TM.pack(self.spacecraft << 4, count, count, status, self.spi, self.counter)
        frame = close_frame(self.key, head + self._field[: self.room])
        del self._field[: self.room]
        self._first = TM_NO_START
        return _TM_MARK + frame


class TelemetryReceiver(Receiver):
    """Accepts TM frames of one spacecraft and gives what was wrapped in them, space packets whole.

    `lost_frames`: frames that are missing between accepted ones; `lost_packets`: packets that
    had begun to arrive and whose rest was lost.
    """

    mark, header = _TM_MARK, _TM_HEADER

    def __init__(
        self, keys: Mapping[int, bytes], spacecraft: int, frame_bytes: int = 256, late: int = 0
    ):
        """Counters may leap as far as they go: frames are sent also where no one listens.

        `late`: counts by which a frame may come late, for links whose datagrams overtake each other
        and come twice; data is then not always in order. Such a frame is accepted once; one that
        comes again as it was is `repeated`, and no sign that somebody replays frames.
        """
        check_link(keys, spacecraft)
        room_in(frame_bytes)
        super().__init__(keys, spacecraft << 4, window=2**32)
        self.frame_bytes = frame_bytes
        self.lost_frames = self.lost_packets = 0
        self._last, self._highest, self._late = (0, 0), (0, 0), late
        self._lately: dict[int, bytes] = {}
        self._packets = bytearray()
        self._follows = False

    def size_at(self, at: int) -> int:
        return self.frame_bytes

    def contents(self, frames: list[bytes]) -> list[bytes]:
        found: list[bytes] = []
        for frame in frames:
            self._join(frame)
            found += self._complete()
        return found

    def _judge(self, frame: bytes) -> str:
        """As `Receiver`; a frame that was overtaken is accepted, too."""
        spi, number = SECURITY.unpack_from(frame, self.header)
        last, reason = self.counters.get(spi, 0), super()._judge(frame)
        if reason == "replayed" and number > last - self._late:
            return self._judge_late(spi, number, frame[-TRAILER:])
        if not reason:
            if (spi, last) == self._highest:
                self.lost_frames += number - last - 1
            else:
                self._lately.clear()  # the first one, or counters have begun again
            self._highest = spi, number
            self._remember(number, frame[-TRAILER:])
        return reason

    def _judge_late(self, spi: int, number: int, trailer: bytes) -> str:
        """Why a frame with a counter below the last one is not accepted; "" if it was overtaken."""
        if self._lately.get(number) == trailer:
            return "repeated"
        is_known = spi == self._highest[0] and number > min(self._lately, default=number)
        if number in self._lately or not is_known:
            return "replayed"
        self.lost_frames -= 1  # it was thought to be lost
        self._remember(number, trailer)
        return ""

    def _remember(self, number: int, trailer: bytes) -> None:
        """Note a frame that was accepted, and forget those that are too old to come again."""
        if not self._late:
            return
        self._lately[number] = trailer
        if len(self._lately) > 2 * self._late:
            self._lately = {k: self._lately[k] for k in sorted(self._lately)[-self._late :]}

    def _join(self, frame: bytes) -> None:
        """Append a frame's data field, after a gap from its first packet on."""
        spi, number, first, field = data_field(frame)
        last_spi, last = self._last
        self._last = (spi, number)
        if spi != last_spi or number != last + 1:
            self.lost_packets += len(self._packets) > 0
            self._packets.clear()
            self._follows = False
        if not self._follows:
            field = field[first:]
            self._follows = first != TM_NO_START
        self._packets += field

    def _complete(self) -> list[bytes]:
        """Take space packets, and the content of encapsulation packets, out of the data joined."""
        found, at = packets_in(self._packets)
        if at < 0:  # authentic, yet not ours: go on with the next frame in which a packet begins
            self.lost_packets += 1
            self._follows, at = False, len(self._packets)
        del self._packets[:at]
        return found


def data_field(frame: bytes) -> tuple[int, int, int, bytes]:
    """SPI, counter, place of the first packet that begins (`TM_NO_START`: none) and data field.

    Of an authentic TM frame without its mark.
    """
    _, _, _, status, spi, number = _TM.unpack_from(frame)
    return spi, number, status & TM_NO_START, frame[_TM.size : -TRAILER]


def packets_in(data: bytes | bytearray) -> tuple[list[bytes], int]:
    """What the whole packets at the beginning of data carry, and where the rest begins.

    -1 for the rest: there is something else than packets of ours.
    """
    found: list[bytes] = []
    at, end = 0, len(data)
    while at < end:
        kind = data[at]
        if kind == _IDLE[0]:
            at = end - len(data[at:].lstrip(_IDLE))
            continue
        head = _header_bytes(kind)
        if end < at + head:
            break
        size = _packet_bytes(data[at : at + head])
        if size < head:
            return found, -1
        if end < at + size:
            break
        found.append(bytes(data[at + head if kind & _VERSION else at : at + size]))
        at += size
    return found, at


def _header_bytes(kind: int) -> int:
    """Bytes of the header of a packet, by its first byte."""
    if not kind & _VERSION:
        return PRIMARY_BYTES
    return _SHORT_HEADER.size if kind == _SHORT else _LONG_HEADER.size


def _packet_bytes(header: bytes | bytearray) -> int:
    """Bytes of the packet with this header; 0 for a kind of packets that is not ours."""
    kind = header[0]
    if not kind & _VERSION:
        return packet_size(header)
    if kind == _SHORT:
        return header[1]
    return header[2] << 8 | header[3] if kind == _LONG else 0


def encapsulated_bytes(size: int) -> int:
    """Bytes of an encapsulation packet around data of a size."""
    short = size + _SHORT_HEADER.size
    return short if short <= 255 else size + _LONG_HEADER.size


def telemetry_bytes(content_bytes: int, frame_bytes: int = 256) -> int:
    """Bytes on the link, marks included, of the TM frames that packets of a total size fill."""
    frames = -(-content_bytes // room_in(frame_bytes))
    return frames * (len(_TM_MARK) + frame_bytes)


def room_in(frame_bytes: int) -> int:
    """Bytes of data in a TM frame; ValueError for a length that no frame has."""
    if not 64 <= frame_bytes <= 2048:
        raise ValueError(f"frame_bytes: must be from 64 to 2048; received {frame_bytes}")
    return frame_bytes - _TM_HEADER - OVERHEAD
