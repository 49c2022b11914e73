"""KISS frames of recordings, with or without the addresses of AX.25, cut ends included.

Frames stand between bytes 0xC0, each after a command byte; 0xC0 and 0xDB within are escaped. A
recording that begins or ends within a frame says so less clearly: it is read as KISS if most of its
whole frames hold what the link looks for. Space packets have no mark and no checksum, so that a
frame of another length than its packets state is damaged, and left out.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from torquer.flight.packets.frames import FRAMESYNC
from torquer.flight.packets.protected import TelemetryReceiver
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.packets.space_packets import IDLE_APID, PRIMARY_BYTES, packet_size
from torquer.ground.recorded.authentic import Data

#: Least bytes by which a file is judged, and bytes by which most are judged.
_LEAST, _BEGINNING = 16, 2**17
_FEND, _ESCAPES = b"\xc0", {b"\xdb\xdc": b"\xc0", b"\xdb\xdd": b"\xdb"}
_ESCAPED = re.compile(b"\xdb.?", re.DOTALL)
#: Bytes of an address of AX.25; control and protocol of what carries data without a connection.
ADDRESS, _UNNUMBERED = 7, b"\x03\xf0"
#: The share of frames above which all are taken to be what these are.
_MOST = 0.5


class Unwrapped(NamedTuple):
    """What KISS frames hold; `what`: their kind; `left_out`: (reason, place, example, bytes)."""

    data: bytes
    what: list[str]
    left_out: list[tuple[str, int, str, int]]


def unwrap_kiss(data: Data, link: SpaceLink) -> Unwrapped | None:
    """The bytes of a file of KISS frames and nothing else; None for another file."""
    if len(data) < _LEAST or _split(data[:_BEGINNING]) is None:
        return None
    if (parts := _split(data[:])) is None or not parts[1]:
        return None
    first, frames, last = parts
    payloads = [_ESCAPED.sub(lambda found: _ESCAPES[found[0]], f[1:]) for f in frames]
    what, payloads = _without_all_addresses(payloads)
    is_ours = _holds(link)
    ours = [is_ours(payload) for payload in payloads]
    are_ours = sum(ours) > _MOST * len(ours)
    if (first or last) and not are_ours:
        return None
    is_checked = are_ours and link.link == "space_packets"
    wrong = [is_checked and not _apids(payload) for payload in payloads]
    return _joined(payloads, wrong, what, (first, last))


def _split(data: bytes) -> tuple[bytes, list[bytes], bytes] | None:
    """The cut frame at the beginning, whole frames, the cut one at the end; None if none are."""
    first, *between = data.split(_FEND)
    if not between:
        return None
    last = between.pop()
    frames = [frame for frame in between if frame]
    if any(frame[0] & 0x0F for frame in frames):  # another command than data
        return None
    if any(found not in _ESCAPES for frame in frames for found in _ESCAPED.findall(frame)):
        return None
    return first, frames, last


def _joined(
    payloads: list[bytes], wrong: list[bool], what: list[str], ends: tuple[bytes, bytes]
) -> Unwrapped:
    """The payloads one after the other, without those that are wrong and the cut ends."""
    kept, at, left_out = [], 0, []
    first, last = ends
    if first:
        left_out.append(("kiss_cut", 0, "", len(first)))
    for payload, is_wrong in zip(payloads, wrong, strict=True):
        if is_wrong:
            left_out.append(("kiss_length", at, _lengths(payload), len(payload)))
            continue
        kept.append(payload)
        at += len(payload)
    if last:
        left_out.append(("kiss_cut", at, "", len(last)))
    return Unwrapped(b"".join(kept), what, left_out)


def _lengths(payload: bytes) -> str:
    if len(payload) < PRIMARY_BYTES:
        return f"{len(payload)} bytes, must be at least {PRIMARY_BYTES}"
    return f"{len(payload)} bytes, must be {packet_size(payload)}"


def _holds(link: SpaceLink) -> Callable[[bytes], bool]:
    """Whether a payload is what a link looks for."""
    if link.link != "space_packets":
        is_plain = link.link == "historical"
        mark = FRAMESYNC.to_bytes(4, "little") if is_plain else TelemetryReceiver.mark
        return lambda payload: payload.startswith(mark)
    known = {packet.id for packet in link.dictionary.down.values()}
    return lambda payload: not known.isdisjoint(_apids(payload))


def _apids(payload: bytes) -> list[int]:
    """Of whole space packets with nothing else among them; none if there is something else."""
    at, found = 0, []
    while at + PRIMARY_BYTES <= len(payload) and not payload[at] >> 5:
        header = payload[at : at + PRIMARY_BYTES]
        found.append((header[0] << 8 | header[1]) & IDLE_APID)
        at += packet_size(header)
    return found if at == len(payload) else []


def _without_all_addresses(frames: list[bytes]) -> tuple[list[str], list[bytes]]:
    """How frames are described, and what they carry if all have addresses."""
    what = ["KISS frames (0xC0)"]
    payloads = [_without_addresses(frame) for frame in frames]
    found = [payload for payload in payloads if payload is not None]
    if len(found) < len(frames):
        return what, frames
    return [*what, "AX.25 addresses"], found


def _without_addresses(frame: bytes) -> bytes | None:
    """What an AX.25 frame carries; None if it is none."""
    end = end_of_addresses(frame)
    if not end or frame[end : end + 2] != _UNNUMBERED:
        return None
    return frame[end + 2 :]


def end_of_addresses(frame: bytes) -> int:
    """Bytes of the addresses of AX.25 at the beginning; 0 if there are none."""
    for end in range(ADDRESS, min(len(frame), 10 * ADDRESS) + 1, ADDRESS):
        name = frame[end - ADDRESS : end - 1]
        text = bytes(byte >> 1 for byte in name)
        if any(byte & 1 for byte in name) or not re.fullmatch(rb"[A-Z0-9]+ *", text):
            return 0
        if frame[end - 1] & 1:
            return end if end >= 2 * ADDRESS else 0
    return 0
