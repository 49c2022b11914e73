"""Recordings of space packets of another satellite: in KISS frames, damaged, with gaps."""

import re
import struct
from contextlib import closing

import pytest
from recorded_passes import reasons

from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.keys import Keys
from torquer.flight.packets.software_file import SpaceLink
from torquer.ground.archive import Archive
from torquer.ground.recording import import_recording

TIME = Field(name="t", type="u32be", scale=1000, unit="ms", description="t")
WORD = Field(name="word", type="u32be", description="w")
DICTIONARY = Dictionary(
    name="other",
    down={
        "words": Packet(name="words", id=1025, description="w", fields=(TIME, WORD), time_ms="t")
    },
)
LINK = SpaceLink("other", DICTIONARY, "space_packets", Keys())
#: A word of which the half is escaped in KISS.
WORDS = 0xC0DB_0000


def words(number, apid=1025, flags=3, count=None, more=b""):
    """A packet by its layout."""
    data = struct.pack(">II", 7000 + number, WORDS + number) + more
    count = number if count is None else count
    return struct.pack(">HHH", apid, flags << 14 | count % 2**14, len(data) - 1) + data


PACKETS = [words(number) for number in range(100)]
ALL = b"".join(PACKETS)


def imported(folder, *recordings):
    """The counts of an import, and the words that the archive has then."""
    paths = [folder / f"{number}.bin" for number in range(len(recordings))]
    for path, data in zip(paths, recordings, strict=True):
        path.write_bytes(data)
    with closing(Archive(folder / "a.sqlite", DICTIONARY)) as archive:
        counts = import_recording(LINK, paths, archive)
        return counts, [number - WORDS for (number,) in archive.read("SELECT word FROM words")]


def kiss(frame):
    return b"\xc0\x00" + frame.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc") + b"\xc0"


WRAPPED = [kiss(packet) for packet in PACKETS]


@pytest.mark.parametrize(
    ("begin", "end", "kept", "cuts"),
    [(0, -7, range(99), 1), (5, None, range(1, 100), 1), (5, -7, range(1, 99), 2)],
)
def test_kiss_frames_are_read_although_the_ends_are_cut(tmp_path, begin, end, kept, cuts):
    counts, found = imported(tmp_path, b"".join(WRAPPED)[begin:end])
    assert sorted(found) == list(kept) and reasons(counts) == {"kiss_cut": cuts}
    assert "KISS frames" in counts["notes"][0] and not counts["failure"]
    assert counts["bytes"] - counts["lost_bytes"] == 14 * len(kept)


def test_kiss_frame_of_another_length_is_left_out(tmp_path):
    wrong = kiss(PACKETS[40][:8] + b"xy" + PACKETS[40][8:])
    counts, found = imported(tmp_path, b"".join([*WRAPPED[:40], wrong, *WRAPPED[41:]]))
    assert sorted(found) == [k for k in range(100) if k != 40]
    (entry,) = counts["left_out"]
    assert (entry["reason"], entry["count"], entry["first_byte"]) == ("kiss_length", 1, 40 * 14)
    assert entry["text"].startswith("has a KISS frame") and "16 bytes, must be 14" in entry["text"]


def test_plain_packets_are_not_taken_for_kiss_frames(tmp_path):
    """Their sequence flags are 0xC0, and a count below 256 follows as a command would."""
    counts, found = imported(tmp_path, ALL)
    assert sorted(found) == list(range(100)) and not counts["notes"]


def test_packets_across_kiss_frames_are_read(tmp_path):
    pieces = [ALL[at : at + 9] for at in range(0, len(ALL), 9)]
    counts, found = imported(tmp_path, b"".join(map(kiss, pieces)))
    assert sorted(found) == list(range(100)) and counts["left_out"] == []


@pytest.mark.parametrize(
    ("made", "reason", "text"),
    [
        ({"more": b"x"}, "length", "state another length .*: 15 bytes of words, must be 14"),
        ({"flags": 0}, "segmented", "are segments .*: sequence flags 0 of words, must be 3"),
        ({"apid": 77}, "unknown", "have an id .*: APID 77, must be one of 1025"),
    ],
)
def test_packets_that_are_left_out_are_told_by_what_is_wrong(tmp_path, made, reason, text):
    wrong = [words(number, **made) for number in range(9)]
    counts, found = imported(tmp_path, b"".join(wrong))
    (entry,) = counts["left_out"]
    assert (entry["reason"], entry["count"], entry["first_byte"]) == (reason, 9, 0) and not found
    assert re.match(text, entry["text"]) and entry["text"] in counts["failure"]
    counts, found = imported(tmp_path, ALL, ALL[:28] + b"".join(wrong))
    (entry,) = [each for each in counts["left_out"] if each["reason"] == reason]
    assert (entry["recording"], entry["first_byte"]) == ("1.bin", 28)


def test_cut_packet_at_the_end_is_at_its_place(tmp_path):
    counts, _ = imported(tmp_path, ALL[:-3])
    (entry,) = counts["left_out"]
    assert (entry["reason"], entry["first_byte"]) == ("cut", 99 * 14)
    assert entry["text"].endswith("11 bytes, must be 14")


def test_gaps_in_the_counters_are_lost_packets(tmp_path):
    assert imported(tmp_path, ALL)[0]["lost_packets"] == 0
    counts, _ = imported(tmp_path, b"".join(PACKETS[:30]), b"".join(PACKETS[60:]))
    assert counts["lost_packets"] == 30
    counts, _ = imported(tmp_path, b"".join(PACKETS[60:]), b"".join(PACKETS[:70]))
    assert counts["lost_packets"] == 0


def test_recording_of_which_nothing_is_kept_is_told_by_its_name(tmp_path):
    other = b"".join(words(number, apid=77) for number in range(9))
    counts, _ = imported(tmp_path, ALL, b"A text about nothing.\n", ALL, other)
    assert counts["notes"] == [
        "1.bin: nothing is kept of it: no frame begins in it",
        "3.bin: nothing is kept of it: CCSDS space packets of APID 77",
    ]
    assert not counts["failure"]


def test_packets_of_others_in_kiss_frames_are_told_as_such(tmp_path):
    other = kiss(words(7, apid=77))
    counts, found = imported(tmp_path, b"".join([*WRAPPED[:50], other, *WRAPPED[50:]])[:-4])
    assert sorted(found) == list(range(99))
    assert reasons(counts) == {"unknown": 1, "kiss_cut": 1}
