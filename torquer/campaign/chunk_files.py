"""Files of chunks: numbers as they are in memory, as there are thousands of such files.

A NetCDF file takes fifty milliseconds to write and as many to read, however few members it has.
Here a line of JSON says what there is; the numbers follow, one variable after another, and the
digest that all results end with.
"""

import json
from pathlib import Path

import numpy as np
import xarray as xr

from torquer.simulation.results.file import Damaged, load_sealed, save_sealed

#: Ending of the files' names.
SUFFIX = ".members"
#: Kinds of numbers, texts and instants that a file may have; none is an object of Python.
_KINDS = "biufUM"


def save_chunk(data: xr.Dataset, path: Path) -> None:
    """Write members, of numbers, texts and instants; what stood there is replaced."""
    arrays = {str(name): each.values for name, each in data.variables.items()}
    said = {
        name: {
            "dims": data.variables[name].dims,
            "type": values.dtype.str,
            "shape": values.shape,
            "attributes": data.variables[name].attrs,
        }
        for name, values in arrays.items()
    }
    whole = {"variables": said, "coordinates": [*data.coords], "attributes": data.attrs}
    parts = [json.dumps(whole).encode(), b"\n", *(each.tobytes() for each in arrays.values())]
    save_sealed(b"".join(parts), path)


def load_chunk(path: Path) -> xr.Dataset:
    """Members of a file, in memory; `Damaged` for one that is not as it was written."""
    data = load_sealed(path)
    try:
        return _read(data)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise Damaged(
            f"result: must be a chunk of members; received {path} ({type(error).__name__}: {error})"
        ) from None


def _read(data: bytes) -> xr.Dataset:
    line, _, numbers = data.partition(b"\n")
    said = json.loads(line)
    variables, at = {}, 0
    for name, each in said["variables"].items():
        kind, shape = np.dtype(each["type"]), tuple(each["shape"])
        if kind.kind not in _KINDS:
            raise ValueError(f"{name!r} holds neither numbers nor texts")
        count = int(np.prod(shape))
        values = np.frombuffer(numbers, kind, count, at).reshape(shape).copy()
        variables[name] = (tuple(each["dims"]), values, each["attributes"])
        at += values.nbytes
    if at != len(numbers):
        raise ValueError("it has other numbers than it says")
    coordinates = {name: variables.pop(name) for name in said["coordinates"]}
    return xr.Dataset(variables, coordinates, said["attributes"])
