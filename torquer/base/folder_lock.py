"""An output folder locked by one run: a second run is refused before it computes."""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_NAME = ".claimed"


@contextlib.contextmanager
def claim(out: Path, option: str = "--out") -> Iterator[None]:
    """Hold the folder for this process within the block; the system releases it with the process.

    ValueError if another process has it.
    """
    path = out / _NAME
    file = _try_lock(path)
    if file is None:
        raise ValueError(f"{option}: must not be in use by another run; received {out}")
    try:
        yield
    finally:
        if sys.platform == "win32":  # a file that is open is not removed there
            file.close()
        with contextlib.suppress(OSError):
            path.unlink()
        file.close()


def _try_lock(path: Path):
    """The file, open and locked; None if another process has locked it."""
    while True:
        if path.is_symlink():
            path.unlink()
        file = path.open("a")
        try:
            _lock(file.fileno())
        except OSError:
            file.close()
            return None
        with contextlib.suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()  # the process that held it has removed it meanwhile


def _lock(descriptor: int) -> None:
    if sys.platform == "win32":
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
