"""Where the pieces of a run are kept: in memory, or in files as the run goes on."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from torquer.simulation.results.dataset import (
    INTERRUPTED,
    STOPPED,
    record_dataset,
    whole_run_names,
    with_state,
)
from torquer.simulation.results.file import join, lazily, own_folder, read_attributes, save
from torquer.simulation.setup.run import Run

if TYPE_CHECKING:
    import xarray as xr

#: Rows of a chunk in a file that grows.
_CHUNK_ROWS = 4096


class InMemory:
    """Keeps the pieces as datasets; `earlier`: those before the run's present one, joined."""

    def __init__(self, earlier: xr.Dataset | None = None):
        self.parts = [] if earlier is None or earlier.sizes["time"] == 0 else [earlier]

    def keep(self, run: Run) -> None:
        """Keep the run's piece, which is complete."""
        self.parts.append(record_dataset(run))

    def checkpoint(self, run: Run) -> None:
        """Nothing: what is in memory is lost with the process in any case."""

    def result(self, run: Run, how: str, ended: str) -> xr.Dataset:
        """The whole of what was computed."""
        parts = self.parts if run.is_at_end else [*self.parts, record_dataset(run)]
        if len(parts) > 1:
            import xarray as xr

            known = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
            joined = xr.concat(parts, "time", join="override", combine_attrs="override", **known)
            parts = [_believed_from_the_start(joined)]
        return with_state(parts[0], run, how, ended)


def _believed_from_the_start(data: xr.Dataset) -> xr.Dataset:
    """With the truth where the computer believed in it, before it was told of other models."""
    pairs = (("position_believed", "position_inertial"), ("b_believed", "b_inertial"))
    return data.assign({k: data[k].fillna(data[true]) for k, true in pairs if k in data})


class InFile:
    """Keeps the first piece in a file, later ones in files of a folder next to it until the end.

    Each of them is written whole and has the state at its end: the run can go on from the last
    one, however the process ended.
    """

    def __init__(self, path: Path):
        self.path = path

    def keep(self, run: Run) -> None:
        """Write the run's piece, complete or not."""
        self._write(run, INTERRUPTED, f"interrupted at t = {run.now_s:g} s")

    checkpoint = keep

    def result(self, run: Run, how: str, ended: str) -> xr.Dataset:
        """Write what there is of the last piece; the result, read from the file if it is long."""
        part = self._write(run, how, ended)
        if run.piece.first == 0:
            return part
        gather(self.path)
        return lazily(self.path)

    def _write(self, run: Run, how: str, ended: str) -> xr.Dataset:
        part = with_state(record_dataset(run), run, how, ended)
        path = self.path
        if run.piece.first > 0:
            path = parts_folder(self.path) / f"{run.first_row:012d}.nc"
            own_folder(path.parent)
        grows = run.steps > run.piece.last and run.piece.first == 0
        save(part, path, _growing(part) if grows else None)
        return part


def check_free(path: Path, key: str, ways_out: str) -> None:
    """ValueError where an unfinished run, or a file of unknown content, stands; `key` names it."""
    if not path.exists():
        return
    try:
        earlier = read_attributes(path)
    except (OSError, ValueError):
        raise ValueError(
            f"{key}: must hold no file that cannot be read; received {path}, damaged or not "
            f"written by torquer: {ways_out}"
        ) from None
    if earlier.get("how_it_ended") in (INTERRUPTED, STOPPED):
        raise ValueError(
            f"{key}: must hold no unfinished run; received {path} ({earlier['ended']}): {ways_out}"
        )


def parts_folder(path: Path) -> Path:
    """Folder of the pieces after the first of an unfinished run."""
    return path.with_name(path.name + ".parts")


def gather(path: Path) -> None:
    """Append the pieces after the first of an unfinished run to its file, if there are any."""
    folder = parts_folder(path)
    if not folder.is_dir():
        return
    if parts := sorted(folder.glob("*.nc")):  # none if the process ended as it wrote the first
        join(path, parts, _append)
    shutil.rmtree(folder)


def drop_parts(path: Path) -> None:
    """Remove what an earlier run has left in pieces."""
    if parts_folder(path).is_dir():
        shutil.rmtree(parts_folder(path))


def _growing(part: xr.Dataset) -> dict:
    """How a file that grows is written: time without an end, in chunks; its instants exact."""
    along = [name for name, values in part.variables.items() if "time" in values.dims]
    shapes = {name: part[name].shape[1:] for name in along}
    encoding = {name: {"chunksizes": (_CHUNK_ROWS, *shape)} for name, shape in shapes.items()}
    encoding["utc"] |= {"units": "nanoseconds since 1970-01-01", "dtype": "int64"}
    return {"unlimited_dims": ("time",), "encoding": encoding}


def _append(path: Path, part: xr.Dataset) -> None:
    """Write a part's rows at their place in a file, and replace the state and attributes."""
    import h5netcdf

    with h5netcdf.File(path, "r+") as file:
        first_row = int(np.searchsorted(file.variables["time"][:], part["time"].values[0]))
        end = first_row + part.sizes["time"]
        file.resize_dimension("time", end)
        for name, values in part.variables.items():
            if "time" in values.dims:
                file.variables[name][first_row:end] = _as_stored(values)
        for name in whole_run_names(part):
            file.variables[name][...] = part[name].values
        for name, value in part.attrs.items():
            file.attrs[name] = value


def _as_stored(values: xr.Variable) -> np.ndarray:
    """Numbers as they stand in the file: instants in nanoseconds since 1970."""
    if values.dtype.kind == "M":
        return values.values.astype("datetime64[ns]").astype(np.int64)
    return values.values
