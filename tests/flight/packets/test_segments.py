"""Frames on a CAN bus: cut, put together again, and never mixed."""

import random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from packet_cases import PACKETS, SATELLITE, some_bytes
from packet_strategies import any_fields

from torquer.flight.packets.dictionary import Dictionary, Packet
from torquer.flight.packets.frames import FRAMESYNC, HEADER, HEADER_BYTES, Downlink, Uplink
from torquer.flight.packets.segments import Joiner, Splitter, can_id, checked_places, places

EXTENDED = SATELLITE.down["extended"]


def frame_of(direction, packet, rng, time_s=5):
    make = Downlink(SATELLITE) if direction == "down" else Uplink(SATELLITE)
    empty = [b"" if field.type == "bytes" else 0 for _, field, _ in packet.numbers()]
    header = make.frame(packet.name, time_s, empty)[:HEADER_BYTES]
    return header + some_bytes(packet, rng)


def joined(joiner, segments):
    return [frame for segment in segments if (frame := joiner.feed(*segment))]


@pytest.mark.parametrize(("name", "packet"), PACKETS.items(), ids=PACKETS)
def test_every_frame_comes_back(name, packet):
    direction = name.partition("_")[0]
    splitter, joiner = Splitter(SATELLITE, direction), Joiner(SATELLITE, direction)
    rng = np.random.default_rng(1)
    for time_s in (0, 2**32 - 1, 7):
        frame = frame_of(direction, packet, rng, time_s)
        segments = list(splitter.frame(frame))
        assert all(1 <= len(each.data) <= 8 and each.can_id < 2**29 for each in segments)
        assert joined(joiner, segments) == [frame]
    assert (joiner.lost_frames, joiner.rejected) == (0, {})


@pytest.mark.parametrize("packet", PACKETS.values(), ids=PACKETS)
def test_no_number_crosses_a_segment(packet):
    ends = [place.stop for place in places(packet)]
    assert [place.start for place in places(packet)] == [0, *ends[:-1]]
    assert ends[-1] == packet.size
    for _, field, at in packet.numbers():
        size = field.size // len(field.names)
        assert field.type == "bytes" or not any(at < end < at + size for end in ends)


@settings(max_examples=80, deadline=None)
@given(fields=any_fields(), data=st.data())
def test_any_packet_comes_back_in_segments_or_as_bytes(fields, data):
    packet = Packet(name="house", id=data.draw(st.sampled_from([7, 255, 256])), description="d",
                    fields=fields)  # fmt: skip
    dictionary = Dictionary(name="any", down={"house": packet})
    raw = data.draw(st.binary(min_size=packet.size, max_size=packet.size))
    frame = HEADER.pack(FRAMESYNC, 5, packet.id & 0xFF, 0, 0, packet.size) + raw
    splitter, joiner = Splitter(dictionary, "down"), Joiner(dictionary, "down")
    assert b"".join(joined(joiner, splitter.split(frame))) == frame
    try:
        found = checked_places(packet)
    except ValueError:
        assert packet.id == 256 or any(field.kind.bits % 8 for field in fields)
        return
    ends = {place.stop for place in found}
    assert max(place.stop - place.start for place in found) <= 8 and max(ends) == packet.size
    for place in packet.places:
        inside = any(place.bit < 8 * end < place.bit + place.bits for end in ends)
        assert place.field.type == "bytes" or not inside


def test_identifiers_differ_and_commands_win_the_bus():
    segments = {
        direction: [
            can_id(direction, packet.id, number)
            for packet in getattr(SATELLITE, direction).values()
            for number in range(1 + len(places(packet)))
        ]
        for direction in ("up", "down")
    }
    both = segments["up"] + segments["down"]
    assert len(set(both)) == len(both)
    assert max(segments["up"]) < min(segments["down"])


