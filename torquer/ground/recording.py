"""Frames of a stream with their quality; recordings of passes put into an archive."""

from __future__ import annotations

import gc
import mmap
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Frame, Stream
from torquer.flight.packets.pus_user import User
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.packets.space_stream import SpaceStream
from torquer.flight.packets.station import Station
from torquer.ground.archive import (
    AUTHENTIC,
    SUSPECT,
    UNCHECKED,
    Archive,
    ArchiveError,
    Row,
    RowMaker,
)
from torquer.ground.recorded.authentic import AuthenticFrames, Data
from torquer.ground.recorded.batches import Batches
from torquer.ground.recorded.counters import SequenceCounters
from torquer.ground.recorded.dialects import Decoded, decode, name_dialect, name_space_packets
from torquer.ground.recorded.joined import PacketJoiner, Part
from torquer.ground.recorded.left_out import Tally
from torquer.ground.recorded.plain import PlainFrames

#: The packet that a satellite sends once it has started.
READY = "ready"
#: Bytes of frames that wait before they are written, in the order of their times.
_WAITING = 2**26
#: Most rows of a transaction: meanwhile a ground that runs must wait.
_AT_ONCE = 50_000
#: Most parts of packets that are kept for later recordings.
_MOST_PARTS = 100_000
#: Bytes of space packets that are worked on at a time.
_PART = 2**20
#: Bytes by which it is told what a file is that has no frames of ours.
_LOOKED_AT = 2**20
#: The share of the bytes below which an import has failed.
_LITTLE = 0.5


class Judge:
    """Makes rows of the frames of a station, and says how far each can be trusted.

    Frames must be taken one by one as the station finds them, since its counters say what was lost
    before each.
    """

    def __init__(self, station: Station, dictionary: Dictionary):
        self._station, self._lost = station, 0
        self._maker = RowMaker(dictionary)

    def rows(self, frames: Iterable[Frame], received_ms: int | None) -> list[tuple[Frame, Row]]:
        """The frames with their rows."""
        return [(each, self._maker.row(each, received_ms, self._quality())) for each in frames]

    def _quality(self) -> int:
        if self._station.protection is not None:
            return AUTHENTIC
        stream = self._station.stream
        before, self._lost = self._lost, stream.lost_bytes + sum(stream.rejected.values())
        return UNCHECKED if self._lost == before else SUSPECT


def import_recording(
    link: SpaceLink,
    recording: Path | Sequence[Path],
    archive: Archive,
    progress: Callable[[float], None] | None = None,
) -> dict[str, Any]:
    """Put the frames of recordings into an archive; what was found, new, lost and left out.

    Frames count by their MAC and content: they may come in any order, from several stations, twice,
    and with counters that begin again. Rows have no time of reception; those that are there stay.

    `frames`: packets that were found; `new`: those that the archive did not have; `left_out`: a
    list of reasons, each with `reason`, `text`, `count`, `first_byte` and its `recording`; `notes`:
    how files were read that are no plain bytes, and of which nothing was kept; `failure`: one line
    if little or nothing was kept, else "". `progress`: called with the part that is done.
    """
    paths = [recording] if isinstance(recording, Path) else list(recording)
    try:
        with _without_collecting():
            return _import(link, paths, archive, progress)
    except sqlite3.Error as error:
        raise ArchiveError(
            f"archive: must be an archive that can be written; received {archive.path}: {error}"
        ) from None


def _import(
    link: SpaceLink,
    paths: Sequence[Path],
    archive: Archive,
    progress: Callable[[float], None] | None,
) -> dict[str, Any]:
    work, notes, starts, beginning = _Import(link, archive), [], [], b""
    size = sum(path.stat().st_size for path in paths) or 1
    for path in paths:
        starts.append((work.bytes, path))
        with _content(path) as content:
            decoded = decode(content, link)
            notes += [f"{path.name}: {decoded.note}"] if decoded.note else []
            kept = work.kept
            work.read(decoded, size, progress)
            head = decoded.data[:_LOOKED_AT]
            if work.kept == kept and len(paths) > 1 and not (decoded.left_out and not head):
                notes.append(f"{path.name}: nothing is kept of it: {_named(head, link)}")
            beginning = beginning or head
    found = work.finish()
    notes += work.notes()
    left_out = [_in_file(entry, starts) for entry in work.tally.entries()]
    failure = ""
    if found["frames"] == 0 or found["lost_bytes"] > (1 - _LITTLE) * found["bytes"]:
        most = [f"{each['count']} {each['text']}" for each in left_out]
        why = name_dialect(beginning, link) or next(iter(most), "") or _named(beginning, link)
        failure = _failure(found, paths, why)
    return {**found, "left_out": left_out, "notes": notes, "failure": failure}


