"""NetCDF files through HDF5 files that keep what was found in them, against xarray's own."""

import io
import pickle
from copy import deepcopy

import h5py
import numpy as np
import pytest
import xarray as xr
from h5netcdf import CompatibilityError

import torquer
from torquer.simulation.results import netcdf

T_S = np.arange(5.0)
DATA = xr.Dataset(
    {
        "rate": (("time", "axis"), np.random.default_rng(1).normal(size=(5, 3)), {"units": "1/s"}),
        "count": ("time", np.arange(5)),
        "note": ("time", np.array(["a", "", "é", "中", "long" * 50])),
        "number": ((), 3.0),
    },
    {
        "time": T_S,
        "axis": list("xyz"),
        "utc": ("time", np.array("2012-03-04", "M8[ns]") + np.arange(5)),
    },
    {"name": "tip-off", "laws": ["a", "b"], "seed": 3},
)
GROWING = {"unlimited_dims": ("time",), "encoding": {"rate": {"chunksizes": (4, 3)}}}
WAYS = pytest.mark.parametrize("how", [{}, GROWING], ids=["fixed", "growing"])


def encodings(data):
    """How each variable stands in its file."""
    kept = {name: {**v.encoding, "source": None} for name, v in data.variables.items()}
    return str(kept | {"unlimited_dims": data.encoding.get("unlimited_dims")})


def test_the_bytes_are_those_of_xarray():
    assert netcdf.write_bytes(DATA) == DATA.to_netcdf(None, engine="h5netcdf")


@WAYS
def test_what_is_written_is_what_xarray_writes(how):
    """Files that grow have the same in another order of the disk."""
    ours = xr.load_dataset(netcdf.write_bytes(DATA, **deepcopy(how)), engine="h5netcdf")
    theirs = xr.load_dataset(
        DATA.to_netcdf(None, engine="h5netcdf", **deepcopy(how)), engine="h5netcdf"
    )
    assert ours.identical(theirs)
    assert encodings(ours) == encodings(theirs)


@WAYS
def test_what_is_read_is_what_xarray_reads(how, tmp_path):
    path = tmp_path / "data.nc"
    path.write_bytes(netcdf.write_bytes(DATA, **deepcopy(how)))
    theirs = xr.load_dataset(path, engine="h5netcdf")
    with netcdf.view(path) as seen:
        for read in (netcdf.read(path), netcdf.read(io.BytesIO(path.read_bytes())), seen):
            assert read.identical(theirs)
            assert encodings(read) == encodings(theirs)


@pytest.mark.parametrize(
    "data",
    [
        xr.Dataset({("a",): ("time", [1.0])}),
        xr.Dataset({3: ("time", [1.0])}),
        xr.Dataset({"a/b": ("time", [1.0])}),
        xr.Dataset(attrs={"": 1}),
        xr.Dataset(attrs={"limits": {"low": 1}}),
        xr.Dataset(attrs={"on": True}),
    ],
    ids=["tuple", "number", "slash", "no name", "table", "truth"],
)
def test_unstorable_data_are_refused_with_the_reason_of_xarray(data, tmp_path):
    with pytest.raises((TypeError, ValueError, CompatibilityError)) as theirs:
        data.to_netcdf(None, engine="h5netcdf")
    with pytest.raises(ValueError) as ours:
        torquer.save(data, tmp_path / "data.nc")
    reason = str(theirs.value).partition("\n")[0]
    assert str(ours.value) == f"result: must be what NetCDF can store; received: {reason}"
    assert not any(tmp_path.iterdir())


def test_growing_dimension_stays_unlimited_when_written_again():
    read = netcdf.read(io.BytesIO(netcdf.write_bytes(DATA, **deepcopy(GROWING))))
    again = netcdf.read(io.BytesIO(netcdf.write_bytes(read)))
    assert again.identical(read)
    assert again.encoding["unlimited_dims"] == {"time"}
    with pytest.warns(UserWarning, match="not part of current dataset dimensions"):
        first = netcdf.write_bytes(read.isel(time=0))
    assert netcdf.read(io.BytesIO(first)).identical(read.isel(time=0))


def test_view_reads_on_demand_and_passes_to_another_process(tmp_path):
    path = tmp_path / "data.nc"
    path.write_bytes(netcdf.write_bytes(DATA))
    with netcdf.view(path) as seen:
        with pytest.raises(OSError, match="already open"), h5py.File(path, "r+"):
            pass  # HDF5 refuses to write to what is open to be read
        assert np.array_equal(pickle.loads(pickle.dumps(seen))["rate"], DATA["rate"])
    h5py.File(path, "r+").close()  # closed with the dataset
