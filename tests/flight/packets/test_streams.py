"""Streams that were damaged on their way: what is found in them, and what is not invented."""

import random
import struct

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from packet_cases import PACKETS, SATELLITE, some_bytes

from torquer.flight.packets.frames import HEADER_BYTES, Downlink, Stream, Uplink

MARK = bytes.fromhex("ddccbbaa")
#: Packets in whose data a whole frame may stand: damage to them may hide one that follows.
OPAQUE = {
    packet.name
    for packet in PACKETS.values()
    if any(field.type == "bytes" for field in packet.fields)
}


def frames(direction, count, rng, names=None):
    """Frames of random packets."""
    packets = getattr(SATELLITE, direction)
    names = names or [name for name in packets]
    found = []
    for _ in range(count):
        packet = packets[names[int(rng.integers(len(names)))]]
        code = int(rng.integers(3)) if direction == "down" else SATELLITE.modules[packet.module]
        time_s = int(rng.integers(2**32))
        header = struct.pack("<IIBBIH", 0xAABBCCDD, time_s, packet.id, code, 0, packet.size)
        found.append(header + some_bytes(packet, rng))
    return found


def found_in(data, direction, sizes=None):
    """(frames, stream) of data that come in parts of these sizes."""
    stream, found, at = Stream(SATELLITE, direction), [], 0
    for size in sizes or [len(data)]:
        found += stream.feed(data[at : at + size])
        at += size
    found += stream.feed(data[at:])
    found += stream.finish()
    return found, stream


class Damaged:
    """Bytes, and for each the frame and the place in it that it comes from."""

    def __init__(self, whole):
        self.whole = whole
        self.bytes = bytearray(b"".join(whole))
        self.origins = [(k, i) for k, frame in enumerate(whole) for i in range(len(frame))]

    def mutate(self, rng):
        """One mistake of a link."""
        kind, at = rng.randrange(6), rng.randrange(len(self.bytes) + 1)
        length = rng.choice((1, 1, 2, 3, 4, rng.randrange(1, 40), rng.randrange(1, 200)))
        if kind == 0 and at < len(self.bytes):
            self.put(at, at + 1, bytes([self.bytes[at] ^ 1 << rng.randrange(8)]))
        elif kind == 1:
            self.put(at, at + length, b"")
        elif kind == 2:
            self.put(at, at, rng.randbytes(length))
        elif kind == 3:  # noise over what was there
            self.put(at, at + length, rng.randbytes(min(length, len(self.bytes) - at)))
        elif kind == 4:  # a part that comes again elsewhere
            other = rng.randrange(len(self.bytes) + 1)
            self.put(at, at, bytes(self.bytes[other : other + length]))
        else:  # a header where there is none
            self.put(at, at, rng.choice(self.whole)[: rng.choice((4, 9, 16, 17))])

    def put(self, start, stop, data):
        self.bytes[start:stop] = data
        self.origins[start:stop] = [None] * len(data)

    def intact(self):
        """(place, frame) of the frames that are all there."""
        found, at = [], 0
        while at < len(self.origins):
            origin = self.origins[at]
            if origin and origin[1] == 0:
                frame = self.whole[origin[0]]
                run = [(origin[0], i) for i in range(len(frame))]
                if self.origins[at : at + len(frame)] == run:
                    found.append((at, frame))
            at += 1
        return found


def places_of(found, data):
    """Where the frames that were found stand, in order; they share at most three bytes."""
    places, at = [], 0
    for frame in found:
        place = data.find(frame.raw, at)
        assert place >= 0, "a frame that is not in the stream"
        places.append(place)
        at = place + len(frame.raw) - 3
    return places


