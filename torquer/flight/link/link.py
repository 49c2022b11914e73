"""What all links have in common. None of their functions waits, so that the flight never does."""

from __future__ import annotations

import socket

from torquer.flight.link.screen import Found, NewScreen, Unscreened, choose

#: Most bytes taken from a peer by one call of `receive`; what is left waits for the next one.
PEER_BYTES = 2048
#: Most peers at a time.
MOST_PEERS = 16
#: Most bytes that wait for a peer: 256 KiB.
MOST_WAITING = 2**18
#: How long `close` may take to send what still waits [s].
GRACE_S = 1.0


class Link:
    """One end of a link: the satellite's, or the ground's.

    `address`: of the satellite's end, with the port that it was given; `sent_bytes`,
    `received_bytes`: of all peers together; `lost_bytes`: what a peer did not get, because it does
    not read or has gone, or because it could not be sent.
    """

    def __init__(self, address: str, new_screen: NewScreen | None = None):
        """`new_screen`: what makes the screen of a peer; bytes go on as they come without one."""
        self.address = address
        self._new_screen: NewScreen = new_screen or Unscreened
        self._is_screened = new_screen is not None
        self.sent_bytes = self.received_bytes = self.lost_bytes = 0

    @property
    def peers(self) -> int:
        """How many peers there are; 0 on a bus, where this is not known."""
        return 0

    @property
    def is_ready(self) -> bool:
        """Whether what is sent now has a way to go."""
        return True

    def receive(self) -> bytes:
        """What has come since the last call; b"" if nothing has.

        With a screen whole frames, those of each peer by themselves; else bytes as they come.
        """
        raise NotImplementedError

    def send(self, data: bytes) -> None:
        """Send to all peers. A peer for which too much waits already loses all of `data`."""
        raise NotImplementedError

    def close(self) -> None:
        """Send what still waits, for at most `GRACE_S`, and end."""
        raise NotImplementedError

    def _send_waiting(self, end: socket.socket, waiting: bytearray) -> bool:
        """Send of what waits for a peer as much as goes; whether the peer is still there."""
        try:
            while waiting:
                sent = end.send(waiting)
                self.sent_bytes += sent
                del waiting[:sent]
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:
            return False
        return True

    def _handed_on(self, found: Found) -> bytes:
        """What is handed on of what has come from all peers."""
        return choose(found) if self._is_screened else b"".join(data for data, _ in found)

    def counts(self) -> dict[str, int]:
        """The counters by name."""
        return {
            "peers": self.peers,
            "sent_bytes": self.sent_bytes,
            "received_bytes": self.received_bytes,
            "lost_bytes": self.lost_bytes,
        }
