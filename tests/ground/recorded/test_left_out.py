"""Why frames are left out, and files that are no plain bytes of the link."""

import random
import struct
from dataclasses import replace

import pytest
from recorded_passes import (
    DICTIONARY,
    HISTORICAL,
    PROTECTED,
    imported,
    packets,
    reasons,
    wrapped,
)

from torquer.flight.packets.dictionary import Packet
from torquer.flight.packets.frames import HEADER
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.space_packets import Telemetry

FRAMES = list(packets(2, 40))
SENT = wrapped(FRAMES)[0]
ALL = b"".join(SENT)
PLAIN = b"".join(FRAMES)


def only(counts):
    """The single reason."""
    (found,) = counts["left_out"]
    return found


def with_head(frame, **changes):
    """A frame whose header differs."""
    keys = ("mark", "time_s", "id", "code", "reserved", "length")
    head = dict(zip(keys, HEADER.unpack_from(frame), strict=True)) | changes
    return HEADER.pack(*head.values()) + frame[HEADER.size :]


def test_other_keys_and_spacecraft(tmp_path):
    for keys, reason, text in (
        (PROTECTED.keys._replace(down=bytes(32)), "mac", "have a wrong MAC"),
        (PROTECTED.keys._replace(spacecraft=5), "spacecraft", "spacecraft 5, must be 77"),
        (PROTECTED.keys._replace(spi=8), "spi", "key 8, must be 1"),
    ):
        other = wrapped(FRAMES, keys)[0]
        counts, kept = imported(tmp_path, b"".join(other))
        found = only(counts)
        assert (found["reason"], found["count"], found["first_byte"]) == (reason, len(other), 0)
        assert text in found["text"] and text in counts["failure"] and not kept


def test_a_damaged_and_a_cut_frame_are_named_with_their_places(tmp_path):
    damaged = bytearray(ALL)
    damaged[3 * 260 + 100] ^= 1
    counts, _ = imported(tmp_path, bytes(damaged[:-20]))
    found = {each["reason"]: (each["count"], each["first_byte"]) for each in counts["left_out"]}
    assert found["checksum"] == (1, 3 * 260)
    assert found["cut"] == (1, len(ALL) - 260)
    assert counts["failure"] == ""


def test_places_are_those_of_their_recordings(tmp_path):
    damaged = bytearray(ALL)
    damaged[100] ^= 1
    counts, _ = imported(tmp_path, ALL, b"noise" + bytes(damaged))
    found = {each["reason"]: (each["recording"], each["first_byte"]) for each in counts["left_out"]}
    assert found["checksum"] == ("1.bin", 5) and found["repeated"] == ("1.bin", 265)


@pytest.mark.parametrize(
    ("changes", "reason", "text"),
    [
        ({"length": 9}, "length", "9 bytes of beacon, must be 8"),
        ({"length": 0x0800}, "length", "must be 8, its two bytes are swapped"),
        ({"id": 99}, "unknown", "id 99, must be one of 1, 2, 3"),
        ({"code": 7}, "status", "status 7 of beacon, must be 0 to 2"),
    ],
)
def test_plain_frames_with_another_header(tmp_path, changes, reason, text):
    beacons = [frame for frame in FRAMES if frame[8] == 1]
    wrong = b"".join(with_head(frame, **changes) for frame in beacons)
    counts, kept = imported(tmp_path, b"\0" * 7 + wrong, link=HISTORICAL)
    found = only(counts)
    assert (found["reason"], found["count"], found["first_byte"]) == (reason, len(beacons), 7)
    assert text in found["text"] and text in counts["failure"] and not kept


def test_less_than_half_of_the_bytes_is_a_failure(tmp_path):
    for noise, fails in ((len(ALL) - 200, False), (len(ALL) + 200, True)):
        counts, _ = imported(tmp_path, ALL + bytes(noise))
        assert bool(counts["failure"]) is fails
    assert f"{len(ALL)} of {2 * len(ALL) + 200} bytes in frames, 40 packets" in counts["failure"]
    for nothing in (b"", b"\0" * 1000, ALL[:100]):
        assert imported(tmp_path, nothing)[0]["failure"].startswith("RECORDING: must hold frames")


def test_authentic_frames_with_other_packets_are_no_success(tmp_path):
    own = Packet(name="own", id=200, description="d", fields=DICTIONARY.down["beacon"].fields)
    foreign = [with_head(frame, id=own.id) for frame in FRAMES if frame[8] == 1]
    counts, kept = imported(tmp_path, b"".join(wrapped(foreign)[0]))
    assert reasons(counts) == {"unknown": len(foreign)} and not kept
    assert "0 packets" in counts["failure"]


# Files that are no plain bytes


