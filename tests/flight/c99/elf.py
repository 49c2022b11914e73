"""Sections, segments and symbols of a program or object in the format ELF, of either byte order."""

import struct
from pathlib import Path
from typing import NamedTuple

#: Types of sections, and flags: those that are in memory, written, run.
SYMBOLS, NO_BITS = 2, 8
WRITTEN, IN_MEMORY, RUN = 1, 2, 4


class Section(NamedTuple):
    """The head of a section."""

    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    alignment: int
    entry_size: int


class Elf:
    """A file of ELF; `order`: "<" or ">", of all its words."""

    def __init__(self, file: Path):
        self.data = file.read_bytes()
        assert self.data[:4] == b"\x7fELF", file
        self.is_wide, self.order = self.data[4] == 2, ">" if self.data[5] == 2 else "<"
        word = "Q" if self.is_wide else "I"
        places = self._at(24, f"3{word}I6H")
        (_, self._segments_at, sections_at, *_, self._segments, size, count, _) = places
        head = f"2I4{word}2I2{word}"
        self.sections = [Section(*self._at(sections_at + k * size, head)) for k in range(count)]

    def _at(self, offset: int, layout: str) -> tuple:
        return struct.unpack_from(self.order + layout, self.data, offset)

    def _word_at(self, offset: int) -> int:
        return self._at(offset, "Q" if self.is_wide else "I")[0]

    def segments(self) -> list[tuple[int, bytes, int]]:
        """Of each segment that is loaded its address, bytes and size in memory."""
        found = []
        for k in range(self._segments):
            if self.is_wide:
                kind, _, offset, at, _, count, size = self._at(self._segments_at + 56 * k, "2I5Q")
            else:
                kind, offset, at, _, count, size = self._at(self._segments_at + 32 * k, "6I")
            if kind == 1 and size:
                found.append((at, self.data[offset : offset + count], size))
        return found

    def symbols(self) -> dict[str, int]:
        """Addresses by name."""
        found = {}
        for section in self.sections:
            if section.kind == SYMBOLS:
                names = self.sections[section.link].offset
                for at in range(section.offset, section.offset + section.size, section.entry_size):
                    name, *_ = self._at(at, "I")
                    (value,) = self._at(
                        at + (8 if self.is_wide else 4), "Q" if self.is_wide else "I"
                    )
                    end = self.data.index(b"\0", names + name)
                    found[self.data[names + name : end].decode()] = value
        return found

    def sizes(self) -> dict[str, int]:
        """Bytes of code, constants, variables with a first value and without, in memory."""
        found = {"text": 0, "constants": 0, "data": 0, "bss": 0}
        for each in self.sections:
            if each.flags & IN_MEMORY:
                found[_place_of(each)] += each.size
        return found


def _place_of(section: Section) -> str:
    if section.flags & RUN:
        return "text"
    if not section.flags & WRITTEN:
        return "constants"
    return "bss" if section.kind == NO_BITS else "data"
