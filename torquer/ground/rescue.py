"""What is readable of an archive, however damaged: its tables and their rows.

A file is not trusted because we made it: disks fail, copies end early, others edit it. Tables that
are views, and columns that are computed, are refused, since reading them can go on without end.
Where pages are damaged, rows are read up to the damage and on from the first readable one after it.
`Losses` has a line for whatever is lost.
"""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.mistakes import quote_value
from torquer.ground.archive import (
    ArchiveError,
    connect_read_only,
    dictionary_in,
    quote_names,
    quoted,
)
from torquer.ground.columns import FIRST_MS, LAST_MS, Column, found_columns, packet_columns

#: Names that tables and columns of packets have.
_NAME = re.compile(r"[A-Za-z]\w*")
#: A file that should be so many times as long as it is does not tell its length.
_MOST_TIMES_LONGER = 1000
#: How often reading goes on behind a damage.
_MOST_DAMAGES = 100
#: What SQLite raises for a damaged file; text that is none may be in its messages, too.
_UNREADABLE = (sqlite3.Error, UnicodeError)
#: Places of the size of a page and the number of pages in the header of a file of SQLite.
_PAGE_BYTES, _PAGES = struct.Struct(">16xH"), struct.Struct(">28xI")
_HEADER_BYTES = 100
#: That rows cannot be read.
_DAMAGED = object()
#: Orders of SQLite: numbers, then texts, then other bytes.
_RANKS: dict[type, int] = {str: 1, bytes: 2}


@dataclass
class Losses:
    """What was lost, a line each; `tell` is called with the line."""

    tell: Callable[[str], None]
    count: int = 0
    _told: set[str] = field(default_factory=set)
    _values: dict[str, list] = field(default_factory=dict)

    def add(self, line: str) -> None:
        """Tell of a loss, once though its table is read twice."""
        if line in self._told:
            return
        self._told.add(line)
        self.count += 1
        self.tell(line)

    def add_values(self, name: str, values: list, instead: Any = None) -> None:
        """Note values that do not fit, by `packet.column`, until the packet is done.

        `instead`: what is written for them; None: nothing.
        """
        if values:
            entry = self._values.setdefault(name, [0, values[0], instead])
            entry[0] += len(values)

    def forget_values(self) -> None:
        """Begin again with a packet."""
        self._values.clear()

    def tell_values(self) -> None:
        """Tell of the values that did not fit, of each column once."""
        for name, (count, value, instead) in self._values.items():
            one = "row" if name.endswith("._time_ms") else "value"
            are = f"{one}s are" if count > 1 else f"{one} is"
            what = "left out" if instead is None else f"written as {instead}"
            self.add(
                f"{name}: must be of its type and range; received {quote_value(value)}: "
                f"{count} {are} {what}"
            )
        self.forget_values()


class Table(NamedTuple):
    """A table that can be read: its packet, what is known of it, its columns."""

    name: str
    about: dict[str, str]
    columns: list[Column]


