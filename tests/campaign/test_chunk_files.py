"""Chunks as files: what was written comes back; what was not is one line."""

import hashlib

import numpy as np
import pytest
import xarray as xr
from artificial_campaign import artificial

from torquer.campaign.chunk_files import load_chunk, save_chunk
from torquer.simulation.results import file as files
from torquer.simulation.results.file import Damaged


@pytest.fixture
def path(tmp_path):
    return tmp_path / "000000000000.members"


@pytest.mark.parametrize("count", [1, 20])
def test_members_come_back_as_they_were(path, count):
    """With numbers, vectors, times, texts, signals, and what no number is."""
    whole = artificial(count, failed=[0])
    whole["odd"] = ("member", np.full(count, -0.0))
    whole["nan"] = ("member", np.full(count, 0x7FF8000000000123).view(np.float64))
    whole["held"] = ("member", np.arange(count) % 2 == 0, {"long_name": "\u00fcber\n"})
    whole["none"] = (("member", "nothing"), np.empty((count, 0)))
    save_chunk(whole, path)
    found = load_chunk(path)
    assert found.identical(whole)
    assert [*found.data_vars] == [*whole.data_vars] and [*found.coords] == [*whole.coords]
    for name, each in whole.variables.items():
        assert found[name].dtype == each.dtype
        assert found[name].values.tobytes() == each.values.tobytes(), name
        assert found[name].values.flags.writeable or name in whole.coords


def test_what_stood_there_is_replaced(path):
    for count in (20, 3):
        save_chunk(artificial(count), path)
        assert load_chunk(path).sizes["member"] == count
    assert [*path.parent.iterdir()] == [path]


def test_each_changed_byte_and_each_lost_end_is_found(path):
    save_chunk(artificial(3), path)
    data = path.read_bytes()
    for place in (0, 10, len(data) // 2, len(data) - 80, len(data) - 1):
        path.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
        with pytest.raises(Damaged, match="as torquer wrote it"):
            load_chunk(path)
        path.write_bytes(data[:place])
        with pytest.raises(Damaged, match="as torquer wrote it"):
            load_chunk(path)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('"<f8"', '"|O"'),
        ('"<f8"', '"<f4"'),
        ('"<f8"', '"nothing"'),
        ('"shape": [3]', '"shape": [300000000]'),
        ('"shape": [3]', '"shape": [-1]'),
        ('"shape": [3]', '"shape": ["a"]'),
        ('"coordinates": ["member"', '"coordinates": ["other"'),
        ('"dims": ["member"]', '"dims": ["x", "y"]'),
        ('{"variables"', '{"variable"'),
        ('{"variables"', '"variables"'),
    ],
)
def test_a_file_that_was_edited_with_its_digest_is_one_line(path, before, after):
    save_chunk(artificial(3), path)
    data = path.read_bytes()[: -files._SEAL_BYTES]
    assert before.encode() in data
    data = data.replace(before.encode(), after.encode())
    path.write_bytes(data + files._SEAL + hashlib.sha256(data).hexdigest().encode())
    with pytest.raises(Damaged, match=r"^result: must be a chunk of members; received ") as error:
        load_chunk(path)
    assert "\n" not in str(error.value)


def test_numbers_alone_make_no_chunk(path):
    xr.Dataset({"x": ("member", np.arange(3))}).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(Damaged):
        load_chunk(path)
