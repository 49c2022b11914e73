"""A satellite without flight software, for tests of the ground: it counts, and obeys."""

import json
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from itertools import islice
from types import SimpleNamespace

from ground_flight import Client, until

from torquer.flight.link import open_link
from torquer.flight.packets.frames import Downlink, Stream
from torquer.flight.packets.protected import CommandReceiver, TelemetrySender
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.software_file import load_link

#: Pieces of what is injected that are sent at a time.
_AT_ONCE = 50


class SmallSatellite:
    """Sends `parameter` with 1, 2, 3 ... each `pace_s`, and an answer to each command.

    `sent`: the last number; `obeyed`: commands that were accepted; `is_mute`: sends nothing.
    `injected`: an iterator of bytes to be sent, too.
    """

    def __init__(self, address="tcp:127.0.0.1:0", pace_s=0.05):
        software = load_link()
        keys, self._dictionary = software.keys, software.dictionary
        self._sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
        own = {keys.spi: keys.up, keys.recovery_spi: keys.recovery}
        self.receiver = CommandReceiver(own, keys.spacecraft)
        self._stream, self._made = Stream(self._dictionary, "up"), Downlink(self._dictionary)
        self._link, self.pace_s = open_link(address), pace_s
        self._is_on_bus = address.startswith("can:")  # where nobody knows who listens
        self.address, self.sent, self.obeyed, self.is_mute = self._link.address, 0, [], False
        self.injected = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._fly, daemon=True)
        self._thread.start()

    def _fly(self):
        due_s = 0.0
        while not self._ended.wait(0.01):
            for part in self.receiver.feed(self._link.receive()):
                for frame in self._stream.feed(part):
                    self._obey(frame)
            if (
                (self._link.peers or self._is_on_bus)
                and not self.is_mute
                and time.monotonic() >= due_s
            ):
                due_s = time.monotonic() + self.pace_s
                self.sent += 1
                self._send("parameter", (7, float(self.sent)))
            if self.injected is not None:
                data = b"".join(islice(self.injected, _AT_ONCE))
                self._link.send(data)
                self.injected = self.injected if data else None

    def _obey(self, frame):
        self.obeyed.append(frame.packet.name)
        values = {
            "command_id": frame.packet.id,
            "module_id": frame.module,
            "accepted": 1,
            "code": int(Reason.DONE),
            "command_time": frame.time_s,
            "request": frame.request,
        }
        names = self._dictionary.down["acknowledgement"].names
        self._send("acknowledgement", tuple(values.get(name, 0) for name in names))

    def _send(self, name, values):
        frame = self._made.frame(name, 1000 + self.sent, values)
        self._link.send(self.wrap(frame))

    def wrap(self, frame):
        """A frame as it goes down."""
        return self._sender.wrap(frame) + self._sender.flush()

    def close(self):
        self._ended.set()
        self._thread.join(10.0)
        self._link.close()


@contextmanager
def small_satellite(**keys):
    made = SmallSatellite(**keys)
    try:
        yield made
    finally:
        made.close()


def received(client, key="sat"):
    """The numbers of the satellite that are in the archive, in the order of its time; [] if none
    can be read now.
    """
    status, body, _ = client.raw(f"/api/{key}/history/parameter/value?size=20000&latest=1")
    assert status in (200, 503)
    return [row[2] for row in json.loads(body)] if status == 200 else []


def command(client, key="sat"):
    """Send a command; its state once it has been answered."""
    status, ordered = client.order("get_parameter", key, index=0)
    return client.ends(ordered["id"], key)["state"] if status == 200 else ordered["error"]


def ground_process(folder, address, *options, start=("-m", "torquer"), port=0, **keys):
    """A ground in a process of its own, once it serves, and its client.

    `start`: how Python begins the command line.
    """
    run = [sys.executable, *start, "ground", "--link", address, "--satellite", "sat"]
    run += ["--folder", str(folder), "--port", str(port), "--no-browser", *map(str, options)]
    process = subprocess.Popen(
        run, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **keys
    )
    client = Client(SimpleNamespace(address=process.stdout.readline().strip(), watcher=""))
    until(lambda: client.raw("/")[0] == 200)
    return process, client
