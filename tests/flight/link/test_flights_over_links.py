"""`torquer fly --listen`: a client commands, gets the answer, and the session replays."""

import contextlib
import json
import os
import signal
import socket
import time

import pytest

from torquer.cli import main
from torquer.compile import engine
from torquer.flight.packets.frames import Uplink
from torquer.flight.packets.station import Station
from torquer.flight.software import session
from torquer.flight.software.session_file import load_session
from torquer.flight.software.software import load_software

DAY = "examples/chibis_m_day.toml"
TICKS = 300
flies = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture
def call(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return left.value.code, out, err

    return run


class Client:
    """A clock for the flight: while the flight waits for a control step, the client acts."""

    def __init__(self, monkeypatch, act):
        self.now, self.step, self.act, self.link = 0.0, 0, act, None
        self.end, self.got = None, b""
        software = load_software()
        self.station, self.uplink = Station(software), Uplink(software.dictionary)
        monkeypatch.setattr(session, "time", self)
        from torquer.cli.commands import fly

        open_link = fly.open_link

        def opened(*arguments):
            self.link = open_link(*arguments)
            return self.link

        monkeypatch.setattr(fly, "open_link", opened)

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds
        self.step += 1
        self.act(self, self.step)
        if self.end is not None:
            time.sleep(0.001)  # so that the bytes are there on any system
            with contextlib.suppress(BlockingIOError):
                self.got += self.end.recv(1_000_000)

    def connect(self):
        host, port = self.link.address.removeprefix("tcp:").split(":")
        self.end = socket.create_connection((host, int(port)), 20)
        self.end.setblocking(False)

    def command(self, name, *values):
        return self.station.command(self.uplink.frame(name, 0, (1, *values)))

    def names(self):
        """Packets that came down to the client."""
        return [frame.packet.name for frame in self.station.receive(self.got)]


def flown(call, out, *arguments):
    return call(
        *("fly", DAY, "--speed", 1000, "--ticks", TICKS, "--out", out, "--json"),
        *("--listen", "tcp:127.0.0.1:0", *arguments),
    )


@flies
def test_a_client_commands_and_gets_the_acknowledgement(call, tmp_path, monkeypatch):
    def act(client, step):
        if step == 50:
            client.connect()
        if step == 60:
            ping = client.command("get_parameter", 0)
            client.end.send(ping[:5])
            client.rest = ping[5:]
        if step == 61:
            client.end.send(client.rest)

    client = Client(monkeypatch, act)
    code, text, err = flown(call, tmp_path)
    client.end.close()
    answer = json.loads(text)
    assert code == 0 and f"listening on {client.link.address}" in err
    assert "acknowledgement" in client.names()
    assert answer["packets"]["acknowledgement"] == 1
    assert answer["link"]["received_bytes"] > 0 == answer["link"]["lost_bytes"]
    assert (tmp_path / "downlink.bin").read_bytes().endswith(client.got[-200:])
    uplink = load_session(tmp_path / "session.json").uplink
    assert len(uplink) == 1 and all(step >= 50 for step, _ in uplink)  # once it is whole
    assert call("session", "replay", tmp_path / "session.json")[0] == 0


@flies
def test_flight_replays_despite_garbage_and_coming_and_going_clients(call, tmp_path, monkeypatch):
    def act(client, step):
        if step in (20, 40, 60):
            client.connect()
        if step in (25, 45):
            client.end.send(bytes(range(256)) * 3 + client.command("get_parameter", 0)[:9])
        if step in (30, 50):
            client.end.close()
            client.end = None
        if step == 65:
            client.got = b""
        if step in (70, 80, 90):  # the first may be taken for the rest of what was cut
            client.end.send(client.command("get_parameter", 0))

    client = Client(monkeypatch, act)
    code, text, _ = flown(call, tmp_path)
    client.end.close()
    answer = json.loads(text)
    assert code == 0 and answer["ticks"] == TICKS
    assert "acknowledgement" in client.names()
    assert call("session", "replay", tmp_path / "session.json")[0] == 0


@flies
@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_an_interrupted_flight_is_written_and_replays(call, tmp_path, monkeypatch):
    def act(client, step):
        if step == 40:
            client.connect()
        if step == 100:
            os.kill(os.getpid(), signal.SIGINT)

    client = Client(monkeypatch, act)
    code, text, err = flown(call, tmp_path)
    client.end.setblocking(True)
    while client.end.recv(65536):
        pass
    client.end.close()
    ticks = json.loads(text)["ticks"]
    assert code == 130 and f"interrupted after {ticks} control steps; what came down" in err
    assert 101 <= ticks <= 102  # the signal may come while the flight waits for the next step
    assert call("session", "replay", tmp_path / "session.json")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("tcp:127.0.0.1:0",), "--listen: must be given with --realtime or --speed"),
        (("7070", "--realtime"), "--listen: must be tcp:HOST:PORT"),
        (("tcp:127.0.0.1:99999", "--realtime"), "--listen: port must be a whole number"),
        (("can:socketcan:nocan9", "--realtime"), "--listen: "),
    ],
)
def test_a_wrong_link_gets_one_line(call, tmp_path, arguments, message):
    code, _, err = call("fly", DAY, "--out", tmp_path, "--listen", *arguments)
    assert code == 2 and message in err


def test_a_port_in_use_gets_one_line(call, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as other:
        address = f"tcp:127.0.0.1:{other.getsockname()[1]}"
        code, _, err = call("fly", DAY, "--out", tmp_path, "--realtime", "--listen", address)
    assert code == 2 and f"must be an address that can be opened; received '{address}'" in err
