"""The historical frames of Chibis-M, bit exact: a header of 16 bytes, then the data of a packet.

Both headers are packed and little-endian, as on the ARM LPC2294 of the satellite. They carry no
checksum: damage to data within a whole frame cannot be noticed here (see `protected`).

uplink    framesync u32 0xAABBCCDD, time_stamp u32 (execution time), msg_id u8, module_id u8,
          request u16, valid_until u16, data_length u16
downlink  framesync u32, time_stamp u32 (when the frame was made), msg_id u8, msg_status u8,
          reserved u8[4], data_length u16

Times are seconds since 2010-01-01 00:00:00. After SDOT, App. A, where `request` and `valid_until`
are one reserved u32: the number of a command in the answers to it, and the low 16 bits of the last
second at which it may be received; 0: none.
"""

import struct
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from typing import Any, Literal, NamedTuple

from torquer.flight.packets.codec import decoder, encoder
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.security import begun_mark

#: On-board time counts from then on.
EPOCH = datetime(2010, 1, 1, tzinfo=UTC)
#: How often it is saved, unless a software file says otherwise [s]: a reboot goes on from there.
CLOCK_SAVED_S = 60.0
FRAMESYNC = 0xAABBCCDD
#: `msg_status` of a downlink frame.
STATUS = INFO, ALARM, STOP = (0, 1, 2)
STATUS_LABELS = ("INFO", "ALARM", "STOP")
_MARK = struct.pack("<I", FRAMESYNC)
#: framesync, time_stamp, msg_id, msg_status or module_id, reserved, data_length
HEADER = struct.Struct("<IIBBIH")
HEADER_BYTES = HEADER.size
#: What an uplink header has in place of the reserved bytes: request, valid_until.
_MARKS = struct.Struct("<HH")
#: The last number of a command; numbers then begin with 1 again.
LAST_REQUEST = 2**16 - 1
#: Seconds after which `valid_until` begins again.
_MARKED = 1 << 16
_LATEST = 2**32 - 1
Direction = Literal["down", "up"]


def _header(direction: str, *code_and_reserved: Field) -> Packet:
    return Packet(
        name=f"{direction}_header",
        id=255,
        description="header of every frame",
        fields=(
            Field(name="framesync", type="u32", description="0xAABBCCDD"),
            Field(name="time_stamp", type="u32", unit="s", description="since 2010-01-01"),
            Field(name="msg_id", type="u8", description="packet"),
            *code_and_reserved,
            Field(name="data_length", type="u16", unit="B", description="bytes of the packet"),
        ),
    )


#: The headers as packets, for what describes frames.
HEADERS = {
    "down": _header(
        "down",
        Field(name="msg_status", type="u8", labels=STATUS_LABELS, description="kind of the frame"),
        Field(name="reserved", type="u8", count=4, description="zeros"),
    ),
    "up": _header(
        "up",
        Field(name="module_id", type="u8", description="module to which the command goes"),
        Field(name="request", type="u16", description="number of the command, 0: none"),
        Field(
            name="valid_until",
            type="u16",
            unit="s",
            description="low bits of the last second to receive it, 0: any",
        ),
    ),
}


class Frame(NamedTuple):
    """A frame that was received.

    `time_s`: its time stamp; `code`: its status (downlink) or module (uplink); `values` in the
    order of `packet.names`; `raw`: the whole frame; `request`, `valid_until`: of a command.
    """

    packet: Packet
    time_s: int
    code: int
    values: tuple
    raw: bytes
    request: int = 0
    valid_until: int = 0

    @property
    def status(self) -> int:
        """Status of a downlink frame: INFO, ALARM or STOP."""
        return self.code

    @property
    def module(self) -> int:
        """Id of the module to which a command goes."""
        return self.code


class Rejected(NamedTuple):
    """A header that was rejected: enough for a negative acknowledgement.

    `reason`: 'unknown' (id), 'length', 'module', 'status', or 'cut' (another frame, or the end of
    a recording, comes before its end); the rest as the header says.
    """

    reason: str
    id: int
    time_s: int
    code: int
    length: int
    request: int = 0


