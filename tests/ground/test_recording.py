"""Recorded passes: damaged ones, ones that come twice, in any order."""

import random
from contextlib import closing
from dataclasses import replace

import pytest

from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.software_file import load_link
from torquer.ground.archive import AUTHENTIC, SUSPECT, UNCHECKED, Archive
from torquer.ground.recording import import_recording

PROTECTED = load_link()
HISTORICAL = replace(PROTECTED, link="historical")
DICTIONARY = PROTECTED.dictionary
MADE = Downlink(DICTIONARY)


def packets(seed, number):
    """Frames of a pass: extended telemetry, beacons, events, dumps."""
    draw = random.Random(seed)
    for k in range(number):
        kind = draw.choices(("extended", "beacon", "event", "dump"), (10, 3, 2, 1))[0]
        numbers = [draw.randrange(1, 100) for _ in DICTIONARY.down[kind].names]
        if kind == "dump":
            numbers[-1] = draw.randbytes(64)
        if kind in ("extended", "event"):
            numbers[-1] = 1e3 * k
        yield MADE.frame(kind, k, numbers)


def protected(frames):
    """(bytes, frames of the link, which of them each packet lies in) of a pass."""
    sender = TelemetrySender(PROTECTED.keys.down, PROTECTED.keys.spi, PROTECTED.keys.spacecraft)
    stream, where = b"", []
    for frame in frames:
        first = sender.counter
        stream += sender.wrap(frame)
        if len(where) % 3 == 2:
            stream += sender.flush()
        where.append((first + 1, sender.counter + bool(sender._field)))
    return stream + sender.flush(), where


def damaged(data, draw, share=0.05):
    """The data with about this share of its bytes in damaged stretches, and which bytes are."""
    found, hit = bytearray(data), set()
    while len(hit) < share * len(data):
        first = draw.randrange(len(data))
        for at in range(first, min(first + draw.randrange(1, 60), len(data))):
            found[at] ^= draw.randrange(1, 256)
            hit.add(at)
    return bytes(found), hit


def put(tmp_path, name, data, software=PROTECTED):
    """Import bytes into an archive; the counts, and all rows by packet."""
    file = tmp_path / "pass.bin"
    file.write_bytes(data)
    with closing(Archive(tmp_path / f"{name}.sqlite", DICTIONARY)) as archive:
        counts = import_recording(software, file, archive)
        rows = {p: archive.read(f'SELECT * FROM "{p}"') for p in DICTIONARY.down}
    return counts, rows


def number_of(rows):
    return sum(map(len, rows.values()))


@pytest.mark.parametrize("seed", range(3))
def test_a_damaged_pass_gives_every_intact_frame_and_no_other(tmp_path, seed):
    draw = random.Random(seed)
    frames = list(packets(seed, 3000))
    data, where = protected(frames)
    _, whole = put(tmp_path, "whole", data)
    assert number_of(whole) == len(set(frames))
    broken, hit = damaged(data, draw)
    counts, found = put(tmp_path, "broken", broken)
    size = 260
    assert len(data) % size == 0
    intact = {1 + at // size for at in range(0, len(data), size)} - {1 + at // size for at in hit}
    expected = {
        frame
        for frame, (first, last) in zip(frames, where, strict=True)
        if all(number in intact for number in range(first, last + 1))
    }
    assert 0.3 < len(expected) / len(frames) < 0.95
    assert counts["rejected"] > 0 and counts["lost_bytes"] > 0
    assert {p: set(rows) <= set(whole[p]) for p, rows in found.items()} == dict.fromkeys(
        found, True
    ), "none invented"
    assert number_of(found) == len(expected), "every intact one"


@pytest.mark.parametrize("software", [PROTECTED, HISTORICAL])
def test_a_pass_that_comes_twice_leaves_the_same_archive(tmp_path, software):
    frames = list(packets(7, 400))
    data = protected(frames)[0] if software is PROTECTED else b"".join(frames)
    broken, _ = damaged(data, random.Random(1), 0.02)
    first, rows = put(tmp_path, "once", broken, software)
    again, same = put(tmp_path, "once", broken, software)
    assert first["new"] == number_of(rows) > 100
    assert again["new"] == 0 and same == rows
    assert put(tmp_path, "elsewhere", broken, software)[1] == rows


def test_passes_may_come_in_any_order(tmp_path):
    frames = list(packets(8, 600))
    data, _ = protected(frames)
    middle = 260 * (len(data) // 520)
    for name, parts in (("a", (data[:middle], data[middle:])), ("b", (data[middle:], data))):
        for part in parts:
            put(tmp_path, name, part)
    a, b = put(tmp_path, "a", b"")[1], put(tmp_path, "b", b"")[1]
    assert number_of(b) == len(set(frames))
    assert number_of(a) >= len(set(frames)) - 1  # one packet lies across the cut


def test_forged_and_foreign_frames_are_not_archived(tmp_path):
    frames = list(packets(9, 50))
    for keys in (PROTECTED.keys._replace(down=bytes(32)), PROTECTED.keys._replace(spacecraft=5)):
        sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
        data = b"".join(map(sender.wrap, frames)) + sender.flush()
        counts, rows = put(tmp_path, "forged", data)
        assert number_of(rows) == counts["frames"] == 0 < counts["rejected"]


def test_rows_say_how_far_they_can_be_trusted(tmp_path):
    frames = list(packets(10, 30))
    cut = b"".join(frames[:10]) + b"\x00garbage" + b"".join(frames[10:])
    _, rows = put(tmp_path, "historical", cut, HISTORICAL)
    quality = sorted(row for found in rows.values() for row in found)
    suspect = [row[0] for row in quality if row[3] == SUSPECT]
    assert len(suspect) == 1
    assert {row[3] for row in quality} == {SUSPECT, UNCHECKED}
    _, rows = put(tmp_path, "protected", protected(frames)[0])
    assert {row[3] for found in rows.values() for row in found} == {AUTHENTIC}
    assert {row[2] for found in rows.values() for row in found} == {None}, "no time of reception"


@pytest.mark.parametrize("reboots", [1, 2])
def test_counters_that_are_passed_over_at_a_reboot_are_no_loss(tmp_path, reboots):
    """The counter that a satellite keeps lies ahead, and it goes on from there."""
    keys, stream = PROTECTED.keys, b""
    sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    for session in range(reboots + 1):
        if session:
            sender.counter += 5000
        values = [session] + [1] * (len(DICTIONARY.down["ready"].names) - 1)
        stream += sender.wrap(MADE.frame("ready", 100 * session, values))
        stream += b"".join(map(sender.wrap, packets(session, 60))) + sender.flush()
    counts, _ = put(tmp_path, "a", stream)
    assert counts["lost_frames"] == 0
    (note,) = counts["notes"]
    assert note.startswith(f"{5000 * reboots} counters of frames are passed over at {reboots} ")


def test_a_gap_without_a_reboot_is_a_loss(tmp_path):
    keys = PROTECTED.keys
    sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    stream = b"".join(map(sender.wrap, packets(1, 60))) + sender.flush()
    sender.counter += 7
    stream += b"".join(map(sender.wrap, packets(2, 60))) + sender.flush()
    counts, _ = put(tmp_path, "a", stream)
    assert counts["lost_frames"] == 7 and counts["notes"] == []
