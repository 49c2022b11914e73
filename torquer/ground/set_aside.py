"""Files of an archive that somebody removes or damages under the running ground."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

#: What SQLite puts behind the name of an archive for its journal and the journal's index.
_ENDS = ("", "-wal", "-shm")


class FileMarks:
    """Which files an open archive has: SQLite writes on into those that were removed."""

    def __init__(self, path: Path):
        self._paths = [Path(f"{path}{end}") for end in _ENDS[:2]]
        self._marks: dict[Path, tuple[int, int]] = {}

    def begin(self) -> None:
        """Note the files of an archive that was just opened."""
        self._marks = {}
        self.note()

    def note(self) -> None:
        """Note files that were made meanwhile."""
        for path in self._paths:
            if path not in self._marks and (mark := _mark(path)) is not None:
                self._marks[path] = mark

    def missing(self) -> str:
        """The name of a file that was removed or replaced; "" if none was."""
        return next((p.name for p, mark in self._marks.items() if _mark(p) != mark), "")


def set_aside(path: Path) -> Path:
    """Give an archive that is closed another name, with its journal; the new path."""
    new = next(
        place
        for n in itertools.count(1)
        if not (place := path.with_name(f"{path.stem}.damaged-{n}{path.suffix}")).exists()
    )
    for end in _ENDS:
        old = Path(f"{path}{end}")
        if old.exists():
            old.rename(f"{new}{end}")
    return new


def _mark(path: Path) -> tuple[int, int] | None:
    try:
        about = os.stat(path)
    except OSError:
        return None
    return about.st_dev, about.st_ino
