"""Files of members joined into one, block by block: memory holds one block, however many there are.

The file grows as blocks are appended. It takes its place when it is whole; until then nothing that
it is made of is removed.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np
import xarray as xr

from torquer.campaign.chunk_files import SUFFIX, load_chunk
from torquer.simulation.results.file import check, lazily, load, save, save_in_parts
from torquer.simulation.setup.signals import noted_signals

#: Members of a block, and of a chunk of a file that grows.
BLOCK, _CHUNK = 8192, 1024
#: Bytes of a file up to which it is read whole.
_SMALL = 1 << 24
_INSTANTS = {"units": "nanoseconds since 1970-01-01", "dtype": "int64"}


def numbers_in(file: Path) -> np.ndarray:
    """Numbers of the members of a file."""
    if file.suffix == SUFFIX:
        return load_chunk(file)["member"].values
    check(file)
    with h5py.File(file) as data:
        return data["member"][...].astype(np.int64)


def join_chunks(parts: Sequence[xr.Dataset], attributes: Mapping[str, str]) -> xr.Dataset:
    """Chunks as one dataset, in the order of the members."""
    whole = xr.concat(
        parts, "member", data_vars="minimal", coords="minimal", compat="override",
        join="override", combine_attrs="override",
    )  # fmt: skip
    return whole.assign_attrs(attributes)


def in_blocks(
    files: Sequence[Path], found: Sequence[np.ndarray], members: np.ndarray, attributes: Mapping
) -> Iterator[xr.Dataset]:
    """Members in the order of their numbers, `BLOCK` at a time, each from the first that has it.

    `found`: numbers of the members of each file. KeyboardInterrupt on a signal.
    """
    numbers, first = np.unique(np.concatenate(found), return_index=True)
    places = first[np.searchsorted(numbers, members)]
    source = np.repeat(np.arange(len(files)), [*map(len, found)])
    row = np.concatenate([np.arange(len(each)) for each in found])
    for k in range(0, len(members), BLOCK):
        if noted_signals().asked:
            raise KeyboardInterrupt
        at = places[k : k + BLOCK]
        parts = [_rows_of(files[n], row[at[source[at] == n]]) for n in np.unique(source[at])]
        joined = join_chunks(parts, attributes)
        yield joined.isel(member=np.argsort(joined["member"].values)).drop_encoding()


def _rows_of(file: Path, rows: np.ndarray) -> xr.Dataset:
    """Some members of a file, in memory."""
    if file.suffix == SUFFIX:
        return load_chunk(file).isel(member=rows)
    if file.stat().st_size <= _SMALL:
        return load(file).isel(member=rows)
    with lazily(file) as data:
        first, last = int(rows.min()), int(rows.max()) + 1
        return data.isel(member=slice(first, last)).load().isel(member=rows - first)


def write_blocks(blocks: Iterator[xr.Dataset], members: int, path: Path) -> xr.Dataset:
    """Write all members into one file; the whole, which is read from there if it is long."""
    first = next(blocks)
    if first.sizes["member"] == members:
        save(first, path)
        return first
    save_in_parts(first, blocks, path, _growing(first), _append, members / first.sizes["member"])
    return lazily(path)


def _growing(block: xr.Dataset) -> dict:
    """How a file that grows is written: members without an end, in chunks; instants exact."""
    encoding: dict = {}
    for name, each in block.variables.items():
        if "member" in each.dims:
            encoding[name] = {"chunksizes": (_CHUNK, *each.shape[1:])}
            encoding[name] |= _INSTANTS if each.dtype.kind == "M" else {}
    return {"unlimited_dims": ("member",), "encoding": encoding}


def _append(path: Path, block: xr.Dataset) -> None:
    """Write members behind those that a file has."""
    import h5netcdf

    with h5netcdf.File(path, "r+") as file:
        first = file.dimensions["member"].size
        file.resize_dimension("member", first + block.sizes["member"])
        for name, values in block.variables.items():
            if "member" in values.dims:
                file.variables[name][first:] = _as_stored(values.values)


def _as_stored(values: np.ndarray) -> np.ndarray:
    """Values as they stand in the file: instants in nanoseconds since 1970, texts as such."""
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64)
    if values.dtype.kind == "b":
        return values.astype(np.int8)
    return values if values.dtype.kind in "iuf" else values.astype(object)
