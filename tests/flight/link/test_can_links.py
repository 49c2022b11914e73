"""CAN: every packet comes back; segments that are lost, repeated or foreign are counted."""

import contextlib
import importlib
import itertools
import sys
import threading
import time

import numpy as np
import pytest
from packet_cases import PACKETS, SATELLITE, some_bytes

from torquer.flight.link import open_link
from torquer.flight.packets.frames import HEADER_BYTES, Downlink, Stream, Uplink
from torquer.flight.packets.segments import Joiner, Splitter

can = pytest.importorskip("can", reason="extra `can`")
can_bus = importlib.import_module("torquer.flight.link.can_bus")

PATIENCE_S = 20.0
_NAMES = (f"test {number}" for number in itertools.count())


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch):
    monkeypatch.setattr(can_bus, "PAUSE_S", 0.0)


@pytest.fixture
def ends():
    """The satellite's end and the ground's of a bus, and the bus of a bystander."""
    name = next(_NAMES)
    with contextlib.ExitStack() as stack:
        satellite = stack.enter_context(
            contextlib.closing(open_link(f"can:virtual:{name}", SATELLITE))
        )
        bus = can_bus.open_bus("virtual", name)
        ground = can_bus.CanLink(bus, "the ground", SATELLITE, sends="up")
        stack.enter_context(contextlib.closing(ground))
        bystander = can_bus.open_bus("virtual", name)
        stack.callback(bystander.shutdown)
        yield satellite, ground, bystander


def frame_of(name, packet, rng):
    make = Downlink(SATELLITE) if name.startswith("down") else Uplink(SATELLITE)
    empty = [b"" if field.type == "bytes" else 0 for _, field, _ in packet.numbers()]
    return make.frame(packet.name, 5, empty)[:HEADER_BYTES] + some_bytes(packet, rng)


def received(link, size):
    """So many bytes out of a link."""
    found, end_s = bytearray(), time.monotonic() + PATIENCE_S
    while len(found) < size:
        assert time.monotonic() < end_s
        found += link.receive()
        time.sleep(0.001)
    return bytes(found)


@pytest.mark.parametrize(("name", "packet"), PACKETS.items(), ids=PACKETS)
def test_every_packet_crosses_the_bus(ends, name, packet):
    satellite, ground, _ = ends
    sender, receiver = (satellite, ground) if name.startswith("down") else (ground, satellite)
    rng = np.random.default_rng(2)
    frames = [frame_of(name, packet, rng) for _ in range(3)]
    sender.send(frames[0] + frames[1])
    sender.send(frames[2])
    assert received(receiver, 3 * len(frames[0])) == b"".join(frames)
    counts = receiver.counts()
    assert (counts["lost_frames"], counts["rejected_segments"]) == (0, 0)


def test_other_bytes_cross_as_a_stream_also_behind_frames(ends):
    satellite, ground, _ = ends
    frame = frame_of("down_extended", SATELLITE.down["extended"], np.random.default_rng(3))
    data = bytes(range(256)) * 20
    satellite.send(data)
    satellite.send(frame + data)
    satellite.send(frame[:-1])
    expected = data + frame + data + frame[:-1]
    assert received(ground, len(expected)) == expected
    assert ground.counts()["lost_segments"] == 0


def test_lost_and_repeated_segments_are_counted(ends):
    satellite, _, bystander = ends
    splitter = Splitter(SATELLITE, "up")

    def say(segment):
        bystander.send(can.Message(arbitration_id=segment.can_id, data=segment.data))

    name = next(name for name in SATELLITE.up if len(list(segments_of(name))) > 2)
    frames = [list(segments_of(name, splitter)) for _ in range(4)]
    for segment in [*frames[0], *frames[1][:-1], *frames[2], frames[3][0], *frames[3]]:
        say(segment)
    size = len(frame_of(f"up_{name}", SATELLITE.up[name], np.random.default_rng(4)))
    received(satellite, 3 * size)
    counts = satellite.counts()
    assert satellite.received_bytes == 3 * size and counts["lost_frames"] == 1
    stream = list(splitter.stream(bytes(range(80))))
    for segment in [*stream[:2], stream[1], *stream[5:]]:
        say(segment)
    assert received(satellite, 56) == bytes([*range(16), *range(40, 80)])
    after = satellite.counts()
    assert after["lost_segments"] == 3
    assert after["rejected_segments"] == counts["rejected_segments"] + 1


