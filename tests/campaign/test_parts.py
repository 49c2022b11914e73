"""Campaigns flown in parts by several machines and joined: the campaign that is flown at once."""

import numpy as np
import pytest
import xarray as xr
from tip_off import SCENARIO, campaign

import torquer
from torquer.campaign import fly
from torquer.campaign.parts import Part, join_parts
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.results.file import save

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(fly, "CHUNK", 8)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The campaign at once, and the files of its three parts."""
    folder, scenario = tmp_path_factory.mktemp("parts"), scenario_from_text(SCENARIO)
    made = campaign(scenario)
    files = [folder / f"{k}.nc" for k in (1, 2, 3)]
    for k, file in enumerate(files, start=1):
        torquer.fly_campaign(scenario, made, to=file, part=(k, 3), workers=1)
    return torquer.fly_campaign(scenario, made, workers=1), files


@pytest.mark.parametrize("runs", [1, 2, 7, 128, 1000])
def test_parts_have_each_member_once(runs):
    for count in {1, 2, 3, runs}:
        parts = [Part(k + 1, count).members(runs) for k in range(count)]
        assert np.array_equal(np.concatenate(parts), np.arange(runs)) or count > runs


def test_joined_parts_are_the_campaign_in_whatever_order(flown, tmp_path):
    whole, files = flown
    assert torquer.join_parts(files).identical(whole)
    joined = torquer.join_parts([files[2], files[0], files[1]], tmp_path / "whole.nc")
    assert joined.identical(whole)
    assert torquer.load(tmp_path / "whole.nc").identical(whole)


def test_a_part_goes_on_and_a_joined_campaign_takes_more_runs(flown, tmp_path):
    _, files = flown
    scenario = scenario_from_text(SCENARIO)
    path = tmp_path / "one.nc"
    told = []
    for _ in range(2):
        torquer.fly_campaign(scenario, campaign(scenario), to=path, part=(1, 3), resume=True,
                             progress=told.append)  # fmt: skip
    assert [each.runs for each in told] == [13, 13] and told[-1].done == 13
    joined = tmp_path / "joined.nc"
    torquer.join_parts([path, *files[1:]], joined)
    more = campaign(scenario, runs=48)
    grown = torquer.fly_campaign(scenario, more, to=joined, resume=True)
    assert grown.identical(torquer.fly_campaign(scenario, more))


@pytest.mark.parametrize("part", [(0, 3), (4, 3), (1, 41), (1,), (1, 2, 3), (True, 2), (1.0, 2)])
def test_a_part_that_there_is_not_is_refused(part):
    scenario = scenario_from_text(SCENARIO)
    with pytest.raises(ValueError, match=r"^part: must be K/N with 1 <= K <= N <= 40 \(runs\); re"):
        torquer.fly_campaign(scenario, campaign(scenario), part=part)


def test_a_campaign_that_may_end_early_has_no_parts():
    scenario = scenario_from_text(SCENARIO)
    stop = {"outcome": "success", "half_width": 0.1}
    with pytest.raises(ValueError, match=r"^part: must not be given with campaign\.stop"):
        torquer.fly_campaign(scenario, campaign(scenario, stop=stop), part=(1, 2))


def edited(file, path, change):
    """The part of a file with a change."""
    data = torquer.load(file)
    save(change(data), path)
    return path


def with_attribute(key, value):
    return lambda data: data.assign_attrs({key: value})


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (with_attribute("scenario", "{}"), "whose scenario is another than that of "),
        (with_attribute("versions", "{}"), "whose versions is another"),
        (with_attribute("laws", "{}"), "whose laws is another"),
        (with_attribute("provenance", "{}"), "whose provenance is another"),
        (lambda data: data.drop_vars("coil_energy_j", errors="ignore").drop_vars("seed"),
         "whose variables or times are others"),
        (lambda data: data.assign_coords(time=data["time"] + 1.0), "whose variables or times are"),
        (lambda data: data.isel(member=slice(1, None)), "received 39, without 13"),
        (lambda data: data.assign_coords(member=data["member"] + 100), "received 40, without 13"),
        (lambda data: data.assign_coords(member=data["member"] - 13), "received 27, without 13"),
    ],
    ids=["scenario", "versions", "laws", "provenance", "variables", "times", "members", "beyond",
         "twice"],
)  # fmt: skip
def test_parts_that_do_not_fit_are_refused(flown, tmp_path, change, expected):
    _, files = flown
    other = edited(files[1], tmp_path / "other.nc", change)
    with pytest.raises(ValueError, match="files: must ") as error:
        join_parts([files[0], other, files[2]])
    assert expected in str(error.value) and "\n" not in str(error.value)


def test_parts_that_overlap_must_agree(flown, tmp_path):
    whole, files = flown
    assert join_parts([*files, files[1]]).identical(whole)

    def other(data: xr.Dataset) -> xr.Dataset:
        data["final_rate_deg_s"].values[2] += 1e-12
        return data

    with pytest.raises(ValueError, match=r"^files: must agree .* another member 15 in .*2"):
        join_parts([*files, edited(files[1], tmp_path / "other.nc", other)])


def test_what_is_no_part_gets_one_line(flown, tmp_path):
    _, files = flown
    for given, expected in (
        ([], "^files: must be one or more; received none"),
        (
            [files[0], tmp_path / "nothing.nc"],
            "^files: must be files that can be read; received ",
        ),
    ):
        with pytest.raises(ValueError, match=expected):
            join_parts(given)
    with pytest.raises(ValueError, match="to: must hold no campaign; received"):
        join_parts(files, files[0])
