"""PUS-C in damaged and malformed packets: no error, and nothing wrong is taken for right."""

import random
import struct

import pytest
from frame_attacks import KEY, SPACECRAFT
from hypothesis import given, settings, strategies as st
from pus_ends import (
    APID,
    SATELLITE,
    UPLINK,
    answer,
    judged,
    process,
    reframed,
    stamp,
    user,
    with_crc,
)
from spacepackets.ecss import PusTc, PusTm

from torquer.flight.packets.frames import ALARM, INFO
from torquer.flight.packets.keys import Keys
from torquer.flight.packets.protected import TelemetryReceiver, TelemetrySender
from torquer.flight.packets.reasons import REJECTIONS, Reason
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.packets.station import Station

pytestmark = pytest.mark.verifies("REQ-PUS-005")
SPI = 9


def telecommand(service=8, subtype=1, data=b"\x12\x01", apid=APID, count=7):
    made = PusTc(service, subtype, apid=apid, app_data=data, seq_count=count, ack_flags=9)
    return bytes(made.pack())


def telemetry(service=3, subtype=25, data=b"\x00\x01" + bytes(8), apid=APID, time=None):
    made = PusTm(service, subtype, timestamp=time or stamp(5), source_data=data, apid=apid)
    return bytes(made.pack())


def patched(packet, at, value, fits=True):
    """A packet with another byte, and the CRC that fits."""
    changed = packet[:at] + bytes([value]) + packet[at + 1 :]
    return with_crc(changed) if fits else changed


