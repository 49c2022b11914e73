"""What is to be archived waits here until the archive takes it; nobody waits for the disk.

A thread writes what is put, in order. While the archive cannot be written (full disk, another
program's lock, damage, a file that was removed) all is kept in memory, and tried again with pauses
of up to some seconds. Rows are bounded by their numbers: 2 million are some 70 MB, 10 hours of 43
numbers at 1 Hz or an hour at 10 Hz. Of more the oldest rows are dropped, and counted. Log, counters
and states of commands are small.
"""

from __future__ import annotations

import asyncio
import os
import sqlite3
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, NamedTuple

from torquer.flight.packets.dictionary import Dictionary
from torquer.ground.archive import (
    Archive,
    ArchiveError,
    Batch,
    Row,
    StorageError,
    is_damage,
    is_passing,
    read_only,
)
from torquer.ground.commands import last_commands
from torquer.ground.ground_clock import now_ms
from torquer.ground.set_aside import FileMarks, set_aside

#: Most numbers of rows that wait, most entries of the log, most other things.
MOST_NUMBERS, MOST_ENTRIES, MOST_OTHERS = 2_000_000, 10_000, 10_000
#: A row's own size, counted in numbers.
_ROW_NUMBERS = 12
#: How long a statement waits for another program, and whoever puts rows for the archive [s].
PATIENCE_S, _WAIT_S = 1.0, 0.2
#: Age of what waits from which the archive counts as failing [s].
FAILING_S = 2.0
#: First and longest pause between two attempts [s].
PAUSES_S = 0.25, 3.0
#: Attempts after which an archive that is damaged is set aside.
_ATTEMPTS = 3
#: Most rows of one transaction.
_AT_ONCE = 2000


class Found(NamedTuple):
    """What an archive held when the ground began: its counters, last numbers, last commands."""

    counters: dict[str, int]
    last_entry: int
    commands: list[dict[str, Any]]


