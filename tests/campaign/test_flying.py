"""Campaigns flown: the same bits wherever and in whatever parts, and nothing lost."""

import re
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from datetime import UTC, datetime

import numpy as np
import pytest
from tip_off import SCENARIO, TABLE, campaign

import torquer
from torquer.campaign import fleet, fly
from torquer.campaign.chunk_files import SUFFIX, save_chunk
from torquer.campaign.fly import OneByOne
from torquer.campaign.sampling import member_scenario
from torquer.campaign.store import chunks_folder, chunks_there, remove
from torquer.compile import engine
from torquer.scenario.change import with_values
from torquer.scenario.load import scenario_from_text
from torquer.simulation.setup import size
from torquer.simulation.setup.run import prepare

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(fly, "CHUNK", 8)


@pytest.fixture
def scenario():
    return scenario_from_text(SCENARIO)


@pytest.fixture(scope="module")
def whole():
    """The campaign of 40 members, flown at once."""
    scenario = scenario_from_text(SCENARIO)
    return torquer.fly_campaign(scenario, campaign(scenario), workers=1)


def test_a_member_alone_is_the_member_of_the_campaign(scenario, whole):
    made, result = campaign(scenario), whole
    assert result["member"].values.tolist() == list(range(40))
    assert set(result["how_it_ended"].values) == {"complete"}
    for member in (0, 9, 39):
        alone = torquer.simulate(member_scenario(scenario, made, member))
        rate = np.degrees(np.linalg.norm(alone["omega_body"].values, axis=1))
        assert result["final_rate_deg_s"].values[member] == rate[-1]
        assert result["coil_energy_j"].values[member] == float(alone["coil_energy"])
        series = result["series.final_rate_deg_s"].values[member]
        assert np.array_equal(series, rate.astype(np.float32))


def test_bits_do_not_depend_on_threads_or_chunks(scenario, whole, monkeypatch):
    made = campaign(scenario)
    assert torquer.fly_campaign(scenario, made, workers=1).identical(whole)
    assert torquer.fly_campaign(scenario, made, workers=3).identical(whole)
    monkeypatch.setattr(fly, "CHUNK", 40)
    assert torquer.fly_campaign(scenario, made, workers=2).identical(whole)


@pytest.mark.parametrize("workers", [1, 2])
def test_chunks_grow_while_they_are_quick_and_shrink_at_the_end(
    scenario, tmp_path, monkeypatch, workers
):
    """Whatever their sizes, the bits are those of chunks of one size; slow ones stay small."""
    made, path = campaign(scenario, runs=400), tmp_path / "campaign.nc"
    put, sizes = fly.put_chunk, []

    def noted(path, data):
        sizes.append(data.sizes["member"])
        put(path, data)

    monkeypatch.setattr(fly, "put_chunk", noted)
    monkeypatch.setattr(fly, "CHUNK_S", 1e6)
    monkeypatch.setattr(fly, "MOST", 64)
    grown = torquer.fly_campaign(scenario, made, to=path, workers=workers)
    assert sum(sizes) == 400 and sizes[0] == 8 and max(sizes) == 64 and sizes[-1] == 8
    assert all(size % 8 == 0 for size in sizes) and len(sizes) < 30
    sizes.clear()
    monkeypatch.setattr(fly, "CHUNK_S", 0.0)
    even = torquer.fly_campaign(scenario, made, to=tmp_path / "even.nc", workers=workers)
    assert sizes == [8] * 50
    assert grown.identical(even)


def test_chunks_stay_short_where_few_may_be_enough(scenario, monkeypatch):
    """The last member is that of chunks of one size; not many more are flown than needed."""
    monkeypatch.setattr(fly, "CHUNK_S", 1e6)
    stop = {"outcome": "coil_energy_j", "half_width": 1e9, "least": 30}
    made, told = campaign(scenario, runs=4000, stop=stop), []
    result = torquer.fly_campaign(scenario, made, workers=1, progress=told.append)
    assert result.sizes["member"] == 32 and told[-1].done <= 64


@pytest.mark.slow
def test_processes_give_the_same_bits(scenario):
    made = campaign(scenario, runs=16)
    here = torquer.fly_campaign(scenario, made)
    there = torquer.fly_campaign(scenario, made, workers=2, where="processes")
    assert there.identical(here)


