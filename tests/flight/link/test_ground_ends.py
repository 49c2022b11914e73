"""The ground's end of links: finds the satellite, loses it, finds it again; both ways."""

import contextlib
import socket
import time

import pytest

from torquer.flight.link import connect, open_link
from torquer.flight.link.link import MOST_WAITING

HOST = "127.0.0.1"
#: Far longer than anything here takes: only a failure waits so long.
PATIENCE_S = 20.0


def until(what, *links):
    """Wait for a condition while links work."""
    end_s = time.monotonic() + PATIENCE_S
    while not what():
        for link in links:
            link.receive()
        assert time.monotonic() < end_s, "it takes too long"
        time.sleep(0.002)


def got(link, size, *others):
    """Bytes received until there are so many."""
    found, end_s = b"", time.monotonic() + PATIENCE_S
    while len(found) < size:
        found += link.receive()
        for other in others:
            other.receive()
        assert time.monotonic() < end_s, f"{len(found)} of {size} bytes"
    return found


@pytest.fixture(params=["tcp", "udp"])
def ends(request):
    with (
        contextlib.closing(open_link(f"{request.param}:{HOST}:0")) as satellite,
        contextlib.closing(connect(satellite.address)) as ground,
    ):
        until(lambda: satellite.peers, satellite, ground)
        yield satellite, ground


def test_bytes_go_both_ways(ends):
    satellite, ground = ends
    down, up = bytes(range(256)) * 4, b"command"
    satellite.send(down)
    assert got(ground, len(down)) == down and ground.is_ready
    ground.send(up)
    assert got(satellite, len(up), ground) == up
    assert ground.counts()["received_bytes"] == len(down)
    assert ground.counts()["sent_bytes"] == len(up)


def free_port():
    with socket.create_server((HOST, 0)) as taken:
        return taken.getsockname()[1]


def test_ground_finds_a_satellite_that_comes_late_and_returns():
    address = f"tcp:{HOST}:{free_port()}"
    with contextlib.closing(connect(address)) as ground:
        assert (ground.receive(), ground.is_ready) == (b"", False)
        ground.send(b"lost")
        assert ground.lost_bytes == 4
        for word in (b"first", b"again"):
            with contextlib.closing(open_link(address)) as satellite:
                until(lambda: ground.peers and satellite.peers, ground, satellite)
                satellite.send(word)
                assert got(ground, len(word)) == word
            until(lambda: not ground.peers, ground)


def test_a_satellite_that_does_not_read_costs_bounded_memory():
    with socket.create_server((HOST, 0)) as server:
        address = f"tcp:{HOST}:{server.getsockname()[1]}"
        with contextlib.closing(connect(address)) as ground:
            until(lambda: ground.peers, ground)
            part = bytes(2**16)
            for _ in range(200):
                ground.send(part)
            assert ground.lost_bytes > 0
            assert ground.lost_bytes + ground.sent_bytes + MOST_WAITING >= 200 * len(part)


def test_strangers_are_not_heard_over_udp():
    with (
        contextlib.closing(open_link(f"udp:{HOST}:0")) as satellite,
        contextlib.closing(connect(satellite.address)) as ground,
        socket.socket(type=socket.SOCK_DGRAM) as stranger,
    ):
        until(lambda: satellite.peers, satellite, ground)
        stranger.sendto(b"forged", ground._end.getsockname())
        satellite.send(b"genuine")
        assert got(ground, 7) == b"genuine"


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp:127.0.0.1", "must be tcp:HOST:PORT"),
        ("udp:127.0.0.1:-1", "port must be a whole number"),
        ("serial:/dev/ttyS0", "must be tcp:HOST:PORT"),
    ],
)
def test_a_wrong_address_gets_one_line(address, message):
    with pytest.raises(ValueError, match=message) as refused:
        connect(address)
    assert address in str(refused.value) and "\n" not in str(refused.value)


def test_both_ends_of_a_can_bus():
    pytest.importorskip("can")
    with (
        contextlib.closing(open_link("can:virtual:ground_end")) as satellite,
        contextlib.closing(connect("can:virtual:ground_end")) as ground,
    ):
        satellite.send(bytes(100))
        assert got(ground, 100) == bytes(100)
        ground.send(b"\x01" * 50)
        assert got(satellite, 50) == b"\x01" * 50
