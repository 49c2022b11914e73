"""Processes that need the same code compiled take turns: one compiles, the others find it kept.

A turn is a lock on one byte of a file in the cache folder: it ends with its process, however that
ends. Where there are no such locks, nobody waits, and each process compiles.
"""

import functools
import hashlib
import os
import time
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

#: The file, in a folder of compiled code.
TURNS = "turns"
#: How long a process waits for another one before it compiles the same itself [s]: that one may
#: have been stopped. Between two looks it sleeps.
_PATIENCE_S, _LOOK_S = 120.0, 0.02


def take(folder: Path, what: str) -> int | None:
    """Wait for the turn to make something; its place in the file, None without a turn."""
    place = int.from_bytes(hashlib.sha256(what.encode()).digest()[:7], "big")
    until_s = time.monotonic() + _PATIENCE_S
    while fcntl is not None and time.monotonic() < until_s:
        try:
            fcntl.lockf(_opened(folder), fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
            return place
        except BlockingIOError:
            time.sleep(_LOOK_S)
        except OSError:  # no such locks here, or a folder that cannot be written
            return None
    return None


def give_back(folder: Path, place: int | None) -> None:
    """End a turn."""
    if place is not None:
        fcntl.lockf(_opened(folder), fcntl.LOCK_UN, 1, place)


@functools.cache
def _opened(folder: Path) -> int:
    """The file, open as long as the process lives: closing it anywhere would end all turns."""
    return os.open(folder / TURNS, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
