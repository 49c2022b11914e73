"""Files of members joined block by block: what all of them are at once, in bounded memory."""

import numpy as np
import pytest
import xarray as xr
from artificial_campaign import artificial
from memory_peak import peak_of

import torquer
from torquer.campaign import joining
from torquer.campaign.joining import in_blocks, numbers_in, write_blocks
from torquer.campaign.settling import settling
from torquer.campaign.summary import campaign_summary
from torquer.report.campaign import bands
from torquer.simulation.results.file import lazily, save
from torquer.simulation.setup.signals import noting_signals


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(joining, "BLOCK", 20)
    monkeypatch.setattr(joining, "_CHUNK", 8)


def chunks(data: xr.Dataset, folder, size: int = 7) -> list:
    """Files of neighbours, the last one of fewer."""
    files = []
    for first in range(0, data.sizes["member"], size):
        files.append(folder / f"{first:012d}.nc")
        save(data.isel(member=slice(first, first + size)), files[-1])
    return files


def joined(files, members, path) -> xr.Dataset:
    found = [*map(numbers_in, files)]
    attributes = torquer.load(files[0]).attrs
    return write_blocks(in_blocks(files, found, members, attributes), len(members), path)


@pytest.mark.parametrize("count", [5, 20, 21, 60])
def test_a_file_that_grew_is_the_one_written_at_once(tmp_path, count):
    """With numbers, vectors, times, texts, and signals; from files in any order."""
    whole, path = artificial(count, failed=[1, 3]), tmp_path / "campaign.nc"
    save(whole, tmp_path / "whole.nc")
    expected = torquer.load(tmp_path / "whole.nc")
    files = chunks(whole, tmp_path)
    for order in (files, files[::-1]):
        made = joined(order, np.arange(count), path)
        assert made.load().identical(expected)
        assert torquer.load(path).identical(expected)
        assert {name: each.dtype for name, each in torquer.load(path).items()} == {
            name: each.dtype for name, each in expected.items()
        }


def test_a_file_goes_on_with_what_it_has_first(tmp_path, monkeypatch):
    """One that grew before, too large to be read at once, and files with some of its members."""
    monkeypatch.setattr(joining, "_SMALL", 0)
    whole, path = artificial(60), tmp_path / "campaign.nc"
    joined(chunks(whole.isel(member=np.arange(0, 60, 2)), tmp_path), np.arange(0, 60, 2), path)
    other = whole.assign(final_rate_deg_s=whole["final_rate_deg_s"] + 1.0)
    grown = joined([path, *chunks(other, tmp_path)], np.arange(60), path).load()
    moved = grown["final_rate_deg_s"].values - whole["final_rate_deg_s"].values
    assert np.array_equal(moved > 0.5, np.arange(60) % 2 == 1)
    same = grown.drop_vars("final_rate_deg_s").identical(
        torquer.load(path).drop_vars("final_rate_deg_s")
    )
    assert same and grown["member"].values.tolist() == [*range(60)]


class Full(OSError):
    pass


def test_what_stands_there_stays_until_the_new_one_is_whole(tmp_path):
    files, path = chunks(artificial(60), tmp_path), tmp_path / "campaign.nc"
    path.write_bytes(b"earlier")

    def cut():
        blocks = in_blocks(files, [*map(numbers_in, files)], np.arange(60), {})
        yield next(blocks)
        yield next(blocks)
        raise Full

    with pytest.raises(Full):
        write_blocks(cut(), 60, path)
    assert path.read_bytes() == b"earlier"
    assert sorted(tmp_path.iterdir()) == sorted([*files, path])


def test_a_signal_ends_it_between_two_blocks(tmp_path):
    files, path = chunks(artificial(60), tmp_path), tmp_path / "campaign.nc"
    with noting_signals() as signals, pytest.raises(KeyboardInterrupt):
        signals.count = 1
        try:
            joined(files, np.arange(60), path)
        finally:
            signals.forget()
    assert not path.exists() and all(file.exists() for file in files)


def test_statistics_of_a_stored_campaign_are_those_in_memory(tmp_path, monkeypatch):
    """Whatever part of the signals is in memory at once."""
    whole, path = artificial(60, failed=[4]), tmp_path / "campaign.nc"
    expected = campaign_summary(whole)
    percentiles = bands.percentiles(whole["series.settling_s"].values)
    joined(chunks(whole, tmp_path), np.arange(60), path)
    monkeypatch.setattr("torquer.campaign.contents._BLOCK", 7)
    monkeypatch.setattr(bands, "_MOST", 60 * 3)
    stored = lazily(path)
    assert campaign_summary(stored) == expected
    assert settling(stored, "settling_s") == settling(whole, "settling_s") is not None
    variable, all_of_them = stored["series.settling_s"], np.arange(60)
    for instants in (np.arange(50), np.array([0, 1, 7, 20, 49]), np.array([49])):
        found = bands.bands_of(variable, all_of_them, instants)
        assert np.array_equal(found, percentiles[:, instants], equal_nan=True)


def test_memory_does_not_grow_with_the_number_of_members(tmp_path, monkeypatch):
    """Four times as many take some numbers each more; their signals would be 1.3 MB."""
    monkeypatch.setattr(joining, "BLOCK", 500)
    monkeypatch.setattr("torquer.simulation.results.file._BLOCK", 1 << 16)
    peaks = []
    for count in (2000, 8000):
        folder = tmp_path / str(count)
        folder.mkdir()
        files = chunks(artificial(count)[["settling_s", "series.settling_s", "ended"]], folder, 500)
        peaks.append(peak_of(lambda: joined(files, np.arange(count), folder / "all.nc")))  # noqa: B023
        assert (folder / "all.nc").stat().st_size > 200 * count
    assert peaks[1] < peaks[0] + 6e5, peaks
