"""The archive of a satellite: SQLite, a table a packet, each frame once.

A row has the numbers of the packet under their names, in the units of the dictionary, and

_time_ms      on-board time [ms since 1970, UTC]: the field that the packet names, or the time stamp
_digest       of the whole frame: with the time it is the key of the row
_received_ms  time of reception [ms since 1970, UTC]; NULL for a recording
_quality      2: in an authentic frame, 1: without checksum, 0: the same with bytes lost just before
_status       of the frame: 0 INFO, 1 ALARM, 2 STOP

Numbers that were not known on board are NULL, bytes are hexadecimal digits. A whole number that is
too large for SQLite (2^63 and above) is a text of its 20 digits. Tables that begin with
`_` are not packets: `_about` (name of the satellite, dictionary), `_counters`, `_commands`, `_log`,
`_stack` (a row a step, in place 0 the command stack itself), `_parts` (of packets that lie across
frames, whose other frame no recording has had yet), `_alarms`, `_violations` (the out-of-limits
log).

One process writes; any number read at the same time. What has been committed outlives the process.
"""

from __future__ import annotations

import json
import math
import sqlite3
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from pydantic import ValidationError

from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.frames import EPOCH, Frame
from torquer.flight.packets.mistakes import describe_mistake

#: On-board time counts from 2010 on, the archive from 1970 on [ms].
EPOCH_MS = round(EPOCH.timestamp() * 1e3)
#: Packets that tell of earlier times: they do not show the satellite's clock.
RECORDED = ("stored", "dump")
SUSPECT, UNCHECKED, AUTHENTIC = range(3)
_VERSION = 1
#: How long a statement waits for another process [s].
_PATIENCE_S = 10.0
_TABLES = """
CREATE TABLE IF NOT EXISTS _about (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS _counters (name TEXT PRIMARY KEY, value INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS _log (
  id INTEGER PRIMARY KEY, time_ms INTEGER NOT NULL, made_ms INTEGER NOT NULL,
  severity TEXT NOT NULL, text TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS _commands (
  id INTEGER PRIMARY KEY, made_ms INTEGER NOT NULL, made_by TEXT NOT NULL, command TEXT NOT NULL,
  "values" TEXT NOT NULL, acknowledge INTEGER NOT NULL, packet INTEGER NOT NULL,
  execute_s INTEGER NOT NULL, state TEXT NOT NULL,
  sent_ms INTEGER, received_ms INTEGER, answered_ms INTEGER, reason TEXT NOT NULL DEFAULT '');
CREATE TABLE IF NOT EXISTS _stack (
  place INTEGER PRIMARY KEY, what TEXT NOT NULL, state TEXT NOT NULL, command INTEGER,
  reason TEXT NOT NULL DEFAULT '');
CREATE TABLE IF NOT EXISTS _parts (
  is_tail INTEGER NOT NULL, spi INTEGER NOT NULL, number INTEGER NOT NULL, data BLOB NOT NULL,
  time_s INTEGER, ends INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS _alarms (key TEXT PRIMARY KEY, alarm TEXT, shelf TEXT);
CREATE TABLE IF NOT EXISTS _violations (
  id INTEGER PRIMARY KEY, key TEXT NOT NULL, severity TEXT NOT NULL, "limit" TEXT NOT NULL,
  mode TEXT NOT NULL, start_ms INTEGER NOT NULL, end_ms INTEGER NOT NULL,
  received_ms INTEGER NOT NULL, extreme REAL, count INTEGER NOT NULL, is_over INTEGER NOT NULL,
  acknowledged_by TEXT NOT NULL, acknowledged_ms INTEGER, comment TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS _violations_ended ON _violations (end_ms);
"""


class Row(NamedTuple):
    """A frame as the archive keeps it; times in ms since 1970, UTC."""

    packet: str
    time_ms: int
    received_ms: int | None
    quality: int
    status: int
    digest: int
    values: tuple


