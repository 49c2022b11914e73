"""Text in hexadecimal: digits in pairs, or a dump with a column of offsets and one of text.

A dump is told by its first lines: the first word of each counts the bytes of those before it, in
hexadecimal as `xxd` and `hexdump -C` write it, in octal or decimal as `od -t x1` may. Text that is
hexadecimal but for some lines is not read: the first of these is named.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from torquer.ground.recorded.authentic import Data

#: Least bytes by which a file is judged, and bytes by which most are judged.
_LEAST, _BEGINNING = 16, 4096
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
#: Text of digits in pairs, with what is written between and before them.
_NOT_DIGITS = re.compile(rb"0[xX]|[\s,:;]+")
_HEX = re.compile(rb"[0-9A-Fa-f\s,:;xX]*")
_DIGITS = re.compile(rb"[0-9A-Fa-f]")
#: Printed text; the share of its characters that are digits in text that is almost hexadecimal.
_PRINTED, _ALMOST = re.compile(rb"[\t\n\r -~]*"), 0.8
#: A line of a dump: its offset, a colon, the rest.
_LINE = re.compile(rb"\s*(?:0[xX])?([0-9A-Fa-f]{4,16})(:?)(?:[ \t]+(\S.*))?\s*")
#: The same bytes as in the line before, up to the next offset; most bytes that it may stand for.
_SAME, _MOST_SAME = b"*", 2**28
_BASES = (16, 8, 10)
_SHOWN = 40


class Text(NamedTuple):
    """The bytes of a text, how it is written, and what stopped it ("" if nothing did)."""

    data: bytes
    what: str
    stopped: str = ""


class _Line(NamedTuple):
    """A line of a dump: its number, itself, its offset as it is written, a colon, the rest."""

    number: int
    line: bytes
    offset: bytes
    colon: bytes
    rest: bytes

    def digits(self) -> list[bytes]:
        """What its bytes may be: up to its text, which two spaces or a bar set off."""
        bar = re.split(rb"\||\s>", self.rest)[0]
        bodies = [re.split(rb"\s\s", self.rest)[0], bar] if self.colon else [bar]
        joined = [b"".join(body.split()) for body in bodies]
        return [each for each in joined if len(_DIGITS.findall(each)) == len(each)]


def _stopped(number: int, line: bytes, must: str) -> str:
    shown = line.strip()[:_SHOWN].decode("ascii", "replace")
    return f"line {number} must {must}; received {shown!r}"


def read_hex(data: Data) -> Text | None:
    """The bytes of a text in hexadecimal; None for another file."""
    begin = len(_BYTE_ORDER_MARK) * (data[: len(_BYTE_ORDER_MARK)] == _BYTE_ORDER_MARK)
    beginning = data[begin : begin + _BEGINNING]
    if len(data) < _LEAST or _PRINTED.fullmatch(beginning) is None:
        return None
    if base := _base(beginning):
        return _from_dump(data[begin:].splitlines(), base)
    marks = b"".join(beginning.split())
    is_almost = len(_DIGITS.findall(marks)) > _ALMOST * len(marks) or _HEX.fullmatch(marks)
    return _from_digits(data[begin:].splitlines()) if is_almost else None


def _from_digits(lines: list[bytes]) -> Text | None:
    what, found, odd = "text in hexadecimal", [], 0
    for number, line in enumerate(lines, 1):
        marks = _NOT_DIGITS.sub(b"", line)
        if len(_DIGITS.findall(marks)) != len(marks):
            return Text(b"", what, _stopped(number, line, "have digits in pairs, nothing else"))
        odd = number if len(marks) % 2 else odd
        found.append(marks)
    digits = b"".join(found)
    if len(digits) % 2:
        must = f"end with a pair: there are {len(digits)} digits"
        return Text(b"", what, _stopped(odd, lines[odd - 1], must))
    return Text(bytes.fromhex(digits.decode("ascii")), what) if digits else None


def _parsed(number: int, line: bytes) -> _Line | None:
    found = _LINE.fullmatch(line)
    return _Line(number, line, found[1], found[2], found[3] or b"") if found else None


def _base(beginning: bytes) -> int:
    """The base of the offsets if the first lines are those of a dump, 0 if they are none."""
    lines = [line for line in beginning.splitlines() if line.strip() != _SAME][:2]
    first, second = ([_parsed(0, line) for line in lines] + [None, None])[:2]
    if first is None or not first.rest:
        return 0
    if second is None:
        return 16 * bool(first.colon or b"|" in first.rest)
    if first.colon:
        return 16
    for base in _BASES:
        size = _number(second.offset, base) - _number(first.offset, base)
        if any(len(digits) == 2 * size > 0 for digits in first.digits()):
            return base
    return 0


def _number(offset: bytes, base: int) -> int:
    try:
        return int(offset, base)
    except ValueError:
        return -(2**70)


def _from_dump(lines: list[bytes], base: int) -> Text:
    """The bytes of a dump: each line must have as many as the next offset counts."""
    what, found, latest = "hexadecimal dump with offsets", bytearray(), None
    start, is_same = 0, False
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.strip() == _SAME:
            is_same |= bool(line.strip())
            continue
        here = _parsed(number, line)
        if here is None or _is_swapped(here):
            must = "begin with an offset, then have bytes one by one or as xxd writes them"
            return Text(b"", what, _stopped(number, line, must))
        at = _number(here.offset, base)
        if latest is None:
            start = at
        elif fault := _take(found, latest, at - start - len(found), is_same):
            return Text(b"", what, fault)
        latest, is_same = here, False
    if latest is not None and latest.rest:
        fault = _take(found, latest, None, is_same=False)
        return Text(bytes(found) * (not fault), what, fault)
    return Text(bytes(found), what)


def _is_swapped(line: _Line) -> bool:
    """Whether words of several bytes may be in the order of the machine that wrote them."""
    word = re.split(rb"\s", line.rest)[0]
    return len(word) in ((8, 16) if line.colon else (4, 8, 16))


def _take(found: bytearray, line: _Line, size: int | None, is_same: bool) -> str:
    """Add the bytes of a line, again up to a size if they are the same; else why they are none."""
    for digits in line.digits():
        whole = len(digits) // 2
        does_fit = size in (None, whole) or (is_same and whole and 0 < (size or 0) <= _MOST_SAME)
        if digits and len(digits) % 2 == 0 and does_fit:
            data = bytes.fromhex(digits.decode("ascii"))
            found += data if size in (None, whole) else (data * (size // whole + 1))[:size]
            return ""
    expected = "whole bytes" if size is None else f"{size} bytes, as the next offset counts"
    return _stopped(line.number, line.line, f"have {expected}")