def check(whole, direction, rng, mistakes):
    """Damage frames and look for what is left; the number of intact ones that were not found."""
    damaged = Damaged(whole)
    for _ in range(mistakes):
        damaged.mutate(rng)
    data = bytes(damaged.bytes)
    found, stream = found_in(data, direction)
    places = places_of(found, data)
    packets = {packet.id: packet for packet in getattr(SATELLITE, direction).values()}
    for frame in found:  # what is given has a header that belongs to its packet
        mark, time_s, number, code, _, length = struct.unpack_from("<IIBBIH", frame.raw)
        packet = packets[number]
        assert (mark, time_s, code, packet) == (0xAABBCCDD, frame.time_s, frame.code, frame.packet)
        assert length == packet.size == len(frame.raw) - HEADER_BYTES
        assert code < 3 if direction == "down" else code == SATELLITE.modules[packet.module]
    overlaps = [
        max(0, p + len(f.raw) - q) for p, f, q in zip(places, found, places[1:], strict=False)
    ]
    assert sum(len(frame.raw) for frame in found) - sum(overlaps) + stream.lost_bytes == len(data)
    taken, hidden = dict(zip(places, found, strict=True)), 0
    for place, frame in damaged.intact():
        if place in taken:
            assert taken[place].raw == frame
            continue
        over = [f for p, f in taken.items() if p < place < p + len(f.raw)]
        assert over and over[0].packet.name in OPAQUE, "an intact frame was not found"
        hidden += 1
    return hidden


@pytest.mark.parametrize("direction", ["down", "up"])
def test_all_frames_of_a_sound_stream_are_found(direction):
    rng = np.random.default_rng(1)
    whole = frames(direction, 500, rng)
    found, stream = found_in(b"".join(whole), direction)
    assert [frame.raw for frame in found] == whole
    assert (stream.lost_bytes, stream.rejected) == (0, {})
    make = Downlink(SATELLITE) if direction == "down" else Uplink(SATELLITE)
    for frame in found:
        code = [frame.status] if direction == "down" else []
        assert make.frame(frame.packet.name, frame.time_s, frame.values, *code) == frame.raw


@pytest.mark.verifies("REQ-PKT-003")
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32), data=st.data())
def test_parts_of_any_size_give_the_same_frames(seed, data):
    rng, direction = random.Random(seed), data.draw(st.sampled_from(["down", "up"]))
    damaged = Damaged(frames(direction, 6, np.random.default_rng(seed)))
    for _ in range(rng.randrange(8)):
        damaged.mutate(rng)
    stream = bytes(damaged.bytes)
    sizes = data.draw(st.lists(st.integers(0, 60), max_size=60))
    whole, once = found_in(stream, direction)
    parts, other = found_in(stream, direction, sizes)
    assert [(f.raw, f.values) for f in map(shown, parts)] == [
        (f.raw, f.values) for f in map(shown, whole)
    ]
    assert (once.lost_bytes, once.rejected) == (other.lost_bytes, other.rejected)


def shown(frame):
    """A frame with NaN as text, which equals itself."""
    return frame._replace(values=tuple(map(repr, frame.values)))


@pytest.mark.verifies("REQ-PKT-003")
@pytest.mark.parametrize("direction", ["down", "up"])
def test_damage_costs_the_frames_that_it_touches_only(direction):
    rng, hidden = random.Random(5), 0
    for k in range(300):
        whole = frames(direction, rng.randrange(1, 12), np.random.default_rng(k))
        hidden += check(whole, direction, rng, rng.randrange(1, 8))
    assert hidden <= 10  # behind damaged packets of bytes, which may hold frames


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["down", "up"])
def test_damage_in_a_million_frames_costs_only_the_touched_ones(direction):
    rng, count, k = random.Random(6), 0, 0
    while count < 1_000_000:
        whole = frames(direction, 60, np.random.default_rng(k))
        check(whole, direction, rng, rng.randrange(1, 60))
        count, k = count + len(whole), k + 1


def test_without_packets_of_bytes_nothing_is_hidden():
    rng = random.Random(7)
    names = [name for name in SATELLITE.down if name not in OPAQUE]
    for k in range(200):
        whole = frames("down", rng.randrange(1, 12), np.random.default_rng(k), names)
        assert check(whole, "down", rng, rng.randrange(1, 8)) == 0


def dump_of(data):
    return Downlink(SATELLITE).frame("dump", 7, (1, 0, len(data), data))


BEACON = Downlink(SATELLITE).frame("beacon", 5, (3, 1, 1, 7, 31, 4660, 255))


