"""Files that are no plain bytes of this satellite's link: read where that is plain, else named.

Text in hexadecimal and KISS (with or without the addresses of AX.25) say what they are in every
byte, and are read. Bytes in another order, and frames of others, are named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from torquer.flight.packets.frames import FRAMESYNC
from torquer.flight.packets.protected import TelemetryReceiver
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.packets.space_packets import IDLE_APID, PRIMARY_BYTES, packet_size
from torquer.ground.recorded.authentic import Data
from torquer.ground.recorded.hexadecimal import read_hex
from torquer.ground.recorded.kiss import ADDRESS, end_of_addresses, unwrap_kiss
from torquer.ground.recorded.plain import find_marks

PLAIN_MARK = FRAMESYNC.to_bytes(4, "little")
TM_MARK = TelemetryReceiver.mark
#: How many packets in a row are looked at, and named.
_LOOKED_AT, _NAMED = 1000, 5


class Decoded(NamedTuple):
    """The bytes that a file stands for; `note`: how it was read, "" for plain bytes.

    `left_out`: (reason, place, example, bytes) of what is not among the bytes.
    """

    data: Data
    note: str
    left_out: Sequence[tuple[str, int, str, int]] = ()


def decode(data: Data, link: SpaceLink) -> Decoded:
    """What a file stands for, as far as that is plain."""
    notes: list[str] = []
    left_out: list[tuple[str, int, str, int]] = []
    if (text := read_hex(data)) is not None:
        if text.stopped:
            left_out = [("text", 0, text.stopped, len(data))]
            return Decoded(b"", f"not read, {text.what}: {text.stopped}", left_out)
        data = text.data
        notes.append(text.what)
    if (unwrapped := unwrap_kiss(data, link)) is not None:
        data, what, left_out = unwrapped
        notes += what
    note = f"read as {' of '.join(notes)}; places are those of what was read" if notes else ""
    return Decoded(data, note, left_out)


def name_dialect(data: bytes, link: SpaceLink) -> str:
    """What bytes seem to be that hold no frames of this link; "" if they seem to be nothing."""
    if one := _one_byte(data):
        return one
    names = (
        _other_link(data, link),
        _other_order(data),
        _swapped_packets(data),
        _other_frames(data, link),
    )
    own = "" if link.link == "space_packets" else name_space_packets(data)
    return next(filter(None, (*names, _addresses(data), own)), "")


def _other_link(data: bytes, link: SpaceLink) -> str:
    """Frames of the other kind of link."""
    if link.link == "historical" and data.count(TM_MARK):
        return "TM transfer frames (CCSDS 132.0-B), link = 'historical' looks for none"
    if link.link != "historical" and data.count(PLAIN_MARK) and not data.count(TM_MARK):
        return f"frames without protection; link = '{link.link}' looks for TM transfer frames"
    return ""


def _other_order(data: bytes) -> str:
    """Sync marks that appear once bytes change places."""
    as_they_are = _begins(data)
    if data.count(PLAIN_MARK[::-1]) > as_they_are + data.count(TM_MARK[::-1]):
        return "numbers in headers of the other byte order (AABBCCDD, most significant byte first)"
    for size, what in ((2, "pairs"), (4, "fours")):
        swapped = (_turned(data[shift:], size) for shift in range(size))
        if any(_begins(each) > max(as_they_are, 1) for each in swapped):
            return f"bytes are swapped in {what}"
    return ""


def _one_byte(data: bytes) -> str:
    """Nothing but one byte: of a disk that was full, or a memory that was never written."""
    if not data or data.count(data[:1]) < len(data):
        return ""
    return f"all its bytes are {data[0]:02X}: it holds nothing"


def _swapped_packets(data: bytes) -> str:
    """Space packets that appear once bytes change places."""
    if name_space_packets(data):
        return ""
    for size, what in ((2, "pairs"), (4, "fours")):
        if name := name_space_packets(_turned(data, size)):
            return f"bytes are swapped in {what}: without that, {name}"
    return ""


def _begins(data: bytes) -> int:
    return data.count(PLAIN_MARK) + data.count(TM_MARK)


def _turned(data: bytes, size: int) -> bytes:
    """Bytes turned around in groups."""
    whole = data[: len(data) // size * size]
    return np.frombuffer(whole, np.uint8).reshape(-1, size)[:, ::-1].tobytes()


def _other_frames(data: bytes, link: SpaceLink) -> str:
    """TM frames of another length."""
    places = find_marks(np.frombuffer(data, np.uint8), TM_MARK)
    if len(places) < 3:
        return ""
    (distance, count), *_ = Counter(np.diff(places).tolist()).most_common(1)
    size = distance - len(TM_MARK)
    ours = TelemetryReceiver({}, link.keys.spacecraft).frame_bytes
    if 2 * count < len(places) - 1 or size == ours:
        return ""
    first = int(places[0]) + len(TM_MARK)
    spacecraft = (data[first] << 8 | data[first + 1]) >> 4 & 0x3FF
    return f"TM transfer frames of {size} bytes, must be {ours}; of spacecraft {spacecraft}"


def _addresses(data: bytes) -> str:
    end = end_of_addresses(data)
    if not end:
        return ""
    to, source = (_call(data[at : at + ADDRESS]) for at in (0, ADDRESS))
    return f"AX.25 addresses, from {source} to {to}"


def _call(address: bytes) -> str:
    name = bytes(byte >> 1 for byte in address[:-1]).decode("ascii").strip()
    number = address[-1] >> 1 & 0xF
    return f"{name}-{number}" if number else name


def name_space_packets(data: bytes) -> str:
    """Space packets (CCSDS 133.0-B) one after the other; "" if there are none."""
    apids = Counter((first << 8 | second) & IDLE_APID for first, second, *_ in _primary(data))
    if apids.total() < 3 or apids.total() == len(apids):  # none comes twice: bytes of any kind
        return ""
    named = [str(apid) for apid, _ in apids.most_common()]
    more = ", ..." if len(named) > _NAMED else ""
    return f"CCSDS space packets of APID {', '.join(named[:_NAMED])}{more}"


def _primary(data: bytes) -> list[bytes]:
    """Primary headers from the first byte on; none if there is something else between them."""
    found: list[bytes] = []
    at = 0
    while at + PRIMARY_BYTES <= len(data) and len(found) < _LOOKED_AT:
        header = data[at : at + PRIMARY_BYTES]
        if header[0] >> 5:  # another version
            return []
        found.append(header)
        at += packet_size(header)
    return found