class Mortal(ThreadPoolExecutor):
    """A pool that ends as one of processes does when the system kills a worker."""

    deaths = 0

    def __init__(self, workers, *how):
        super().__init__(workers)
        self.broken = False

    def submit(self, function, of, first, last):
        if self.broken:
            raise BrokenProcessPool
        if first == 16 and Mortal.deaths:
            Mortal.deaths -= 1
            self.broken = True
            return super().submit(self.die)
        return super().submit(function, of, first, last)

    def die(self):
        raise BrokenProcessPool


@pytest.mark.parametrize("deaths", [2, 3])
def test_a_campaign_goes_on_without_a_worker_that_died(
    scenario, whole, tmp_path, monkeypatch, deaths
):
    made, path = campaign(scenario), tmp_path / "campaign.nc"
    monkeypatch.setattr("torquer.campaign.executors.ProcessPoolExecutor", Mortal)
    monkeypatch.setattr(Mortal, "deaths", deaths)
    options = {"to": path, "where": "processes", "workers": 1}
    if deaths == 3:
        message = (
            r"^workers: must survive; received 3 that were killed, as by a lack of memory: take "
        )
        with pytest.raises(ValueError, match=message):
            torquer.fly_campaign(scenario, made, **options)
        assert len(chunks_there(path)) >= 2
        options["resume"] = True
    assert torquer.fly_campaign(scenario, made, **options).identical(whole)


def test_times_from_a_list_stay_times_in_processes(scenario):
    times = [datetime(2012, 3, day, tzinfo=UTC) for day in (4, 5)]
    made = campaign(scenario, runs=4, vary={"start": {"values": times}})
    there = torquer.fly_campaign(scenario, made, workers=1, where="processes")
    assert there["start"].dtype.kind == "M"
    assert there.identical(torquer.fly_campaign(scenario, made, workers=1))


@pytest.mark.parametrize("block", [8192, 2])
def test_times_that_vary_are_kept_in_the_file(scenario, tmp_path, monkeypatch, block):
    monkeypatch.setattr("torquer.campaign.joining.BLOCK", block)
    times = [datetime(2012, 3, 4, tzinfo=UTC), datetime(2012, 3, 5, tzinfo=UTC)]
    made = campaign(scenario, runs=4, vary={"start": {"uniform": times}})
    kept = torquer.fly_campaign(scenario, made, to=tmp_path / "campaign.nc", workers=1).load()
    alone = torquer.fly_campaign(scenario, made, workers=1)
    assert kept["start"].dtype.kind == "M"
    assert (kept["start"].values == alone["start"].values).all()
    more = campaign(scenario, runs=6, vary={"start": {"uniform": times}})
    options = {"to": tmp_path / "campaign.nc", "workers": 1, "resume": True}
    longer = torquer.fly_campaign(scenario, more, **options)
    assert longer.isel(member=slice(4))["start"].identical(kept["start"])


def interrupted(scenario, made, path, where="threads"):
    """Fly two or more chunks of eight members to a file; what is in them."""

    def impatient(progress):
        if progress.done >= 16:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        torquer.fly_campaign(scenario, made, to=path, workers=1, where=where, progress=impatient)
    there = [file.read_bytes() for file in chunks_there(path).values()]
    assert len(there) >= 2
    return there


@pytest.mark.parametrize("where", ["threads", "processes"])
def test_an_interrupted_campaign_goes_on_with_what_is_missing(scenario, whole, tmp_path, where):
    made, path = campaign(scenario), tmp_path / "campaign.nc"
    there = interrupted(scenario, made, path, where)
    flown = []
    resumed = torquer.fly_campaign(
        scenario, made, to=path, workers=1, resume=True, progress=flown.append
    )
    assert resumed.identical(whole)
    assert len(flown) == 5 - len(there)
    assert torquer.load(path).identical(whole)
    assert not chunks_folder(path).exists()


@pytest.fixture
def begun(scenario, tmp_path):
    """The file of an interrupted campaign, the campaign, the files of its chunks."""
    made, path = campaign(scenario), tmp_path / "campaign.nc"
    interrupted(scenario, made, path)
    return path, made, list(chunks_there(path).values())


