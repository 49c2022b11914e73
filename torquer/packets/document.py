"""The dictionary as a page of documentation."""

from collections.abc import Iterator

from torquer.packets.dictionary import Dictionary, Field, Packet
from torquer.packets.frames import HEADERS
from torquer.packets.segments import can_id, places


def document(dictionary: Dictionary) -> str:
    """Markdown: frames, modules, every packet with its bytes, enumerations."""
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
    lines += [*_can(dictionary), ""]
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
    if not field.labels:
        return ""
    return f" ({', '.join(f'{number} {label}' for number, label in enumerate(field.labels))})"


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
