"""Non-volatile memory: files in a main and a reserve file system, each with a checksum.

A file is written to both, main first. Of the copies that are whole, the one written last counts:
a power failure between the two, or a file system that takes no more files, costs nothing that was
reported as written. What goes wrong is counted and reported, never raised.
"""

import contextlib
import os
import re
import struct
import zlib
from collections import Counter, deque
from collections.abc import Iterator, Mapping, MutableMapping
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

from torquer.base.replaced_files import folder_to_disk, replacing, to_disk
from torquer.flight.packets.reasons import Reason

#: Before the data of a file: mark, number of the writing, length of the data, CRC-32 of the name,
#: of these two numbers and of the data: a file under another file's name is damaged, too.
_SEAL = struct.Struct("<4sIII")
_MARK = b"TQM1"
_NAME = re.compile(r"[a-z0-9_][a-z0-9_.-]{0,63}")
_IN_WORDS = "of at most 64 of a-z, 0-9 and '_.-', the first no '.' or '-'"
_REPORTS = 64
#: File that holds the names of all others, one a line: a file whose copies are both gone is missed.
INDEX = "index"
#: Numbers of the writing of copies that do not count.
_DAMAGED, _MISSING = -1, -2


class Report(NamedTuple):
    """Something that went wrong with a file: the reason and the name of the file."""

    code: Reason
    name: str


class Folder(MutableMapping[str, bytes]):
    """A folder as a mapping of names to contents; a content is replaced as a whole or not at all.

    Raises OSError where the file system does.
    """

    def __init__(self, path: Path):
        self.path = path

    def __getitem__(self, name: str) -> bytes:
        try:
            return (self.path / name).read_bytes()
        except FileNotFoundError:
            raise KeyError(name) from None

    def __setitem__(self, name: str, content: bytes) -> None:
        with (
            replacing(self.path / name, f".{name}.part") as unfinished,
            open(unfinished, "r+b") as file,
        ):
            file.write(content)
            to_disk(file)

    def __delitem__(self, name: str) -> None:
        try:
            (self.path / name).unlink()
        except FileNotFoundError:
            raise KeyError(name) from None
        folder_to_disk(self.path)

    def __iter__(self) -> Iterator[str]:
        with os.scandir(self.path) as found:
            return iter(sorted(one.name for one in found if _NAME.fullmatch(one.name)))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def seal(name: str, writing: int, data: bytes) -> bytes:
    """Content of a file: seal and data."""
    head = name.encode() + struct.pack("<II", writing, len(data))
    crc = zlib.crc32(data, zlib.crc32(head))
    return _SEAL.pack(_MARK, writing, len(data), crc) + data


def unseal(name: str, content: bytes) -> tuple[int, bytes] | None:
    """Number of the writing and data of a file's content; None unless it is whole."""
    if len(content) < _SEAL.size:
        return None
    _, writing, _, _ = _SEAL.unpack_from(content)
    data = content[_SEAL.size :]
    return (writing, data) if seal(name, writing, data) == content else None


