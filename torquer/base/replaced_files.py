"""Files that are replaced as a whole or not at all, whenever the power fails."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO


@contextlib.contextmanager
def replacing(path: Path, unfinished_name: str = "") -> Iterator[Path]:
    """A new file to write next to the given path, which takes its place at the end of the block.

    A file or link of its name is removed first: one that others have left would be written through.
    `unfinished_name`: its name until then [that of the path with the ending .part].
    """
    unfinished = path.with_name(unfinished_name or path.name + ".part")
    unfinished.unlink(missing_ok=True)
    try:
        open(unfinished, "xb").close()
        yield unfinished
        os.replace(unfinished, path)
    except BaseException:
        with contextlib.suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise
    folder_to_disk(path.parent)


def to_disk(file: BinaryIO) -> None:
    """What was written to a file is on the disk."""
    file.flush()
    os.fsync(file.fileno())


def folder_to_disk(folder: Path) -> None:
    """A new name is on the disk when its folder is."""
    with contextlib.suppress(OSError):  # not on every system
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
