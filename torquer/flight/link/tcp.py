"""TCP: clients connect, command, and get the downlink."""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress

from torquer.flight.link.link import GRACE_S, MOST_PEERS, MOST_WAITING, PEER_BYTES, Link
from torquer.flight.link.screen import Found, NewScreen, Screen

#: How long a client has its place at least, and how long one may take nothing of what waits for it
#: and send nothing [s].
STAY_S, IDLE_S = 2.0, 30.0


class _Peer:
    """A client, what waits to be sent to it, and whether it has proven to have the key.

    `since_s`: when it came; `active_s`: when it last sent something, or had taken everything.
    """

    def __init__(self, end: socket.socket, screen: Screen):
        self.end, self.waiting, self.screen = end, bytearray(), screen
        self.since_s = self.active_s = time.monotonic()
        self.is_proven = False
        end.setblocking(False)
        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)


class TcpLink(Link):
    """Any number of clients up to `MOST_PEERS`. One more takes the place of the one that has been
    there for longest without a frame that the satellite would accept; a client that has sent such a
    frame keeps its place. So who connects and commands at once is heard, whoever else is there.

    What waits for a client is bounded by `MOST_WAITING`: beyond it the client loses whole calls of
    `send`, so that what it gets are whole frames.
    """

    def __init__(self, host: str, port: int, new_screen: NewScreen | None = None):
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        self._server = socket.create_server(place[:2], family=family, backlog=MOST_PEERS)
        self._server.setblocking(False)
        super().__init__(f"tcp:{describe_end(self._server)}", new_screen)
        self._peers: list[_Peer] = []

    @property
    def peers(self) -> int:
        """How many clients are connected, as far as this is known."""
        return len(self._peers)

    def receive(self) -> bytes:
        self._accept()
        return self._handed_on([each for peer in list(self._peers) for each in self._read(peer)])

    def send(self, data: bytes) -> None:
        self._accept()
        for peer in list(self._peers):
            if len(peer.waiting) + len(data) > MOST_WAITING:
                self._push(peer)
            if len(peer.waiting) + len(data) > MOST_WAITING:
                self.lost_bytes += len(data)
                continue
            if not peer.waiting:
                peer.active_s = time.monotonic()
            peer.waiting += data
            self._push(peer)

    def close(self) -> None:
        end_s = time.monotonic() + GRACE_S
        self._server.close()
        while waiting := [peer for peer in self._peers if peer.waiting]:
            left_s = end_s - time.monotonic()
            if left_s <= 0.0:
                break
            select.select([], [peer.end for peer in waiting], [], left_s)
            for peer in waiting:
                self._push(peer)
        for peer in list(self._peers):
            self._part_from(peer)

    def _accept(self) -> None:
        """Take the clients that have connected since; part from those that have fallen asleep."""
        now_s = time.monotonic()
        for peer in [each for each in self._peers if now_s - each.active_s > IDLE_S]:
            self._push(peer)
            if peer.waiting and peer in self._peers:
                self._part_from(peer)
        with suppress(OSError):
            while True:
                end, _ = self._server.accept()
                if len(self._peers) < MOST_PEERS or self._make_room(now_s):
                    self._peers.append(_Peer(end, self._new_screen()))
                else:
                    end.close()

    def _make_room(self, now_s: float) -> bool:
        """Part from the client that is there for longest without proof, if there is one."""
        others = [
            peer for peer in self._peers if not peer.is_proven and now_s - peer.since_s > STAY_S
        ]
        if others:
            self._part_from(min(others, key=lambda peer: peer.since_s))
        return bool(others)

    def _read(self, peer: _Peer) -> Found:
        """What has come from a client."""
        now_s = time.monotonic()
        try:
            data = peer.end.recv(PEER_BYTES)
        except (BlockingIOError, InterruptedError):
            return peer.screen.pass_on(b"", now_s)
        except OSError:
            data = b""
        if not data:
            self._part_from(peer)
            return []
        self.received_bytes += len(data)
        peer.active_s = now_s
        found = peer.screen.pass_on(data, now_s)
        peer.is_proven = peer.is_proven or any(is_proven for _, is_proven in found)
        return found

    def _push(self, peer: _Peer) -> None:
        before = len(peer.waiting)
        if not self._send_waiting(peer.end, peer.waiting):
            self._part_from(peer)
        elif len(peer.waiting) < before:
            peer.active_s = time.monotonic()

    def _part_from(self, peer: _Peer) -> None:
        self.lost_bytes += len(peer.waiting)
        self._peers.remove(peer)
        with suppress(OSError):
            peer.end.shutdown(socket.SHUT_WR)
        peer.end.close()


def describe_end(end: socket.socket) -> str:
    """HOST:PORT of a socket, IPv6 in brackets."""
    host, port = end.getsockname()[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
