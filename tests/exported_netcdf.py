"""An exported file of a packet, read for tests.

xarray opens a file whose time has no end by looking at all variables for each of them: 1.2 s for
the 47 of a packet of Chibis-M.
"""

import h5netcdf
import h5py
import xarray as xr


def read_exported(path) -> xr.Dataset:
    """What `xarray.open_dataset` gives, in memory."""
    with h5py.File(path, "r") as numbers, h5netcdf.File(numbers, "r") as file:
        variables = {}
        for name, each in file.variables.items():
            found = numbers[name]
            values = (found.asstr() if h5py.check_string_dtype(found.dtype) else found)[()]
            variables[name] = xr.Variable(each.dimensions, values, _plain(each.attrs))
        return xr.decode_cf(xr.Dataset(variables, attrs=_plain(file.attrs)))


def _plain(attributes) -> dict:
    return {key: attributes[key] for key in attributes}