def test_a_chunk_that_goes_missing_is_counted_and_flown_again(scenario, whole, begun):
    path, made, (first, *_) = begun
    options = {"to": path, "workers": 1, "resume": True}
    message = (
        r"^to: must have all 40 members when they are joined; received 32, without 0 to 7, whose"
    )
    with pytest.raises(ValueError, match=message):
        torquer.fly_campaign(
            scenario, made, **options, progress=lambda _: first.unlink(missing_ok=True)
        )
    assert not path.exists()
    assert torquer.fly_campaign(scenario, made, **options).identical(whole)


def test_files_that_are_no_chunks_of_the_campaign_are_named(scenario, begun):
    path, made, (first, second, *_) = begun
    content = second.read_bytes()

    def refused(name, expected):
        file = chunks_folder(path) / name
        with pytest.raises(ValueError, match=expected.format(file=re.escape(str(file)))):
            torquer.fly_campaign(scenario, made, to=path, resume=True)
        file.unlink()

    second.rename(chunks_folder(path) / f"copy{SUFFIX}")
    only_its_own = r"^to: must have only its own chunks next to it, .*; received {file}: remove"
    refused(f"copy{SUFFIX}", only_its_own)
    (chunks_folder(path) / "000000000016.nc").write_bytes(content)
    refused("000000000016.nc", only_its_own)
    third = f"000000000016{SUFFIX}"
    (chunks_folder(path) / third).write_bytes(content)
    refused(third, r"^to: must have chunks .*; received {file} with 8 to 15$")
    save_chunk(torquer.simulate(scenario), second)
    refused(second.name, r"^to: must be the file of a campaign; received {file}$")
    save_chunk(torquer.fly_campaign(scenario, made).drop_vars("ended"), first)
    refused(first.name, r"^to: must be the file of a campaign; received {file} without ended$")
    other = scenario.replace("initial.reference", "orbital")
    save_chunk(torquer.fly_campaign(other, made), first)
    refused(first.name, r"^scenario: must be the one {file} was started with; received another$")


def test_runs_are_added_to_a_campaign(scenario, whole, tmp_path):
    path = tmp_path / "campaign.nc"
    torquer.fly_campaign(scenario, campaign(scenario, runs=13), to=path)
    more = torquer.fly_campaign(scenario, campaign(scenario), to=path, resume=True)
    assert more.identical(whole)


def test_what_stands_there_is_not_overwritten_nor_mixed(scenario, tmp_path):
    path = tmp_path / "campaign.nc"
    torquer.fly_campaign(scenario, campaign(scenario, runs=8), to=path)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"^to: must hold no campaign; received .*resume"):
        torquer.fly_campaign(scenario, campaign(scenario, runs=8), to=path)
    strict, vary = {"final_rate_deg_s": {"below": 0.1}}, dict(reversed(TABLE["vary"].items()))
    for key, other in (
        ("campaign.seed", (scenario, campaign(scenario, seed=6))),
        ("campaign.sampling", (scenario, campaign(scenario, sampling="sobol"))),
        ("campaign.success", (scenario, campaign(scenario, success=strict))),
        ("campaign.success", (scenario, campaign(scenario, success={}))),
        ("campaign.vary", (scenario, campaign(scenario, vary=vary))),
        ("scenario", (scenario.replace("initial.reference", "orbital"), campaign(scenario))),
    ):
        with pytest.raises(ValueError, match=rf"^{key}: must be the one .* was started with; rec"):
            torquer.fly_campaign(*other, to=path, resume=True)
    assert path.read_bytes() == before


def test_a_scenario_is_the_same_however_it_was_made(scenario, tmp_path):
    path = tmp_path / "campaign.nc"
    torquer.fly_campaign(scenario, campaign(scenario, runs=8), to=path)
    same = scenario.replace("initial.reference", "inertial").replace("description", "the same")
    more = torquer.fly_campaign(same, campaign(same, runs=9), to=path, resume=True)
    assert more.sizes["member"] == 9


def test_a_law_edited_since_is_refused(scenario, tmp_path):
    file, path = tmp_path / "laws.py", tmp_path / "campaign.nc"
    text = "def damp(inputs, parameters, memory):\n    return {}\n"
    law = {"kind": "user", "file": str(file), "function": "damp"}
    file.write_text(text.format("(0.1, 0.0, 0.0)"))
    own = scenario.replace("control.law", law)
    with pytest.warns(OneByOne, match="a law in plain Python"):
        torquer.fly_campaign(own, campaign(own, runs=1), to=path)
    file.write_text(text.format("(0.2, 0.0, 0.0)"))
    with pytest.raises(ValueError, match=r"^law damp: must be the one .* has been edited since$"):
        torquer.fly_campaign(own, campaign(own, runs=2), to=path, resume=True)