def test_lost_segments_cost_their_frames_only_and_never_mix_two():
    """Frames of one kind that differ in one number: mixing two would be easy."""
    rng, make = random.Random(3), Downlink(SATELLITE)
    splitter, joiner = Splitter(SATELLITE, "down"), Joiner(SATELLITE, "down")
    sent = [make.frame("extended", 5, [1e-6 * k] * 43) for k in range(400)]
    expected, found = [], []
    for frame in sent:
        segments = list(splitter.frame(frame))
        kept = [each for each in segments if rng.random() > 0.03]
        found += joined(joiner, kept)
        expected += [frame] if kept == segments else []
    assert 150 < len(expected) < 350
    assert found == expected
    first, last = sent.index(found[0]), sent.index(found[-1])
    assert joiner.lost_frames == last - first + 1 - len(found)
    assert joiner.rejected.keys() == {"order"}


def test_two_halves_of_frames_are_not_one():
    """All is in order, but the end of one frame and the beginning of the next are missing."""
    make, splitter = Downlink(SATELLITE), Splitter(SATELLITE, "down")
    joiner = Joiner(SATELLITE, "down")
    one, two = (list(splitter.frame(make.frame("extended", 5, [k] * 43))) for k in (0.0, 1e-3))
    assert joined(joiner, one[:7] + two[7:]) == []
    assert joiner.rejected == {"checksum": 1}


def test_packets_may_be_interleaved_and_segments_repeated():
    rng = np.random.default_rng(2)
    splitter, joiner = Splitter(SATELLITE, "down"), Joiner(SATELLITE, "down")
    sent = [frame_of("down", packet, rng) for packet in SATELLITE.down.values()]
    rows = [list(splitter.frame(frame)) for frame in sent]
    mixed = [row[k] for k in range(40) for row in rows if k < len(row)]
    twice = [segment for segment in mixed for _ in range(2)]
    found = joined(joiner, twice)
    assert sorted(found) == sorted(sent)
    assert joiner.lost_frames == 0


def test_frame_that_comes_twice_is_given_once():
    splitter, joiner = Splitter(SATELLITE, "down"), Joiner(SATELLITE, "down")
    frame = Downlink(SATELLITE).frame("extended", 5, [0.0] * 43)
    segments = list(splitter.frame(frame))
    assert joined(joiner, segments + segments) == [frame]
    assert (joiner.lost_frames, joiner.rejected) == (0, {"repeated": 1})


@pytest.mark.parametrize(
    ("identifier", "data", "reason"),
    [
        (can_id("down", 99, 0), bytes(8), "unknown"),
        (can_id("down", 2, 200), bytes(8), "unknown"),
        (can_id("up", 2, 0), bytes(8), "unknown"),
        (can_id("down", 2, 0) | 1 << 20, bytes(8), "unknown"),
        (can_id("down", 2, 0), bytes(7), "length"),
        (can_id("down", 1, 1), bytes(7), "length"),
        (can_id("down", 1, 1), bytes(8), "order"),
    ],
)
def test_segment_that_does_not_belong_here_is_counted(identifier, data, reason):
    joiner = Joiner(SATELLITE, "down")
    assert joiner.feed(identifier, data) == b""
    assert joiner.rejected == {reason: 1}


def test_any_bytes_pass_and_missing_ones_are_counted():
    rng = np.random.default_rng(4)
    splitter, joiner = Splitter(SATELLITE, "up"), Joiner(SATELLITE, "up")
    blocks = [rng.bytes(n) for n in (1, 8, 9, 1024, 1200)]
    assert b"".join(joiner.feed(*s) for b in blocks for s in splitter.stream(b)) == b"".join(blocks)
    assert joiner.lost_segments == 0
    for segment in list(splitter.stream(bytes(80)))[3:]:
        joiner.feed(*segment)
    assert joiner.lost_segments == 3


def test_a_joiner_survives_any_segments():
    rng = random.Random(8)
    joiner, splitter = Joiner(SATELLITE, "down"), Splitter(SATELLITE, "down")
    for _ in range(20_000):
        identifier = can_id("down", rng.choice((1, 2, 3, 10, 99)), rng.randrange(16))
        assert joiner.feed(identifier, rng.randbytes(rng.randrange(9))) == b""
    assert joiner.rejected.keys() == {"unknown", "length", "order", "checksum"}
    frame = Downlink(SATELLITE).frame("extended", 5, [0.0] * 43)
    assert joined(joiner, splitter.frame(frame)) == [frame]