class RowMaker:
    """Makes rows of frames: what it must know of each packet is worked out once."""

    def __init__(self, dictionary: Dictionary):
        self._known = {name: _Known(packet) for name, packet in dictionary.down.items()}

    def row(self, frame: Frame, received_ms: int | None, quality: int) -> Row:
        """The row of a frame."""
        known = self._known[frame.packet.name]
        digest = blake2b(frame.raw, digest_size=8).digest()
        return Row(
            frame.packet.name,
            known.time_ms(frame),
            received_ms,
            quality,
            frame.status,
            int.from_bytes(digest, "big", signed=True),
            known.values(frame.values),
        )


class _Known:
    """A packet: where its time is, which values mean 'not known', whether some become texts."""

    def __init__(self, packet: Packet):
        fields = [field for _, field, _ in packet.numbers()]
        self._time = packet.names.index(packet.time_ms) if packet.time_ms else None
        self._unknown = tuple(
            math.nan if f.unknown_value is None else f.unknown_value for f in fields
        )
        self._has_texts = any(f.dtype in ("O", "u8") for f in fields)

    def time_ms(self, frame: Frame) -> int:
        """On-board time, ms since 1970: of the field, unless that is none."""
        if self._time is not None:
            time_ms = frame.values[self._time]
            if 0.0 <= time_ms < 2.0**53 or 1e3 * frame.time_s <= time_ms < 0.0:
                return EPOCH_MS + round(time_ms)
        return EPOCH_MS + 1000 * frame.time_s

    def values(self, values: tuple) -> tuple:
        """Values with None for those that were not known; bytes and large numbers as digits."""
        if self._has_texts:
            values = tuple(map(_as_stored, values))
        return tuple(
            None if v == unknown or v != v else v
            for v, unknown in zip(values, self._unknown, strict=True)
        )


def _as_stored(value):
    """A value as SQLite can hold it, which also puts texts behind numbers in order."""
    if isinstance(value, bytes):
        return value.hex()
    return f"{value:020d}" if isinstance(value, int) and value >= 2**63 else value


class ArchiveError(ValueError):
    """A file that is no archive, or one of another satellite: one line."""


class OtherPacketsError(ArchiveError):
    """An archive of a satellite with other packets: one line."""


class StorageError(ArchiveError):
    """An archive that cannot be opened now; `is_damaged`: what is in the file is not as it was."""

    def __init__(self, line: str, is_damaged: bool = False):
        super().__init__(line)
        self.is_damaged = is_damaged


class Batch(NamedTuple):
    """What is stored at once: rows, counters, entries of the log, commands as they are now.

    `others`: statements with their values, by keys of whoever has them executed.
    """

    rows: list[Row]
    counters: Mapping[str, int] = MappingProxyType({})
    entries: Sequence[tuple[int, int, int, str, str]] = ()
    commands: Sequence[Mapping[str, Any]] = ()
    others: Mapping[tuple, tuple[str, tuple]] = MappingProxyType({})


