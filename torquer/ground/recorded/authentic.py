"""Protected frames of recordings by their MAC: each once, in whatever order they come.

A link in service refuses a counter that is not above the last one, so that nobody can replay what
was recorded. For history a counter is no reason: passes come newest first, from several stations
and twice, and a satellite whose memory was lost counts from 0 again. What proves a frame is its
MAC; that makes it one is its content.
"""

from __future__ import annotations

from collections.abc import Iterator
from mmap import mmap

from torquer.flight.packets.protected import TelemetryReceiver
from torquer.flight.packets.security import MAC_BYTES, SECURITY, TRAILER
from torquer.flight.packets.software_file import SpaceLink
from torquer.ground.recorded.left_out import Tally

Data = bytes | mmap


class AuthenticFrames:
    """Authentic TM frames, each once; `kept`, `lost_bytes`: bytes of those, and of no frame."""

    def __init__(self, link: SpaceLink, tally: Tally):
        keys = link.keys
        self._receiver = TelemetryReceiver({keys.spi: keys.down}, keys.spacecraft)
        self._keys, self._tally = keys, tally
        self._seen: set[bytes] = set()
        self.lost_bytes = self.kept = 0

    def read(self, data: Data) -> Iterator[tuple[int, bytes]]:
        """(place of its mark, frame without mark) of each frame that did not come before."""
        mark, size, doubt = self._receiver.mark, self._receiver.frame_bytes, self._receiver.doubt
        seen, at, kept = self._seen, 0, 0
        while (found := data.find(mark, at)) >= 0:
            at = found + len(mark)
            frame = data[at : at + size]
            reason = doubt(frame) if len(frame) == size else "cut"
            if reason:  # only the MAC proves where a frame ends: a genuine one may follow the mark
                self._tally.add(reason, found, self._example(reason, frame))
                continue
            at += size
            kept += len(mark) + size
            proof = frame[-TRAILER : MAC_BYTES - TRAILER]
            if proof in seen:
                self._tally.add("repeated", found)
                continue
            seen.add(proof)
            yield found, frame
        self.lost_bytes += len(data) - kept
        self.kept += kept

    def _example(self, reason: str, frame: bytes) -> str:
        """What was found where something else is looked for."""
        if reason == "spacecraft":
            number = (frame[0] << 8 | frame[1]) >> 4 & 0x3FF
            return f"spacecraft {number}, must be {self._keys.spacecraft}"
        if reason == "spi":
            spi, _ = SECURITY.unpack_from(frame, self._receiver.header)
            return f"key {spi}, must be {self._keys.spi}"
        if reason == "cut":
            return f"{len(frame)} bytes, must be {self._receiver.frame_bytes}"
        return ""
