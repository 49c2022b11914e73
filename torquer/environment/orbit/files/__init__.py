"""Files of orbits: their formats, each told by how a file begins."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from torquer.environment.orbit.files.csv_rows import is_csv, read_csv
from torquer.environment.orbit.files.elements import ElementSet, are_elements, read_elements
from torquer.environment.orbit.files.naming import first_line
from torquer.environment.orbit.files.oem import is_oem, read_oem
from torquer.environment.orbit.files.omm import is_omm
from torquer.environment.orbit.files.sp3 import is_sp3, read_sp3
from torquer.environment.orbit.files.states import States, checked

#: What files may be, for messages.
FORMATS = "OEM or OMM of CCSDS, SP3, CSV with names of columns, or two-line elements"
#: Characters of a file's first line that messages show.
_SHOWN = 40


#: Formats, by how a file begins: two-line elements are told by any of their lines.
_READERS = (
    (is_oem, read_oem),
    (is_sp3, read_sp3),
    (are_elements, read_elements),
    (is_csv, read_csv),
)
Orbits = States | list[ElementSet]


class Asked(NamedTuple):
    """What a scenario says of a file: see `FileOrbit`."""

    satellite: str | None = None
    axes: str | None = None
    without_checksums: bool = False


def read_orbit_file(path: Path, asked: Asked) -> Orbits:
    """The `States` of a file, checked, or a list of elements; ValueError with line and reason.

    What was read last is kept: a file is read again when it has been written again.
    """
    try:
        status = path.stat()
        return _read(path, asked, status.st_mtime_ns, status.st_size)
    except OSError as error:
        raise ValueError(
            f"file: must be a file that can be read; received {path} ({error.strerror or error})"
        ) from None


def is_orbit_file(text: str) -> bool:
    """Whether a text begins as one of the formats."""
    return any(is_it(text) for is_it, _ in _READERS)


def in_file(name: str, fault: str) -> str:
    """A fault in a file, by the key `file`, with the file's name and line."""
    return f"file: {name}{' ' if fault.startswith('line ') else ': '}{fault}"


@lru_cache(maxsize=8)
def _read(path: Path, asked: Asked, *_) -> Orbits:
    try:
        return _parse(_text(path), asked)
    except ValueError as error:
        key, _, rest = str(error).partition(": ")
        if key in Asked._fields:
            raise ValueError(f"{key}: {rest} (file {path.name})") from None
        raise ValueError(in_file(path.name, str(error))) from None


def _text(path: Path) -> str:
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(
            f"line {line}: must be text in UTF-8; received {data[error.start : error.start + 4]!r}"
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _parse(text: str, asked: Asked) -> Orbits:
    read = _reader(text)
    if asked.without_checksums and (read is not read_elements or is_omm(text)):
        raise ValueError(
            "without_checksums: must be left out, as the file has no two-line elements; received "
            "true"
        )
    if asked.axes is not None and read is not read_csv:
        raise ValueError(f"axes: must be left out, as the file says them; received {asked.axes!r}")
    if read is read_elements:
        return read_elements(text, asked.satellite, asked.without_checksums)
    if read is not read_csv:
        return checked(read(text, asked.satellite))
    if asked.satellite is not None:
        raise ValueError(
            f"satellite: must be left out for a table of one; received {asked.satellite!r}"
        )
    return checked(read_csv(text, asked.axes))


def _reader(text: str) -> Callable:
    """The reader of a file's format."""
    for is_it, read in _READERS:
        if is_it(text):
            return read
    head = first_line(text)
    received = f"one that begins with {head[:_SHOWN]!r}" if head else "an empty file"
    raise ValueError(f"must be {FORMATS}; received {received}")
