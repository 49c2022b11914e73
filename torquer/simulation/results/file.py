"""Results as NetCDF files: written whole or not at all, believed only as they were written.

A file ends with a digest of all before it, which NetCDF and HDF5 do not read. It is compared
before HDF5 sees the file: HDF5 ends the process on some damaged files, and on a full disk. So
files are also built in memory, and what grows has its place on the disk before it grows.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import io
import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from torquer.base.replaced_files import replacing, to_disk
from torquer.simulation.results.claims import Unbelievable, check_claims
from torquer.simulation.setup.signals import noted_signals

if TYPE_CHECKING:
    import xarray as xr

_SEAL = b"\nsha256 of the above, by torquer: "
_SEAL_BYTES = len(_SEAL) + 64
_BLOCK = 1 << 22
#: What a stored result takes in addition to its numbers, with a margin [bytes].
OVERHEAD = 1 << 20


class Damaged(ValueError):
    """A file that is not as it was written."""


class NotStorable(ValueError):
    """A result that NetCDF does not take, for a name or a text in it."""


def save(result: xr.Dataset, path, how: dict | None = None) -> None:
    """Write a result as NetCDF; what stood there before is replaced when all is written.

    `how`: more arguments of `xarray.Dataset.to_netcdf`.

        >>> torquer.save(result, "run.nc")
    """
    save_sealed(in_bytes(result, how), path)


def in_bytes(result: xr.Dataset, how: dict | None = None) -> memoryview:
    """A result as NetCDF; NotStorable for one that NetCDF does not take."""
    from h5netcdf import CompatibilityError

    from torquer.simulation.results.netcdf import write_bytes

    try:
        return write_bytes(result, **(how or {}))
    except (TypeError, ValueError, RuntimeError, CompatibilityError) as error:
        reason = str(error).partition("\n")[0]
        raise NotStorable(f"result: must be what NetCDF can store; received: {reason}") from error


def save_sealed(data: bytes | memoryview, path) -> None:
    """Write bytes and their digest; what stood there before is replaced when all is written."""
    with (
        noted_signals().writing(),
        replacing(Path(path)) as unfinished,
        unfinished.open("wb") as file,
    ):
        file.write(data)
        file.write(_SEAL + hashlib.sha256(data).hexdigest().encode())
        to_disk(file)


#: Names under which commands write their results into a folder.
IN_FOLDER = ("result.nc", "campaign.nc")


def load(path) -> xr.Dataset:
    """Read a result back, from a file or from a folder in which a command has written one.

    ValueError for a file that is not as it was written, and for a folder without a result or with
    two.

        >>> torquer.save(result, "run.nc")
        >>> torquer.load("run.nc").identical(result)
        True
    """
    from torquer.simulation.results import netcdf

    path = _in_folder(Path(path))
    check(path)
    with _read(path):
        data = io.BytesIO(path.read_bytes())
        _check_claims(data, data)
        return netcdf.read(data)


def _in_folder(path: Path) -> Path:
    """The only result in a folder; any other path as it is."""
    if not path.is_dir():
        return path
    found = [path / name for name in IN_FOLDER if (path / name).exists()]
    if len(found) != 1:
        there = "both" if found else "none"
        raise ValueError(
            f"path: must hold {' or '.join(IN_FOLDER)}; received {path}, a folder with {there}"
        )
    return found[0]


def lazily(path) -> xr.Dataset:
    """A stored result whose numbers are read when they are asked for, and not kept in memory."""
    from torquer.simulation.results import netcdf

    path = _in_folder(Path(path))
    check(path)
    with _read(path):
        with path.open("rb") as raw:
            _check_claims(path, raw)
        return netcdf.view(path)


def load_sealed(path) -> bytes:
    """The bytes of a file without their digest; `Damaged` if it is not as it was written."""
    check(path)
    return Path(path).read_bytes()[:-_SEAL_BYTES]


def check(path) -> None:
    """Raise `Damaged` unless a file is as it was written; reads all of it."""
    path = Path(path)
    if path.exists() and not path.is_file():  # reading a pipe or a device may have no end
        raise Damaged(f"result: must be a file; received {path}")
    with path.open("rb") as file:
        _check(path, file, path.stat().st_size)


def _check_claims(path, raw: BinaryIO) -> None:
    import h5py

    with h5py.File(path) as file:
        check_claims(file, raw)


def read_attributes(path) -> dict:
    """What a stored result says of itself, without its numbers."""
    import h5py

    check(path)
    with _read(path), h5py.File(path) as file:
        return dict(file.attrs)


@contextlib.contextmanager
def _read(path: Path):
    """Within the block, what HDF5 says of a file that it cannot read becomes one line.

    The digest does not exclude such files: whoever edits one on purpose can compute it again.
    """
    try:
        yield
    except Unbelievable as error:
        raise Damaged(
            f"result: must hold numbers and texts as torquer writes them; received {path}, in "
            f"which {error}"
        ) from None
    except (
        OSError, ValueError, KeyError, TypeError, AttributeError, RuntimeError, MemoryError
    ) as error:  # fmt: skip
        raise Damaged(
            f"result: must be readable NetCDF; received {path} ({_reason(error)})"
        ) from None


@contextlib.contextmanager
def explain_errors(path):
    """Within the block, an error about what a file lacks or holds becomes one line that names it.

    What torquer wrote lacks nothing; what others have changed may.
    """
    try:
        yield
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        raise Damaged(
            f"result: must hold what torquer writes; received {path} ({_reason(error)})"
        ) from error


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def join(first, others: Iterable, grow) -> None:
    """Append files to the first one, which is replaced when all is done.

    `grow(path, part)` appends the dataset of a file; the disk has room for it then.
    """
    first, others = Path(first), list(others)
    with noted_signals().writing(), replacing(first) as unfinished:
        shutil.copyfile(first, unfinished)
        room = sum(other.stat().st_size + OVERHEAD for other in others)
        with unfinished.open("r+b") as file:
            _reserve(file, unfinished.stat().st_size, room)
        for other in others:
            grow(unfinished, load(other))
        _seal(unfinished)


def save_in_parts(first: xr.Dataset, others: Iterable, path, how: dict, grow, times: float) -> None:
    """Write a result part by part, of which one is in memory at a time; all of it or nothing.

    `how`: the first part is written so; `grow(path, part)` appends one; `times`: by how much the
    whole is longer than the first, for which the disk has room before it grows.
    """
    with replacing(Path(path)) as unfinished:
        save(first, unfinished, how)
        size = unfinished.stat().st_size
        with unfinished.open("r+b") as file:
            _reserve(file, size, int(size * times) + OVERHEAD)
        for part in others:
            grow(unfinished, part)
        _seal(unfinished)


def put(path, data: str | bytes | memoryview) -> Path:
    """Write a file whole; what stood there is replaced, also a symbolic link, never followed."""
    path = Path(path)
    with replacing(path) as unfinished:
        unfinished.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


def own_folder(path) -> Path:
    """Make a folder for output unless it is there; OSError for a symbolic link to another one."""
    path = Path(path)
    if path.is_symlink():
        raise NotADirectoryError(errno.ENOTDIR, f"{path.name} is a symbolic link", str(path))
    path.mkdir(parents=True, exist_ok=True)
    return path


def _seal(path: Path) -> None:
    """Write the digest of all that HDF5 left in a file behind it."""
    with path.open("r+b") as file:
        digest = _digest_file(file, path.stat().st_size)
        file.seek(0, os.SEEK_END)
        file.write(_SEAL + digest)
        to_disk(file)


def _check(path: Path, file: BinaryIO, size: int) -> None:
    length = size - _SEAL_BYTES
    if length > 0:
        file.seek(length)
        seal = file.read()
        file.seek(0)
        if seal.startswith(_SEAL) and seal == _SEAL + _digest_file(file, length):
            return
    raise Damaged(f"result: must be as torquer wrote it; received {path}, damaged or edited since")


def _digest_file(file: BinaryIO, length: int) -> bytes:
    digest, left = hashlib.sha256(), length
    while left > 0 and (block := file.read(min(_BLOCK, left))):
        digest.update(block)
        left -= len(block)
    return digest.hexdigest().encode()


def _reserve(file: BinaryIO, size: int, room: int) -> None:
    """OSError unless the disk has room behind a file's end."""
    if hasattr(os, "posix_fallocate"):  # not on Windows
        os.posix_fallocate(file.fileno(), size, room)
