"""Telemetry in TM frames: as spacepackets reads them; what arrives was sent, once and in order."""

import copy
import hashlib
import hmac
import random
import struct

import pytest
from frame_attacks import KEY, SPACECRAFT, refit
from hypothesis import given, settings, strategies as st
from spacepackets.ccsds.tm_frame import TmTransferFrame

from torquer.flight.packets.protected import TELEMETRY_BYTES, TelemetryReceiver, TelemetrySender

SPI, MARK = 9, b"\x1a\xcf\xfc\x1d"
DATAS = st.lists(st.binary(max_size=100) | st.sampled_from([bytes(253), bytes(254), MARK * 300]))


def link(frame_bytes=256, counter=0):
    """A sender and a receiver that understand each other."""
    sender = TelemetrySender(KEY, SPI, SPACECRAFT, counter, frame_bytes)
    return sender, TelemetryReceiver({SPI: KEY}, SPACECRAFT, frame_bytes=frame_bytes)


def sent_by(sender, datas, at_once=3):
    """All frames, marks included, of data of which a few come each tick."""
    stream = b""
    for number, data in enumerate(datas, 1):
        stream += sender.wrap(data)
        stream += sender.flush() if number % at_once == 0 else b""
    stream += sender.flush()
    size = 4 + sender.room + 30
    assert len(stream) % size == 0
    return [stream[at : at + size] for at in range(0, len(stream), size)]


