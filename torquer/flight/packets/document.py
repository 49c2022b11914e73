"""The dictionary as a page of documentation."""

from collections.abc import Iterator

from torquer.flight.packets.alarm_limits import alarm_in_words
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.fields import Order
from torquer.flight.packets.frames import ALARM, HEADERS, INFO, Direction
from torquer.flight.packets.framing import PRIMARY_HEADER
from torquer.flight.packets.pus_profile import EVENT, Kind, Made, Profile
from torquer.flight.packets.segments import can_id, checked_places


def document(dictionary: Dictionary, link: str = "historical") -> str:
    """Markdown: frames, modules, every packet with its bytes, segments on a CAN bus, PUS-C.

    `link`: by which the packets come, as the software file has it.
    """
    is_foreign = link == "space_packets"
    order = _order(dictionary)
    lines = [
        *_introduction(dictionary, order),
        "",
        "## Frames",
        "",
        *(_space_packets() if is_foreign else _frames()),
    ]
    if dictionary.modules:
        lines += ["## Modules", "", "| id | module |", "|---|---|"]
        lines += [f"| {number} | `{name}` |" for name, number in dictionary.modules.items()]
        lines += [""]
    lines += ["## Telemetry", ""]
    for packet in dictionary.down.values():
        title = f"`{packet.name}`, id {packet.id}, {packet.size} bytes"
        lines += _section(packet, title, order)
    if dictionary.up:
        lines += ["## Commands", ""]
    for packet in dictionary.up.values():
        title = f"`{packet.name}`, id {packet.id}, module `{packet.module}`, {packet.size} bytes"
        lines += _section(packet, title, order)
    if not is_foreign:
        lines += [*_can(dictionary), "", *_pus(dictionary), ""]
    return "\n".join(lines)


def _order(dictionary: Dictionary) -> Order:
    """The byte order of most numbers: only the other one is written beside a type."""
    orders = [field.byte_order for field in _fields(dictionary) if field.kind.letter not in "sx"]
    return "big" if 2 * orders.count("big") > len(orders) else "little"


def _fields(dictionary: Dictionary) -> Iterator[Field]:
    for packet in (*dictionary.down.values(), *dictionary.up.values()):
        yield from packet.fields


def _introduction(dictionary: Dictionary, order: Order) -> list[str]:
    counted = "; bits count from the highest" if order == "big" else ""
    has_offset = any(field.offset for field in _fields(dictionary))
    added = " + what stands behind it" if has_offset else ""
    return [
        f"Numbers are {order}-endian and follow each other without gaps{counted}. "
        f"Value = raw number x scale{added}.",
        "A value out of range is sent as the nearest one that can be; an unknown one (NaN) as the",
        "least raw number of a whole type. Times count from 2010-01-01 00:00:00.",
    ]


def _frames() -> list[str]:
    lines = ["Every frame is a header of 16 bytes, then the packet. The framesync is 0xAABBCCDD."]
    for direction, title in (("up", "Uplink header"), ("down", "Downlink header")):
        lines += ["", f"### {title}", "", *_table(HEADERS[direction], "little")]
    return [*lines, ""]


def _space_packets() -> list[str]:
    begin = "Every packet is a space packet (CCSDS 133.0-B): a primary header, then the fields."
    return [begin, "", *_table(PRIMARY_HEADER, "big"), ""]


def _section(packet: Packet, title: str, order: Order) -> list[str]:
    return [f"### {title}", "", f"{packet.description}.", "", *_table(packet, order), ""]


def _table(packet: Packet, order: Order) -> list[str]:
    return [
        "| byte | field | type | scale | unit | limits | meaning |",
        "|---|---|---|---|---|---|---|",
        *(f"| {' | '.join(row)} |" for row in _rows(packet, order)),
    ]


