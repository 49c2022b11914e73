"""Results read back from a file, or from the folder of a command."""

import pytest
import xarray as xr

import torquer


@pytest.mark.parametrize("name", ["result.nc", "campaign.nc"])
def test_a_result_is_found_in_the_folder_of_its_command(tmp_path, name):
    result = xr.Dataset({"rate": ("time", [1.0, 0.5])}, attrs={"name": "tip-off"})
    torquer.save(result, tmp_path / name)
    for path in (tmp_path, str(tmp_path), tmp_path / name):
        assert torquer.load(path).identical(result)


def test_a_folder_without_a_result_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"path: must hold result\.nc or campaign\.nc; received"):
        torquer.load(tmp_path)


def test_of_two_results_in_a_folder_none_is_chosen(tmp_path):
    for name in ("result.nc", "campaign.nc"):
        torquer.save(xr.Dataset({"rate": ("time", [1.0])}), tmp_path / name)
    with pytest.raises(ValueError, match=r"result\.nc or campaign\.nc; .*, a folder with both$"):
        torquer.load(tmp_path)