def packets_in(field):
    """Content of encapsulation packets, read as CCSDS 133.1-B, 4.1.2, has the bits."""
    found = []
    while field:
        bits = f"{field[0]:08b}"
        assert bits[:3] == "111", "version"
        header = {"00": 1, "01": 2, "10": 4}[bits[6:]]
        size = int.from_bytes(field[header // 2 : header], "big") if header > 1 else 1
        assert bits[3:6] == ("000" if header == 1 else "111"), "idle, or of private use"
        assert header < 4 or field[1] == 0, "user-defined field, extension of the protocol"
        found += [field[header:size]] if header > 1 else []
        field = field[size:]
    return found


@settings(deadline=None)  # the first call imports the other package
@given(DATAS, st.sampled_from([64, 100, 256, 1115]), st.integers(0, 300))
def test_another_package_reads_the_frames(datas, frame_bytes, counter):
    sender, _ = link(frame_bytes, counter)
    joined, starts = b"", []
    for number, frame in enumerate(sent_by(sender, datas), counter + 1):
        assert frame[:4] == MARK
        frame = frame[4:]
        read = TmTransferFrame.unpack(frame, frame_bytes, has_error_control_field=True)
        assert read.pack() == frame
        header = read.primary_header
        assert header.master_channel_id.transfer_frame_version == 0
        assert header.master_channel_id.spacecraft_id == SPACECRAFT
        assert (header.vc_id, header.ocf_flag) == (0, False)
        assert header.master_ch_frame_count == header.vc_frame_count == number % 256
        status = header.frame_datafield_status
        assert (status.secondary_header_flag, status.sync_flag) == (False, False)
        assert (status.packet_order_flag, status.segment_len_id) == (False, 3)
        assert read.data_field[:6] == struct.pack(">HI", SPI, number)
        assert read.data_field[-16:] == hmac.new(KEY, frame[:-18], hashlib.sha256).digest()[:16]
        if status.first_header_pointer != 0x7FF:
            starts.append(len(joined) + status.first_header_pointer)
        joined += read.data_field[6:-16]
    assert packets_in(joined) == datas
    for start in starts:  # of each, whole packets follow
        assert packets_in(joined[start:]) == datas[len(datas) - len(packets_in(joined[start:])) :]


@given(DATAS, st.sampled_from([64, 256, 1115]), st.integers(1, 2000))
def test_what_is_wrapped_arrives_however_it_is_cut(datas, frame_bytes, size):
    sender, receiver = link(frame_bytes)
    stream = b"".join(sent_by(sender, datas))
    pieces = [stream[at : at + size] for at in range(0, len(stream), size)]
    assert [data for piece in pieces for data in receiver.feed(piece)] == datas
    assert (receiver.rejected, receiver.lost_bytes) == ({}, 0)
    assert (receiver.lost_frames, receiver.lost_packets) == (0, 0)


def test_garbage_is_counted_at_once_and_split_marks_are_found():
    sender, receiver = link(64)
    for number in range(4):
        assert receiver.feed(b"garbage" + MARK[:number]) == []
        assert receiver.lost_bytes == 7
        frame = sender.wrap(b"data") + sender.flush()
        arrived = [data for byte in frame[number:] for data in receiver.feed(bytes([byte]))]
        assert arrived == [b"data"] and receiver.lost_bytes == 7
        receiver.lost_bytes = 0


def test_a_frame_that_is_just_full_is_sent_at_once():
    sender, receiver = link(64)
    assert receiver.feed(sender.wrap(bytes(32))) == [bytes(32)]  # and 2 of the packet's header
    assert sender.flush() == b""
    assert receiver.feed(sender.wrap(b"next") + sender.flush()) == [b"next"]


def test_idle_packets_between_packets_are_passed_over():
    sender, receiver = link()
    sender._field += 3 * b"\xe0"
    sender._first = 0
    assert receiver.feed(sender.wrap(b"data") + sender.flush()) == [b"data"]


def test_incomplete_frame_is_dropped_at_the_end_of_the_stream():
    sender, receiver = link()
    begun = (sender.wrap(b"lost") + sender.flush())[:100]
    assert receiver.feed(begun) == [] and receiver.lost_bytes == 0
    assert receiver.flush() == []
    assert (receiver.rejected, receiver.lost_bytes) == ({"length": 1}, 100)
    assert receiver.feed(sender.wrap(b"next") + sender.flush()) == [b"next"]


@given(st.lists(st.binary(max_size=400), min_size=1))
def test_nothing_is_held_back_beyond_a_flush(datas):
    sender, receiver = link()
    for data in datas:
        assert receiver.feed(sender.wrap(data) + sender.flush()) == [data]
        assert sender.flush() == b""


def numbered(count, seed=1):
    """Data of all sizes that begin with their number."""
    rng = random.Random(seed)
    return [struct.pack(">I", n) + rng.randbytes(rng.randrange(150)) for n in range(count)]


@pytest.mark.parametrize("seed", range(20))
def test_lost_doubled_reordered_frames_deliver_data_once_in_order(seed):
    rng, datas = random.Random(seed), numbered(300)
    sender, receiver = link(rng.choice((64, 128, 256)))
    frames = sent_by(sender, datas, at_once=5)
    line = [frame for frame in frames[:-1] for _ in range(rng.choice((0, 1, 1, 1, 2)))]
    for _ in range(10):
        at = rng.randrange(len(line) - 1)
        line[at], line[at + 1] = line[at + 1], line[at]
    arrived = receiver.feed(b"".join(line))
    numbers = [struct.unpack_from(">I", data)[0] for data in arrived]
    assert numbers == sorted(set(numbers))
    assert arrived == [datas[number] for number in numbers]
    assert 0 < receiver.lost_frames < len(frames)
    assert receiver.rejected.keys() == {"replayed"}
    sender.counter += 5  # a gap that nobody sees otherwise
    assert receiver.feed(sender.wrap(b"after") + sender.flush()) == [b"after"]


@pytest.mark.parametrize("seed", range(10))
def test_frames_that_may_be_late_are_accepted_once(seed):
    """Of datagrams that overtake each other and come twice, each frame of whole packets counts."""
    rng, datas = random.Random(seed), [bytes([n]) * 100 for n in range(200)]
    sender, receiver = link()
    receiver = TelemetryReceiver({SPI: KEY}, SPACECRAFT, late=8)
    frames = sent_by(sender, datas, at_once=1)
    first, *rest = frames
    places = [(k + rng.uniform(0.0, 4.0), frame) for k, frame in enumerate(rest)]
    again = [(place + 1.0, frame) for place, frame in places if rng.random() < 0.3]
    line = [frame for _, frame in sorted(places + again, key=lambda each: each[0])]
    lost = []
    arrived = receiver.feed(first)
    for frame in line:
        arrived += receiver.feed(frame)
        lost.append(receiver.lost_frames)
    assert sorted(arrived) == datas and arrived != datas
    assert min(lost) == 0 < max(lost) and receiver.lost_frames == 0
    assert receiver.rejected == {"repeated": len(again)}


def test_a_counter_that_begins_again_is_no_late_frame():
    sender, _ = link()
    receiver = TelemetryReceiver({SPI: KEY}, SPACECRAFT, late=8)
    for frame in sent_by(sender, [bytes([n]) * 100 for n in range(5)], at_once=1):
        receiver.feed(frame)
    again, _ = link()
    frames = sent_by(again, [bytes([n]) * 100 for n in range(50, 60)], at_once=1)
    assert receiver.feed(frames[0]) == [] and receiver.rejected == {"replayed": 1}
    receiver.counters[SPI] = 0
    assert receiver.feed(b"".join(frames)) == [bytes([n]) * 100 for n in range(50, 60)]
    assert receiver.lost_frames == 0
    assert receiver.feed(frames[-2]) == [] and receiver.rejected["repeated"] == 1


def test_lost_frames_are_counted_and_what_is_whole_is_kept():
    sender, receiver = link(64)  # with room for 34 bytes
    frames = sent_by(sender, [bytes([n]) * 30 for n in range(12)], at_once=100)
    # bytes 170 to 203 are lost: the end of packet 5 (160 to 191) and the begin of packet 6
    arrived = receiver.feed(b"".join(frames[:5] + frames[6:]))
    assert [data[0] for data in arrived] == [0, 1, 2, 3, 4, 7, 8, 9, 10, 11]
    assert (receiver.lost_frames, receiver.lost_packets) == (1, 1)


def mutated(rng, frame):
    """A frame damaged or forged; the attacker knows the CRC, and where counter and SPI are."""
    damaged = bytearray(frame)
    kind = rng.randrange(7)
    if kind == 0:
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    elif kind == 1:
        return rng.randbytes(rng.randrange(300))
    elif kind == 2:
        return bytes(damaged[: rng.randrange(len(damaged))])
    elif kind == 3:
        return bytes(damaged[rng.randrange(1, len(damaged)) :])
    elif kind == 4:
        struct.pack_into(">I", damaged, 12, rng.randrange(2**32))
        return with_crc(damaged)
    elif kind == 5:
        other = TelemetrySender(rng.randbytes(32), SPI, SPACECRAFT, rng.randrange(100))
        return other.wrap(b"forged" * 30) + other.flush()
    else:
        damaged[rng.randrange(4, len(damaged) - 2)] ^= 1 + rng.randrange(255)
        return with_crc(damaged)
    return bytes(damaged)


def with_crc(frame):
    """The frame with the CRC that it should have: `refit` of a mark of two bytes."""
    return bytes(frame[:2]) + refit(bytearray(frame[2:]))


def attacked(count, seed):
    """Feed `count` mutated frames among genuine ones; the receiver."""
    rng = random.Random(seed)
    sender, receiver = link()
    last = -1
    for number in range(count // 20):
        data = struct.pack(">I", number) + rng.randbytes(rng.randrange(200))
        genuine = sender.wrap(data) + sender.flush()
        for _ in range(20):
            before = dict(receiver.counters)
            arrived = receiver.feed(mutated(rng, genuine))
            # only what completes a genuine frame by chance is accepted
            assert arrived in ([], [data])
            assert arrived == [] or last < number
            last = number if arrived else last
            assert receiver.counters == before or receiver.counters == {SPI: sender.counter}
        assert receiver.flush() == []
        assert receiver.feed(genuine) == ([data] if last < number else [])
        last = number
        assert receiver.counters == {SPI: sender.counter}
    return receiver


def test_no_wrong_telemetry_in_ten_thousand_mutated_frames():
    receiver = attacked(10_000, seed=3)
    assert {"checksum", "mac"} <= receiver.rejected.keys()
    assert receiver.lost_frames == 0


def test_authentic_non_packet_data_do_not_stop_the_stream():
    sender, receiver = link()
    sender._field += b"\x42 not a packet"
    sender._first = 0
    assert receiver.feed(sender.flush() + sender.wrap(b"next") + sender.flush()) == [b"next"]
    sender._field += b"\xfd\x01 a length that is none"
    sender._first = 0
    assert receiver.feed(sender.flush() + sender.wrap(b"next") + sender.flush()) == [b"next"]
    sender._field += b"\x42" + bytes(sender.room)
    sender._first = 0
    frame = sender._frame()
    assert receiver.feed(frame + sender.wrap(b"next") + sender.flush()) == [b"next"]
    assert receiver.lost_packets == 3


@given(st.integers(0, 1500))
def test_copies_go_on_as_the_first(at):
    sender, receiver = link(128)
    stream = b"".join(sent_by(sender, numbered(8)))
    receiver.feed(stream[:at])
    sender.wrap(b"waits")
    others = copy.deepcopy((sender, receiver))
    ends = [one.feed(stream[at:] + two.flush()) for two, one in ((sender, receiver), others)]
    assert ends[0] == ends[1] and ends[0][-1] == b"waits"
    assert vars(others[1]) == vars(receiver)


def test_rebooted_sender_continues_with_a_later_counter():
    sender, receiver = link()
    assert receiver.feed(sender.wrap(b"one") + sender.flush()) == [b"one"]
    sender.wrap(b"lost with the memory of the sender")
    sender, _ = link(counter=1000)
    assert receiver.feed(sender.wrap(b"two") + sender.flush()) == [b"two"]
    assert receiver.lost_frames == 999


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: link(63), "frame_bytes: must be from 64 to 2048; received 63"),
        (lambda: link(2049), "frame_bytes: must be from 64 to 2048; received 2049"),
        (lambda: link()[0].wrap(bytes(65532)), "data: at most 65531 bytes; received 65532"),
    ],
)
def test_mistakes_are_named(make, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        make()


def test_the_longest_data_arrive():
    sender, receiver = link()
    data = random.Random(1).randbytes(TELEMETRY_BYTES)
    assert receiver.feed(sender.wrap(data) + sender.flush()) == [data]
