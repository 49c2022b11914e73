"""Sixteen clients without the key flood a flight: memory stays, genuine commands are answered."""

import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest
from frame_attacks import refit

from torquer.compile import engine
from torquer.flight.packets.frames import Uplink
from torquer.flight.packets.station import Station
from torquer.flight.software.session import replay_session
from torquer.flight.software.session_file import Replayed, load_session
from torquer.flight.software.software import load_software

pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc"),
    pytest.mark.slow,
]
DAY = "examples/chibis_m_day.toml"
CLIENTS, PATIENCE_S = 16, 120.0
#: Commands before the flood, which somebody has recorded.
RECORDED = 40
#: How long the flood lasts [s], what the flight may grow in it [kB], the answer of a command [s].
FLOOD_S, GROWTH_KB, ANSWER_S = 20.0, 8000, 5.0


class Flood(threading.Thread):
    """Clients that send as much as is taken, connect again when they are shut out, never read."""

    def __init__(self, port, data):
        super().__init__(daemon=True)
        self.port, self.data, self.ended, self.sent = port, data, threading.Event(), 0

    def run(self):
        clients = [None] * CLIENTS
        while not self.ended.wait(0.02):
            for k, client in enumerate(clients):
                try:
                    if client is None:
                        clients[k] = client = socket.create_connection(("127.0.0.1", self.port), 5)
                        client.setblocking(False)
                    self.sent += client.send(self.data[k % len(self.data)])
                except BlockingIOError:
                    pass
                except OSError:
                    clients[k] = None
        for client in filter(None, clients):
            client.close()


class Ground:
    """A client with the key."""

    def __init__(self, port):
        software = load_software()
        self.port, self.end = port, None
        self.station, self.frame = Station(software), Uplink(software.dictionary).frame
        self.station.use_key(0, RECORDED)

    def seconds_to_answer(self):
        """How long the answer to a command takes, from connecting on where it is shut out."""
        begun_s, packets, sent_s = time.monotonic(), [], -PATIENCE_S
        while "acknowledgement" not in packets:
            assert time.monotonic() < begun_s + PATIENCE_S
            if self.end is None:
                self.end, sent_s = (
                    socket.create_connection(("127.0.0.1", self.port), 5),
                    -PATIENCE_S,
                )
                self.end.settimeout(0.1)
            try:
                if time.monotonic() > sent_s + 2.0:
                    command = self.station.command(self.frame("report_status", 0, (1, 1)))
                    self.end.sendall(command)
                    sent_s = time.monotonic()
                data = self.end.recv(65536)
                packets += [frame.packet.name for frame in self.station.receive(data)]
                if not data:
                    self.end = None
            except TimeoutError:
                pass
            except OSError:
                self.end = None
        return time.monotonic() - begun_s


def attacks():
    """What the clients send: noise, marks, beginnings, frames that are forged or were recorded."""
    rng, station = random.Random(4), Station(load_software())
    frame = Uplink(load_software().dictionary).frame("report_status", 0, (1, 1))
    recorded = [station.command(frame) for _ in range(RECORDED)]
    forged = []
    for genuine in recorded:
        changed = bytearray(genuine)
        changed[25] ^= 1
        forged.append(refit(changed))
    begun = b"\xeb\x90" + bytes([0x20, 77, 3, 0xFF])
    kinds = (b"".join(forged), b"".join(recorded), rng.randbytes(4000), begun * 600, b"\xeb\x90")
    return [(kind * (60000 // len(kind) + 1))[:60000] for kind in kinds]


def resident_kb(process):
    with open(f"/proc/{process.pid}/status") as file:
        return int(next(line for line in file if line.startswith("VmRSS")).split()[1])


@pytest.mark.verifies("REQ-LNK-008", "REQ-SES-003", "REQ-SES-004")
def test_a_flood_costs_no_memory_and_delays_no_genuine_command(tmp_path):
    command = [sys.executable, "-m", "torquer", "fly", DAY, "--speed", "20", "--out", tmp_path]
    with subprocess.Popen(
        [*command, "--listen", "tcp:127.0.0.1:0", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as flight:
        address = next(line for line in flight.stderr if "listening on" in line)
        port = int(address.rpartition(":")[2])
        ground, flood = Ground(port), Flood(port, attacks())
        ground.seconds_to_answer()  # compiled from here on
        before_kb = resident_kb(flight)
        flood.start()
        took_s, end_s = [], time.monotonic() + FLOOD_S
        while time.monotonic() < end_s:
            if len(took_s) % 4 == 3:  # somebody new
                ground.end.close()
                ground.end = None
            took_s.append(ground.seconds_to_answer())
            time.sleep(0.5)
        grown_kb = resident_kb(flight) - before_kb
        flood.ended.set()
        flood.join()
        flight.send_signal(signal.SIGINT)
        with contextlib.suppress(OSError):
            ground.end.close()
        out, _ = flight.communicate(timeout=PATIENCE_S)
    assert flood.sent > 1_000_000
    assert max(took_s) < ANSWER_S and len(took_s) > 5
    assert grown_kb < GROWTH_KB
    ticks = json.loads(out)["ticks"]
    size = os.path.getsize(tmp_path / "session.json")
    assert size < 40_000 + 3000 * ticks  # of each control step the little that is refused
    session, again = load_session(tmp_path / "session.json"), Replayed()
    for tick in replay_session(session):
        again.note(tick.downlink)
    assert again.list_digests() == session.digests and session.ticks == ticks
    print(f"answers {took_s}, {grown_kb} kB, {size} B in {ticks} steps, {flood.sent} B sent")
