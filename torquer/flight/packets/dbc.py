"""The dictionary as a DBC file: every segment of every packet is a message with its own layout.

Messages are called `down_packet_0` (time stamp, status, counter, checksum: see `segments`) and
`down_packet_1`, ... (data); commands `up_...`. Fields of bytes become unsigned numbers of up to
eight bytes, `name__0`, `name__1`, ..., little-endian. Names of bits are in comments; a number of
which a single bit is set has its name as a text.
"""

from typing import NamedTuple

from torquer.flight.packets.bits import NONE
from torquer.flight.packets.dictionary import TYPES, Dictionary, Field, Packet
from torquer.flight.packets.frames import HEADERS, Direction
from torquer.flight.packets.segments import SEGMENT_BYTES, can_id, places

_EXTENDED = 1 << 31
_FLOATS = {"f32": 1, "f64": 2}
_SENDERS = {"down": ("Satellite", "Ground"), "up": ("Ground", "Satellite")}


class Signal(NamedTuple):
    """A number in a segment: its field, first byte in the segment, bytes."""

    name: str
    field: Field
    at: int
    size: int


class Message(NamedTuple):
    """A segment: sender, receiver and signals."""

    name: str
    can_id: int
    size: int
    description: str
    nodes: tuple[str, str]
    signals: tuple[Signal, ...]


def dbc(dictionary: Dictionary) -> str:
    """The DBC file of a dictionary."""
    messages = [
        message
        for direction in ("down", "up")
        for packet in getattr(dictionary, direction).values()
        for message in _messages(packet, direction)
    ]
    signals = [(message, signal) for message in messages for signal in message.signals]
    lines = ['VERSION ""', "", "NS_ :", "", "BS_:", "", "BU_: Satellite Ground", ""]
    for message in messages:
        lines += [_head(message), *(f" {_signal(message, s)}" for s in message.signals), ""]
    lines += [f'CM_ BO_ {m.can_id | _EXTENDED} "{m.description}";' for m in messages]
    lines += [f'CM_ SG_ {_place(m, s)} "{_comment(s.field)}";' for m, s in signals]
    lines += [f"VAL_ {_place(m, s)} {text} ;" for m, s in signals if (text := _labels(s.field))]
    lines += [
        f"SIG_VALTYPE_ {_place(m, s)} : {_FLOATS[s.field.type]};"
        for m, s in signals
        if s.field.type in _FLOATS
    ]
    return "\n".join(lines) + "\n"


def _messages(packet: Packet, direction: Direction) -> list[Message]:
    """The segments of a packet."""
    after = len(places(packet)) + 1
    rows = [_first_signals(direction), *(_signals(packet, place) for place in places(packet))]
    sizes = [SEGMENT_BYTES, *(place.stop - place.start for place in places(packet))]
    return [
        Message(
            f"{direction}_{packet.name}_{number}",
            can_id(direction, packet.id, number),
            sizes[number],
            f"{packet.description}; segment {number} of {after}",
            _SENDERS[direction],
            tuple(rows[number]),
        )
        for number in range(after)
    ]


def _first_signals(direction: Direction) -> list[Signal]:
    """Segment 0."""
    header = {field.name: field for field in HEADERS[direction].fields}
    code = header["msg_status" if direction == "down" else "module_id"]
    counter = Field(name="counter", type="u8", description="frames of this packet, modulo 256")
    checksum = Field(name="checksum", type="u16", description="CRC-16 of the frame")
    time_stamp = header["time_stamp"]
    return [
        Signal("time_stamp", time_stamp, 0, 4),
        Signal(code.name, code, 4, 1),
        Signal("counter", counter, 5, 1),
        Signal("checksum", checksum, 6, 2),
    ]


def _signals(packet: Packet, place: slice) -> list[Signal]:
    """The numbers in one segment, and the parts of bytes."""
    found = []
    for name, field, at in packet.numbers():
        size = field.size // len(field.names)
        begin, end = max(at, place.start), min(at + size, place.stop)
        if begin < end:
            parts = [p for p in places(packet) if p.start < at + size and p.stop > at]
            part = f"__{parts.index(place)}" if field.type == "bytes" else ""
            found.append(Signal(f"{name}{part}", field, begin - place.start, end - begin))
    return found


def _place(message: Message, signal: Signal) -> str:
    return f"{message.can_id | _EXTENDED} {signal.name}"


def _head(message: Message) -> str:
    number = message.can_id | _EXTENDED
    return f"BO_ {number} {message.name}: {message.size} {message.nodes[0]}"


def _signal(message: Message, signal: Signal) -> str:
    """Place, sign, scale, range and unit of a number."""
    field, kind = signal.field, TYPES[signal.field.type]
    is_signed = field.type[0] in "if"
    least, greatest = kind.low * field.scale, kind.high * field.scale
    if field.type == "bytes" or not kind.is_whole:
        least = greatest = 0.0
    return (
        f"SG_ {signal.name} : {8 * signal.at}|{8 * signal.size}@1{'-' if is_signed else '+'} "
        f"({field.scale:.17g},0) [{least:.15g}|{greatest:.15g}] "
        f'"{field.unit}" {message.nodes[1]}'
    )


def _labels(field: Field) -> str:
    """Texts of numbers; of bits, of those numbers that have a single one or none."""
    names = dict(enumerate(field.labels))
    if field.bits:
        names = {0: NONE} | {1 << place: name for place, name in enumerate(field.bits)}
    return " ".join(f'{number} "{name}"' for number, name in names.items())


def _comment(field: Field) -> str:
    """Description of a number, with the names of its bits."""
    bits = ", ".join(f"{place} {name}" for place, name in enumerate(field.bits))
    return f"{field.description}; bits: {bits}" if bits else field.description
