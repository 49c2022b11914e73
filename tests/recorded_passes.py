"""Passes made for tests of recordings, and what an archive has of them."""

import random
from contextlib import closing
from dataclasses import replace

from torquer.flight.packets.frames import Downlink, Stream
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.software_file import load_link
from torquer.ground.archive import AUTHENTIC, Archive, RowMaker
from torquer.ground.recording import import_recording

PROTECTED = load_link()
HISTORICAL = replace(PROTECTED, link="historical")
DICTIONARY = PROTECTED.dictionary
MADE = Downlink(DICTIONARY)
SIZE = 260


def packets(seed, number, start_s=0):
    """Different frames of packets of all sizes, a second apart."""
    draw = random.Random(seed)
    for k in range(number):
        kind = draw.choice(("extended", "beacon", "event", "dump", "stored"))
        numbers = [draw.randrange(1, 100) for _ in DICTIONARY.down[kind].names]
        if kind == "dump":
            numbers[-1] = draw.randbytes(64)
        if kind in ("extended", "event", "stored"):
            numbers[-1] = 1e3 * (start_s + k)
        yield MADE.frame(kind, start_s + k, numbers)


def wrapped(frames, keys=PROTECTED.keys, at_once=3):
    """(link frames, counters of those in which each frame lies), some frames sent at once."""
    sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    stream, where = b"", []
    for number, frame in enumerate(frames, 1):
        first = sender.counter
        stream += sender.wrap(frame)
        where.append((first, sender.counter + bool(sender._field)))
        stream += sender.flush() if number % at_once == 0 else b""
    stream += sender.flush()
    return [stream[at : at + SIZE] for at in range(0, len(stream), SIZE)], where


def imported(folder, *recordings, link=PROTECTED, name="sat"):
    """Import recordings at once; the counts and what the archive has, by packet."""
    paths = []
    for number, data in enumerate(recordings):
        paths.append(folder / f"{number}.bin")
        paths[-1].write_bytes(data)
    with closing(Archive(folder / f"{name}.sqlite", DICTIONARY)) as archive:
        counts = import_recording(link, paths, archive)
        return counts, rows_in(archive)


def rows_in(archive):
    return {
        row for p in DICTIONARY.down for row in archive.read(f'SELECT "{p}".*, ? FROM "{p}"', p)
    }


def rows_of(folder, frames):
    """What an archive has into which frames were put one by one, as by a link in service."""
    maker = RowMaker(DICTIONARY)
    found = []
    for raw in frames:
        stream = Stream(DICTIONARY, "down")
        found += [*stream.feed(raw), *stream.finish()]
    with closing(Archive(folder / "expected.sqlite", DICTIONARY)) as archive:
        archive.put(maker.row(frame, None, AUTHENTIC) for frame in found)
        return rows_in(archive)


def reasons(counts):
    return {each["reason"]: each["count"] for each in counts["left_out"]}
