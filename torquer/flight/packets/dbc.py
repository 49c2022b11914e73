"""The dictionary as a DBC file: every segment of every packet is a message with its own layout.

Messages are called `down_packet_0` (time stamp, status, counter, checksum: see `segments`) and
`down_packet_1`, ... (data); commands `up_...`. Fields of bytes become unsigned numbers of up to
eight bytes, `name__0`, `name__1`, ..., little-endian. Names of bits are in comments; a number of
which a single bit is set has its name as a text. A big-endian number is stated by its highest bit,
as DBC does. There is no way to state a polynomial, a float of 16 bits, or an id above 255.
"""

from typing import NamedTuple

from torquer.flight.packets.bits import NONE
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.frames import HEADERS, Direction
from torquer.flight.packets.segments import SEGMENT_BYTES, can_id, checked_places, places

_EXTENDED = 1 << 31
_FLOATS = {"f32": 1, "f64": 2}
_SENDERS = {"down": ("Satellite", "Ground"), "up": ("Ground", "Satellite")}


class Signal(NamedTuple):
    """A number in a segment: its field, its first bit in the segment, how many."""

    name: str
    field: Field
    bit: int
    bits: int


class Message(NamedTuple):
    """A segment: sender, receiver and signals."""

    name: str
    can_id: int
    size: int
    description: str
    nodes: tuple[str, str]
    signals: tuple[Signal, ...]


def dbc(dictionary: Dictionary) -> str:
    """The DBC file of a dictionary; ValueError with one line for what DBC cannot state."""
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
    _check(packet, direction)
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


def _check(packet: Packet, direction: Direction) -> None:
    """ValueError for what DBC, or an identifier on the bus, cannot state."""
    place = f"{direction}.{packet.name}"
    checked_places(packet)
    for field in packet.fields:
        if field.polynomial:
            raise ValueError(f"{place}.{field.name}: must have scale and offset for DBC; received "
                             "a polynomial")  # fmt: skip
        if field.type == "f16":
            raise ValueError(f"{place}.{field.name}: must be f32 or f64 for DBC; received f16")


def _first_signals(direction: Direction) -> list[Signal]:
    """Segment 0."""
    header = {field.name: field for field in HEADERS[direction].fields}
    code = header["msg_status" if direction == "down" else "module_id"]
    counter = Field(name="counter", type="u8", description="frames of this packet, modulo 256")
    checksum = Field(name="checksum", type="u16", description="CRC-16 of the frame")
    time_stamp = header["time_stamp"]
    return [
        Signal("time_stamp", time_stamp, 0, 32),
        Signal(code.name, code, 32, 8),
        Signal("counter", counter, 40, 8),
        Signal("checksum", checksum, 48, 16),
    ]


def _signals(packet: Packet, place: slice) -> list[Signal]:
    """The numbers in one segment, and the parts of bytes."""
    found = []
    for name, field, bit, bits in packet.places:
        begin, end = max(bit, 8 * place.start), min(bit + bits, 8 * place.stop)
        if begin < end:
            parts = [p for p in places(packet) if 8 * p.start < bit + bits and 8 * p.stop > bit]
            part = f"__{parts.index(place)}" if field.type == "bytes" else ""
            found.append(Signal(f"{name}{part}", field, begin - 8 * place.start, end - begin))
    return found


def _place(message: Message, signal: Signal) -> str:
    return f"{message.can_id | _EXTENDED} {signal.name}"


def _head(message: Message) -> str:
    number = message.can_id | _EXTENDED
    return f"BO_ {number} {message.name}: {message.size} {message.nodes[0]}"


def _signal(message: Message, signal: Signal) -> str:
    """Place, sign, scale, range and unit of a number."""
    field = signal.field
    is_big, sign = field.byte_order == "big", "-" if field.kind.letter in "if" else "+"
    least, greatest = field.range if field.kind.is_whole else (0.0, 0.0)
    start = (signal.bit | 7) - signal.bit % 8 if is_big else signal.bit  # the highest bit
    return (
        f"SG_ {signal.name} : {start}|{signal.bits}@{'0' if is_big else '1'}{sign} "
        f"({field.scale:.17g},{field.offset:.17g}) [{_end(least)}|{_end(greatest)}] "
        f'"{field.unit}" {message.nodes[1]}'
    )


def _end(value: float) -> str:
    """An end of a range; whole ones have all their digits."""
    return str(value) if isinstance(value, int) else f"{value:.15g}"


def _labels(field: Field) -> str:
    """Texts of numbers; of bits, of those numbers that have a single one or none."""
    names = field.texts
    if field.bits:
        names = {0: NONE} | {1 << place: name for place, name in enumerate(field.bits)}
    return " ".join(f'{number} "{name}"' for number, name in names.items())


def _comment(field: Field) -> str:
    """Description of a number, with the names of its bits."""
    bits = ", ".join(f"{place} {name}" for place, name in enumerate(field.bits))
    return f"{field.description}; bits: {bits}" if bits else field.description
