"""Frames of a stream with their quality; recordings of passes put into an archive."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Frame
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.packets.station import Station
from torquer.ground.archive import AUTHENTIC, SUSPECT, UNCHECKED, Archive, Row, RowMaker

#: Bytes of a recording that are worked on at a time.
_PART = 2**20


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
    recording: Path,
    archive: Archive,
    progress: Callable[[float], None] | None = None,
) -> dict[str, int]:
    """Put the frames of a recording into an archive; what was found, lost and rejected, by name.

    The rows have no time of reception. Frames that are there already are not added again, so that
    recordings may come twice and in any order. `progress`: called with the part that is done.
    """
    station, size = Station(link), max(recording.stat().st_size, 1)
    judge = Judge(station, link.dictionary)
    frames = new = done = 0

    def put(found: Iterable[Frame]) -> None:
        nonlocal frames, new
        rows = [row for _, row in judge.rows(found, None)]
        frames, new = frames + len(rows), new + archive.put(rows)

    with open(recording, "rb") as file:
        while data := file.read(_PART):
            put(station.receive(data))
            done += len(data)
            if progress:
                progress(done / size)
    put(station.finish())
    return {"bytes": done, "frames": frames, "new": new, **station.counts()}
