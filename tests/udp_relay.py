"""A network between ground and satellite by UDP that doubles and reorders datagrams, for tests."""

import contextlib
import random
import select
import socket
import threading


class UdpRelay:
    """Passes datagrams between whoever sends to `address` and a satellite.

    `doubled`, `late`: shares of datagrams that come twice, and after the next one.
    """

    def __init__(self, satellite, doubled=0.0, late=0.0, seed=1):
        host, port = satellite.removeprefix("udp:").rsplit(":", 1)
        self._place, self._shares, self._random = (host, int(port)), (doubled, late), None
        self._random = random.Random(seed)
        self._near, self._far = (socket.socket(type=socket.SOCK_DGRAM) for _ in range(2))
        self._near.bind(("127.0.0.1", 0))
        self.address = f"udp:127.0.0.1:{self._near.getsockname()[1]}"
        self._client, self._held = None, {"up": None, "down": None}
        self.passed = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._pass_all, daemon=True)
        self._thread.start()

    def move(self, satellite):
        """From now on the satellite is at another address."""
        host, port = satellite.removeprefix("udp:").rsplit(":", 1)
        self._place = host, int(port)

    def _pass_all(self):
        while not self._ended.is_set():
            for end in select.select([self._near, self._far], [], [], 0.05)[0]:
                with contextlib.suppress(OSError):
                    data, place = end.recvfrom(2**16)
                    if end is self._near:
                        self._client = place
                        self._pass(data, self._far, self._place, "up")
                    elif self._client is not None:
                        self._pass(data, self._near, self._client, "down")

    def _pass(self, data, end, place, way):
        doubled, late = self._shares
        held, self._held[way] = self._held[way], None
        if data and held is None and self._random.random() < late:
            self._held[way] = data
            return
        for each in [data, *([data] if self._random.random() < doubled else []), held]:
            if each is not None:
                end.sendto(each, place)
                self.passed += 1

    def close(self):
        self._ended.set()
        self._thread.join(5.0)
        self._near.close()
        self._far.close()
