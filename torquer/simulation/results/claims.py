"""What an HDF5 file claims to hold, looked at before any of it is read.

A file of some kilobytes can claim terabytes: parts of an array that were never written, or that
compress well, or texts that all stand at one place, take no room in it. It can also name other
files as the places of its numbers. Torquer writes none of these.
"""

from __future__ import annotations

import math
import os
import struct
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    import h5py

#: Bytes of numbers and texts for each byte of a file: 1 as torquer writes them, more only if the
#: caller of `save` has asked for compression.
MOST_FOR_A_BYTE = 100
#: A text of any length, as it stands in an array: its length, where the letters stand.
_TEXT = struct.Struct("<I12x")


class Unbelievable(ValueError):
    """A claim that no file of torquer makes."""


def check_claims(file: h5py.File, raw: BinaryIO) -> None:
    """`Unbelievable` unless a file holds numbers and texts of its own, no more than fit into it.

    `raw`: the same file as bytes.
    """
    import h5py

    _check_attributes(file.attrs)
    left = MOST_FOR_A_BYTE * raw.seek(0, os.SEEK_END)
    for name in file:
        if not isinstance(file.get(name, getlink=True), h5py.HardLink):
            raise Unbelievable(f"{name!r} is a link")
        array = file[name]
        _check_array(name, array)
        _check_attributes(array.attrs)
        left -= _needed_bytes(array, raw)
        if left < 0:
            raise Unbelievable(f"{name!r} claims more than {MOST_FOR_A_BYTE} times its bytes")


def _check_array(name: str, array: h5py.Dataset) -> None:
    """`Unbelievable` unless it is an array of numbers or of texts, in this file."""
    import h5py

    if not isinstance(array, h5py.Dataset) or array.shape is None:
        raise Unbelievable(f"{name!r} is no array")
    if array.is_virtual or array.external:
        raise Unbelievable(f"{name!r} stands in other files")
    if h5py.check_string_dtype(array.dtype) is None and array.dtype.kind not in "biuf":
        raise Unbelievable(f"{name!r} holds neither numbers nor texts")


def _check_attributes(attributes: h5py.AttributeManager) -> None:
    """`Unbelievable` for a list of more texts than may be as long as the whole file together."""
    import h5py

    for name in attributes:
        found = attributes.get_id(name)
        texts = math.prod(found.shape) if h5py.check_string_dtype(found.dtype) else 0
        if texts > MOST_FOR_A_BYTE:
            raise Unbelievable(f"{name!r} is a list of {texts} texts")


def _needed_bytes(array: h5py.Dataset, raw: BinaryIO) -> int:
    """What an array takes in memory, or a piece of it while it is read if that is more."""
    cells = max(math.prod(array.shape), math.prod(array.chunks or ()))
    letters = _count_letters(array, raw) if array.dtype.kind == "O" else 0
    return cells * array.dtype.itemsize + letters


def _count_letters(array: h5py.Dataset, raw: BinaryIO) -> int:
    """Letters of all texts of an array, by the lengths that stand in it."""
    stored = array.id.get_storage_size()
    if array.compression or stored % _TEXT.size:
        raise Unbelievable(f"{array.name!r} holds texts in a form that torquer does not write")
    if array.chunks:
        count = array.id.get_num_chunks()
        places = (array.id.get_chunk_info(k).chunk_offset for k in range(count))
        pieces = [array.id.read_direct_chunk(place)[1] for place in places]
    elif (place := array.id.get_offset()) is not None:
        raw.seek(place)
        pieces = [raw.read(stored)]
    else:  # nothing was written
        pieces = []
    return sum(length for piece in pieces for (length,) in _TEXT.iter_unpack(piece))