def test_campaign_cannot_resume_from_the_file_of_a_single_run(scenario, tmp_path):
    path = tmp_path / "result.nc"
    torquer.simulate(scenario, to=path)
    with pytest.raises(ValueError, match=r"^to: must be the file of a campaign; received "):
        torquer.fly_campaign(scenario, campaign(scenario, runs=2), to=path, resume=True)


def test_no_member_is_dropped_by_fewer_runs(scenario, tmp_path):
    path = tmp_path / "campaign.nc"
    there = len(interrupted(scenario, campaign(scenario), path)) * 8
    message = rf"^campaign.runs: must be {there} or more, as .* has so many members; received 13$"
    with pytest.raises(ValueError, match=message):
        torquer.fly_campaign(scenario, campaign(scenario, runs=13), to=path, resume=True)
    result = torquer.fly_campaign(scenario, campaign(scenario, runs=there), to=path, resume=True)
    assert result.sizes["member"] == there


@pytest.mark.parametrize("sampling", ["random", "sobol", "latin_hypercube"])
def test_runs_are_added_where_members_do_not_depend_on_them(scenario, tmp_path, sampling):
    """Of a Latin hypercube each member is drawn with all others."""
    path = tmp_path / "campaign.nc"
    torquer.fly_campaign(scenario, campaign(scenario, runs=8, sampling=sampling), to=path)
    before, more = path.read_bytes(), campaign(scenario, runs=16, sampling=sampling)
    if sampling == "latin_hypercube":
        message = r"^campaign.runs: must be 8, as when .* was started: a Latin hyper.* received 16$"
        with pytest.raises(ValueError, match=message):
            torquer.fly_campaign(scenario, more, to=path, resume=True)
        assert path.read_bytes() == before
    else:
        result = torquer.fly_campaign(scenario, more, to=path, resume=True)
        assert result.identical(torquer.fly_campaign(scenario, more))


def test_members_that_fail_are_kept_with_the_reason(scenario):
    torques = {"disturbance.constant_torque_n_m": {"values": [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]}}
    disturbed = scenario.replace("disturbance", {"constant_torque_n_m": [1e-6, 0.0, 0.0]})
    result = torquer.fly_campaign(disturbed, campaign(disturbed, runs=12, vary=torques))
    failed = result["how_it_ended"].values == "failed"
    strong = result["disturbance.constant_torque_n_m"].values[:, 0] > 0.0
    assert 0 < strong.sum() < 12 and np.array_equal(failed, strong)
    assert all("must be shorter for RK4" in text for text in result["ended"].values[failed])
    assert np.isnan(result["final_rate_deg_s"].values[failed]).all()
    assert not result["succeeded"].values[failed].any()


def test_texts_that_a_file_cannot_hold_are_stored_as_escapes(scenario, tmp_path, monkeypatch):
    """Among the values of a key, and in the reason why a member failed after all was checked."""
    monkeypatch.setattr(fly, "check_own_parts", lambda *_: None)
    file, path = tmp_path / "laws.py", tmp_path / "campaign.nc"
    file.write_text("def law(inputs, parameters, memory):\n    return 0.0, 0.0, 0.0\n")
    own = scenario.replace("control.law", {"kind": "user", "file": str(file), "function": "law"})
    vary = {"control.law.function": {"values": ["a\0b"]}}
    with pytest.warns(OneByOne):
        torquer.fly_campaign(own, campaign(own, runs=1, vary=vary), to=path)
    result = torquer.load(path)
    assert result["control.law.function"].values.tolist() == ["a\\x00b"]
    assert "must be defined in the file; received 'a\\x00b'" in result["ended"].values[0]


def test_hardware_varies_in_lanes_orbits_alone_with_the_same_result(scenario):
    vary = {
        "spacecraft.magnetometer.bias_nt": {"normal": {"mean": [0, 0, 0], "sigma": 500.0}},
        "control.law.gain_a_m2_s_per_t": {"log_uniform": [1e4, 1e6]},
    }
    for more in ({}, {"orbit.raan_deg": {"uniform": [0.0, 360.0]}}):
        made = campaign(scenario, runs=6, vary=vary | more)
        result = torquer.fly_campaign(scenario, made, workers=1)
        for member in (0, 5):
            alone = torquer.simulate(member_scenario(scenario, made, member))
            rate = np.degrees(np.linalg.norm(alone["omega_body"].values, axis=-1))[-1]
            assert result["final_rate_deg_s"].values[member] == rate