class Memory:
    """Files by name, in folders `main/` and `reserve/` of a folder, or (None) in two dicts.

    A name has 1 to 64 lower-case letters, digits, `_`, `.` and `-`, of which `.` and `-` are not
    first; `ValueError` for another. `places`: the sealed files of `main` and `reserve` by name,
    where a fault may damage them. `counts`: what went wrong, by reason. With dicts a memory is
    plain state that can be copied.
    """

    def __init__(self, folder: Path | str | None = None):
        self.counts: Counter[Reason] = Counter()
        self._reports: deque[Report] = deque(maxlen=_REPORTS)
        self._writings: dict[str, int] = {}
        self._index: set[str] | None = None
        self.places: dict[str, MutableMapping[str, bytes]] = {"main": {}, "reserve": {}}
        if folder is not None:
            self.places = {place: self._mount(Path(folder), place) for place in self.places}

    def read(self, name: str) -> bytes | None:
        """Content of a file: of the copies that are whole, the one written last; None without one.

        Reported: RESERVE_USED, FILE_DAMAGED, FILE_MISSING.
        """
        main, reserve = self._copies(name)
        writing, data = last = max(main, reserve, key=itemgetter(0))
        if data is None:
            self._report(Reason.FILE_DAMAGED if writing == _DAMAGED else Reason.FILE_MISSING, name)
        elif last is not main:
            self._report(Reason.RESERVE_USED, name)
        return data

    def write(self, name: str, data: bytes) -> bool:
        """Replace a file; False if neither file system took it: both have the old content.

        Reported: FILE_NOT_WRITTEN, for each file system (`main/NAME`).
        """
        return bool(self._replace(name, data))

    def advance(self, name: str, data: bytes) -> bool:
        """As `write`, of what must never go back: a file system that refuses loses its old copy.

        Otherwise the old copy would count again where the new one is damaged later.
        """
        taken = self._replace(name, data)
        if taken:
            self._drop(name, [place for place in self.places if place not in taken])
        return bool(taken)

    def remove(self, name: str) -> None:
        """Remove a file, as far as the file systems let it."""
        self._drop(name, list(self.places))
        self._note(self._known() - {name})

    def mend(self, tells: bool = True) -> None:
        """Write again each file of which a copy is missing, damaged or old; at boot.

        Reported: FILE_MISSING for a file of which no copy is left; what `read` and `write` report
        and, if it `tells`, FILE_REPAIRED.
        """
        names = set(self.names())
        if names and self.read(INDEX) is None:
            self._note(names)
        for name in sorted(self._known() - names):
            self._report(Reason.FILE_MISSING, name)
        for name in self.names():
            main, reserve = self._copies(name)
            if main == reserve:
                continue
            data = self.read(name) if tells else max(main, reserve, key=itemgetter(0))[1]
            if data is not None and self.write(name, data) and tells:
                self._report(Reason.FILE_REPAIRED, name)

    def names(self) -> list[str]:
        """Names of all files but the index, sorted, damaged ones included."""
        found: set[str] = set()
        for files in self.places.values():
            with contextlib.suppress(OSError):
                found.update(files)
        return sorted(found - {INDEX})

    def take_reports(self) -> list[Report]:
        """What went wrong since the last call, oldest first; the last 64 if there is more."""
        taken = list(self._reports)
        self._reports.clear()
        return taken

    def snapshot(self) -> dict:
        """All files as they are, damaged ones too, counts and reports: plain data for `restore`."""
        files = {place: dict(_readable(files)) for place, files in self.places.items()}
        return {"files": files, "counts": dict(self.counts), "reports": list(self._reports)}

    def restore(self, snapshot: Mapping) -> None:
        """Take over what `snapshot` gave, of this memory or another."""
        for place, files in self.places.items():
            for name in set(files) - set(snapshot["files"][place]):
                del files[name]
            files.update(snapshot["files"][place])
        self.counts = Counter(snapshot["counts"])
        self._reports = deque(snapshot["reports"], maxlen=_REPORTS)
        self._writings.clear()
        self._index = None

    def _mount(self, folder: Path, place: str) -> Folder:
        mounted = Folder(folder / place)
        try:
            mounted.path.mkdir(parents=True, exist_ok=True)
        except OSError:
            self._report(Reason.FILE_NOT_WRITTEN, place)
        return mounted

    def _copies(self, name: str) -> list[tuple[int, bytes | None]]:
        """Number of the writing and data of a file's main and reserve copy."""
        if not _NAME.fullmatch(name):
            raise ValueError(f"memory: a name must be {_IN_WORDS}; received {name!r}")
        return [self._copy(files, name) for files in self.places.values()]

    def _copy(self, files: MutableMapping[str, bytes], name: str) -> tuple[int, bytes | None]:
        try:
            return unseal(name, files[name]) or (_DAMAGED, None)
        except KeyError:
            return _MISSING, None
        except OSError:
            return _DAMAGED, None

    def _replace(self, name: str, data: bytes) -> list[str]:
        """As `_put_all`, and the index with a new name."""
        taken = self._put_all(name, data)
        if taken and name not in self._known():
            self._note(self._known() | {name})
        return taken

    def _known(self) -> set[str]:
        """The names in the index; without one those that there are."""
        if self._index is None:
            data = max(self._copies(INDEX), key=itemgetter(0))[1]
            self._index = set(self.names() if data is None else data.decode().split())
        return self._index

    def _note(self, names: set[str]) -> None:
        self._index = names
        self._put_all(INDEX, "\n".join(sorted(names)).encode())

    def _put_all(self, name: str, data: bytes) -> list[str]:
        """The file systems that have taken a new content of a file."""
        if name not in self._writings:
            self._writings[name] = max(0, *(writing for writing, _ in self._copies(name)))
        self._writings[name] = (self._writings[name] + 1) % 2**32
        content = seal(name, self._writings[name], bytes(data))
        return [place for place in self.places if self._put(place, name, content)]

    def _drop(self, name: str, places: list[str]) -> None:
        for place in places:
            with contextlib.suppress(KeyError, OSError):
                del self.places[place][name]

    def _put(self, place: str, name: str, content: bytes) -> bool:
        try:
            self.places[place][name] = content
        except OSError:
            self._report(Reason.FILE_NOT_WRITTEN, f"{place}/{name}")
            return False
        return True

    def _report(self, code: Reason, name: str) -> None:
        self.counts[code] += 1
        self._reports.append(Report(code, name))


def _readable(files: MutableMapping[str, bytes]) -> Iterator[tuple[str, bytes]]:
    """Names and contents of the files of a file system, as far as it lets them be read."""
    names: list[str] = []
    with contextlib.suppress(OSError):
        names = list(files)
    for name in names:
        with contextlib.suppress(OSError, KeyError):
            yield name, files[name]
