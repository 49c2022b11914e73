"""Space packets of another satellite out of a stream: found, passed over, lost."""

import struct
import time

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from spacepackets.ccsds.spacepacket import SequenceFlags, SpacePacketHeader

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.framing import PRIMARY_HEADER, check_framing
from torquer.flight.packets.keys import Keys
from torquer.flight.packets.software_file import SpaceLink, load_link
from torquer.flight.packets.space_stream import SpaceStream
from torquer.flight.packets.station import Station

#: Milliseconds from 2000 to 2010.
SINCE_2000_MS = 315_619_200_000
TIME = Field(name="t", type="u32be", scale=1000, offset=-SINCE_2000_MS, unit="ms", description="t")
RATE = Field(name="rate", type="i12be", count=2, scale=0.5, description="rate")
WORD = Field(name="word", type="u64be", description="word")
DICTIONARY = Dictionary(
    name="other",
    down={
        "rates": Packet(name="rates", id=1025, description="r", fields=(TIME, RATE), time_ms="t"),
        "words": Packet(name="words", id=0, description="w", fields=(TIME, WORD), time_ms="t"),
    },
)
SECONDS = st.integers(SINCE_2000_MS // 1000, 2**32 - 1)


def made(apid, data, count=0, **keys):
    """A packet by another package."""
    header = SpacePacketHeader.tm(apid, count, len(data) - 1, **keys)
    return bytes(header.pack()) + data


def rates(seconds, a, b, count=0):
    data = struct.pack(">I", seconds) + ((a % 4096) << 12 | b % 4096).to_bytes(3, "big")
    return made(1025, data, count)


def words(seconds, word, count=0):
    return made(0, struct.pack(">IQ", seconds, word), count, sec_header_flag=True)


def values(frames):
    return [(frame.packet.name, *frame.values[1:]) for frame in frames]


some_packets = st.lists(
    st.builds(rates, SECONDS, st.integers(-2048, 2047), st.integers(-2048, 2047))
    | st.builds(words, SECONDS, st.integers(0, 2**64 - 1), st.integers(0, 16383)),
    max_size=12,
)


def test_primary_header_is_that_of_another_package():
    header = made(1025, bytes(7), 77)
    assert decoder(PRIMARY_HEADER)(header) == (0, 0, 0, 1025, 3, 77, 6)


@settings(max_examples=60, deadline=None)
@given(packets=some_packets, cuts=st.sets(st.integers(0, 300), max_size=8))
def test_packets_are_found_in_parts_of_any_size(packets, cuts):
    data, stream = b"".join(packets), SpaceStream(DICTIONARY)
    ends = [*sorted(cuts), len(data)]
    frames = [f for a, b in zip([0, *ends[:-1]], ends, strict=True) for f in stream.feed(data[a:b])]
    assert [frame.raw for frame in frames] == packets
    assert list(stream.finish()) == [] and stream.lost_bytes == 0 and not stream.rejected


def test_values_and_time_are_those_of_the_packet():
    seconds = SINCE_2000_MS // 1000 + 86400
    first, second = SpaceStream(DICTIONARY).feed(rates(seconds, -3, 5) + words(7, 2**64 - 1))
    assert (first.values, first.time_s) == ((86_400_000.0, -1.5, 2.5), 86400)
    assert second.values[1] == 2**64 - 1 and second.time_s == 7 - SINCE_2000_MS // 1000


def test_packets_of_others_and_idle_ones_are_passed_over():
    other = made(500, bytes(40)) + made(0x7FF, bytes(11)) + made(500, bytes(3))
    stream = SpaceStream(DICTIONARY)
    data = other + rates(400_000_000, 1, 2) + other + rates(400_000_000, 3, 4) + other
    assert values(stream.feed(data)) == [("rates", 0.5, 1.0), ("rates", 1.5, 2.0)]
    assert list(stream.finish()) == []
    assert stream.lost_bytes == 0 and stream.rejected == {"unknown": 6}
    assert stream.take_rejected()[-1].id == 500


def test_bytes_of_no_packet_are_lost_and_the_stream_goes_on():
    rng = np.random.default_rng(4)
    packets = [rates(400_000_000 + k, k, -k) for k in range(50)]
    noise = [bytes([0xFF]) + rng.bytes(int(rng.integers(0, 40))) for _ in packets]
    stream = SpaceStream(DICTIONARY)
    data = b"".join(a + b for a, b in zip(noise, packets, strict=True))
    assert [frame.raw for frame in stream.feed(data)] == packets
    assert stream.lost_bytes == sum(map(len, noise))


def test_packet_of_another_length_is_not_taken_for_ours():
    stream = SpaceStream(DICTIONARY)
    longer = made(1025, bytes(9))
    assert values(stream.feed(longer + words(400_000_000, 5))) == [("words", 5)]
    assert stream.rejected == {"length": 1}
    assert stream.first == {"length": (0, "15 bytes of rates, must be 13")}


def test_segments_and_packets_of_others_are_told_with_their_places():
    stream = SpaceStream(DICTIONARY)
    segment = made(1025, bytes(7), seq_flags=SequenceFlags.FIRST_SEGMENT)
    whole = rates(400_000_000, 1, 2)
    assert len(list(stream.feed(whole + segment + made(500, b"x") + whole))) == 2
    assert stream.rejected == {"segmented": 1, "unknown": 1}
    assert stream.first == {
        "segmented": (13, "sequence flags 1 of rates, must be 3"),
        "unknown": (26, "APID 500, must be one of 0, 1025"),
    }


def test_many_packets_of_others_without_one_of_ours_are_no_lost_bytes():
    stream, other = SpaceStream(DICTIONARY), made(500, bytes(1000))
    for _ in range(200):
        assert list(stream.feed(other)) == []
    assert list(stream.finish()) == []
    assert stream.lost_bytes == 0 and stream.rejected == {"unknown": 200}


def test_time_for_packets_of_others_grows_with_their_number_only():
    """A megabyte of zeros is 150 thousand packets: a copy of the rest for each took 3 s."""
    stream = SpaceStream(Dictionary(name="other", down={"rates": DICTIONARY.down["rates"]}))
    began = time.process_time()
    assert list(stream.feed(bytes(7 * 2**17))) == []
    assert time.process_time() - began < 1.5 and stream.rejected["unknown"] > 2**17 - 9


def test_cut_packet_at_the_end_is_rejected():
    stream = SpaceStream(DICTIONARY)
    whole = rates(400_000_000, 1, 2)
    assert len(list(stream.feed(whole + whole[:-1]))) == 1 and list(stream.finish()) == []
    assert stream.first == {"cut": (len(whole), "12 bytes, must be 13")}
    assert stream.rejected == {"cut": 1} and stream.lost_bytes == len(whole) - 1


def test_noise_without_end_takes_no_memory():
    stream = SpaceStream(DICTIONARY)
    for _ in range(40):
        assert list(stream.feed(b"\xff" * 10_000)) == []
    assert len(stream._buffer) < 80_000
    assert list(stream.finish()) == [] and stream.lost_bytes == 400_000


def test_station_reads_space_packets_without_protection():
    station = Station(SpaceLink("other", DICTIONARY, "space_packets", Keys()))
    assert station.protection is None
    assert values(station.receive(rates(400_000_000, 1, 2))) == [("rates", 0.5, 1.0)]
    assert station.counts()["lost_bytes"] == 0


FILE = 'name = "other"\n[down.house]\nid = {id}\ndescription = "d"\n{more}fields = [{fields}]\n'
FIELDS = '{ name = "t", type = "u8", description = "x" }'


@pytest.mark.parametrize(
    ("link", "more", "number", "message"),
    [
        ("space_packets", 'time_ms = "t"\n', 2046, None),
        ("space_packets", 'time_ms = "t"\n', 0, None),
        ("space_packets", 'time_ms = "t"\n', 2047, r"down\.house\.id: must be 0 to 2046 .*2047"),
        ("space_packets", "", 7, r"down\.house\.time_ms: must be given .*; received nothing"),
        ("historical", "", 255, None),
        ("historical", "", 1025, r"id: must be 1 to 255 with link = 'historical'.*received 1025"),
        ("pus", "", 0, r"id: must be 1 to 255 with link = 'pus' .*; received 0"),
    ],
)
def test_link_has_room_for_ids_and_needs_a_time(tmp_path, link, more, number, message):
    """`message`: None where it fits."""
    text = FILE.format(id=number, more=more, fields=FIELDS)
    (tmp_path / "d.toml").write_text(text, encoding="utf-8")
    file = tmp_path / "software.toml"
    file.write_text(f'dictionary = "d.toml"\nlink = "{link}"\n', encoding="utf-8")
    if message is None:
        assert load_link(file).dictionary.down["house"].id == number
        return
    with pytest.raises(ValueError, match=message) as error:
        load_link(file)
    assert len(str(error.value).splitlines()) == 1


def test_long_packets_come_as_space_packets_only():
    field = Field(name="data", type="bytes", count=3000, description="d")
    packet = Packet(name="long", id=7, description="l", fields=(TIME, field), time_ms="t")
    dictionary = Dictionary(name="other", down={"long": packet})
    check_framing(dictionary, "space_packets")
    (frame,) = SpaceStream(dictionary).feed(made(7, bytes(4) + b"x" * 3000))
    assert frame.values[1] == b"x" * 3000
    with pytest.raises(
        ValueError, match=r"down\.long\.fields: must have at most 960 bytes with li"
    ):
        check_framing(dictionary, "protected")