NOISE = "spacecraft.magnetometer.noise_nt"
GAIN = {"control.law.gain_a_m2_s_per_t": {"log_uniform": [1e4, 1e6]}}


@pytest.mark.parametrize(
    ("vary", "alone", "expected"),
    [
        (GAIN, 0, None),
        (GAIN | {"orbit.raan_deg": {"uniform": [0, 360]}}, 24, "orbit.raan_deg varies, and members "
         "flown together share orbit, environment, ephemeris and steps"),
        ({NOISE: {"uniform": [1, 9]}}, 24, f"{NOISE} varies, and members flown together share it"),
        ({NOISE: {"values": [0.0, 9.0]}}, 14, None),  # the others fit
    ],
)  # fmt: skip
def test_fit_is_reported_and_members_that_fit_are_prepared_at_once(
    scenario, monkeypatch, recwarn, vary, alone, expected
):
    made, prepared = campaign(scenario, runs=24, vary=vary), []
    monkeypatch.setattr(fleet, "prepare", lambda *a, **k: prepared.append(a) or prepare(*a, **k))
    flying = fleet.Fleet(scenario, made)
    assert flying.why_not_in_lanes == (expected or "")
    prepared.clear()
    flying.fly(np.arange(24))
    assert len(prepared) == alone
    torquer.fly_campaign(scenario, made)
    assert [expected in str(each.message) for each in recwarn if each.category is OneByOne] == (
        [True] if expected else []
    )


AXES = {
    f"{to}_deg": {"signal": {"axis": [0, 0, 1], "to": to}, "what": {"at_end": True}}
    for to in ("sun", "nadir", "orbit_normal", "field")
}


def test_outcomes_in_lanes_and_alone_have_the_same_bits(scenario):
    """Also angles to directions that are computed for all members at once."""
    made = campaign(scenario, runs=20, outcomes=AXES, success={})
    flying = fleet.Fleet(scenario, made)
    in_lanes = flying.fly(np.arange(20))
    flying._lanes = None
    alone = flying.fly(np.arange(20))
    for name in AXES:
        assert np.isfinite(in_lanes.outcomes[name]).all()
        assert np.array_equal(in_lanes.outcomes[name], alone.outcomes[name]), name


NOISY = {
    "spacecraft.magnetometer": {"noise_nt": 50.0, "resolution_nt": 20.0},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 1e-4},
    "spacecraft.attitude_sensor.noise_deg": 0.01,
    "control.sample_s": 10.0,
    "simulation": {"duration_s": 900.0, "record_s": 20.0},
}


def test_adaptive_steps_in_lanes_and_alone_have_the_same_bits(scenario, recwarn):
    """Of 64 members; in another order; in other chunks, by several workers."""
    adaptive = with_values(scenario, NOISY)
    made = campaign(adaptive, runs=64, vary=TABLE["vary"] | GAIN, outcomes=AXES, success={})
    flying = fleet.Fleet(adaptive, made)
    assert flying.why_not_in_lanes == ""
    members = np.arange(64)
    in_lanes, turned = flying.fly(members), flying.fly(members[::-1])
    flown = torquer.fly_campaign(adaptive, made, workers=3)
    flying._lanes = None
    alone = flying.fly(members)
    for kind in ("outcomes", "series"):
        for name, values in getattr(alone, kind).items():
            assert np.isfinite(values).all()
            assert np.array_equal(getattr(in_lanes, kind)[name], values), name
            assert np.array_equal(getattr(turned, kind)[name][::-1], values), name
            stored = flown[name if kind == "outcomes" else f"series.{name}"].values
            assert np.array_equal(stored, values), name
    assert not [each for each in recwarn if each.category is OneByOne]


def test_adaptive_steps_come_to_the_outcomes_of_short_fixed_ones(scenario):
    adaptive = with_values(scenario, {"simulation": NOISY["simulation"]})
    result = torquer.fly_campaign(adaptive, campaign(adaptive, runs=3))
    fixed = torquer.fly_campaign(scenario, campaign(scenario, runs=3))
    difference = result["final_rate_deg_s"] - fixed["final_rate_deg_s"]
    assert 0.0 < abs(difference).max() < 1e-4


