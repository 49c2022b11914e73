"""Files within files, and bytes as text: gzip, ZIP, encodings."""

from __future__ import annotations

import bz2
import codecs
import gzip
import lzma
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

#: First bytes of files that hold others, and what opens them.
PACKED = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
    b"PK\x03\x04": None,
}
#: Bytes that a packed file may have when unpacked.
MOST_BYTES = 4_000_000_000
_BLOCK = 1 << 20
#: Pairs of bytes that show an encoding without a mark.
_LEAST_PAIRS = 8
#: Marks at the beginning of a text that say how it is encoded; the longer ones first.
MARKS = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}


def is_packed(head: bytes) -> bool:
    """Whether the first bytes of a file are those of one that holds others."""
    return any(head.startswith(sign) for sign in PACKED)


@contextmanager
def unpacked(path: Path, member: str | None) -> Iterator[Path]:
    """The file that a packed one holds, in a folder that is removed after the block.

    `member`: its name in a ZIP that holds several. ValueError for a file that cannot be unpacked.
    """
    with path.open("rb") as file:
        head = file.read(8)
    opened = next(how for sign, how in PACKED.items() if head.startswith(sign))
    with TemporaryDirectory() as folder:
        out = Path(folder) / "unpacked"
        try:
            if opened is None:
                _from_zip(path, member, out)
            else:
                with opened(path, "rb") as file:
                    _copy(file, out, path)
        except (OSError, EOFError, zlib.error, lzma.LZMAError, zipfile.BadZipFile) as error:
            raise ValueError(
                f"FILE: must be a whole packed file; received {path}, which cannot be unpacked"
            ) from error
        yield out


def _from_zip(path: Path, member: str | None, out: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        names = [each.filename for each in archive.infolist() if not each.is_dir()]
        names = [each for each in names if not each.startswith("__MACOSX/")]
        if "[Content_Types].xml" in names:
            raise ValueError(
                f"FILE: must be text, such as a workbook exported as CSV; received {path}, a "
                "workbook"
            )
        if member is None and len(names) != 1:
            raise ValueError(
                f"member: must name a file of {path.name}: {', '.join(names[:20])}; received none"
            )
        if member is not None and member not in names:
            raise ValueError(f"member: must be one of {', '.join(names[:20])}; received {member!r}")
        found = archive.getinfo(member or names[0])
        if found.flag_bits & 1:
            raise ValueError(f"FILE: must be without a password; received {path}")
        with archive.open(found) as file:
            _copy(file, out, path)


def _copy(file, out: Path, path: Path) -> None:
    size = 0
    with out.open("wb") as written:
        while block := file.read(_BLOCK):
            size += len(block)
            if size > MOST_BYTES:
                raise ValueError(
                    f"FILE: must have at most {MOST_BYTES // 10**9} GB when unpacked; received "
                    f"{path}"
                )
            written.write(block)


def find_encoding(head: bytes) -> str | None:
    """The encoding that the first bytes of a text state or show; None if they do neither."""
    marked = next((name for mark, name in MARKS.items() if head.startswith(mark)), None)
    if marked is not None or b"\0" not in head:
        return marked
    pairs = len(head) // 2
    low, high = head[0 : 2 * pairs : 2], head[1 : 2 * pairs : 2]
    if pairs < _LEAST_PAIRS:
        return None
    if high.count(0) > 0.9 * pairs and not low.count(0):
        return "utf-16-le"
    if low.count(0) > 0.9 * pairs and not high.count(0):
        return "utf-16-be"
    return None


def decode(data: bytes, encoding: str | None, path: Path) -> str:
    """The text of bytes; ValueError, which names the key, for one of an encoding not known."""
    known = encoding or find_encoding(data[:4096]) or "utf-8"
    try:
        text = data.decode(known)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ValueError(
            "encoding: must be given for text that is not "
            f"{known.upper()}, such as 'latin-1', 'cp1252' or 'cp1251'; received "
            f"{encoding or 'none'} for {path.name}, byte 0x{data[error.start]:02x} in line {line}"
        ) from None
    text = text.removeprefix("\ufeff").replace("\0", "")
    return text.replace("\r\n", "\n").replace("\r", "\n")
