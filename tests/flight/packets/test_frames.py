"""Frames as the satellite sent them, and the stream that finds them again."""

import copy

import pytest

from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.frames import ALARM, HEADER_BYTES, Downlink, Stream, Uplink

CHIBIS = load_dictionary("chibis_m")
BEACON = bytes.fromhex(
    "ddccbbaa 15cd5b07 01 01 00000000 0800"  # framesync, time 123456789, id, ALARM, length
    "03 01 01 07 1f 3412 ff"  # TRIAD, DETUMB, AUTOMATIC, flags, power, reboots 0x1234, errors
)
SET_MODE = bytes.fromhex("ddccbbaa 00000000 10 01 00000000 0300 01 02 05")


def frames_of(data, direction="down"):
    stream = Stream(CHIBIS, direction)
    return list(stream.feed(data)), stream


@pytest.mark.verifies("REQ-PKT-001")
def test_beacon_is_the_historical_one_bit_by_bit():
    values = (3, 1, 1, 7, 0x1F, 0x1234, 255)
    assert Downlink(CHIBIS).frame("beacon", 123456789.9, values, ALARM) == BEACON
    (frame,), stream = frames_of(BEACON)
    assert (frame.packet.name, frame.time_s, frame.status) == ("beacon", 123456789, ALARM)
    assert (frame.values, frame.raw, stream.lost_bytes) == (values, BEACON, 0)
    assert BEACON[HEADER_BYTES + 5 : HEADER_BYTES + 7] == bytes([0x34, 0x12])


@pytest.mark.verifies("REQ-PKT-001")
def test_command_is_the_historical_one_bit_by_bit():
    assert Uplink(CHIBIS).frame("set_mode", 0, (1, 2, 5)) == SET_MODE
    (frame,), _ = frames_of(SET_MODE, "up")
    assert (frame.packet.name, frame.module, frame.values) == ("set_mode", 1, (1, 2, 5))


@pytest.mark.parametrize(
    ("place", "value", "reason"),
    [(8, 99, "unknown"), (14, 9, "length"), (15, 255, "length"), (9, 3, "status")],
)
def test_header_that_is_wrong_is_rejected_and_counted(place, value, reason):
    wrong = bytearray(BEACON)
    wrong[place] = value
    found, stream = frames_of(bytes(wrong) + BEACON)
    assert [frame.raw for frame in found] == [BEACON]
    assert (stream.rejected, stream.lost_bytes) == ({reason: 1}, len(BEACON))
    (rejected,) = stream.take_rejected()
    assert (rejected.reason, rejected.time_s) == (reason, 123456789)
    assert stream.take_rejected() == []


def test_command_for_another_module_is_rejected_with_its_id():
    wrong = SET_MODE[:9] + bytes([2]) + SET_MODE[10:]
    found, stream = frames_of(wrong, "up")
    assert (found, stream.rejected) == ([], {"module": 1})
    (rejected,) = stream.take_rejected()
    assert (rejected.id, rejected.code, rejected.length) == (16, 2, 3)


def test_frame_that_lost_bytes_spares_the_next_one():
    extended = Downlink(CHIBIS).frame("extended", 5, [0.0] * 43)
    for lost in range(1, len(extended)):
        found, stream = frames_of(extended[:-lost] + BEACON + BEACON)
        assert [frame.raw for frame in found][-2:] == [BEACON, BEACON], lost
        taken = lost < 4  # of the next framesync: not enough to notice that a frame begins
        assert len(found) == 2 + taken
        assert stream.lost_bytes == (0 if taken else len(extended) - lost)


def test_stream_can_be_split_and_copied_anywhere():
    data = b"noise" + BEACON + BEACON[:9] + BEACON + b"\xdd\xcc" + BEACON
    whole, _ = frames_of(data)
    assert len(whole) == 3
    for at in range(len(data)):
        stream = Stream(CHIBIS, "down")
        found = list(stream.feed(data[:at]))
        twin = copy.deepcopy(stream)
        assert found + list(stream.feed(data[at:])) == whole
        assert found + list(twin.feed(data[at:])) == whole
        assert (stream.lost_bytes, stream.rejected) == (twin.lost_bytes, twin.rejected)
        assert stream.lost_bytes == len(data) - 3 * len(BEACON)
