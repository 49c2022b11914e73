"""A satellite in flight and a ground that serves it, for tests: in threads of this process."""

import contextlib
import json
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from onboard_ground import scenario

from torquer.flight.link import open_link, screens_of
from torquer.flight.software.core import Core
from torquer.ground.contact import AS_ARCHIVED
from torquer.ground.file import SatelliteTable, make_satellite
from torquer.pages.ground.server import Ground

#: Far longer than anything here takes: only a failure waits so long.
PATIENCE_S = 60.0
#: Pause after each control step of a flight [s], and where a browser needs much of the machine.
PACE_S, SLOW_PACE_S = 0.01, 0.1


def until(what, why="it takes too long", patience_s=PATIENCE_S):
    """Wait for a truth; what it was."""
    end_s = time.monotonic() + patience_s
    while not (found := what()):
        assert time.monotonic() < end_s, why
        time.sleep(0.01)
    return found


@contextlib.contextmanager
def flying(software=None, address="tcp:127.0.0.1:0", memory=None, flown=None, pace_s=PACE_S):
    """The address of a satellite that flies; `log`: bytes that went up; `flown`: its scenario;
    `pace_s`: the pause after each control step.
    """
    core = Core(flown or scenario(864000.0), software, memory)
    link = open_link(address, core.software.dictionary, screens_of(core.software, core.judge))
    core.tick()  # compiled before anybody waits
    ended, flight = threading.Event(), Flying(link.address)

    def fly():
        while not ended.wait(pace_s):
            uplink = flight.injected + link.receive()
            flight.injected = b""
            flight.uplink += uplink
            link.send(core.tick(uplink))

    thread = threading.Thread(target=fly, daemon=True)
    thread.start()
    try:
        yield flight
    finally:
        ended.set()
        thread.join(PATIENCE_S)
        link.close()


class Flying:
    """A flight: its address, what it has received; `injected`: received with the next step."""

    def __init__(self, address):
        self.address, self.uplink, self.injected = address, b"", b""


class Client:
    """What asks a ground, as a browser and the command line do."""

    def __init__(self, ground):
        parts = urlsplit(ground.address)
        self.base, self.port = f"{parts.scheme}://{parts.netloc}", parts.port
        self.token, self.watcher = parse_qs(parts.query)["token"][0], ground.watcher
        self._open = urllib.request.build_opener(urllib.request.ProxyHandler({})).open

    def raw(self, path, body=None, **headers):
        """(status, body, headers) of an answer."""
        request = urllib.request.Request(self.base + path, body)
        for name, value in {"authorization": f"Bearer {self.token}", **headers}.items():
            if value is not None:
                request.add_header(name, value)
        try:
            with self._open(request, timeout=PATIENCE_S) as answer:
                return answer.status, answer.read(), dict(answer.headers)
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read(), dict(error.headers)

    def get(self, path):
        status, body, _ = self.raw(f"/api/{path}")
        assert status == 200, body
        return json.loads(body)

    def order(self, command, key="chibis", **values):
        """(status, answer) of a command."""
        body = json.dumps({"command": command, "values": values}).encode()
        status, answer, _ = self.raw(f"/api/{key}/commands", body)
        return status, json.loads(answer)

    def ends(self, number, key="chibis"):
        """A command once it has been answered."""
        return until(
            lambda: next(
                (
                    each
                    for each in self.get(f"{key}/sent")
                    if each["id"] == number and each["state"] not in ("waiting", "sent")
                ),
                None,
            ),
            "no answer",
        )

    def value(self, number, key="chibis", packet="extended"):
        """The newest row of a number, once there is one."""
        path = f"{key}/history/{packet}/{number}?latest=1&size=1"
        return until(lambda: self.get(path), "no telemetry")[0]

    def texts(self, key="chibis"):
        """The texts of the log."""
        return [each["text"] for each in self.get(f"{key}/log")]

    def live(self, **headers):
        """A websocket with the page's cookie; close it."""
        from websockets.sync.client import connect

        own = {"Cookie": f"torquer_{self.port}={self.token}", "Origin": self.base}
        return connect(
            f"ws://127.0.0.1:{self.port}/api/live",
            additional_headers={k: v for k, v in (own | headers).items() if v},
            proxy=None,
        )


def table(address, software=None, in_scenario="examples/chibis_m_day.toml"):
    """A satellite of the ground file."""
    path = Path(in_scenario) if in_scenario else None
    return SatelliteTable(link=address, software=software, scenario=path)


@contextlib.contextmanager
def serving(folder, counters=AS_ARCHIVED, **tables):
    """A client of a ground that serves satellites by their short names."""
    folder.mkdir(parents=True, exist_ok=True)
    satellites = [make_satellite(key, each) for key, each in tables.items()]
    ground, ready = Ground(satellites, folder, 0, counters), threading.Event()
    thread = threading.Thread(target=ground.serve, args=(ready.set,), daemon=True)
    thread.start()
    assert ready.wait(PATIENCE_S)
    try:
        client = Client(ground)
        until(lambda: client.raw("/")[0] == 200)
        yield client
    finally:
        ground.stop()
        thread.join(PATIENCE_S)
        assert not thread.is_alive() and not ground.unarchived, ground.unarchived


@contextlib.contextmanager
def serving_slowly(folder):
    """A client of a ground with a satellite in flight that leaves a browser much of the machine."""
    with (
        flying(pace_s=SLOW_PACE_S) as satellite,
        serving(folder, chibis=table(satellite.address)) as client,
    ):
        client.value("omega_x")
        yield client