def segments_of(name, splitter=None):
    frame = frame_of(f"up_{name}", SATELLITE.up[name], np.random.default_rng(4))
    return (splitter or Splitter(SATELLITE, "up")).frame(frame)


NUMBERED = sorted(name for name, packet in SATELLITE.up.items() if packet.size > 8)


def numbered(name, request=7, acknowledge=1):
    """A command with a number, whose frame has no checksum."""
    packet = SATELLITE.up[name]
    empty = [b"" if field.type == "bytes" else 0 for _, field, _ in packet.numbers()]
    return Uplink(SATELLITE).frame(name, 5, [acknowledge, *empty[1:]], request=request)


@pytest.mark.parametrize("name", NUMBERED)
def test_numbered_command_comes_whole_or_not_at_all(name):
    """Each of its segments lost in turn, then the next command."""
    one, two = numbered(name), numbered(name, 8, 0)
    count = len(list(Splitter(SATELLITE, "up").split(one)))
    for lost in range(count):
        splitter, joiner = Splitter(SATELLITE, "up"), Joiner(SATELLITE, "up")
        stream = Stream(SATELLITE, "up")
        segments = [*splitter.split(one), *splitter.split(two)]
        found = b"".join(joiner.feed(*s) for k, s in enumerate(segments) if k != lost)
        assert found.endswith(two) and joiner.lost_segments == (lost > 0)
        taken = [(frame.request, frame.values[0]) for frame in stream.feed(found)]
        assert taken == [(8, 0)]


@pytest.mark.parametrize("name", NUMBERED)
@pytest.mark.parametrize("is_whole", [False, True])
def test_nothing_comes_between_the_parts_of_a_numbered_command(name, is_whole):
    """A command without a number has identifiers of its own, which may win the arbitration."""
    splitter, joiner = Splitter(SATELLITE, "up"), Joiner(SATELLITE, "up")
    parts, plain = list(splitter.split(numbered(name))), numbered("shift_clock", 0)
    between = list(splitter.split(plain))[: None if is_whole else 1]
    for place in range(1, len(parts)):
        found = [joiner.feed(*s) for s in (*parts[:place], *between, *parts[place:])]
        assert [each for each in found if each] == [plain, numbered(name)][not is_whole :]
        parts, between = list(splitter.split(numbered(name))), list(splitter.split(plain))
        between = between[: None if is_whole else 1]


@pytest.mark.parametrize("cut", range(24))
def test_bytes_that_begin_like_a_command_are_not_kept_back(cut):
    """They come as soon as they are seen to be none: an unknown id, another length."""
    unknown = bytearray(numbered(NUMBERED[0]))
    unknown[8] = 255
    splitter, joiner = Splitter(SATELLITE, "up"), Joiner(SATELLITE, "up")
    data = bytes(unknown) + bytes(cut)
    assert b"".join(joiner.feed(*s) for s in splitter.split(data)) == data


def test_many_numbered_commands_cross_the_bus_from_several_threads(ends):
    """Segments of two of them are never mixed."""
    satellite, ground, _ = ends
    frames = [numbered(NUMBERED[k % len(NUMBERED)], k + 1) for k in range(60)]
    threads = [threading.Thread(target=lambda own=own: [ground.send(f) for f in own])
               for own in (frames[::3], frames[1::3], frames[2::3])]  # fmt: skip
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    stream = Stream(SATELLITE, "up")
    found = list(stream.feed(received(satellite, sum(map(len, frames)))))
    assert sorted(frame.request for frame in found) == list(range(1, 61))
    assert satellite.counts()["lost_segments"] == 0


def test_a_repeated_segment_of_a_stream_is_no_loss():
    """255 segments would otherwise be missing, and its bytes come twice."""
    joiner = Joiner(SATELLITE, "up")
    segments = list(Splitter(SATELLITE, "up").stream(bytes(24)))
    found = [joiner.feed(*s) for s in (segments[0], segments[0], *segments[1:], segments[2])]
    assert b"".join(found) == bytes(24)
    assert (joiner.lost_segments, joiner.rejected) == (0, {"repeated": 2})


