"""TCP and UDP: bytes whole and in order, peers that vanish, never read, or come back."""

import contextlib
import importlib
import socket
import time

import pytest

from torquer.flight.link import open_link, screens_of
from torquer.flight.link.link import MOST_PEERS, MOST_WAITING, PEER_BYTES
from torquer.flight.packets.frames import Uplink
from torquer.flight.packets.protected import CommandReceiver, CommandSender
from torquer.flight.packets.software_file import load_link

tcp_link = importlib.import_module("torquer.flight.link.tcp")

HOST = "127.0.0.1"
#: Far longer than anything here takes: only a failure waits so long.
PATIENCE_S = 20.0


@pytest.fixture(params=["tcp", "udp"])
def link(request):
    with contextlib.closing(open_link(f"{request.param}:{HOST}:0")) as opened:
        yield opened


@pytest.fixture
def tcp():
    with contextlib.closing(open_link(f"tcp:{HOST}:0")) as opened:
        yield opened


def port_of(link):
    return int(link.address.rpartition(":")[2])


@contextlib.contextmanager
def client_of(link):
    """A peer of a link, known to it."""
    is_tcp = link.address.startswith("tcp")
    with socket.socket(type=socket.SOCK_STREAM if is_tcp else socket.SOCK_DGRAM) as end:
        end.settimeout(PATIENCE_S)
        before = link.peers
        end.connect((HOST, port_of(link)))
        if not is_tcp:
            end.send(b"")
        until(lambda: link.receive() == b"" and link.peers == before + 1)
        yield end


def until(is_so):
    """Wait for what must come."""
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.001)


def received(link, size):
    """So many bytes out of a link."""
    found = bytearray()
    until(lambda: found.extend(link.receive()) or len(found) >= size)
    return bytes(found)


def taken(client, size):
    """So many bytes at a client."""
    found = b""
    while len(found) < size:
        part = client.recv(65536)
        assert part
        found += part
    return found


@pytest.mark.parametrize("step", [1, 7, 500, 1300])
def test_bytes_come_whole_and_in_order_however_they_are_split(link, step):
    data = bytes(range(256)) * 4
    parts = [data[at : at + step] for at in range(0, len(data), step)]
    with client_of(link) as client:
        found = b""
        for part in parts:
            client.send(part)
            found += link.receive()
        found += received(link, len(data) - len(found))
        assert found == data
        for part in parts:
            link.send(part)
            assert taken(client, len(part)) == part
    assert link.sent_bytes == link.received_bytes == len(data)
    assert link.lost_bytes == 0


def test_all_peers_get_the_same(link):
    with client_of(link) as first, client_of(link) as second, client_of(link) as third:
        link.send(b"to all" * 500)
        for client in (first, second, third):
            assert taken(client, 3000) == b"to all" * 500
    assert link.sent_bytes == 9000


def test_nobody_there_is_no_loss(link):
    link.send(b"into the void")
    assert (link.receive(), link.peers) == (b"", 0)
    assert (link.sent_bytes, link.lost_bytes) == (0, 0)


def test_client_vanishing_within_a_frame_is_forgotten_and_may_return(tcp):
    with client_of(tcp) as client:
        client.sendall(b"half a fra")
        assert received(tcp, 10) == b"half a fra"
    until(lambda: tcp.receive() == b"" and tcp.peers == 0)
    tcp.send(b"nobody gets this")
    with client_of(tcp) as client:
        client.sendall(b"whole")
        tcp.send(b"answer")
        assert received(tcp, 5) == b"whole" and taken(client, 6) == b"answer"


def test_a_client_that_is_reset_is_forgotten(tcp):
    with client_of(tcp) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    until(lambda: (tcp.send(b"x"), tcp.peers)[1] == 0)
    assert tcp.receive() == b""