GOOD, INSIDE = telecommand(), telecommand(count=8)
LATER = b"\x01" + stamp(1000)
#: By name: packet, reason, what the log states of it.
MALFORMED = {
    "bit": (patched(GOOD, 11, 0x13, fits=False), "checksum", 0),
    "crc": (GOOD[:-1] + bytes([GOOD[-1] ^ 1]), "checksum", 0),
    "length too small": (patched(GOOD, 5, GOOD[5] - 1), "length", 0),
    "length too great": (patched(GOOD, 5, GOOD[5] + 1), "length", 0),
    "rest": (GOOD + b"\0", "length", 0),
    "cut": (GOOD[:12], "length", 0),
    "only a header": (GOOD[:6], "length", 0),
    "segment": (patched(GOOD, 2, GOOD[2] & 0x7F), "version", 0),
    "without a secondary header": (patched(GOOD, 0, GOOD[0] & ~0x08), "version", 0),
    "PUS-A": (patched(GOOD, 6, 0x19), "version", 0),
    "another process": (telecommand(apid=APID + 1), "apid", 0),
    "no such service": (telecommand(200, 1), "unknown", 200 << 8 | 1),
    "no such subservice": (telecommand(11, 9), "unknown", 11 << 8 | 9),
    "a schedule reset with data": (telecommand(11, 3, b"\0"), "length", 11 << 8 | 3),
    "no activity to delete": (telecommand(11, 5, b""), "length", 11 << 8 | 5),
    "two activities to delete": (telecommand(11, 5, b"\2" + bytes(12)), "value", 11 << 8 | 5),
    "half an activity to delete": (telecommand(11, 5, b"\1\0\1"), "length", 11 << 8 | 5),
    "one-shot report": (telecommand(3, 27, b"\x01\x00\x01"), "unknown", 3 << 8 | 27),
    "no such function": (telecommand(data=b"\xfa\x01"), "unknown", 250),
    "a parameter as a function": (telecommand(data=b"\x15\x00\x00"), "unknown", 21),
    "no function": (telecommand(data=b""), "length", 8 << 8 | 1),
    "few arguments": (telecommand(data=b"\x12"), "length", 18),
    "many arguments": (telecommand(data=b"\x12\x01\x01"), "length", 18),
    "no parameters": (telecommand(20, 1, b"\x00"), "value", 20 << 8 | 1),
    "two parameters": (telecommand(20, 1, b"\x02\0\0\1\0"), "value", 20 << 8 | 1),
    "parameters without N": (telecommand(20, 1, b""), "length", 20 << 8 | 1),
    "half a parameter": (telecommand(20, 3, b"\x01\0\0\0"), "length", 20 << 8 | 3),
    "connection test with data": (telecommand(17, 1, b"\0"), "length", 17 << 8 | 1),
    "schedule without N": (telecommand(11, 4, b""), "length", 11 << 8 | 4),
    "no activities": (telecommand(11, 4, b"\0"), "value", 11 << 8 | 4),
    "activity without a packet": (telecommand(11, 4, LATER), "length", 11 << 8 | 4),
    "activity cut": (telecommand(11, 4, LATER + INSIDE[:-1]), "length", 11 << 8 | 4),
    "activity with a rest": (telecommand(11, 4, LATER + INSIDE + b"\0"), "length", 11 << 8 | 4),
    "fewer activities than N": (
        telecommand(11, 4, b"\x02" + LATER[1:] + INSIDE),
        *("length", 11 << 8 | 4),
    ),
    "activity with a wrong CRC": (
        telecommand(11, 4, LATER + INSIDE[:-1] + b"\0"),
        *("checksum", 11 << 8 | 4),
    ),
    "activity for another process": (
        telecommand(11, 4, LATER + telecommand(apid=1)),
        *("apid", 11 << 8 | 4),
    ),
    "connection test as an activity": (
        telecommand(11, 4, LATER + telecommand(17, 1, b"")),
        *("unknown", 11 << 8 | 4),
    ),
    "insertion as an activity": (
        telecommand(11, 4, LATER + telecommand(11, 4, LATER + INSIDE)),
        *("unknown", 11 << 8 | 4),
    ),
    "another time code": (
        telecommand(11, 4, b"\x01\x2e" + LATER[2:] + INSIDE),
        *("time", 11 << 8 | 4),
    ),
    "a time after the day": (
        telecommand(11, 4, LATER[:4] + b"\xff\xff\xff\xff" + INSIDE),
        *("time", 11 << 8 | 4),
    ),
}  # fmt: skip
#: Without a request ID.
NO_TELECOMMAND = {
    "nothing": (b"", "length"),
    "five bytes": (GOOD[:5], "length"),
    "telemetry": (patched(GOOD, 0, GOOD[0] & ~0x10), "version"),
    "packet version": (patched(GOOD, 0, GOOD[0] | 0x20), "version"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_a_malformed_telecommand_is_refused_counted_and_answered(name):
    packet, reason, number = MALFORMED[name]
    board = process()
    assert judged(board, packet) == [] and board.rejected == {reason: 1}
    (header,) = board.take_rejected()
    assert (header.reason, header.id, header.length) == (reason, number, len(packet))
    (report,) = [PusTm.unpack(each, 7) for each in board.reports([], 0)]
    assert (report.service, report.message_subtype) == (1, 2)
    assert report.tm_data == packet[:4] + bytes([REJECTIONS[reason]])
    assert [frame.packet.id for frame in judged(board, GOOD)] == [18]


@pytest.mark.parametrize("name", NO_TELECOMMAND)
def test_what_has_no_request_id_is_refused_and_counted(name):
    packet, reason = NO_TELECOMMAND[name]
    board = process()
    assert judged(board, packet) == [] and board.rejected == {reason: 1}
    assert not board.waiting and board.reports([], 0) == []


def test_reports_on_malformed_packets_have_the_codes_of_the_software():
    assert REJECTIONS["checksum"] is Reason.CHECKSUM and REJECTIONS["apid"] is Reason.MODULE
    reasons = {reason for _, reason, _ in MALFORMED.values()}
    assert reasons <= REJECTIONS.keys()


def test_only_the_latest_rejected_packets_are_kept():
    board = process()
    for number in range(30):
        judged(board, telecommand(100, number))
    assert [header.id & 0xFF for header in board.take_rejected()] == list(range(20, 30))
    assert board.take_rejected() == []


@pytest.mark.parametrize(
    ("packet", "reason"),
    [
        (b"", "length"),
        (telemetry()[:-1], "length"),
        (patched(telemetry(), 12, 1, fits=False), "checksum"),
        (patched(telemetry(), 6, 0x10), "version"),
        (GOOD + bytes(20), "length"),
        (patched(telemetry(), 0, 0x18), "version"),
        (telemetry(apid=1), "apid"),
        (telemetry(time=b"\x2e" + bytes(6)), "time"),
        (telemetry(3, 26), "unknown"),
        (telemetry(200, 1), "unknown"),
        (telemetry(data=b"\x00"), "unknown"),
        (telemetry(data=b"\x00\xfa" + bytes(8)), "unknown"),
        (telemetry(data=b"\x00\x00" + bytes(8)), "unknown"),
        (telemetry(data=b"\x03\x01" + bytes(8)), "status"),
        (telemetry(data=b"\x00\x01" + bytes(9)), "length"),
        (telemetry(5, 1, b"\x20\x01\x20"), "length"),
        (telemetry(5, 1, b"\x20"), "unknown"),
        (telemetry(5, 1, b"\x20\x01\x21" + bytes(12)), "value"),
        (telemetry(5, 5, b"\x20\x01\x20" + bytes(12)), "unknown"),
        (telemetry(20, 2, b""), "unknown"),
        (telemetry(20, 2, b"\x02" + bytes(20)), "value"),
        (telemetry(20, 2, b"\x01" + bytes(9)), "length"),
        (telemetry(17, 2, b"\x00"), "length"),
        (telemetry(1, 3, bytes(4)), "unknown"),
        (telemetry(1, 7, bytes(5)), "length"),
        (telemetry(1, 2, bytes(4)), "length"),
    ],
)
def test_malformed_telemetry_is_rejected_and_counted(packet, reason):
    ground = user()
    assert list(ground.feed(packet)) == [] and ground.rejected == {reason: 1}
    assert len(list(ground.feed(telemetry()))) == 1


def test_idle_packets_are_no_news():
    ground = user()
    assert list(ground.feed(bytes.fromhex("07ffc000000000"))) == [] and not ground.rejected


def mutated(rng, packet):
    """A packet with one of several mistakes; sometimes with the CRC that then fits."""
    damaged = bytearray(packet)
    kind = rng.randrange(4)
    if kind == 0:
        for _ in range(rng.randrange(1, 4)):
            damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    elif kind == 1:
        del damaged[rng.randrange(len(damaged)) :]
    elif kind == 2:
        damaged += rng.randbytes(rng.randrange(1, 20))
    else:
        at = rng.randrange(len(damaged))
        damaged[at : at + rng.randrange(8)] = rng.randbytes(rng.randrange(8))
    fits = rng.random() < 0.5 and len(damaged) > 2
    return with_crc(damaged) if fits else bytes(damaged)


def samples(rng):
    """Packets of all kinds, up and down."""
    ground, board, up, down = user(), process(), [], []
    for packet in SATELLITE.up.values():
        data = rng.randbytes(packet.size)
        module = SATELLITE.modules[packet.module]
        up += [ground.request(reframed(packet, t, module, data)) for t in (0, 123456)]
        up.append(telecommand(11, 4, b"\x02" + 2 * (stamp(50) + INSIDE)))
    for packet in SATELLITE.down.values():
        frames = [reframed(packet, 9, s, rng.randbytes(packet.size)) for s in (INFO, ALARM)]
        down += board.reports(frames, 0)
    (frame,) = judged(board, GOOD)
    judged(board, ground.ping())
    judged(board, up[0], Reason.STATE)
    down += board.reports([], 0)
    return up, down + board.reports([answer(frame)], 0)


def test_mutated_packets_raise_no_error_and_wrong_crcs_are_rejected():
    rng = random.Random(8)
    up, down = samples(rng)
    board, ground = process(), user()
    accepted = 0
    for _ in range(10_000):
        packet = mutated(rng, rng.choice(up))
        found = judged(board, packet, rng.choice([0, 5, 14]))
        alive = [each for each in board.reports([answer(f) for f in found], 0)]
        assert not found or (with_crc(packet) == packet and PusTc.unpack(packet))
        accepted += len(found) > 0
        packet = mutated(rng, rng.choice(down))
        made = list(ground.feed(packet))
        assert not made or (with_crc(packet) == packet and PusTm.unpack(packet, 7))
        for each in alive:
            list(ground.feed(each))
    assert accepted > 100 and {"checksum", "length", "version", "unknown"} <= board.rejected.keys()
    assert {"checksum", "length", "version", "unknown"} <= ground.rejected.keys()


@settings(deadline=None)
@given(st.binary(max_size=80), st.booleans())
def test_no_bytes_cause_an_error(data, fits):
    packet = with_crc(data) if fits and len(data) > 2 else data
    board, ground = process(), user()
    judged(board, packet)
    list(ground.feed(packet))
    board.reports([data], 0)


def sent_in_frames(packets, frame_bytes):
    sender = TelemetrySender(KEY, SPI, SPACECRAFT, frame_bytes=frame_bytes)
    stream = b"".join(sender.wrap_packet(packet) for packet in packets)
    return stream + sender.flush()


@pytest.mark.verifies("REQ-PUS-001")
@pytest.mark.parametrize("frame_bytes", [64, 256, 2048])
def test_a_stream_may_be_cut_at_any_byte(frame_bytes):
    """Space packets of all sizes across transfer frames, received in parts of any sizes."""
    rng = random.Random(frame_bytes)
    _, packets = samples(rng)
    stream = sent_in_frames(packets, frame_bytes)
    for size in (1, 2, 3, 7, 50, len(stream)):
        receiver = TelemetryReceiver({SPI: KEY}, SPACECRAFT, frame_bytes=frame_bytes)
        parts = (stream[at : at + size] for at in range(0, len(stream), size))
        assert [packet for part in parts for packet in receiver.feed(part)] == packets
        assert receiver.lost_packets == receiver.lost_bytes == 0


def test_mixed_packets_share_frames_and_next_survives_a_lost_frame():
    sender = TelemetrySender(KEY, SPI, SPACECRAFT, frame_bytes=64)
    receiver = TelemetryReceiver({SPI: KEY}, SPACECRAFT, frame_bytes=64)
    packet = telemetry()
    both = sender.wrap_packet(packet) + sender.wrap(b"data") + sender.flush()
    assert receiver.feed(both) == [packet, b"data"]
    long = telemetry(data=b"\x00\x02" + bytes(96))
    stream = sender.wrap_packet(long) + sender.wrap_packet(packet) + sender.flush()
    frame = 64 + 4
    assert receiver.feed(stream[:frame] + stream[2 * frame :]) == [packet]
    assert receiver.lost_packets == 1 and receiver.lost_frames == 1


@pytest.mark.parametrize("packet", [b"", GOOD[:-1], GOOD + b"\0", b"\x20" + GOOD[1:]])
def test_only_space_packets_travel_as_they_are(packet):
    sender = TelemetrySender(KEY, SPI, SPACECRAFT)
    with pytest.raises(ValueError, match="packet: must be a space packet"):
        sender.wrap_packet(packet)
    assert sender.flush() == b""


KEYS = Keys(bytes(32), bytes(range(32)), SPI, APID)
PUS, PROTECTED = (SpaceLink("test", SATELLITE, kind, KEYS) for kind in ("pus", "protected"))


def test_a_station_receives_telemetry_in_any_parts():
    rng = random.Random(1)
    _, packets = samples(rng)
    sender = TelemetrySender(KEYS.down, SPI, APID)
    stream = b"".join(sender.wrap_packet(packet) for packet in packets) + sender.flush()
    whole = list(Station(PUS).receive(stream))
    station = Station(PUS)
    cut = [f for byte in struct.unpack(f"{len(stream)}c", stream) for f in station.receive(byte)]
    assert repr(cut) == repr(whole) and len(whole) > 2 * len(SATELLITE.down)
    assert list(station.finish()) == [] and station.pings_answered == 1


def test_a_ping_belongs_to_pus():
    with pytest.raises(ValueError, match="ping: must be of a link with PUS"):
        Station(PROTECTED).ping()
    assert Station(PROTECTED).pings_answered == 0
    assert Station(PROTECTED).command(UPLINK.frame("automatic", 0, (1, 1)))
