"""The ground's end of TCP and UDP links: it finds the satellite again whenever it is lost."""

from __future__ import annotations

import socket
import time
from contextlib import suppress

from torquer.flight.link.link import GRACE_S, MOST_WAITING, Link

#: Time between two attempts to connect, and between two greetings over UDP [s].
RETRY_S = 1.0
#: Most bytes taken by one call of `receive`.
_AT_ONCE = 2**18
_LARGEST = 2**16
#: Time between two attempts to send the rest at the end [s].
_LOOK_S = 0.01


class TcpClient(Link):
    """Connects to a satellite that listens, again and again where there is none."""

    def __init__(self, host: str, port: int):
        super().__init__(f"tcp:{host}:{port}")
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        self._family, self._place = family, place
        self._end: socket.socket | None = None
        self._waiting = bytearray()
        self._is_connected, self._due_s = False, 0.0

    @property
    def peers(self) -> int:
        return int(self._is_connected)

    @property
    def is_ready(self) -> bool:
        return self._is_connected

    def receive(self) -> bytes:
        found = bytearray()
        while self._connect() and self._end is not None and len(found) < _AT_ONCE:
            try:
                data = self._end.recv(_LARGEST)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:
                data = b""
            if not data:
                self._lose()
                break
            found += data
        self._push()
        self.received_bytes += len(found)
        return bytes(found)

    def send(self, data: bytes) -> None:
        if not self._connect() or len(self._waiting) + len(data) > MOST_WAITING:
            self.lost_bytes += len(data)
            return
        self._waiting += data
        self._push()

    def close(self) -> None:
        end_s = time.monotonic() + GRACE_S
        while self._waiting and self._end is not None:
            if time.monotonic() >= end_s:
                break
            time.sleep(_LOOK_S)
            self._push()
        self._lose()

    def _connect(self) -> bool:
        """Whether there is a connection; otherwise one is begun, or waited for."""
        if self._is_connected:
            return True
        if self._end is None and time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + RETRY_S
            with suppress(OSError):
                self._end = socket.socket(self._family, socket.SOCK_STREAM)
                self._end.setblocking(False)
                self._end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._end.connect(self._place)  # goes on in the background
        if self._end is not None:
            self._look()
        return self._is_connected

    def _look(self) -> None:
        """Whether the attempt has come to its end."""
        assert self._end is not None
        has_failed = self._end.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) != 0
        try:
            self._end.getpeername()  # there is one as soon as there is a connection
        except OSError:
            if has_failed or time.monotonic() >= self._due_s:
                self._lose()
        else:
            self._is_connected = True

    def _push(self) -> None:
        if self._end is not None and not self._send_waiting(self._end, self._waiting):
            self._lose()

    def _lose(self) -> None:
        self.lost_bytes += len(self._waiting)
        self._waiting.clear()
        self._is_connected = False
        if self._end is not None:
            self._end.close()
            self._end = None


class UdpClient(Link):
    """Greets the satellite with an empty datagram each second, so that it sends its downlink.

    Nobody knows whether the satellite is there unless something comes: `peers` is 0.
    """

    def __init__(self, host: str, port: int):
        super().__init__(f"udp:{host}:{port}")
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        self._end = socket.socket(family, socket.SOCK_DGRAM)
        self._end.setblocking(False)
        self._end.connect(place)  # what others send does not come through
        self._due_s = 0.0

    def receive(self) -> bytes:
        if time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + RETRY_S
            with suppress(OSError):
                self._end.send(b"")
        found = bytearray()
        while len(found) < _AT_ONCE:
            try:
                found += self._end.recv(_LARGEST)
            except OSError:  # nothing there, or nobody
                break
        self.received_bytes += len(found)
        return bytes(found)

    def send(self, data: bytes) -> None:
        try:
            self.sent_bytes += self._end.send(data)
        except OSError:
            self.lost_bytes += len(data)

    def close(self) -> None:
        self._end.close()