class Rescue:
    """The tables of an archive that can be read."""

    def __init__(self, path: Path, losses: Losses):
        """ArchiveError for a file that is no archive."""
        self._losses, self._closing = losses, ExitStack()
        readable = self._closing.enter_context(_readable(path, losses))
        self._db = self._closing.enter_context(closing(connect_read_only(readable)))
        self._db.execute("PRAGMA writable_schema = ON")  # tables are read though others are damaged
        self._db.text_factory = lambda raw: raw.decode("utf-8", "replace")
        self._kinds = self._read_kinds(path)
        self._dictionary = self._read_dictionary()
        if self._dictionary is None and not self.packets:
            self.close()
            raise ArchiveError(f"archive: must be an archive; received {path} without packets")

    def _read_kinds(self, path: Path) -> dict[str, str]:
        """What the names of tables and views are, up to the first damage."""
        kinds = {}
        try:
            for name, kind, root in self._db.execute(
                "SELECT name, type, rootpage FROM sqlite_master"
            ):
                if kind in ("table", "view") and isinstance(name, str):
                    kinds[name] = kind if root or kind != "table" else "virtual table"
        except _UNREADABLE as error:
            if not kinds:
                self.close()
                raise _no_archive(path, error) from None
            self._losses.add(
                f"archive: must be readable; received damage ({_in_words(error)}) in the list of "
                f"its tables: those behind {_in_line(list(kinds)[-1])} are lost"
            )
        return kinds

    def close(self) -> None:
        """Close the file."""
        self._closing.close()

    @property
    def packets(self) -> list[str]:
        """Names of the packets that the archive should have, and of other tables with rows."""
        if self._dictionary is not None:
            return [*self._dictionary.down, *self.unnamed]
        return [name for name in self._kinds if not name.startswith(("_", "sqlite_"))]

    @cached_property
    def unnamed(self) -> list[str]:
        """Tables with rows that are no packets of the dictionary."""
        named = set() if self._dictionary is None else {*self._dictionary.down}
        return [
            name
            for name, kind in self._kinds.items()
            if kind == "table" and name not in named and not name.startswith(("_", "sqlite_"))
            if self._has_rows(name)
        ]

    def _has_rows(self, name: str) -> bool:
        """Whether a table has rows with times, or may have some that cannot be read."""
        try:
            first = f"SELECT _time_ms FROM {quoted(name)} LIMIT 1"
            return bool(self._db.execute(first).fetchall())
        except _UNREADABLE as error:
            return "no such column" not in str(error)

    def tell_unnamed(self, wanted: Collection[str]) -> None:
        """Tell of tables that the dictionary does not know, in one line."""
        if self._dictionary is None:
            return  # told before
        if names := [name for name in self.unnamed if name in wanted]:
            self._losses.add(
                "archive: must hold the packets of its tables in its dictionary; received none of "
                f"{_in_line(', '.join(names))}: tables are written as they are, without units"
            )

    def _read_dictionary(self) -> Dictionary | None:
        try:
            if self._kinds.get("_about") != "table":
                raise ArchiveError("archive: must hold its dictionary; received none")
            return dictionary_in(self._db)
        except ArchiveError as error:
            self._losses.add(f"{error}: tables are written as they are, without units")
        return None

    def table(self, name: str) -> Table | None:
        """The table of a packet; None, and a loss, if it cannot be read."""
        kind = self._kinds.get(name, "none")
        if kind != "table" or not _NAME.fullmatch(name):
            received = f"a {kind}" if kind != "none" else kind
            self._losses.add(
                f"{_in_line(name)}: must be a table by the name of a packet; received {received}"
            )
            return None
        try:
            found = self._db.execute(f'PRAGMA table_xinfo("{name}")').fetchall()
        except _UNREADABLE as error:
            self._losses.add(f"{name}: must be readable; received {_in_words(error)}")
            return None
        return self._described(name, {each[1]: each[2] for each in found if not each[6]})

    def _described(self, name: str, kinds: dict[str, str]) -> Table | None:
        """A table with these columns and types of SQL."""
        about = {"packet": name}
        if self._dictionary is None or name not in self._dictionary.down:
            columns = found_columns({each: kinds[each] for each in kinds if _is_column(each)})
        else:
            packet = self._dictionary.down[name]
            about = {"satellite": self._dictionary.name, **about, "description": packet.description}
            columns = packet_columns(packet)
        missing = [column.source for column in columns if column.source not in kinds]
        if missing:
            self._losses.add(
                f"{name}: must have its columns; received none of {', '.join(missing)}"
            )
        if "_time_ms" in missing:
            return None
        return Table(name, about, [c for c in columns if c.source in kinds])

    def rows(self, table: Table, span: tuple[int, int], size: int) -> Iterator[list[tuple]]:
        """Rows of an interval by time, up to `size` at a time, around damage.

        Rows whose time is none are noted as lost.
        """
        first, end = max(span[0], FIRST_MS), min(span[1], LAST_MS)
        start: int | None = first
        for _ in range(_MOST_DAMAGES):
            assert start is not None
            last = start
            try:
                for part in self._until_damage(table, (start, end), size):
                    last = part[-1][0]
                    yield [row[1:] for row in part]
                self._note_timeless(table.name, span)
                return
            except _UNREADABLE as error:
                start = self._readable_after(table.name, last, end)
                self._tell_damage(table.name, _in_words(error), last, start)
            if start is None:
                return

    def _note_timeless(self, name: str, span: tuple[int, int]) -> None:
        """Note rows whose time is no number, or one of no date that lies in the interval."""
        self._note_times(name, "_time_ms IS NULL")
        if span[0] < FIRST_MS:
            self._note_times(name, "_time_ms < ?", FIRST_MS)
        if span[1] > LAST_MS:
            self._note_times(name, "_time_ms > ?", LAST_MS)
        else:
            self._note_times(name, "_time_ms >= ''")

    def _note_times(self, name: str, which: str, *values: float) -> None:
        found = self._db.execute(
            f'SELECT _time_ms FROM "{name}" WHERE {which} ORDER BY _time_ms', values
        )
        before: tuple = ()
        for (time,) in found:
            key = (_RANKS.get(type(time), 0), time)
            if time is not None and key < before:
                raise sqlite3.DatabaseError("rows out of order")  # a tree that leads into a circle
            before = key if time is not None else before
            self._losses.add_values(f"{name}._time_ms", [time])

    def _tell_damage(self, name: str, error: str, last: int, start: int | None) -> None:
        since = "its beginning" if last == FIRST_MS else str(last)
        until = "its end" if start is None else str(start)
        self._losses.add(
            f"{name}: must be readable; received damage ({error}): rows from {since} to {until} "
            "[ms since 1970] are lost"
        )

    def _until_damage(
        self, table: Table, span: tuple[int, int], size: int
    ) -> Iterator[list[tuple]]:
        """Rows with their time before them, up to the first damage, which is raised."""
        has_digest = any(column.source == "_digest" for column in table.columns)
        found = self._db.execute(
            f"SELECT {quote_names(['_time_ms', *(c.source for c in table.columns)])} "
            f'FROM "{table.name}" WHERE _time_ms BETWEEN ? AND ? '
            f"ORDER BY _time_ms{', _digest' if has_digest else ''}",
            span,
        )
        rows: list[tuple] = []
        before, damage = span[0], None
        while damage is None:
            rows, damage = _fetch(found, size)
            wrong = [row[0] for row in rows if not isinstance(row[0], int)]
            self._losses.add_values(f"{table.name}._time_ms", wrong)
            rows = [row for row in rows if isinstance(row[0], int)]
            ordered = _in_order(rows, before)
            if ordered < len(rows):
                rows, damage = rows[:ordered], sqlite3.DatabaseError("rows out of order")
            if rows:
                before = rows[-1][0]
                yield rows
        if isinstance(damage, Exception):
            raise damage

    def _readable_after(self, name: str, after: int, end: int) -> int | None:
        """Time of the first row behind a damage that can be read; None if there is none."""
        failed, step = 0, 1
        while (found := self._first(name, after + step, end)) is _DAMAGED:
            failed, step = step, 2 * step
            if after + step > end:
                return None
        while step - failed > 1:
            middle = (failed + step) // 2
            earlier = self._first(name, after + middle, end)
            if earlier is _DAMAGED:
                failed = middle
            else:
                step, found = middle, earlier
        return found

    def _first(self, name: str, start: int, end: int) -> Any:
        """Time of the first row of an interval, None if it has none."""
        try:
            found = self._db.execute(
                f'SELECT _time_ms FROM "{name}" WHERE _time_ms BETWEEN ? AND ? '
                "ORDER BY _time_ms LIMIT 1",
                (start, end),
            ).fetchone()
        except _UNREADABLE:
            return _DAMAGED
        return found[0] if found else None