def kiss(frames):
    escaped = (f.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc") for f in frames)
    return b"".join(b"\xc0\x00" + frame + b"\xc0" for frame in escaped)


def address(name, number, last):
    return bytes(2 * c for c in name.ljust(6).encode()) + bytes([0x60 | number << 1 | last])


ADDRESSES = address("RS1SAT", 0, 0) + address("GROUND", 3, 1)


@pytest.mark.parametrize(
    ("data", "note"),
    [
        (ALL.hex().encode(), "text in hexadecimal"),
        (b"\n".join(frame.hex(" ").upper().encode() for frame in SENT), "text in hexadecimal"),
        (b", ".join(b"0x%02x" % byte for byte in ALL), "text in hexadecimal"),
        (kiss(SENT), "KISS frames (0xC0)"),
        (kiss(SENT).hex().encode(), "text in hexadecimal of KISS frames (0xC0)"),
        (kiss(ADDRESSES + b"\x03\xf0" + f for f in SENT), "KISS frames (0xC0) of AX.25 addresses"),
    ],
)
def test_what_is_plain_is_read(tmp_path, data, note):
    counts, kept = imported(tmp_path, data)
    assert counts["notes"] == [f"0.bin: read as {note}; places are those of what was read"]
    assert len(kept) == len(FRAMES) and not counts["failure"]


def swapped(data, size):
    data += bytes(-len(data) % size)
    return b"".join(data[at : at + size][::-1] for at in range(0, len(data), size))


def big_endian(frame):
    return struct.pack(">IIBBIH", *HEADER.unpack_from(frame)) + frame[HEADER.size :]


def reports(apid):
    return b"".join(Telemetry(apid, k, 3, 25, 0, 1, k, bytes(20)).packed() for k in range(9))


@pytest.mark.parametrize(
    ("data", "link", "text"),
    [
        (swapped(ALL, 2), PROTECTED, "bytes are swapped in pairs"),
        (b"x" + swapped(ALL, 4), PROTECTED, "bytes are swapped in fours"),
        (swapped(PLAIN, 2), HISTORICAL, "bytes are swapped in pairs"),
        (b"".join(map(big_endian, FRAMES)), HISTORICAL, "the other byte order"),
        (ALL, HISTORICAL, "TM transfer frames (CCSDS 132.0-B), link = 'historical' looks for none"),
        (PLAIN, PROTECTED, "frames without protection; link = 'protected' looks for TM"),
        (reports(5), PROTECTED, "CCSDS space packets of APID 5"),
        (reports(5) + reports(77), HISTORICAL, "CCSDS space packets of APID 5, 77"),
        (swapped(reports(5), 2), PROTECTED, "bytes are swapped in pairs: without that, CCSDS"),
        (swapped(reports(77), 4), HISTORICAL, "bytes are swapped in fours: without that, CCSDS"),
        (bytes(4000), PROTECTED, "all its bytes are 00: it holds nothing"),
        (b"\xff" * 4000, HISTORICAL, "all its bytes are FF: it holds nothing"),
        (
            ADDRESSES + b"\x03\xf0" + bytes(50),
            PROTECTED,
            "AX.25 addresses, from GROUND-3 to RS1SAT",
        ),
        (
            b"".join(b"\x1a\xcf\xfc\x1d" + b"\x01\x20" + bytes(1113) for _ in range(5)),
            PROTECTED,
            "TM transfer frames of 1115 bytes, must be 256; of spacecraft 18",
        ),
    ],
)
def test_what_is_not_read_is_named(tmp_path, data, link, text):
    counts, kept = imported(tmp_path, data, link=link)
    assert text in counts["failure"] and "\n" not in counts["failure"]
    assert not kept or data == ALL  # the plain frames in protected ones


def test_bytes_of_any_kind_are_not_taken_for_something(tmp_path):
    for seed in range(20):
        noise = random.Random(seed).randbytes(5000)
        counts, kept = imported(tmp_path, noise)
        assert counts["failure"].endswith("no frame begins in it") and not kept


def test_reasons_in_authentic_packets_of_pus(tmp_path):
    """Reports of another application process in frames of ours."""
    link = replace(PROTECTED, link="pus")
    keys = link.keys
    sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    report = Telemetry(5, 0, 3, 25, 0, 1, 7, bytes(20)).packed()
    counts, _ = imported(tmp_path, sender.wrap_packet(report) + sender.flush(), link=link)
    assert reasons(counts) == {"apid": 1} and "another application process" in counts["failure"]


def test_text_that_is_almost_hexadecimal_is_told_by_its_line(tmp_path):
    counts, kept = imported(tmp_path, b"# pass\n" + ALL.hex().encode())
    assert not kept and "text in hexadecimal: line 1 must have digits" in counts["failure"]
    assert only(counts)["text"].startswith("is not read") and counts["lost_bytes"] > len(ALL)


@pytest.mark.parametrize(("link", "data"), [(PROTECTED, ALL), (HISTORICAL, PLAIN)])
def test_one_recording_without_frames_is_named_among_others(tmp_path, link, data):
    counts, _ = imported(tmp_path, data, b"A text about nothing.\n" * 9, data, link=link)
    assert counts["notes"] == ["1.bin: nothing is kept of it: no frame begins in it"]
    assert not counts["failure"]
