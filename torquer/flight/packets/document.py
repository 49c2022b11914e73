"""The dictionary as a page of documentation."""

from collections.abc import Iterator

from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.frames import ALARM, HEADERS, INFO
from torquer.flight.packets.pus_profile import EVENT, Kind, Made, Profile
from torquer.flight.packets.segments import can_id, places


def document(dictionary: Dictionary) -> str:
    """Markdown: frames, modules, every packet with its bytes, segments on a CAN bus, PUS-C."""
    lines = [
        "Numbers are little-endian and follow each other without gaps. Value = raw number x scale.",
        "A value out of range is sent as the nearest one that can be; an unknown one (NaN) as the",
        "least raw number of a whole type. Times count from 2010-01-01 00:00:00.",
        "",
        "## Frames",
        "",
        "Every frame is a header of 16 bytes, then the packet. The framesync is 0xAABBCCDD.",
        "",
    ]
    for direction, title in (("up", "Uplink header"), ("down", "Downlink header")):
        lines += [f"### {title}", "", *_table(HEADERS[direction]), ""]
    lines += ["## Modules", "", "| id | module |", "|---|---|"]
    lines += [f"| {number} | `{name}` |" for name, number in dictionary.modules.items()]
    lines += ["", "## Telemetry", ""]
    for packet in dictionary.down.values():
        lines += _section(packet, f"`{packet.name}`, id {packet.id}, {packet.size} bytes")
    lines += ["## Commands", ""]
    for packet in dictionary.up.values():
        title = f"`{packet.name}`, id {packet.id}, module `{packet.module}`, {packet.size} bytes"
        lines += _section(packet, title)
    lines += [*_can(dictionary), "", *_pus(dictionary), ""]
    return "\n".join(lines)


def _section(packet: Packet, title: str) -> list[str]:
    return [f"### {title}", "", f"{packet.description}.", "", *_table(packet), ""]


def _table(packet: Packet) -> list[str]:
    return [
        "| byte | field | type | scale | unit | limits | meaning |",
        "|---|---|---|---|---|---|---|",
        *(f"| {' | '.join(row)} |" for row in _rows(packet)),
    ]


def _rows(packet: Packet) -> Iterator[list[str]]:
    at = 0
    for field in packet.fields:
        count = "" if field.count == 1 else f" x {field.count}"
        scale = "" if field.scale == 1.0 else f"{field.scale:.12g}"
        limits = "" if field.limits is None else "{:g} to {:g}".format(*field.limits)
        meaning = f"{field.description}{_labels(field)}".replace("|", "\\|")
        yield [
            str(at),
            f"`{field.name}`",
            f"{field.type}{count}",
            scale,
            field.unit,
            limits,
            meaning,
        ]
        at += field.size


def _labels(field: Field) -> str:
    names = field.labels or field.bits
    listed = ", ".join(f"{number} {name}" for number, name in enumerate(names))
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
    for direction in ("down", "up"):
        for packet in getattr(dictionary, direction).values():
            ends = [can_id(direction, packet.id, n) for n in (0, len(places(packet)))]
            lines.append(f"| {direction} `{packet.name}` | 0x{ends[0]:05X} to 0x{ends[1]:05X} |")
    return lines


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