def _rows(packet: Packet, order: Order) -> Iterator[list[str]]:
    at = 0
    for field in packet.fields:
        count = "" if field.count == 1 else f" x {field.count}"
        differs = field.byte_order != order and field.kind.bits > 8
        kind = f"{field.type}{field.byte_order[0]}e" if differs else field.type
        bit = f" bit {at % 8}" if at % 8 else ""
        limits = alarm_in_words(field.limits, field.alarm)
        meaning = f"{field.description}{_labels(field)}".replace("|", "\\|")
        yield [
            f"{at // 8}{bit}",
            f"`{field.name}`" if field.name else "",
            f"{kind}{count}",
            _scale(field),
            field.unit,
            limits,
            meaning,
        ]
        at += field.bit_size


def _scale(field: Field) -> str:
    """The scale, with what is added, or the polynomial in the raw number r."""
    if not field.polynomial:
        scale = "" if field.scale == 1.0 and not field.offset else f"{field.scale:.12g}"
        return f"{scale}, {field.offset:+.12g}" if field.offset else scale
    powers = ["", " r", *(f" r^{power}" for power in range(2, len(field.polynomial)))]
    terms = [f"{each:+.12g}{power}" for each, power in zip(field.polynomial, powers, strict=True)]
    return " ".join(terms).removeprefix("+")


def _labels(field: Field) -> str:
    names = field.texts or dict(enumerate(field.bits))
    listed = ", ".join(f"{number} {name}" for number, name in names.items())
    return f" ({'bits: ' if field.bits else ''}{listed})" if names else ""


def _can(dictionary: Dictionary) -> list[str]:
    """Identifiers on a CAN bus."""
    lines = [
        "## Segments on a CAN bus",
        "",
        "Identifiers have 29 bits. The first segment of a frame holds time stamp u32, status or",
        "module u8, counter u8 and a CRC-16; the others hold the data, and no number crosses from",
        "one into the next.",
        "",
        "| packet | identifiers |",
        "|---|---|",
    ]
    directions: tuple[Direction, ...] = ("down", "up")
    for direction in directions:
        for packet in getattr(dictionary, direction).values():
            lines.append(f"| {direction} `{packet.name}` | {_identifiers(direction, packet)} |")
    return lines


def _identifiers(direction: Direction, packet: Packet) -> str:
    """The first and the last identifier of a packet's segments."""
    try:
        count = len(checked_places(packet))
    except ValueError:
        return "those of a stream of bytes"
    ends = [can_id(direction, packet.id, n) for n in (0, count)]
    return f"0x{ends[0]:05X} to 0x{ends[1]:05X}"


def _pus(dictionary: Dictionary) -> list[str]:
    """Messages of the link with PUS-C."""
    lines = [
        "## PUS-C",
        "",
        'With `link = "pus"` packets are messages of ECSS-E-ST-70-41C. A command with a time stamp',
        "is an activity of TC[11,4]. What is chosen where the standard leaves it open:",
        "`design/0015-pus.md`.",
        "",
        "| packet | message |",
        "|---|---|",
    ]
    profile = Profile(dictionary)
    for packet in dictionary.down.values():
        lines.append(f"| down `{packet.name}` | {_report(profile, packet)} |")
    for packet in dictionary.up.values():
        lines.append(f"| up `{packet.name}` | {_request(profile, packet)} |")
    return lines


def _report(profile: Profile, packet: Packet) -> str:
    """The telemetry message of a packet."""
    if packet.id == profile.acknowledgement:
        return "TM[1,1], TM[1,2], TM[1,7], TM[1,8]"
    kinds = {
        profile.report(Made(packet.id, 0, status, bytes(packet.size)), {}).kind
        for status in (INFO, ALARM)
    }
    if any(service == EVENT for service, _ in kinds):
        return "TM[5,1] to TM[5,4], event definition ID: its code"
    if kinds == {Kind.HOUSEKEEPING}:
        return f"TM[3,25], structure ID {packet.id}"
    return ", ".join(f"TM[{service},{subtype}]" for service, subtype in kinds - {Kind.HOUSEKEEPING})


def _request(profile: Profile, packet: Packet) -> str:
    """The telecommand message of a packet."""
    kind = profile.request(Made(packet.id, 0, 0, bytes(packet.size))).kind
    function = f", function ID {packet.id}" if kind == Kind.PERFORM_FUNCTION else ""
    return f"TC[{kind[0]},{kind[1]}]{function}"
