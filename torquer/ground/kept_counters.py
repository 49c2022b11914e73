"""Counters that are never used twice: numbers are kept in a small file before they are used.

The file lies beside the archive and has its full size from the beginning, so that it can be written
where the disk is full, and where another program holds the archive. It has two places, written in
turn, each with a checksum: while one is written the other is whole. Numbers are kept some ahead, so
that commands need not wait for the disk, and a few can still go up where nothing can be written at
all. A ground that is killed goes on behind those that were kept; one that ends well, with the next.
"""

from __future__ import annotations

import errno
import json
import os
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from zlib import crc32

#: Counters: of commands, of changes of their key, of telemetry; the key; numbers of commands.
UP, RECOVERY, DOWN, KEY, COMMAND = "up", "recovery", "down", "key", "command"
#: The number of a state of the counters: the greater one is the later.
SEQUENCE = "sequence"
#: How many numbers are kept ahead: few, as a satellite accepts a counter that leaps by up to 64.
AHEAD = {UP: 8, RECOVERY: 1, COMMAND: 64}
_PLACE_BYTES = 4096
#: Pause after a failed attempt to write [s].
_PAUSE_S = 1.0


class KeptCounters:
    """The counters of a satellite, in the file `path`.

    `known`: as the archive has them, None if it cannot be read; the later state counts, of archive
    and file. `mirror` is called with each state that was written, but for the counter of telemetry,
    which the archive has with its rows. `failure`: why the file cannot be written now, None if it
    can; `are_unknown`: neither file nor archive tells them; `down`: the last counter of telemetry,
    which whoever hears it sets.
    """

    def __init__(
        self,
        path: Path,
        known: Mapping[str, int] | None,
        mirror: Callable[[dict[str, int]], None] = lambda _: None,
    ):
        self._path, self._mirror = path, mirror
        self._file: int | None = None
        self._lock, self._writer = threading.Lock(), ThreadPoolExecutor(1, "counters")
        self._is_writing, self._due_s = False, 0.0
        self._epoch, self._is_behind = 0, False  # by which key the last state was written
        self.failure: str | None = None
        found = _read(path)
        self.are_unknown = found is None and known is None
        later = max((found or {}, known or {}), key=lambda state: state.get(SEQUENCE, -1))
        self._kept = {name: later.get(name, 0) for name in (UP, RECOVERY, KEY, COMMAND, SEQUENCE)}
        self.down = max(state.get(DOWN, 0) for state in (found or {}, known or {}))
        self._used = {name: self._kept[name] for name in AHEAD}
        self._wanted = {COMMAND}

    @property
    def key(self) -> int:
        """The number of the key of commands."""
        return self._kept[KEY]

    def last(self, name: str) -> int:
        """The last number that was used."""
        return self._used[name]

    def at_least(self, **numbers: int) -> None:
        """Go on behind these numbers, as those of an archive that was lost."""
        for name, number in numbers.items():
            self._used[name] = max(self._used[name], number)
            self._kept[name] = max(self._kept[name], number)
            self.are_unknown &= number == 0 or name == COMMAND

    def learn(self, known: Mapping[str, int], command: int) -> None:
        """Take the counters of an archive that can be read only now; its last command's number."""
        if self.are_unknown:
            self.are_unknown = False
            self._kept[KEY] = known.get(KEY, 0)
            self.at_least(**{name: known.get(name, 0) for name in (UP, RECOVERY)})
            self._keep_soon()
        self.at_least(command=command)

    def trouble(self) -> str | None:
        """Why no counter can be kept now, which is tried again; None if it can."""
        if self.failure is not None or self._is_behind:
            self._keep_soon()
        return (
            f"neither {self._path.name} nor the archive tells it"
            if self.are_unknown
            else (self.failure)
        )

    def begin(self) -> None:
        """Keep the first numbers, before anything is served; this waits for the disk."""
        if not self.are_unknown:
            self._write(self._next(), self._epoch)

    def take(self, name: str) -> int | None:
        """The next number of a counter; None while none is kept, which is then tried."""
        self._wanted.add(name)
        used = self._used[name]
        if self._kept[name] - used <= AHEAD[name] // 2:
            self._keep_soon()
        if used >= self._kept[name] or self.are_unknown:
            return None
        self._used[name] = used + 1
        return used + 1

    def change_key(self, number: int, used: int = 0) -> None:
        """Use another key of commands, whose last counter is `used`, once that is kept."""
        with self._lock:
            self._epoch += 1
            self._used[UP] = self._kept[UP] = used
            self._kept[KEY] = number
            self._is_behind = True
        self._keep_soon()

    def close(self) -> None:
        """Keep what was used and no more, and close the file."""
        self._writer.shutdown(wait=True)
        if not self.are_unknown:
            self._write({**self._kept, **self._used, DOWN: self.down}, self._epoch)
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _next(self) -> dict[str, int]:
        """What is to be kept now."""
        ahead = {
            name: max(self._kept[name], self._used[name] + AHEAD[name]) for name in self._wanted
        }
        return {**self._kept, **ahead, DOWN: self.down}

    def _keep_soon(self) -> None:
        if self._is_writing or time.monotonic() < self._due_s or self.are_unknown:
            return
        self._is_writing = True
        with suppress(RuntimeError):  # at the end nothing more is begun
            self._writer.submit(self._write, self._next(), self._epoch)

    def _write(self, state: dict[str, int], epoch: int) -> None:
        """Write a state, for good; numbers in it may then be used."""
        state = {**state, SEQUENCE: self._kept[SEQUENCE] + 1}
        try:
            self._put(state)
        except OSError as error:
            self.failure = error.strerror or str(error)
            self._due_s = time.monotonic() + _PAUSE_S
        else:
            self.failure = None
            with self._lock:
                self._kept[SEQUENCE] = state[SEQUENCE]
                if epoch == self._epoch:
                    self._is_behind = False
                    self._kept |= {name: state[name] for name in (*AHEAD, KEY)}
            self._mirror({name: state[name] for name in state if name != DOWN})
        self._is_writing = False

    def _put(self, state: dict[str, int]) -> None:
        text = json.dumps(state).encode()
        place = text + b" %08x\n" % crc32(text)
        if not self._is_there():
            self._make()
        assert self._file is not None
        os.lseek(self._file, _PLACE_BYTES * (state[SEQUENCE] % 2), os.SEEK_SET)
        if os.write(self._file, place.ljust(_PLACE_BYTES)) < _PLACE_BYTES:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        os.fsync(self._file)

    def _is_there(self) -> bool:
        """Whether the open file is the one at the path: somebody may have removed it."""
        if self._file is None:
            return False
        try:
            is_same = os.path.samestat(os.fstat(self._file), self._path.stat())
        except OSError:
            is_same = False
        if not is_same:
            os.close(self._file)
            self._file = None
        return is_same

    def _make(self) -> None:
        """Open the file; a new one is complete before it has its name."""
        flags = os.O_RDWR | getattr(os, "O_BINARY", 0)
        if _read(self._path) is None:
            part = self._path.with_name(f"{self._path.name}.part")
            state = json.dumps(self._kept).encode()
            place = (state + b" %08x\n" % crc32(state)).ljust(_PLACE_BYTES)
            with open(part, "wb") as file:
                file.write(2 * place)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, self._path)
        self._file = os.open(self._path, flags)


def _read(path: Path) -> dict[str, int] | None:
    """The later state of a file that is whole; None if there is none."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    found = [_state(data[at : at + _PLACE_BYTES]) for at in (0, _PLACE_BYTES)]
    whole = [state for state in found if state is not None]
    return max(whole, key=lambda state: state.get(SEQUENCE, 0), default=None)


def _state(place: bytes) -> dict[str, int] | None:
    text, _, checksum = place.strip().rpartition(b" ")
    try:
        if int(checksum, 16) != crc32(text):
            return None
        state = json.loads(text)
        return {name: int(state[name]) for name in state}
    except (ValueError, TypeError, OverflowError):
        return None
