"""Datasets as NetCDF, through HDF5 files that look each of their objects up once.

h5netcdf looks an object up at every access, some forty times for each variable, which took half of
the time of writing or reading a file. Import this module where it is needed: it is slow to load.
"""

import io

import h5netcdf
import h5py
import xarray as xr
from xarray.backends import CachingFileManager, H5NetCDFStore


class _File(h5py.File):
    """An HDF5 file that keeps the objects that were found in it by their names."""

    def __init__(self, *args, **kwargs):
        self._found = {}
        super().__init__(*args, **kwargs)

    def __getitem__(self, name):
        if name == "/":
            return self
        if not isinstance(name, str):  # a reference
            return super().__getitem__(name)
        if name not in self._found:
            self._found[name] = super().__getitem__(name)
        return self._found[name]

    def __delitem__(self, name):
        self._found.clear()
        super().__delitem__(name)


def read(source) -> xr.Dataset:
    """The dataset in a file, given by its path or as a file of bytes; all numbers in memory."""
    with _File(source) as file:
        return xr.load_dataset(file, engine="h5netcdf")


def _open_file(path: str, mode: str) -> h5netcdf.File:
    """A NetCDF file; its HDF5 file is closed when nothing refers to it any more."""
    return h5netcdf.File(_File(path, mode), mode, decode_vlen_strings=True)


def view(path) -> xr.Dataset:
    """The dataset in a file; its numbers are read when they are asked for, and not kept."""
    manager = CachingFileManager(_open_file, str(path), mode="r")  # goes to other processes, too
    return xr.open_dataset(H5NetCDFStore(manager), cache=False)


def write_bytes(dataset: xr.Dataset, **how) -> memoryview:
    """The bytes of a NetCDF file; `how`: more arguments of `xarray.Dataset.to_netcdf`."""
    data = io.BytesIO()
    with _File(data, "w", track_order=True) as file:  # as h5netcdf makes files
        dataset.to_netcdf(file, engine="h5netcdf", **how)
    return data.getbuffer()
