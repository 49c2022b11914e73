"""UDP: datagrams; whoever has sent one gets the downlink."""

from __future__ import annotations

import socket
import time

from torquer.flight.link.link import MOST_PEERS, PEER_BYTES, Link
from torquer.flight.link.screen import Found, NewScreen
from torquer.flight.link.tcp import describe_end

#: How long a peer that sends nothing gets the downlink [s].
IDLE_S = 60.0
#: Most bytes sent in a datagram: no network cuts it.
DATAGRAM_BYTES = 1400
_LARGEST = 2**16


class UdpLink(Link):
    """The latest `MOST_PEERS` that have sent a datagram are the peers; an empty one is enough, and
    one that the satellite would accept keeps the place.

    With a screen a frame does not go on in another datagram. Nobody knows whether one that
    was sent arrives: `lost_bytes` are those that the operating system did not take.
    """

    def __init__(self, host: str, port: int, new_screen: NewScreen | None = None):
        family, *_, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(place)
        except OSError:
            self._socket.close()
            raise
        super().__init__(f"udp:{describe_end(self._socket)}", new_screen)
        #: When each was last heard of, in that order; those that have proven to have the key.
        self._peers: dict[tuple, float] = {}
        self._proven: set[tuple] = set()

    @property
    def peers(self) -> int:
        """How many get the downlink."""
        return len(self._peers)

    def receive(self) -> bytes:
        found: Found = []
        now_s, size = time.monotonic(), 0
        for _ in range(MOST_PEERS):
            if size >= PEER_BYTES:
                break
            try:
                data, peer = self._socket.recvfrom(_LARGEST)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:  # a peer that has gone, where the system says so
                continue
            size += len(data)
            passed = self._new_screen().pass_on(data, now_s)
            found += passed
            self._note_peer(peer, now_s, any(is_proven for _, is_proven in passed))
        self.received_bytes += size
        for peer in [each for each, at_s in self._peers.items() if now_s - at_s > IDLE_S]:
            self._forget(peer)
        return self._handed_on(found)

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

    def _note_peer(self, peer: tuple, now_s: float, is_proven: bool) -> None:
        self._peers.pop(peer, None)
        self._peers[peer] = now_s
        if is_proven:
            self._proven.add(peer)
        if len(self._peers) > MOST_PEERS:
            self._forget(next((each for each in self._peers if each not in self._proven), peer))

    def _forget(self, peer: tuple) -> None:
        del self._peers[peer]
        self._proven.discard(peer)