def _no_archive(path: Path, error: Exception) -> ArchiveError:
    return ArchiveError(f"archive: must be an archive; received {path}: {_in_words(error)}")


def _in_line(name: str) -> str:
    """Names, which may be noise, in one line."""
    return " ".join(name.split())


def _in_words(error: Exception) -> str:
    """An error in one line, which does not quote the whole file."""
    return quote_value(" ".join(str(getattr(error, "strerror", error)).split()))[1:-1]


@contextmanager
def _readable(path: Path, losses: Losses) -> Iterator[Path]:
    """The file, or in place of one that ends early a copy with its end: SQLite refuses the file."""
    size, stated = _sizes(path)
    if size >= stated or _has_content(Path(f"{path}-wal")):  # there may be what is missing
        yield path
        return
    losses.add(f"archive: must be whole; received {size} of {stated} bytes")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        copy = Path(shutil.copyfile(path, Path(folder, "archive.sqlite")))
        os.truncate(copy, stated)  # what is missing is zeros, which take no room
        yield copy


def _has_content(path: Path) -> bool:
    return path.exists() and path.stat().st_size > 0


def _sizes(path: Path) -> tuple[int, int]:
    """Bytes of a file, and those that it should have: 0 if it does not tell."""
    try:
        with path.open("rb") as file:
            header, size = file.read(_HEADER_BYTES), os.fstat(file.fileno()).st_size
    except OSError as error:
        raise _no_archive(path, error) from None
    if len(header) < _HEADER_BYTES or not header.startswith(b"SQLite format 3\0"):
        return size, 0
    (page,), (pages,) = _PAGE_BYTES.unpack_from(header), _PAGES.unpack_from(header)
    stated = (65536 if page == 1 else page) * pages
    return size, stated if stated < _MOST_TIMES_LONGER * size else 0


def _is_column(name: str) -> bool:
    return _NAME.fullmatch(name.lstrip("_")) is not None


def _fetch(found: sqlite3.Cursor, size: int) -> tuple[list[tuple], Exception | bool | None]:
    """Up to `size` rows, and the damage behind them: None if there is none, True at the end."""
    rows: list[tuple] = []
    try:
        for row in found:
            rows.append(row)
            if len(rows) == size:
                return rows, None
    except _UNREADABLE as error:
        return rows, error
    return rows, True


def _in_order(rows: list[tuple], before: int) -> int:
    """How many rows come in order of time: a tree that leads into a circle gives them again."""
    for k, row in enumerate(rows):
        if row[0] < before:
            return k
        before = row[0]
    return len(rows)
