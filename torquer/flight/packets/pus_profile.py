"""Which packet of a dictionary is which message of PUS-C (ECSS-E-ST-70-41C), in both directions.

up.set_parameter      TC[20,3] set parameter values
up.get_parameter      TC[20,1] report parameter values
other commands        TC[8,1] perform a function: function ID u8 = id of the packet
with a time stamp     TC[11,4] insert activities, around the telecommand above
up.plan_clear         TC[11,3] reset the schedule
up.plan_cancel        TC[11,5] delete activities, one of them, by its request ID
down.event            TM[5,1] to TM[5,4], by its code; event definition ID u8 = code
down.parameter        TM[20,2] parameter value report
other telemetry       TM[3,25] housekeeping report: structure ID u16 = id + 256 * status
down.acknowledgement  TM[1,x]: `torquer.flight.packets.pus_verification`

Behind these IDs come the fields of the packet, as the dictionary packs them (little-endian); of a
command those after `acknowledge`, which the ack flags replace. Numbers N of repetitions are u8. A
packet of one of these names with other fields than the profile knows is an ordinary one. A request
has no room for the last second at which it may be received (`frames.last_second`).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.dictionary import Dictionary, Packet
from torquer.flight.packets.frames import (
    ALARM,
    FRAMESYNC,
    HEADER,
    HEADER_BYTES,
    INFO,
    STATUS,
    Frame,
)
from torquer.flight.packets.space_packets import (
    ACCEPTANCE,
    COMPLETION,
    PRIMARY_BYTES,
    TIME_BYTES,
    Malformed,
    Telecommand,
    cds,
    packet_size,
    read_cds,
    read_telecommand,
    request_id,
)

EVENT, SEVERITIES = 5, (1, 2, 3, 4)
#: Reason codes of a command that service 1 has messages of its own for: executed; received, and
#: waits for its execution time.
DONE, WAITING = 0, 14
#: Subtype of an event whose code has no severity of its own: low.
_LOW = 2
_STRUCTURE = struct.Struct(">H")
#: Source id of the telecommands of the ground, and so destination of the reports on them.
SOURCE = 1
#: One activity to delete: N, source id, application process id, sequence count.
_ACTIVITY = struct.Struct(">BHHH")
#: What stands around the two last in the first words of a telecommand packet.
_TELECOMMAND, _ALONE = 0x1800, 0xC000
_EXPECTED = {
    "acknowledgement": "command_id u8, module_id u8, accepted u8, code u8, command_time u32, "
    "counter u32, request u32",
    "event": "module_id u8, code u8, argument i32, on_board_ms f64",
    "parameter": "index u16, value f64",
    "set_parameter": "acknowledge u8, index u16, value f64",
    "get_parameter": "acknowledge u8, index u16",
    "plan_clear": "acknowledge u8",
    "plan_cancel": "acknowledge u8, request u32",
}


class Kind:
    """Service and subtype of requests and reports."""

    ACCEPTED, REFUSED, COMPLETED, FAILED = (1, 1), (1, 2), (1, 7), (1, 8)
    HOUSEKEEPING = (3, 25)
    PERFORM_FUNCTION = (8, 1)
    RESET_SCHEDULE, INSERT_ACTIVITIES, DELETE_ACTIVITIES = (11, 3), (11, 4), (11, 5)
    ARE_YOU_ALIVE, I_AM_ALIVE = (17, 1), (17, 2)
    REPORT_PARAMETERS, PARAMETER_VALUES, SET_PARAMETERS = (20, 1), (20, 2), (20, 3)


class Message(NamedTuple):
    """Service, subtype and data of a request or report."""

    kind: tuple[int, int]
    data: bytes


class Made(NamedTuple):
    """A historical frame taken apart. `code`: module or status; `request`: of a command."""

    id: int
    time_s: int
    code: int
    data: bytes
    request: int = 0

    @classmethod
    def of(cls, frame: bytes) -> Made:
        """ValueError if it is shorter than a header."""
        if len(frame) < HEADER_BYTES:
            raise ValueError(f"frame: must have {HEADER_BYTES} bytes; received {len(frame)}")
        _, time_s, number, code, marks, _ = HEADER.unpack_from(frame)
        return cls(number, time_s, code, frame[HEADER_BYTES:], marks & 0xFFFF)


class Profile:
    """The messages of a dictionary. It never changes: copies are the same object."""

    def __init__(self, dictionary: Dictionary):
        self.up = {packet.id: packet for packet in dictionary.up.values()}
        self.down = {packet.id: packet for packet in dictionary.down.values()}
        self.modules = {p.id: dictionary.modules[p.module] for p in dictionary.up.values()}
        self.acknowledgement = _known_id(dictionary.down, "acknowledgement")
        self._event = _known_id(dictionary.down, "event")
        self._parameter = _known_id(dictionary.down, "parameter")
        self._special = {
            kind: number
            for kind, name in _SPECIAL.items()
            if (number := _known_id(dictionary.up, name))
        }

    def __deepcopy__(self, memo: Any) -> Self:
        return self

    def request(self, command: Made) -> Message:
        """The message of a command, whatever its time stamp.

        The request that `plan_cancel` names is the number of a telecommand (`request_number`).
        """
        arguments = command.data[1:]
        for kind, number in self._special.items():
            if number == command.id:
                return Message(kind, _as_special(kind, arguments))
        return Message(Kind.PERFORM_FUNCTION, bytes([command.id]) + arguments)

    def command(self, request: Telecommand, packet: bytes, time_s: int) -> Frame:
        """The command of a request, for execution at a time; `Malformed` if it is none.

        It always asks for an acknowledgement, since failures are always reported; `raw` is the
        telecommand packet.
        """
        number, arguments = self._taken_apart(request)
        known = self.up.get(number)
        if known is None:
            raise Malformed("unknown")
        if len(arguments) != known.size - 1:
            raise Malformed("length")
        values = decoder(known)(bytes([1]) + arguments)
        module = self.modules[number]
        return Frame(known, time_s, module, values, packet, request_number(packet))

    def _taken_apart(self, request: Telecommand) -> tuple[int, bytes]:
        """Id of the packet that a request means, and its fields after `acknowledge`."""
        kind, data = (request.service, request.subtype), request.data
        if kind in self._special:
            return self._special[kind], _from_special(kind, data)
        if kind != Kind.PERFORM_FUNCTION:
            raise Malformed("unknown")
        if not data:
            raise Malformed("length")
        return 0 if data[0] in self._special.values() else data[0], data[1:]

    def activities(self, data: bytes, apid: int) -> list[Frame]:
        """The commands that TC[11,4] inserts, each with its release time; `Malformed` if one is
        malformed.
        """
        if not data or not data[0]:
            raise Malformed("value" if data else "length")
        found, at = [], 1
        for _ in range(data[0]):
            begin = at + TIME_BYTES
            if len(data) < begin + PRIMARY_BYTES:
                raise Malformed("length")
            time_s, end = _release(data[at:begin]), begin + packet_size(data[begin:])
            packet = data[begin:end]
            found.append(self.command(read_telecommand(packet, apid), packet, time_s))
            at = end
        if at != len(data):
            raise Malformed("length")
        return found

    def report(self, made: Made, severities: Mapping[int, int]) -> Message:
        """The message of a frame; `severities`: subtypes of events by code."""
        if made.id == self._event and made.code == ALARM and len(made.data) > 1:
            code = made.data[1]
            return Message((EVENT, severities.get(code, _LOW)), bytes([code]) + made.data)
        if made.id == self._parameter and made.code == INFO:
            return Message(Kind.PARAMETER_VALUES, bytes([1]) + made.data)
        return Message(Kind.HOUSEKEEPING, _STRUCTURE.pack(made.code << 8 | made.id) + made.data)

    def frame(self, kind: tuple[int, int], time_s: int, data: bytes) -> Frame:
        """The frame of a message; `Malformed` if it is none."""
        number, code, packed = self._frame(kind, data)
        packet = self.down.get(number)
        if packet is None or not number:
            raise Malformed("unknown")
        if code not in STATUS:
            raise Malformed("status")
        if len(packed) != packet.size:
            raise Malformed("length")
        return frame_packet(packet, time_s, packed, code)

    def _frame(self, kind: tuple[int, int], data: bytes) -> tuple[int, int, bytes]:
        """Id, status and packed fields of a message."""
        if kind == Kind.HOUSEKEEPING and len(data) >= _STRUCTURE.size:
            (structure,) = _STRUCTURE.unpack_from(data)
            return structure & 0xFF, structure >> 8, data[_STRUCTURE.size :]
        if kind[0] == EVENT and kind[1] in SEVERITIES and len(data) > 2:
            if data[0] != data[2]:
                raise Malformed("value")
            return self._event, ALARM, data[1:]
        if kind == Kind.PARAMETER_VALUES and data:
            if data[0] != 1:
                raise Malformed("value")
            return self._parameter, INFO, data[1:]
        raise Malformed("unknown")


#: Commands that have messages of their own, by these.
_SPECIAL = {
    Kind.REPORT_PARAMETERS: "get_parameter",
    Kind.SET_PARAMETERS: "set_parameter",
    Kind.RESET_SCHEDULE: "plan_clear",
    Kind.DELETE_ACTIVITIES: "plan_cancel",
}


def _as_special(kind: tuple[int, int], arguments: bytes) -> bytes:
    """The data of such a message for the fields of the packet."""
    if kind == Kind.RESET_SCHEDULE:
        return b""
    if kind != Kind.DELETE_ACTIVITIES:
        return bytes([1]) + arguments
    number = int.from_bytes(arguments, "little")
    return _ACTIVITY.pack(1, SOURCE, number >> 16 & 0x7FF, number & 0x3FFF)


def _from_special(kind: tuple[int, int], data: bytes) -> bytes:
    """The fields of the packet for the data of such a message; `Malformed` for more than one."""
    if kind == Kind.RESET_SCHEDULE:
        return data
    if not data:
        raise Malformed("length")
    if data[0] != 1:  # a command of the dictionary is about one parameter, or activity
        raise Malformed("value")
    if kind != Kind.DELETE_ACTIVITIES:
        return data[1:]
    if len(data) != _ACTIVITY.size:
        raise Malformed("length")
    _, _, apid, count = _ACTIVITY.unpack(data)
    number = (_TELECOMMAND | apid & 0x7FF) << 16 | _ALONE | count & 0x3FFF
    return number.to_bytes(4, "little")


def request_number(packet: bytes) -> int:
    """The request ID of a telecommand packet as a number: that of the command in answers to it."""
    return int.from_bytes(request_id(packet), "big")


def ack_flags(command: Made) -> int:
    """The ack flags of a command: both reports if it asks for an acknowledgement, else none."""
    return ACCEPTANCE | COMPLETION if command.data[:1] > b"\0" else 0


def insertion(time_s: int, packet: bytes) -> Message:
    """The message by which a telecommand packet waits for its release time on board."""
    return Message(Kind.INSERT_ACTIVITIES, bytes([1]) + cds(time_s) + packet)


def frame_packet(packet: Packet, time_s: int, data: bytes, status: int = INFO) -> Frame:
    """The historical frame of packed fields, as a stream of frames gives it."""
    head = HEADER.pack(FRAMESYNC, time_s, packet.id, status, 0, len(data))
    return Frame(packet, time_s, status, decoder(packet)(data), head + data)


def _release(code: bytes) -> int:
    """A release time [s since 2010-01-01], rounded up: never early; 0 would mean at once."""
    time_s, ms = read_cds(code)
    return max(1, min(time_s + (ms > 0), 2**32 - 1))


def _known_id(packets: Mapping[str, Packet], name: str) -> int:
    """Id of the packet of a name, if its fields are those that the profile knows; 0 if not."""
    packet = packets.get(name)
    fields = () if packet is None else packet.fields
    plain = all(
        field.count == 1 and field.is_raw and field.byte_order == "little" for field in fields
    )
    listed = ", ".join(f"{field.name} {field.type}" for field in fields)
    return packet.id if packet is not None and plain and listed == _EXPECTED[name] else 0