class Spool:
    """The way to the archive of a satellite at `path`.

    `found`: what was in the archive, None until it could be read. `ArchiveError` for an archive of
    another satellite; one that cannot be opened now is tried again.
    """

    def __init__(self, path: Path, dictionary: Dictionary):
        self.path, self._dictionary = path, dictionary
        self._condition = threading.Condition()
        self._rows: deque[Row] = deque()
        self._numbers = 0
        self._counters: dict[str, int] = {}
        self._entries: deque[tuple] = deque(maxlen=MOST_ENTRIES)
        self._commands: dict[int, dict[str, Any]] = {}
        self._others: dict[tuple, tuple[str, tuple]] = {}
        self._written: Batch | None = None  # what is being written
        self._waiters: list[Future] = []
        self._served: list[Future] = []  # those whose rows are being written
        self._since: tuple[float, int] | None = None
        self._archive: Archive | None = None
        self._closing, self._marks = False, FileMarks(path)
        self._damages, self._was_open = 0, False
        self.reason, self.late, self.lost = "", 0, 0
        self.found: Found | None = None
        self._notes: deque[tuple[str, str]] = deque(maxlen=100)
        with suppress(StorageError):
            self._open()
        if self.found is None:
            self.found = _look_in(path)
        first = self.found.last_entry if self.found else now_ms()
        self._last_entry = first
        self._thread = threading.Thread(target=self._run, name=f"archive {path.stem}", daemon=True)
        self._thread.start()

    # Putting

    async def put_rows(self, rows: Sequence[Row], counters: Mapping[str, int]) -> None:
        """Put rows; returns when they are archived, or a moment later where they are not."""
        if self.is_failing:
            self.add(rows, counters)
            return
        stored: Future = Future()
        self.add(rows, counters, stored)
        await asyncio.wait([asyncio.wrap_future(stored)], timeout=_WAIT_S)

    def add(
        self, rows: Sequence[Row], counters: Mapping[str, int] = {}, stored: Future | None = None
    ) -> None:
        """Put rows and counters; `stored` is done when they are archived."""
        with self._condition:
            self._rows.extend(rows)
            self._numbers += sum(map(_size, rows))
            while self._numbers > MOST_NUMBERS and self._rows:
                self._numbers -= _size(self._rows.popleft())
                self.lost += 1
            self._counters |= counters
            if stored is not None:
                self._waiters.append(stored)
            self._wake()

    def add_counters(self, counters: Mapping[str, int]) -> None:
        """Put counters."""
        with self._condition:
            self._counters |= counters
            self._wake()

    def add_entry(self, time_ms: int, made_ms: int, severity: str, text: str) -> int:
        """Put an entry of the log; its number."""
        text = text.encode("utf-8", "replace").decode()
        with self._condition:
            self._last_entry += 1
            self._entries.append((self._last_entry, time_ms, made_ms, severity, text))
            self._wake()
            return self._last_entry

    def keep_command(self, command: Mapping[str, Any]) -> None:
        """Put a command as it is now, in place of what it was."""
        with self._condition:
            self._commands[command["id"]] = dict(command)
            self._wake()

    def keep(self, key: tuple, statement: str, values: tuple) -> None:
        """Put a statement of a table of its own, in place of what waits under its key, as the last.

        Where too many wait, the oldest are dropped.
        """
        with self._condition:
            self._others.pop(key, None)
            self._others[key] = statement, values
            while len(self._others) > MOST_OTHERS:
                del self._others[next(iter(self._others))]
            self._wake()

    def kept(self, *first) -> list[tuple]:
        """The values of the statements that wait, under keys that begin so."""
        with self._condition:
            others = {**(self._written.others if self._written else {}), **self._others}
        return [values for key, (_, values) in others.items() if key[: len(first)] == first]

    def flush(self) -> None:
        """Wait a moment for what was put to be archived, unless the archive takes nothing."""
        if self.is_failing:
            return
        stored: Future = Future()
        with self._condition:
            self._waiters.append(stored)
            self._wake()
        with suppress(TimeoutError):
            stored.result(_WAIT_S)

    # Looking

    @property
    def since_ms(self) -> int | None:
        """The time since which nothing is archived, None if the archive is up to date."""
        since = self._since
        return since[1] if since and time.monotonic() - since[0] > FAILING_S else None

    @property
    def is_behind(self) -> bool:
        """Whether something waits longer than anybody waits for the archive."""
        since = self._since
        return since is not None and time.monotonic() - since[0] > _WAIT_S

    @property
    def is_failing(self) -> bool:
        """Whether the archive takes nothing."""
        return self.since_ms is not None

    @property
    def waiting(self) -> int:
        """How many rows wait."""
        return len(self._rows)

    def entries(self) -> list[tuple]:
        """Entries of the log that wait."""
        with self._condition:
            return [*(self._written.entries if self._written else ()), *self._entries]

    def notes(self) -> list[tuple[str, str]]:
        """What is to be said of the archive, severity and text, once each."""
        return [self._notes.popleft() for _ in range(len(self._notes))]

    def made_up(self) -> tuple[int, int] | None:
        """How many rows were archived late, and lost, once the archive is up to date again."""
        with self._condition:
            if self.reason or self.is_failing or not (self.late or self.lost):
                return None
            found, self.late, self.lost = (self.late, self.lost), 0, 0
            return found

    def close(self) -> int:
        """Write what waits, if the archive takes it, and close it; how many rows are lost."""
        with self._condition:
            self._closing = True
            self._condition.notify()
        self._thread.join()
        return len(self._rows) + self.lost

    # Writing, in the thread

    def _wake(self) -> None:
        if self._since is None:
            self._since = time.monotonic(), now_ms()
        self._condition.notify()

    def _run(self) -> None:
        pause_s = PAUSES_S[0]
        while self._await_work():
            begun = time.monotonic(), now_ms()
            batch = self._take()
            try:
                self._store(batch)
            except Exception as error:  # what ends the thread would end archiving unseen
                self._put_back(batch, error)
                if self._closing:
                    break
                with self._condition:
                    self._condition.wait_for(lambda: self._closing, pause_s)
                pause_s = min(2.0 * pause_s, PAUSES_S[1])
            else:
                self._done(batch, begun)
                pause_s = PAUSES_S[0]
        if self._archive is not None:
            self._archive.close()

    def _await_work(self) -> bool:
        """Wait until there is something to write; False at the end."""
        with self._condition:
            self._condition.wait_for(lambda: self._closing or self._since is not None)
            return self._since is not None

    def _take(self) -> Batch:
        with self._condition:
            rows = [self._rows.popleft() for _ in range(min(len(self._rows), _AT_ONCE))]
            self._numbers -= sum(map(_size, rows))
            commands = [*self._commands.values()]
            batch = Batch(rows, self._counters, [*self._entries], commands, self._others)
            self._counters, self._commands, self._others = {}, {}, {}
            self._entries.clear()
            self._written = batch
            if not self._rows:
                self._served, self._waiters = self._waiters, []
            return batch

    def _store(self, batch: Batch) -> None:
        if self._archive is not None and (lacking := self._marks.missing()):
            self._reopen(lacking)
        if self._archive is None:
            self._open()
        assert self._archive is not None
        try:
            self._archive.store(batch)
        except Exception as error:
            if _is_storage(error):
                raise
            self._store_singly(batch)
        self._marks.note()
        self._damages = 0

    def _store_singly(self, batch: Batch) -> None:
        """Store what can be stored of a batch of which something never can."""
        assert self._archive is not None
        parts = [Batch([row]) for row in batch.rows]
        parts += [Batch([], entries=[entry]) for entry in batch.entries]
        parts += [Batch([], commands=[command]) for command in batch.commands]
        parts += [Batch([], others={key: each}) for key, each in batch.others.items()]
        for part in [*parts, Batch([], batch.counters)]:
            try:
                self._archive.store(part)
            except Exception as error:
                if _is_storage(error):
                    raise
                self.lost += len(part.rows)
                self._notes.append(("alarm", f"not archived, as it cannot be: {error}"))

    def _put_back(self, batch: Batch, error: Exception) -> None:
        """Keep what was not written, before what has come meanwhile."""
        with self._condition:
            self._rows.extendleft(reversed(batch.rows))
            self._numbers += sum(map(_size, batch.rows))
            self._entries.extendleft(list(batch.entries)[::-1][: MOST_ENTRIES - len(self._entries)])
            self._counters = {**batch.counters, **self._counters}
            kept = {command["id"]: dict(command) for command in batch.commands}
            self._commands = kept | self._commands
            older = {k: v for k, v in batch.others.items() if k not in self._others}
            self._others = older | self._others
            self._written = None
            self._waiters, self._served = self._served + self._waiters, []
            self.reason = " ".join(str(error).split())
        if isinstance(error, sqlite3.Error) and is_passing(error):
            return
        self._close_archive()
        damaged = getattr(error, "is_damaged", False) or (
            isinstance(error, sqlite3.Error) and is_damage(error)
        )
        self._damages += damaged
        if self._was_open and self._damages >= _ATTEMPTS:
            self._damages = 0
            with suppress(OSError):
                aside = set_aside(self.path)
                self._notes.append((
                    "alarm",
                    f"the archive is damaged ({self.reason}). It is kept as {aside.name}, which "
                    "`torquer ground export` reads; another one is begun",
                ))  # fmt: skip

    def _done(self, batch: Batch, begun: tuple[float, int]) -> None:
        with self._condition:
            if self.is_failing:
                self.late += len(batch.rows)
            self._written = None
            rest = self._rows or self._entries or self._commands or self._counters or self._others
            if len(batch.rows) < _AT_ONCE or not rest:
                self._since, self.reason = begun if rest else None, ""  # the rest has come since
            served, self._served = self._served, []
        for each in served:
            each.set_result(None)

    def _open(self) -> None:
        """Open the archive; at first also see what is in it."""
        archive = Archive(self.path, self._dictionary, PATIENCE_S)
        try:
            if self.found is None:
                self.found = _find(archive.read)
        except sqlite3.Error as error:
            archive.close()
            raise StorageError(str(error), is_damage(error)) from None
        self._archive, self._was_open = archive, True
        self._marks.begin()

    def _reopen(self, lacking: str) -> None:
        """Begin again where a file of the archive was removed, with what can be kept of it."""
        assert self._archive is not None
        with suppress(sqlite3.Error):
            self._archive.read("PRAGMA wal_checkpoint(TRUNCATE)")
        self._close_archive()
        self._notes.append(("alarm", f"{lacking} was removed or replaced: it is begun again"))
        self._open()

    def _close_archive(self) -> None:
        if self._archive is not None:
            with suppress(sqlite3.Error):
                self._archive.close()
            self._archive = None


def _size(row: Row) -> int:
    return _ROW_NUMBERS + len(row.values)


def _is_storage(error: Exception) -> bool:
    """Whether an error is the archive's, not that of what is to be stored."""
    its_own = (sqlite3.DatabaseError, sqlite3.OperationalError, sqlite3.InternalError)
    return type(error) in its_own or isinstance(error, OSError | ArchiveError)


def _find(read: Callable[..., list[tuple]]) -> Found:
    (last,) = read("SELECT max(id) FROM _log")
    counters = dict(read("SELECT name, value FROM _counters"))
    return Found(counters, last[0] or 0, last_commands(read))


def _look_in(path: Path) -> Found | None:
    """What is in an archive that can be read, though not be written."""
    try:
        with closing(read_only(path, PATIENCE_S)) as db:
            return _find(lambda statement, *values: db.execute(statement, values).fetchall())
    except (sqlite3.Error, ArchiveError, TypeError):
        return Found({}, 0, []) if not os.path.lexists(path) else None