class Archive:
    """The archive in a file, made if there is none; `dictionary`: of the satellite.

    `patience_s`: how long a statement waits for another process. `ArchiveError` for another file,
    `StorageError` for one that cannot be opened now, and `OtherPacketsError` for packets that
    differ from those in the archive, or lack one of which it has rows; packets may be added.
    """

    def __init__(self, path: Path | str, dictionary: Dictionary, patience_s: float = _PATIENCE_S):
        self.path, self.dictionary = Path(path), dictionary
        self._lock = threading.Lock()
        try:
            self._db = sqlite3.connect(
                self.path, check_same_thread=False, isolation_level=None, timeout=patience_s
            )
            try:
                self._db.execute("PRAGMA journal_mode = WAL")
                self._db.execute("PRAGMA synchronous = NORMAL")
                with self.writing():
                    self._make_tables()
            except BaseException:
                self._db.close()
                raise
        except sqlite3.Error as error:
            raise StorageError(
                f"archive: must be an archive that can be written; received {path}: {error}",
                is_damaged=is_damage(error),
            ) from None
        self._insert = {name: _insert(packet) for name, packet in dictionary.down.items()}

    def close(self) -> None:
        """Write what waits in the journal into the file, and close it."""
        self._db.close()

    def discard(self) -> None:
        """Close the archive and remove its files, as of one in which nothing was put."""
        self.close()
        for end in ("", "-wal", "-shm"):
            Path(f"{self.path}{end}").unlink(missing_ok=True)

    @contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """A transaction: all or nothing, one at a time."""
        with self._lock:
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield self._db
                self._db.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):  # a full disk has ended the transaction already
                    self._db.execute("ROLLBACK")
                raise

    def put(self, rows: Iterable[Row], counters: Mapping[str, int] = MappingProxyType({})) -> int:
        """Add rows, and set counters, in one transaction; how many rows were not there before."""
        return self.store(Batch([*rows], counters))

    def store(self, batch: Batch) -> int:
        """Store a batch in one transaction; how many of its rows were not there before."""
        by_packet: dict[str, list[tuple]] = {}
        for row in batch.rows:
            by_packet.setdefault(row.packet, []).append((*row[1:6], *row.values))
        with self.writing() as db:
            before = db.total_changes
            for packet, group in by_packet.items():
                db.executemany(self._insert[packet], group)
            new = db.total_changes - before
            counters = batch.counters.items()
            db.executemany("INSERT OR REPLACE INTO _counters VALUES (?, ?)", counters)
            db.executemany("INSERT OR REPLACE INTO _log VALUES (?, ?, ?, ?, ?)", batch.entries)
            for command in batch.commands:
                marks = ", ".join("?" * len(command))
                db.execute(
                    f"INSERT OR REPLACE INTO _commands ({quote_names([*command])}) "
                    f"VALUES ({marks})",
                    [*command.values()],
                )
            for statement, values in batch.others.values():
                db.execute(statement, values)
        return new

    def put_many(self, packet: str, rows: list[tuple]) -> int:
        """Add rows of a packet, as `columns_of` orders them, at once; how many are new."""
        with self.writing() as db:
            before = db.total_changes
            db.executemany(self._insert[packet], rows)
            return db.total_changes - before

    def parts(self) -> list[tuple]:
        """Parts of packets whose other parts no recording has had yet, as `put_parts` got them."""
        return self.read("SELECT is_tail, spi, number, data, time_s, ends FROM _parts")

    def put_parts(self, parts: Iterable[tuple]) -> None:
        """Keep parts in place of those that were kept."""
        with self.writing() as db:
            db.execute("DELETE FROM _parts")
            db.executemany("INSERT INTO _parts VALUES (?, ?, ?, ?, ?, ?)", parts)

    def read(self, statement: str, *values) -> list[tuple]:
        """Rows of a statement, by the writer's connection."""
        with self._lock:
            return self._db.execute(statement, values).fetchall()

    def _make_tables(self) -> None:
        for statement in filter(None, map(str.strip, _TABLES.split(";"))):
            self._db.execute(statement)
        about = dict(self._db.execute("SELECT key, value FROM _about"))
        if about and about.get("version") != str(_VERSION):
            raise ArchiveError(
                f"archive: must be of version {_VERSION}; received {self.path} of version "
                f"{about.get('version')}"
            )
        known = json.loads(about.get("down", "{}"))
        own = {p.name: [p.id, p.format, [*p.names]] for p in self.dictionary.down.values()}
        self._check_packets(known, own)
        for packet in self.dictionary.down.values():
            for statement in _create(packet):
                self._db.execute(statement)
        entries = {
            "version": str(_VERSION),
            "dictionary": self.dictionary.model_dump_json(exclude_defaults=True),
            "down": json.dumps(known | own),
        }
        self._db.executemany("INSERT OR REPLACE INTO _about VALUES (?, ?)", entries.items())

    def _check_packets(self, known: dict[str, list], own: dict[str, list]) -> None:
        """Refuse a dictionary of other packets: with it, rows could not be told any more."""
        must = f"archive: must hold the packets of this dictionary; received {self.path} with"
        for name, layout in own.items():
            if known.get(name, layout) != layout:
                raise OtherPacketsError(f"{must} another packet {name}")
        if lacking := [name for name in known if name not in own and self._has_rows(name)]:
            raise OtherPacketsError(f"{must} rows of {', '.join(lacking)}, which it lacks")

    def _has_rows(self, name: str) -> bool:
        is_table = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?"
        if not self._db.execute(is_table, (name,)).fetchall():
            return False
        return bool(self._db.execute(f"SELECT 1 FROM {quoted(name)} LIMIT 1").fetchall())


