"""Files of orbits: their formats, each told by how a file begins."""

from functools import lru_cache
from pathlib import Path

from pydantic import ValidationError

from torquer.environment.orbit.files.csv_rows import is_csv, read_csv
from torquer.environment.orbit.files.elements import Elements, are_elements, read_elements
from torquer.environment.orbit.files.oem import is_oem, read_oem
from torquer.environment.orbit.files.sp3 import is_sp3, read_sp3
from torquer.environment.orbit.files.states import States, checked
from torquer.environment.orbit.sgp4 import Sgp4

#: What files may be, for messages.
FORMATS = "OEM or OMM of CCSDS, SP3, CSV, or two-line elements"


def read_orbit_file(path: Path, satellite: str | None, axes: str | None):
    """The `States` of a file, checked, or a list of `Sgp4`; ValueError with line and reason.

    What was read last is kept: a file is read again when it has been written again.
    """
    try:
        status = path.stat()
        return _read(path, satellite, axes, status.st_mtime_ns, status.st_size)
    except OSError as error:
        raise ValueError(
            f"file: must be a file that can be read; received {path} ({error.strerror or error})"
        ) from None


@lru_cache(maxsize=8)
def _read(path: Path, satellite: str | None, axes: str | None, *_) -> States | list[Sgp4]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"file: must be text in UTF-8; received {path}") from None
    try:
        return _parse(text, satellite, axes)
    except ValueError as error:
        key, _, rest = str(error).partition(": ")
        if key in ("satellite", "axes"):
            raise ValueError(f"{key}: {rest} (file {path.name})") from None
        raise ValueError(f"file: {path.name}: {error}") from None


def _sgp4(elements: Elements) -> Sgp4:
    try:
        return Sgp4(tle=elements.tle)
    except ValidationError as error:
        first = str(error.errors()[0].get("ctx", {}).get("error", error)).split("\n")[0]
        raise ValueError(f"line {elements.line}: {first}") from None


def _parse(text: str, satellite: str | None, axes: str | None) -> States | list[Sgp4]:
    if axes is not None and not is_csv(text):
        raise ValueError(f"axes: must be left out, as the file says them; received {axes!r}")
    if is_oem(text):
        return checked(read_oem(text, satellite))
    if is_sp3(text):
        return checked(read_sp3(text, satellite))
    if are_elements(text):
        return [_sgp4(each) for each in read_elements(text, satellite)]
    if is_csv(text):
        if satellite is not None:
            raise ValueError(
                f"satellite: must be left out for a table of one; received {satellite!r}"
            )
        return checked(read_csv(text, axes))
    raise ValueError(f"must be {FORMATS}; received another file")