def test_never_reading_client_is_bounded_and_loses_whole_pieces(tcp):
    size = 60_000
    pieces = [bytes([number]) * size for number in range(256)]
    with client_of(tcp) as lazy:
        for piece in pieces:
            tcp.send(piece)
        (peer,) = tcp._peers
        assert len(peer.waiting) <= MOST_WAITING
        assert tcp.lost_bytes > 0 and tcp.lost_bytes % size == 0
        number = len(pieces) - tcp.lost_bytes // size
        found = bytearray()
        lazy.setblocking(False)

        def read_on():
            with contextlib.suppress(BlockingIOError):
                found.extend(lazy.recv(1_000_000))
            tcp._push(peer)
            return len(found) == number * size

        until(read_on)
        got = [bytes(found[at : at + size]) for at in range(0, len(found), size)]
        assert got == sorted(got) and set(got) <= set(pieces) and len(set(got)) == number
        assert tcp.sent_bytes == number * size


def test_one_client_that_never_reads_costs_the_others_nothing(tcp):
    with client_of(tcp), client_of(tcp) as reader:
        for number in range(256):
            tcp.send(bytes([number]) * 60_000)
            assert taken(reader, 60_000) == bytes([number]) * 60_000


def test_flood_is_taken_in_bounded_parts_without_loss(tcp):
    data = bytes(range(250)) * 100
    with client_of(tcp) as client:
        client.sendall(data)
        found = bytearray()

        def take():
            part = tcp.receive()
            assert len(part) <= PEER_BYTES
            found.extend(part)
            return len(found) >= len(data)

        until(take)
        assert bytes(found) == data


def is_shut_out(client):
    """Whether the satellite has ended a connection."""
    client.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        return client.recv(1) == b""
    return False


def test_one_client_too_many_is_shut_out_and_admitted_later(tcp, monkeypatch):
    monkeypatch.setattr(tcp_link, "STAY_S", 1e9)
    with contextlib.ExitStack() as stack:
        clients = [stack.enter_context(client_of(tcp)) for _ in range(MOST_PEERS)]
        with socket.create_connection((HOST, port_of(tcp)), PATIENCE_S) as refused:
            until(lambda: tcp.receive() == b"" and is_shut_out(refused))
        assert tcp.peers == MOST_PEERS
        clients[0].close()
        until(lambda: tcp.receive() == b"" and tcp.peers == MOST_PEERS - 1)
        stack.enter_context(client_of(tcp))


@pytest.fixture
def commanded(monkeypatch):
    """A link with a screen, whose clients have no time to stay, and a maker of genuine frames."""
    monkeypatch.setattr(tcp_link, "STAY_S", 0.0)
    link = load_link()
    frame, keys = Uplink(link.dictionary).frame("report_status", 0, (1, 1)), link.keys
    sender = CommandSender(keys.up, keys.spi, keys.spacecraft)
    receiver = CommandReceiver({keys.spi: keys.up}, keys.spacecraft)
    screens = screens_of(link, receiver.judge)
    with contextlib.closing(open_link(f"tcp:{HOST}:0", new_screen=screens)) as opened:
        yield opened, lambda: sender.wrap(frame)


@pytest.mark.verifies("REQ-LNK-008")
def test_whoever_has_the_key_keeps_a_place_and_who_comes_is_heard(commanded):
    tcp, genuine = commanded
    with contextlib.ExitStack() as stack:

        def come():
            end = stack.enter_context(socket.create_connection((HOST, port_of(tcp)), PATIENCE_S))
            until(lambda: tcp.receive() == b"" and tcp._peers[-1].end.getpeername() == name(end))
            return end

        name = socket.socket.getsockname
        ours = come()
        ours.sendall(genuine())
        received(tcp, 1)
        others = [come() for _ in range(3 * MOST_PEERS)]
        assert tcp.peers == MOST_PEERS and not is_shut_out(ours)
        assert [is_shut_out(end) for end in others] == [True] * 33 + [False] * 15
        late = stack.enter_context(socket.create_connection((HOST, port_of(tcp)), PATIENCE_S))
        frame = genuine()
        late.sendall(frame)
        assert received(tcp, 1) == frame
        assert is_shut_out(others[33]) and not is_shut_out(ours)


