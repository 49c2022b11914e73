"""What each kind of link asks of a dictionary, and the header that stands before its packets."""

from typing import Literal, NamedTuple

from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.fields import ANY_BYTES, MOST_BYTES
from torquer.flight.packets.frames import HEADERS

#: Frames of a link: those of Chibis-M; these within frames with checksum and MAC; PUS-C within such
#: frames; space packets of CCSDS 133.0-B as they come, of telemetry.
LinkKind = Literal["historical", "protected", "pus", "space_packets"]


class Framing(NamedTuple):
    """Header of the telemetry of a link, the field in it that has the packet's id, ids and bytes.

    `container`: what XTCE calls a packet with it; no packet and no field has a name with two '_'.
    """

    container: str
    header: Packet
    id_field: str
    ids: range
    bytes: int


def _header_field(name: str, bits: int, description: str, labels: dict | None = None) -> Field:
    keys = {"labels": labels} if labels else {}
    return Field(name=name, type=f"u{bits}", byte_order="big", description=description, **keys)


#: The primary header of a space packet (CCSDS 133.0-B, 4.1.3).
PRIMARY_HEADER = Packet(
    name="primary_header",
    id=0,
    description="primary header of every space packet",
    fields=(
        _header_field("version", 3, "0"),
        _header_field("kind", 1, "kind of the packet", {0: "TELEMETRY", 1: "TELECOMMAND"}),
        _header_field("has_secondary_header", 1, "whether the data begin with another header"),
        _header_field("apid", 11, "application process identifier: packet"),
        _header_field("sequence_flags", 2, "3: not segmented"),
        _header_field("sequence_count", 14, "packets of this identifier, modulo 16384"),
        _header_field("data_length", 16, "bytes of the packet, less one"),
    ),
)
_FRAMES = Framing("downlink__frame", HEADERS["down"], "msg_id", range(1, 256), MOST_BYTES)
#: The last identifier, 2047, is that of idle packets.
SPACE_PACKETS = Framing("space__packet", PRIMARY_HEADER, "apid", range(2047), ANY_BYTES)


def framing_of(link: str) -> Framing:
    """The framing of a kind of link."""
    return SPACE_PACKETS if link == "space_packets" else _FRAMES


def check_framing(dictionary: Dictionary, link: str) -> None:
    """ValueError with one line for a dictionary whose packets such a link cannot carry."""
    ids, most = framing_of(link).ids, framing_of(link).bytes
    for direction in ("down", "up"):
        for packet in getattr(dictionary, direction).values():
            if packet.id not in ids:
                wider = "" if link == "space_packets" else " ('space_packets' has ids up to 2046)"
                raise ValueError(
                    f"{direction}.{packet.name}.id: must be {ids[0]} to {ids[-1]} with link = "
                    f"{link!r}{wider}; received {packet.id}"
                )
            if packet.size > most:
                raise ValueError(
                    f"{direction}.{packet.name}.fields: must have at most {most} bytes with link = "
                    f"{link!r}; received {packet.size}"
                )
    if link == "space_packets":
        _check_telemetry(dictionary)


def _check_telemetry(dictionary: Dictionary) -> None:
    """Space packets are read only, and have no time but that of their fields."""
    if dictionary.up:
        raise ValueError(
            "up: must be left out with link = 'space_packets', by which packets are read only; "
            f"received {', '.join(dictionary.up)}"
        )
    for packet in dictionary.down.values():
        if not packet.time_ms:
            raise ValueError(
                f"down.{packet.name}.time_ms: must be given with link = 'space_packets', whose "
                "headers have no time; received nothing"
            )
