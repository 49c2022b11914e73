"""TCP: clients connect, command, and get the downlink."""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress

from torquer.flight.link.link import GRACE_S, MOST_PEERS, MOST_WAITING, PEER_BYTES, Link


class _Peer:
    """A client, and what waits to be sent to it."""

    def __init__(self, end: socket.socket):
        self.end, self.waiting = end, bytearray()
        end.setblocking(False)
        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)


class TcpLink(Link):
    """Any number of clients up to `MOST_PEERS`; one more is shut out until another has gone.

    What waits for a client is bounded by `MOST_WAITING`: beyond it the client loses whole calls of
    `send`, so that what it gets are whole frames.
    """

    def __init__(self, host: str, port: int):
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        self._server = socket.create_server(place[:2], family=family, backlog=MOST_PEERS)
        self._server.setblocking(False)
        super().__init__(f"tcp:{describe_end(self._server)}")
        self._peers: list[_Peer] = []

    @property
    def peers(self) -> int:
        """How many clients are connected, as far as this is known."""
        return len(self._peers)

    def receive(self) -> bytes:
        self._accept()
        found = b"".join([self._read(peer) for peer in list(self._peers)])
        self.received_bytes += len(found)
        return found

    def send(self, data: bytes) -> None:
        self._accept()
        for peer in list(self._peers):
            if len(peer.waiting) + len(data) > MOST_WAITING:
                self._push(peer)
            if len(peer.waiting) + len(data) > MOST_WAITING:
                self.lost_bytes += len(data)
                continue
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
        """Take the clients that have connected since."""
        with suppress(OSError):
            while True:
                end, _ = self._server.accept()
                if len(self._peers) < MOST_PEERS:
                    self._peers.append(_Peer(end))
                else:
                    end.close()

    def _read(self, peer: _Peer) -> bytes:
        try:
            data = peer.end.recv(PEER_BYTES)
        except (BlockingIOError, InterruptedError):
            return b""
        except OSError:
            data = b""
        if not data:
            self._part_from(peer)
        return data

    def _push(self, peer: _Peer) -> None:
        if not self._send_waiting(peer.end, peer.waiting):
            self._part_from(peer)

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
