"""CAN by python-can (extra `can`): frames in segments, paced."""

from __future__ import annotations

import queue
import threading
import time
from typing import Any

import can

from torquer.flight.link.link import GRACE_S, MOST_WAITING, Link
from torquer.flight.link.screen import NewScreen
from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Direction
from torquer.flight.packets.segments import SEGMENT_BYTES, Joiner, Segment, Splitter, find_direction

#: Pause after each segment [s]: about a third of a bus of 1 Mbit/s; a flood loses segments.
PAUSE_S = 0.0005
#: How long a segment may wait for the bus [s].
_TIMEOUT_S = 0.2
#: Most segments taken by one call of `receive`.
_MOST_SEGMENTS = 1024
#: What python-can raises where a bus cannot be opened.
_NO_BUS = (can.CanError, OSError, ValueError, NotImplementedError, ImportError)


def open_bus(interface: str, channel: str) -> can.BusABC:
    """A bus; ValueError with one line if there is none."""
    # multicast with a hop limit of 0 stays on this machine
    keys: dict[str, Any] = {"hop_limit": 0} if interface == "udp_multicast" else {}
    try:
        return can.Bus(interface=interface, channel=channel, ignore_config=True, **keys)
    except _NO_BUS as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"must be a CAN bus that can be opened ({why})") from None


class CanLink(Link):
    """A node on a bus; whoever listens there gets what it sends, so that no peer is known.

    A thread sends, with a pause after each segment. `sends`: the direction of what it sends,
    "down" for the satellite; it receives the other one. One screen has what all send.
    """

    def __init__(
        self,
        bus: can.BusABC,
        address: str,
        dictionary: Dictionary,
        sends: Direction = "down",
        new_screen: NewScreen | None = None,
    ):
        super().__init__(address, new_screen)
        self._screen = self._new_screen()
        self._bus, self._receives = bus, "up" if sends == "down" else "down"
        self._splitter = Splitter(dictionary, sends)
        self._joiner = Joiner(dictionary, "up" if sends == "down" else "down")
        self._waiting: queue.SimpleQueue[Segment | None] = queue.SimpleQueue()
        self._unreadable = 0
        self._failed: Exception | None = None
        self._counting, self._ended = threading.Lock(), threading.Event()
        self._splitting = threading.Lock()
        self._thread = threading.Thread(target=self._send_all, name="CAN", daemon=True)
        self._thread.start()

    def receive(self) -> bytes:
        found = bytearray()
        for _ in range(_MOST_SEGMENTS):
            try:
                message = self._bus.recv(0.0)
            except (can.CanError, OSError):  # no CAN frame
                self._unreadable += 1
                continue
            if message is None:
                break
            found += self._taken(message)
        self.received_bytes += len(found)
        return self._handed_on(self._screen.pass_on(bytes(found), time.monotonic()))

    def send(self, data: bytes) -> None:
        if self._failed is not None:
            raise RuntimeError(f"{self.address}: {self._failed}") from self._failed
        with self._splitting:  # segments of two threads are not to be interleaved
            # split in any case: the counters then say what was lost
            segments = list(self._splitter.split(data))
            if (self._waiting.qsize() + len(segments)) * SEGMENT_BYTES > MOST_WAITING:
                self._lose(len(data))
                return
            for segment in segments:
                self._waiting.put(segment)

    def close(self) -> None:
        self._waiting.put(None)
        self._thread.join(GRACE_S)
        self._ended.set()
        self._thread.join(2.0 * _TIMEOUT_S)
        self._bus.shutdown()
        while not self._waiting.empty():
            segment = self._waiting.get()
            self._lose(len(segment.data) if segment else 0)

    def counts(self) -> dict[str, int]:
        """The counters by name, with what was lost of the segments that should have come."""
        return super().counts() | {
            "lost_frames": self._joiner.lost_frames,
            "lost_segments": self._joiner.lost_segments,
            "rejected_segments": sum(self._joiner.rejected.values()) + self._unreadable,
        }

    def _taken(self, message: can.Message) -> bytes:
        if not message.is_extended_id or message.is_error_frame or message.is_remote_frame:
            self._unreadable += 1
            return b""
        if find_direction(message.arbitration_id) != self._receives:
            return b""  # what is sent here comes back, on some buses
        return self._joiner.feed(message.arbitration_id, bytes(message.data))

    def _send_all(self) -> None:
        try:
            while (segment := self._waiting.get()) is not None:
                self._send(segment)
                if self._ended.wait(PAUSE_S):
                    return
        except Exception as error:  # what ends the thread must not remain unknown
            self._failed = error

    def _send(self, segment: Segment) -> None:
        message = can.Message(arbitration_id=segment.can_id, data=segment.data, is_extended_id=True)
        try:
            self._bus.send(message, _TIMEOUT_S)
        except (can.CanError, OSError):
            self._lose(len(segment.data))
        else:
            self.sent_bytes += len(segment.data)

    def _lose(self, number: int) -> None:
        with self._counting:
            self.lost_bytes += number