def test_foreign_frames_are_counted_and_own_ones_ignored(ends):
    satellite, _, bystander = ends
    foreign = (
        can.Message(arbitration_id=0x102, data=b"short id", is_extended_id=False),
        can.Message(arbitration_id=0x1FFFFF, is_remote_frame=True, dlc=4),
        can.Message(arbitration_id=0xFFFF, data=b"no such packet"[:8]),
    )
    for message in foreign:
        bystander.send(message)
    for segment in Splitter(SATELLITE, "down").stream(b"an echo of what was sent"):
        bystander.send(can.Message(arbitration_id=segment.can_id, data=segment.data))
    for segment in Splitter(SATELLITE, "up").stream(b"command"):
        bystander.send(can.Message(arbitration_id=segment.can_id, data=segment.data))
    assert received(satellite, 7) == b"command"
    assert satellite.counts()["rejected_segments"] == len(foreign)


def test_blocked_bus_is_bounded_and_loses_whole_pieces(ends, monkeypatch):
    satellite, *_ = ends
    monkeypatch.setattr(can_bus, "MOST_WAITING", 4096)
    monkeypatch.setattr(can_bus, "PAUSE_S", 60.0)
    for _ in range(100):
        satellite.send(bytes(1000))
    assert satellite._waiting.qsize() * 8 <= 4096
    assert satellite.lost_bytes >= 95_000 and satellite.lost_bytes % 1000 == 0


class Broken:
    """A bus on which nothing can be sent, in the way of an error."""

    def __init__(self, error):
        self.error = error

    def send(self, message, timeout):
        raise self.error

    def recv(self, timeout):
        return None

    def shutdown(self):
        pass


def test_what_a_bus_does_not_take_is_counted():
    link = can_bus.CanLink(Broken(can.CanOperationError("bus off")), "broken", SATELLITE)
    link.send(bytes(20))
    link.close()
    assert (link.sent_bytes, link.lost_bytes) == (0, 20)


def test_a_sender_that_fails_is_no_secret():
    link = can_bus.CanLink(Broken(TypeError("no number")), "broken", SATELLITE)
    link.send(bytes(20))
    link._thread.join(PATIENCE_S)
    with pytest.raises(RuntimeError, match="broken: no number"):
        link.send(b"more")
    link.close()
    assert link.lost_bytes > 0


def test_multicast_carries_frames():
    pytest.importorskip("msgpack", reason="extra `can`")
    try:
        link = open_link("can:udp_multicast:239.74.163.99", SATELLITE)
    except ValueError as error:
        pytest.skip(f"no multicast here: {error}")
    bus = can_bus.open_bus("udp_multicast", "239.74.163.99")
    with (
        contextlib.closing(link),
        contextlib.closing(can_bus.CanLink(bus, "the ground", SATELLITE, sends="up")) as ground,
    ):
        ground.send(b"is anybody there")
        end_s, found = time.monotonic() + 2.0, b""
        while not found and time.monotonic() < end_s:
            found += link.receive()
            time.sleep(0.01)
        if not found:
            pytest.skip("no multicast here: nothing comes back")
        found += received(link, 16 - len(found))
        frame = frame_of("down_extended", SATELLITE.down["extended"], np.random.default_rng(5))
        link.send(frame)
        assert found == b"is anybody there" and received(ground, len(frame)) == frame


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("can:udp_multicast:127.0.0.1", "group must be a multicast address"),
        ("can:udp_multicast:sat", "group must be a multicast address"),
        ("can:socketcan:nocan9", "must be a CAN bus that can be opened ("),
    ],
)
def test_no_such_bus_gets_one_line(address, message):
    with pytest.raises(ValueError) as error:
        open_link(address)
    text = str(error.value)
    assert message in text and repr(address) in text and "\n" not in text


def test_without_python_can_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "torquer.flight.link.can_bus", None)
    with pytest.raises(ValueError, match=r"needs python-can, which `pip install 'torquer\[can\]'`"):
        open_link("can:virtual:a")