@pytest.mark.verifies("REQ-LNK-008")
def test_a_client_has_its_place_for_a_while(commanded, monkeypatch):
    """Or those that come again and again would push it out before it has said a word."""
    monkeypatch.setattr(tcp_link, "STAY_S", 1e9)
    tcp, genuine = commanded
    with client_of(tcp) as ours, contextlib.ExitStack() as stack:
        for _ in range(3 * MOST_PEERS):
            stack.enter_context(socket.create_connection((HOST, port_of(tcp)), PATIENCE_S))
            tcp.receive()
        frame = genuine()
        ours.sendall(frame)
        assert received(tcp, 1) == frame and tcp.peers <= MOST_PEERS


def test_a_client_that_takes_nothing_for_long_is_forgotten(tcp, monkeypatch):
    with client_of(tcp), client_of(tcp) as reader:
        for number in range(256):
            tcp.send(bytes([number]) * 60_000)
            taken(reader, 60_000)
        assert tcp.peers == 2
        monkeypatch.setattr(tcp_link, "IDLE_S", 0.0)
        until(lambda: tcp.receive() == b"" and tcp.peers == 1)
        tcp.send(b"news")
        assert taken(reader, 4) == b"news"


def test_a_datagram_peer_that_is_silent_for_long_is_forgotten(monkeypatch):
    with contextlib.closing(open_link(f"udp:{HOST}:0")) as link, client_of(link) as client:
        client.send(b"")
        until(lambda: link.receive() == b"" and link.peers == 1)
        monkeypatch.setattr(importlib.import_module("torquer.flight.link.udp"), "IDLE_S", 0.0)
        time.sleep(0.002)
        assert link.receive() == b"" and link.peers == 0


def test_what_waits_is_sent_at_the_end():
    link = open_link(f"tcp:{HOST}:0")
    with client_of(link) as client:
        link.send(b"the last words")
        link.close()
        assert taken(client, 14) == b"the last words" and client.recv(1) == b""
    assert link.lost_bytes == 0


def test_the_latest_peers_get_datagrams():
    with (
        contextlib.closing(open_link(f"udp:{HOST}:0")) as link,
        contextlib.ExitStack() as stack,
    ):
        clients = [stack.enter_context(client_of(link)) for _ in range(MOST_PEERS)]
        with socket.socket(type=socket.SOCK_DGRAM) as latest:
            latest.settimeout(PATIENCE_S)
            latest.sendto(b"me too", (HOST, port_of(link)))
            assert received(link, 6) == b"me too"
            link.send(b"news")
            assert taken(latest, 4) == b"news"
        assert link.peers == MOST_PEERS and taken(clients[1], 4) == b"news"
        clients[0].setblocking(False)
        with pytest.raises(BlockingIOError):
            clients[0].recv(4)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("", "must be tcp:HOST:PORT, udp:HOST:PORT, can:"),
        ("7070", "must be tcp:HOST:PORT"),
        ("http:127.0.0.1:80", "must be tcp:HOST:PORT"),
        ("tcp:7070", "must be tcp:HOST:PORT"),
        ("tcp:::1:7070", "IPv6 in brackets"),
        ("tcp:127.0.0.1:", "port must be a whole number from 0 to 65535"),
        ("udp:127.0.0.1:65536", "port must be a whole number from 0 to 65535"),
        ("udp:127.0.0.1:-1", "port must be a whole number from 0 to 65535"),
        ("tcp:127.0.0.1:\u0663", "port must be a whole number from 0 to 65535"),
        ("tcp:192.0.2.1:7070", "must be an address that can be opened"),
        ("udp:192.0.2.1:7070", "must be an address that can be opened"),
        ("can:virtual:", "must be tcp:HOST:PORT"),
        ("can:flexray:a", "must be tcp:HOST:PORT"),
    ],
)
def test_a_wrong_address_gets_one_line(address, message):
    with pytest.raises(ValueError) as error:
        open_link(address)
    text = str(error.value)
    assert message in text and repr(address) in text and "\n" not in text


def test_a_port_in_use_gets_one_line(link):
    with pytest.raises(ValueError, match="must be an address that can be opened; received"):
        open_link(link.address)


def test_a_port_is_free_again_after_the_link(tcp):
    with client_of(tcp):
        tcp.close()
    open_link(tcp.address).close()