def test_frames_in_the_data_of_a_dump_are_data():
    dump = dump_of(BEACON + BEACON)
    found, stream = found_in(dump + BEACON + dump, "down")
    assert [frame.raw for frame in found] == [dump, BEACON, dump]
    assert (stream.lost_bytes, stream.rejected) == (0, {})


def test_dump_holding_frames_waits_only_until_the_next_framesync():
    stream, dump = Stream(SATELLITE, "down"), dump_of(BEACON)
    assert list(stream.feed(dump)) == []
    assert list(stream.feed(BEACON[:3])) == []
    assert [frame.raw for frame in stream.feed(BEACON[3:])] == [dump, BEACON]


def test_truncated_dump_gives_back_the_frames_after_it():
    for lost in (4, 9, 40, 70):
        found, stream = found_in(dump_of(bytes(64))[:-lost] + BEACON + b"noise" + BEACON, "down")
        assert [frame.raw for frame in found] == [BEACON, BEACON], lost
        assert stream.rejected == {"cut": 1}


def test_cut_packet_of_bytes_gives_back_all_frames_in_it():
    """Behind its end a frame begins by chance, but one that lies across a number gives it away."""
    extended = Downlink(SATELLITE).frame("extended", 5, [0.0] * 43)
    odd = Downlink(SATELLITE).frame("odd", 5, [0.0] * 2 + [b""] + [0.0] * 15)
    rest = len(odd) - 19 - len(BEACON)
    found, stream = found_in(odd[:19] + BEACON + extended[:rest] + BEACON, "down")
    assert [frame.raw for frame in found] == [BEACON, BEACON]
    assert stream.rejected == {"cut": 2}


def test_cut_byte_packet_passes_as_whole_before_an_adjacent_frame():
    """What cannot be noticed without a checksum: the data could be these bytes."""
    dump = dump_of(bytes(64))
    event = Downlink(SATELLITE).frame("event", 5, (1, 2, 3, 4.0))
    data = (dump[:60] + BEACON + event)[: len(dump)]
    found, _ = found_in(data + BEACON, "down")
    assert [frame.raw for frame in found] == [data, BEACON]


def test_numbers_that_look_like_a_framesync_are_numbers():
    make = Downlink(SATELLITE).frame
    whole = [make("queues", 1, (1, 2, 3, 4, *[0xAABBCCDD] * 4)), BEACON]
    found, stream = found_in(b"".join(whole), "down")
    assert [frame.raw for frame in found] == whole
    assert stream.rejected == {}


def test_last_bytes_of_a_frame_do_not_keep_it_waiting():
    for end in (b"\xdd", b"\xdd\xcc", b"\xdd\xcc\xbb"):
        stream, frame = Stream(SATELLITE, "down"), BEACON[: -len(end)] + end
        assert [each.raw for each in stream.feed(frame)] == [frame]
        assert [each.raw for each in stream.feed(BEACON)] == [BEACON]
        assert stream.lost_bytes == 0


def test_noise_of_framesyncs_takes_time_in_proportion_only():
    stream = Stream(SATELLITE, "down")
    headers = (MARK + bytes(12), BEACON[:16], dump_of(b"")[:16])
    for header in headers:
        assert list(stream.feed(header * 3000)) == []
    assert len(list(stream.feed(BEACON * 9))) == 9
    assert sum(stream.rejected.values()) == 9000
    assert len(stream.take_rejected()) == Stream.MOST_REJECTED


def test_parts_of_a_frame_wait_and_are_dropped_at_end():
    stream = Stream(SATELLITE, "down")
    extended = Downlink(SATELLITE).frame("extended", 5, [0.0] * 43)
    assert list(stream.feed(extended[:80])) == []
    assert [frame.raw for frame in stream.feed(BEACON)] == [BEACON]  # not after 112 bytes
    assert stream.rejected == {"cut": 1}
    assert list(stream.feed(extended[:80])) == []
    assert list(stream.finish()) == []
    assert (stream.rejected, stream.lost_bytes) == ({"cut": 2}, 160)