class Rejections:
    """What a reader of headers rejects. `rejected`: how many, by reason."""

    #: Most headers kept for `take_rejected`: the oldest are dropped.
    MOST_REJECTED = 10

    def __init__(self) -> None:
        self.rejected: Counter[str] = Counter()
        self._latest: deque[Rejected] = deque(maxlen=self.MOST_REJECTED)

    def note_rejected(self, header: Rejected) -> None:
        """Count a header, and keep it until it is taken."""
        self.rejected[header.reason] += 1
        self._latest.append(header)

    def take_rejected(self) -> list[Rejected]:
        """The headers rejected since the last call, at most `MOST_REJECTED`."""
        taken = list(self._latest)
        self._latest.clear()
        return taken


class Downlink:
    """Maker of downlink frames."""

    def __init__(self, dictionary: Dictionary):
        self._known = {
            name: (encoder(packet), [_after_time(packet, status) for status in STATUS])
            for name, packet in dictionary.down.items()
        }

    def frame(self, name: str, time_s: float, values: Sequence, status: int = INFO) -> bytes:
        """The frame of a packet's values, made at `time_s` since 2010-01-01."""
        encode, ends = self._known[name]
        return _begin(time_s) + ends[status] + encode(values)


class Uplink:
    """Maker of uplink frames."""

    def __init__(self, dictionary: Dictionary):
        self._known = {
            name: (encoder(packet), _around_marks(packet, dictionary.modules[packet.module]))
            for name, packet in dictionary.up.items()
        }

    def frame(
        self, name: str, time_s: float, values: Sequence, request: int = 0, valid_until: int = 0
    ) -> bytes:
        """The frame of a command, to be executed at `time_s` since 2010-01-01.

        `values` begin with `acknowledge`; `request`, `valid_until`: see `last_second`.
        """
        encode, (code, length) = self._known[name]
        return _begin(time_s) + code + _MARKS.pack(request, valid_until) + length + encode(values)


def last_second(time_s: float) -> int:
    """The mark of a time since 2010-01-01 [s] in a header: its low bits; 0 is kept for none."""
    return int(time_s) % _MARKED or 1