def is_damage(error: sqlite3.Error) -> bool:
    """Whether an error says that a file is damaged, which waiting does not mend."""
    return _primary(error) in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


def is_passing(error: sqlite3.Error) -> bool:
    """Whether an error passes without the archive being opened again: a full disk, a lock."""
    passing = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
    return _primary(error) in passing


def _primary(error: sqlite3.Error) -> int:
    return getattr(error, "sqlite_errorcode", 0) & 0xFF


def connect_read_only(path: Path | str, patience_s: float = _PATIENCE_S) -> sqlite3.Connection:
    """A connection that reads a file of SQLite; `ArchiveError` for a file that cannot be opened."""
    try:
        uri = f"{Path(path).resolve().as_uri()}?mode=ro"
        db = sqlite3.connect(uri, uri=True, check_same_thread=False, timeout=patience_s)
        db.execute("PRAGMA trusted_schema = OFF")
    except (sqlite3.Error, OSError, ValueError) as error:
        raise ArchiveError(f"archive: must be an archive; received {path}: {error}") from None
    return db


def read_only(path: Path | str, patience_s: float = _PATIENCE_S) -> sqlite3.Connection:
    """A connection that reads an archive, also while it is written; `ArchiveError` for none.

    It may be used by several threads, one at a time. `patience_s`: how long it waits for another.
    """
    db = connect_read_only(path, patience_s)
    try:
        db.execute("SELECT value FROM _about")
    except sqlite3.Error as error:
        db.close()
        raise ArchiveError(f"archive: must be an archive; received {path}: {error}") from None
    return db


def dictionary_in(db: sqlite3.Connection) -> Dictionary:
    """The dictionary of an archive; `ArchiveError` with one line for none."""
    try:
        found = db.execute("SELECT value FROM _about WHERE key = 'dictionary'").fetchone()
        if found is None:
            raise ArchiveError("archive: must hold its dictionary; received none")
        return Dictionary.model_validate_json(found[0])
    except (sqlite3.Error, UnicodeError) as error:
        line = " ".join(str(error).split())
        raise ArchiveError(f"archive: must hold its dictionary; received {line}") from None
    except ValidationError as error:
        (first, *_) = error.errors()
        line = describe_mistake(first) if first["loc"] else "it is no table of JSON"
        raise ArchiveError(f"archive: must hold its dictionary; received another: {line}") from None


def quoted(name: str) -> str:
    """A name for a statement, whatever is in it."""
    return '"' + name.replace('"', '""') + '"'


def quote_names(names: Sequence[str]) -> str:
    """Names of columns for a statement; those of a dictionary need no escapes."""
    return ", ".join(f'"{name}"' for name in names)


def _create(packet: Packet) -> Iterator[str]:
    columns = ", ".join(f'"{name}" {_kind(field)}' for name, field, _ in packet.numbers())
    yield (
        f'CREATE TABLE IF NOT EXISTS "{packet.name}" (_time_ms INTEGER NOT NULL, _digest INTEGER '
        f"NOT NULL, _received_ms INTEGER, _quality INTEGER NOT NULL, _status INTEGER NOT NULL, "
        f"{columns}, PRIMARY KEY (_time_ms, _digest)) WITHOUT ROWID"
    )
    yield (
        f'CREATE INDEX IF NOT EXISTS "_received_{packet.name}" ON "{packet.name}" (_received_ms) '
        "WHERE _received_ms IS NOT NULL"  # recordings have none: they take half of the time so
    )


def _kind(field: Field) -> str:
    if field.dtype in ("O", "u8"):
        return "TEXT" if field.dtype == "O" else ""  # without a type values stay as they are
    return "INTEGER" if field.is_whole else "REAL"


def columns_of(packet: Packet) -> tuple[str, ...]:
    """Columns of a packet's table, in the order in which rows are put."""
    return ("_time_ms", "_received_ms", "_quality", "_status", "_digest", *packet.names)


def _insert(packet: Packet) -> str:
    names = columns_of(packet)
    marks = ", ".join("?" * len(names))
    return f'INSERT OR IGNORE INTO "{packet.name}" ({quote_names(names)}) VALUES ({marks})'
