"""UDP: datagrams; whoever has sent one gets the downlink."""

from __future__ import annotations

import socket

from torquer.flight.link.link import MOST_PEERS, PEER_BYTES, Link
from torquer.flight.link.tcp import describe_end

#: Most bytes sent in a datagram: no network cuts it.
DATAGRAM_BYTES = 1400
_LARGEST = 2**16


class UdpLink(Link):
    """The latest `MOST_PEERS` that have sent a datagram are the peers; an empty one is enough.

    Datagrams are joined to a stream in the order in which they come. Nobody knows whether one that
    was sent arrives: `lost_bytes` are those that the operating system did not take.
    """

    def __init__(self, host: str, port: int):
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(place)
        except OSError:
            self._socket.close()
            raise
        super().__init__(f"udp:{describe_end(self._socket)}")
        #: In the order in which they were last heard of.
        self._peers: dict[tuple, None] = {}

    @property
    def peers(self) -> int:
        """How many get the downlink."""
        return len(self._peers)

    def receive(self) -> bytes:
        found = bytearray()
        for _ in range(MOST_PEERS):
            if len(found) >= PEER_BYTES:
                break
            try:
                data, peer = self._socket.recvfrom(_LARGEST)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:  # a peer that has gone, where the system says so
                continue
            found += data
            self._note_peer(peer)
        self.received_bytes += len(found)
        return bytes(found)

    def send(self, data: bytes) -> None:
        parts = [data[at : at + DATAGRAM_BYTES] for at in range(0, len(data), DATAGRAM_BYTES)]
        for peer in self._peers:
            for part in parts:
                try:
                    self.sent_bytes += self._socket.sendto(part, peer)
                except OSError:
                    self.lost_bytes += len(part)

    def close(self) -> None:
        self._socket.close()

    def _note_peer(self, peer: tuple) -> None:
        self._peers.pop(peer, None)
        self._peers[peer] = None
        if len(self._peers) > MOST_PEERS:
            del self._peers[next(iter(self._peers))]