def _named(data: bytes, link: SpaceLink) -> str:
    """What bytes seem to be of which nothing is kept."""
    return name_dialect(data, link) or name_space_packets(data) or "no frame begins in it"


@contextmanager
def _without_collecting() -> Iterator[None]:
    """Let no garbage be looked for: among millions of tuples it takes a tenth of the time."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@contextmanager
def _content(path: Path) -> Iterator[Data]:
    """The bytes of a file, read as they are needed."""
    with open(path, "rb") as file:
        if path.stat().st_size == 0:
            yield b""
            return
        yield mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)  # goes when nobody reads it


def _in_file(entry: dict, starts: list[tuple[int, Path]]) -> dict:
    """A reason with its first place as that of a file."""
    if entry["first_byte"] is None:
        return {**entry, "recording": None}
    base, path = [each for each in starts if each[0] <= entry["first_byte"]][-1]
    return {**entry, "first_byte": entry["first_byte"] - base, "recording": path.name}


def _failure(found: dict, paths: Sequence[Path], why: str) -> str:
    names = ", ".join(path.name for path in paths)
    kept, size = found["bytes"] - found["lost_bytes"], found["bytes"]
    what = f"{kept} of {size} bytes in frames, {found['frames']} packets"
    return f"RECORDING: must hold frames of this satellite; received {names} with {what}: {why}"


class _Import:
    """The work of an import: frames of recordings, packets of frames, rows of packets."""

    def __init__(self, link: SpaceLink, archive: Archive):
        self._link, self._archive = link, archive
        self.tally, self._batches = Tally(), Batches(link.dictionary)
        self.bytes = self._frames = self._new = self._inner_lost = 0
        self._user = User(link.dictionary, link.keys.spacecraft) if link.link == "pus" else None
        is_plain = link.link == "historical"
        self._space = SpaceStream(link.dictionary) if link.link == "space_packets" else None
        self._counters = SequenceCounters()
        self._make = RowMaker(link.dictionary)
        known = link.dictionary if is_plain else link.dictionary.model_copy(update={"down": {}})
        self._plain = PlainFrames(known, self.tally)
        self._authentic = None if is_plain else AuthenticFrames(link, self.tally)
        self._ready, self._is_done = link.dictionary.down.get(READY), False
        self._joiner = PacketJoiner(*_kept_parts(archive), self._batches.apart_s)

    @property
    def kept(self) -> int:
        """How much was kept: frames and packets, those that came before as well."""
        authentic = self._authentic.kept if self._authentic else 0
        return self._frames + authentic

    def read(self, decoded: Decoded, size: int, progress: Callable[[float], None] | None) -> None:
        """Take the frames of a recording."""
        self.tally.base = self.bytes
        for reason, at, example, lost in decoded.left_out:
            self.tally.add(reason, at, example)
            self._inner_lost += lost
        for count, at in enumerate(self._read(decoded.data)):
            if count % 4096 == 0:
                if self._batches.bytes > _WAITING:
                    self._write()
                if progress:
                    progress(min(1.0, (self.bytes + at) / size))
        self.bytes += len(decoded.data) + sum(lost for *_, lost in decoded.left_out)

    def _read(self, data: Data) -> Iterator[int]:
        """Place of each frame, its packets being taken."""
        if self._authentic is None:
            for at, raw, quality in self._plain.read(data):
                self._batches.add(raw, quality)
                self._frames += 1
                yield at
            return
        if self._space is not None:
            yield from self._space_packets(self._space, data)
            return
        for at, frame in self._authentic.read(data):
            for packet in self._joiner.feed(frame, self.bytes + at):
                self._take(packet, at)
            yield at

    def _space_packets(self, stream: SpaceStream, data: Data) -> Iterator[int]:
        """Place of each part of a stream of space packets, the rows of which are put."""
        before, lost = stream.rejected.copy(), stream.lost_bytes
        stream.begin_recording()
        for first in range(0, len(data), _PART):
            frames = stream.feed(data[first : first + _PART])
            rows = []
            for frame in frames:
                rows.append(row := self._make.row(frame, None, UNCHECKED))
                self._counters.add(frame.raw, row.time_ms)
            self._frames += len(rows)
            self._new += self._archive.put(rows)
            yield first
        list(stream.finish())
        for reason, count in (stream.rejected - before).items():
            self.tally.add(reason, *stream.first[reason], count)
        self._inner_lost += stream.lost_bytes - lost

    def _take(self, packet: bytes, at: int) -> None:
        """Keep what a packet carries: a frame, or whatever it is."""
        if self._user is None and self._batches.takes(packet):
            self._note_reboot(packet[8])
            self._batches.add(packet, AUTHENTIC)
            self._frames += 1
            return
        stream = self._user or Stream(self._link.dictionary, "down")
        before = stream.rejected.copy()
        for frame in [*stream.feed(packet), *stream.finish()]:
            self._note_reboot(frame.packet.id)
            self._batches.add(frame.raw, AUTHENTIC)
            self._frames += 1
        for reason, count in (stream.rejected - before).items():
            self.tally.add(reason, at, count=count)
        self._inner_lost += 0 if self._user else stream.lost_bytes

    def _note_reboot(self, number: int) -> None:
        if self._ready is not None and number == self._ready.id and not self._is_done:
            self._joiner.note_reboot()

    def notes(self) -> list[str]:
        """What must be known of the frames as a whole."""
        missing = self._joiner.missing()
        if not missing.reboots:
            return []
        times = f"{missing.reboots} reboot{'s' * (missing.reboots > 1)}"
        return [
            f"{missing.passed_over} counters of frames are passed over at {times} (packet "
            f"{READY!r}): no loss, the satellite goes on from a counter that it keeps ahead"
        ]

    def _write(self) -> None:
        for batch in self._batches.take():
            for first in range(0, len(batch.rows), _AT_ONCE):
                rows = batch.rows[first : first + _AT_ONCE]
                self._new += self._archive.put_many(batch.packet, rows)

    def finish(self) -> dict[str, int]:
        """The counts, once all that can be joined is written."""
        self.tally.base, self._is_done = 0, True
        for packet, at in self._joiner.join():
            self._take(packet, max(at, 0))
            if self._batches.bytes > _WAITING:
                self._write()
        self._write()
        tails, heads = self._joiner.left()
        _keep_parts(self._archive, tails, heads)
        self._tally_what_is_left([*tails, *heads])
        around = self._authentic or self._plain
        return {
            "bytes": self.bytes,
            "frames": self._frames,
            "new": self._new,
            "lost_bytes": around.lost_bytes + self._inner_lost,
            "lost_frames": self._joiner.missing().lost,
            "lost_packets": len(tails) + len(self._joiner.foreign) + self._counters.lost(),
            "rejected": self.tally.rejected,
        }

    def _tally_what_is_left(self, parts: list[Part]) -> None:
        unclear = self._joiner.unclear
        for part in parts:
            if part.at >= 0:
                self.tally.add("ambiguous" if part.at in unclear else "torn", part.at)
        for at in self._joiner.foreign:
            self.tally.add("foreign", at)
        if self._frames > self._new:
            self.tally.add("archived", None, count=self._frames - self._new)


def _kept_parts(archive: Archive) -> tuple[list[Part], list[Part]]:
    """Tails and heads that earlier recordings left; none came directly before or after another."""
    tails: list[Part] = []
    heads: list[Part] = []
    for k, (is_tail, spi, number, data, time_s, ends) in enumerate(archive.parts()):
        part = Part(spi, number, data, -2 * k - 2, time_s, bool(ends), -1)
        (tails if is_tail else heads).append(part)
    return tails, heads


def _keep_parts(archive: Archive, tails: list[Part], heads: list[Part]) -> None:
    """Keep what later recordings may complete."""
    archive.put_parts(
        (is_tail, part.spi, part.number, part.data, part.time_s, part.ends)
        for is_tail, parts in ((True, tails), (False, heads))
        for part in parts[:_MOST_PARTS]
    )