def test_a_campaign_ends_when_it_knows_enough_however_many_workers(scenario):
    stop = {"outcome": "final_rate_deg_s", "half_width": 0.4, "least": 10}
    made = campaign(scenario, runs=400, stop=stop)
    one = torquer.fly_campaign(scenario, made, workers=1)
    assert 10 <= one.sizes["member"] < 400
    assert torquer.fly_campaign(scenario, made, workers=3).identical(one)


def test_a_resumed_campaign_ends_where_the_unbroken_one_does(scenario, tmp_path):
    path, stop = tmp_path / "campaign.nc", {"outcome": "success", "half_width": 0.12, "least": 10}
    made = campaign(scenario, runs=400, stop=stop)
    whole = torquer.fly_campaign(scenario, made, workers=1)
    assert 24 < whole.sizes["member"] < 400
    interrupted(scenario, made, path)
    assert torquer.fly_campaign(scenario, made, to=path, resume=True).identical(whole)
    flown = []
    again = torquer.fly_campaign(scenario, made, to=path, resume=True, progress=flown.append)
    assert again.identical(whole) and not flown


def test_wider_interval_drops_no_member_and_narrower_one_flies_on(scenario, tmp_path):
    path, stop = tmp_path / "campaign.nc", {"outcome": "success", "half_width": 0.2, "least": 10}
    first = torquer.fly_campaign(scenario, campaign(scenario, runs=400, stop=stop), to=path)
    wide = campaign(scenario, runs=400, stop=stop | {"half_width": 0.4})
    again = torquer.fly_campaign(scenario, wide, to=path, resume=True)
    assert again.sizes["member"] == first.sizes["member"]
    assert torquer.fly_campaign(scenario, wide).sizes["member"] < first.sizes["member"]
    narrow = campaign(scenario, runs=400, stop=stop | {"half_width": 0.12})
    more = torquer.fly_campaign(scenario, narrow, to=path, resume=True)
    assert more.identical(torquer.fly_campaign(scenario, narrow))


def test_campaigns_fly_checked_scenarios_only(scenario):
    made = campaign(scenario, runs=2)
    object.__setattr__(scenario.simulation, "record_s", -20.0)
    with pytest.raises(ValueError, match="greater than 0"):
        torquer.fly_campaign(scenario, made)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"workers": 0}, "workers: must be 1 or more; received 0"),
        ({"where": "elsewhere"}, "where: must be "),
    ],
)
def test_mistakes_are_reported(scenario, options, expected):
    with pytest.raises(ValueError, match=expected):
        torquer.fly_campaign(scenario, campaign(scenario, runs=2), **options)


def test_an_interrupted_campaign_on_dask_goes_on(scenario, tmp_path):
    distributed = pytest.importorskip("distributed")
    made, path = campaign(scenario), tmp_path / "campaign.nc"
    with distributed.LocalCluster(
        1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        interrupted(scenario, made, path, address)
        resumed = torquer.fly_campaign(scenario, made, to=path, where=address, resume=True)
    assert resumed.identical(torquer.fly_campaign(scenario, made))


def test_members_of_several_pieces_end_where_they_end_alone(scenario, monkeypatch):
    """Of 20 records each, the last one of fewer."""
    monkeypatch.setattr(size, "_PIECE_ROWS", 20)
    made = campaign(scenario, runs=3)
    assert prepare(scenario).piece_steps == 400
    result = torquer.fly_campaign(scenario, made)
    for member in range(3):
        alone = torquer.simulate(member_scenario(scenario, made, member))
        rate = np.degrees(np.linalg.norm(alone["omega_body"].values, axis=1))
        series = result["series.final_rate_deg_s"].values[member]
        assert np.array_equal(series, rate.astype(np.float32))
        assert result["final_rate_deg_s"].values[member] == rate[-1]


def test_what_is_there_of_a_campaign_is_removed(scenario, tmp_path):
    """Its chunks alone, its file alone, and nothing."""
    made, path = campaign(scenario), tmp_path / "campaign.nc"
    interrupted(scenario, made, path)
    remove(path)
    torquer.fly_campaign(scenario, made, to=path)
    for _ in range(2):
        remove(path)
        assert list(tmp_path.iterdir()) == []