def seconds_late(now_s: int, valid_until: int) -> int:
    """How long after the last second of a header a time is [s]; negative before, 0 for none."""
    if not valid_until:
        return 0
    return (now_s - valid_until + _MARKED // 2) % _MARKED - _MARKED // 2


def _begin(time_s: float) -> bytes:
    """Framesync and time stamp, rounded down; before 2010 and NaN: 0."""
    try:
        return struct.pack("<II", FRAMESYNC, int(time_s))
    except (ValueError, OverflowError, struct.error):
        return struct.pack("<II", FRAMESYNC, _LATEST if time_s > 0.0 else 0)


def _after_time(packet: Packet, code: int) -> bytes:
    return HEADER.pack(FRAMESYNC, 0, packet.id, code, 0, packet.size)[8:]


def _around_marks(packet: Packet, code: int) -> tuple[bytes, bytes]:
    after = _after_time(packet, code)
    return after[: -_MARKS.size - 2], after[-2:]


class _Known(NamedTuple):
    """What a stream must know of a packet. `codes`: those that its header may hold, `otherwise`:
    the reason why another one is rejected; `opaque`: places in the frame that hold bytes.
    """

    packet: Packet
    size: int
    codes: frozenset[int]
    otherwise: str
    opaque: frozenset[int]
    decode: Callable[..., tuple]


class _Table(dict):
    """What is known, by id. It never changes: copies of a stream share it."""

    def __deepcopy__(self, memo: Any) -> "_Table":
        return self


def _table(dictionary: Dictionary, direction: Direction) -> _Table:
    packets = dictionary.down if direction == "down" else dictionary.up
    known = _Table()
    for packet in packets.values():
        opaque = {
            HEADER_BYTES + at + k
            for _, field, at in packet.numbers()
            for k in range(field.size)
            if field.type == "bytes"
        }
        codes, otherwise = set(STATUS), "status"
        if direction == "up":
            codes, otherwise = {dictionary.modules[packet.module]}, "module"
        known[packet.id] = _Known(
            packet, packet.size, frozenset(codes), otherwise, frozenset(opaque), decoder(packet)
        )
    return known


class Stream(Rejections):
    """Frames from a stream of bytes, which may arrive in parts of any size.

    Bytes that belong to no frame are skipped up to the next framesync; `lost_bytes`: how many
    were skipped. At most one packet's bytes are kept waiting, since a header must state the length
    of its packet.

    A frame that lost bytes would take the beginning of the next one for its end. So a frame is
    discarded as 'cut' if the header of another one stands within it: its id, code and length are
    right by chance once in 2^60 places. Packets with fields of bytes may hold whole frames: there
    a header counts as data if the next frame begins directly after it; this may wait for that
    next frame. The last one to three bytes of a frame, if the next framesync may begin with them,
    are looked at again after it.
    """

    def __init__(self, dictionary: Dictionary, direction: Direction):
        super().__init__()
        self._known = _table(dictionary, direction)
        self.lost_bytes = 0
        self._buffer = bytearray()
        #: Bytes at its beginning that belong to the frame before.
        self._shared = 0

    @property
    def waiting_bytes(self) -> int:
        """Bytes that have come of what is not complete."""
        return max(len(self._buffer) - self._shared, 0)

    def feed(self, data: bytes) -> Iterator[Frame]:
        """The frames that are complete with these bytes."""
        self._buffer += data
        return self._frames(ended=False)

    def finish(self) -> Iterator[Frame]:
        """Frames still waiting at the end of a recording or contact: no bytes can follow."""
        yield from self._frames(ended=True)
        self._lose(len(self._buffer))

    def _frames(self, ended: bool) -> Iterator[Frame]:
        known, buffer = self._known, self._buffer
        while self._synchronise():
            _, time_s, number, code, marks, length = HEADER.unpack_from(buffer)
            entry = known.get(number)
            reason = _reason(entry, code, length)
            if entry is None or reason:
                self._reject(reason, len(_MARK))
                continue
            size = HEADER_BYTES + length
            cut = self._cut(entry, size, ended)
            if cut > 0:
                self._reject("cut", cut)
                continue
            if ended and len(buffer) < size:
                self._reject("cut", len(_MARK))
                continue
            if cut < 0 or len(buffer) < size:
                return
            raw = bytes(buffer[:size])
            self._shared = begun_mark(raw, _MARK)
            del buffer[: size - self._shared]
            values = entry.decode(raw, HEADER_BYTES)
            yield Frame(entry.packet, time_s, code, values, raw, marks % _MARKED, marks // _MARKED)

    def _synchronise(self) -> bool:
        """Whether the buffer begins with a whole header, after the bytes before it were skipped."""
        buffer = self._buffer
        if not buffer.startswith(_MARK):
            at = buffer.find(_MARK)
            self._lose(at if at >= 0 else len(buffer) - begun_mark(buffer, _MARK))
        return len(buffer) >= HEADER_BYTES

    def _cut(self, entry: _Known, size: int, ended: bool) -> int:
        """Where another frame begins within the first one; 0: nowhere, -1: not known yet.

        Once the first one is discarded, so are its fields of bytes: the first header counts.
        """
        buffer, begin = self._buffer, 0
        at = buffer.find(_MARK, len(_MARK), size)
        while at >= 0:
            if len(buffer) < at + HEADER_BYTES:
                return 0 if ended else -1
            _, _, number, code, _, length = HEADER.unpack_from(buffer, at)
            if not _reason(self._known.get(number), code, length):
                begin = begin or at
                if at not in entry.opaque:
                    return begin
                if len(buffer) < size + len(_MARK) and not ended:
                    return -1
                if not _MARK.startswith(buffer[size : size + len(_MARK)]):
                    return begin
            at = buffer.find(_MARK, at + 1, size)
        return 0

    def _reject(self, reason: str, skipped: int) -> None:
        """Count the header at the beginning of the buffer and skip bytes."""
        _, time_s, number, code, marks, length = HEADER.unpack_from(self._buffer)
        self.note_rejected(Rejected(reason, number, time_s, code, length, marks % _MARKED))
        self._lose(skipped)

    def _lose(self, count: int) -> None:
        shared = min(self._shared, count)
        self._shared -= shared
        self.lost_bytes += count - shared
        del self._buffer[:count]


def _reason(entry: _Known | None, code: int, length: int) -> str:
    """Why a header is rejected; "" if it is not."""
    if entry is None:
        return "unknown"
    if length != entry.size:
        return "length"
    return "" if code in entry.codes else entry.otherwise
