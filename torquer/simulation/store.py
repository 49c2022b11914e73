"""Where the pieces of a run are kept: in memory, or appended to a file as they are completed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from torquer.simulation.result import INTERRUPTED, of_the_whole, part_of, save, with_state
from torquer.simulation.run import Run

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
        self.parts.append(part_of(run))

    def result(self, run: Run, how: str, ended: str) -> xr.Dataset:
        """The whole of what was computed."""
        parts = [*self.parts, part_of(run)]
        if len(parts) > 1:
            import xarray as xr

            known = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
            parts = [xr.concat(parts, "time", join="override", combine_attrs="override", **known)]
        return with_state(parts[0], run, how, ended)


class InFile:
    """Appends the pieces to a file, which can be gone on from whenever the process ends."""

    def __init__(self, path: Path):
        self.path = path

    def keep(self, run: Run) -> None:
        """Write the run's piece, which is complete."""
        self._write(run, INTERRUPTED, f"interrupted at t = {run.now_s:g} s")

    def result(self, run: Run, how: str, ended: str) -> xr.Dataset:
        """Write what there is of the last piece; the result, read from the file if it is long."""
        part = self._write(run, how, ended)
        return part if run.piece.first == 0 else lazily(self.path)

    def _write(self, run: Run, how: str, ended: str) -> xr.Dataset:
        part = with_state(part_of(run), run, how, ended)
        if run.piece.first > 0:
            _append(part, self.path, run.first_row)
        else:
            grows = run.steps > run.piece.last
            save(part, self.path, _growing(part) if grows else None)
        return part


def lazily(path: Path) -> xr.Dataset:
    """A stored result whose numbers are read when they are asked for, and not kept in memory."""
    import xarray as xr

    return xr.open_dataset(path, engine="h5netcdf", cache=False)


def _growing(part: xr.Dataset) -> dict:
    """How a file that grows is written: time without an end, in chunks; its instants exact."""
    along = [name for name, values in part.variables.items() if "time" in values.dims]
    shapes = {name: part[name].shape[1:] for name in along}
    encoding = {name: {"chunksizes": (_CHUNK_ROWS, *shape)} for name, shape in shapes.items()}
    encoding["utc"] |= {"units": "nanoseconds since 1970-01-01", "dtype": "int64"}
    return {"unlimited_dims": ("time",), "encoding": encoding}


def _append(part: xr.Dataset, path: Path, first_row: int) -> None:
    """Write a part's rows at their place in a file, the state and attributes anew."""
    import h5netcdf

    end = first_row + part.sizes["time"]
    with h5netcdf.File(path, "r+") as file:
        file.resize_dimension("time", end)
        for name, values in part.variables.items():
            if "time" in values.dims:
                file.variables[name][first_row:end] = _stored(values)
        for name in of_the_whole(part):
            file.variables[name][...] = part[name].values
        for name, value in part.attrs.items():
            file.attrs[name] = value


def _stored(values: xr.Variable) -> np.ndarray:
    """Numbers as they stand in the file: instants in nanoseconds since 1970."""
    if values.dtype.kind == "M":
        return values.values.astype("datetime64[ns]").astype(np.int64)
    return values.values
