"""Statements of C as they come out of the translator: lines, declarations, assignments."""

import re
from collections import Counter
from dataclasses import dataclass, field

from torquer.flight.c99.types import Type

_WORD = re.compile(r"(?<![.>\w])[A-Za-z_]\w*")


@dataclass
class Line:
    """A line of text at a depth of blocks."""

    depth: int
    text: str


@dataclass
class Declared(Line):
    """A variable that is declared here, with its first value; `text` is that value, or ''."""

    name: str = ""
    type: Type | None = None
    roots: frozenset[str] = frozenset()
    is_constant: bool = False
    has_effect: bool = False


@dataclass
class Stored(Line):
    """An assignment of `text` to a variable."""

    name: str = ""
    has_effect: bool = False


@dataclass
class Left(Line):
    """A return from a kernel that has failed, with nothing of its own to answer."""


@dataclass
class Block:
    """Lines that are collected; `effects`: whether they change memory."""

    lines: list[Line] = field(default_factory=list)
    effects: bool = False

    def __bool__(self) -> bool:
        return bool(self.lines)


def without_unread(lines: list[Line], kept: set[str]) -> list[Line]:
    """The lines without variables that nothing reads; what has an effect stays, unread."""
    while True:
        words = count_words(lines)
        unread = {
            each.name
            for each in lines
            if isinstance(each, Declared | Stored)
            and each.name not in kept
            and words[each.name] == 0
        }
        if not unread:
            return lines
        lines = [made for each in lines for made in _without(each, unread)]


def _without(line: Line, unread: set[str]) -> list[Line]:
    if not isinstance(line, Declared | Stored) or line.name not in unread:
        return [line]
    return [Line(line.depth, f"(void){line.text};")] if line.has_effect else []


def count_words(lines: list[Line]) -> Counter[str]:
    """How often each word is read; members of structs are none."""
    return Counter(word for line in lines for word in _WORD.findall(line.text))
