"""Tables `[campaign]` as they are read: what is understood, and every mistake in one line."""

import copy
import json
import re
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st
from messages import message_of

import torquer
from torquer.campaign.load import campaign_from_data, check_campaign, load_campaign
from torquer.campaign.outcomes import DEFAULT
from torquer.campaign.sampling import draw
from torquer.campaign.spec import Campaign
from torquer.campaign.variation import Variation
from torquer.cli.commands import validate as cli
from torquer.scenario.load import ScenarioError, load_scenario, scenario_from_text

EXAMPLE = Path(__file__).parents[2] / "examples" / "chibis_m_detumble.toml"
TABLE = """
[campaign]
runs = 1000
seed = 7
sampling = "sobol"

[campaign.vary]
start = { uniform = [2012-03-04T00:00:00Z, 2012-03-05T00:00:00Z] }
initial.attitude = "uniform"
initial.rate_deg_s = { direction = "uniform", magnitude = { uniform = [1, 10] } }
spacecraft.body.inertia_kg_m2.relative = { uniform = [0.9, 1.1] }
spacecraft.magnetometer.noise_nt = { truncated_normal = { mean = 10, sigma = 5, low = 0 } }
"spacecraft.magnetometer.bias_nt" = { normal = { mean = [0, 0, 0], sigma = 50 } }
control.law.gain_a_m2_s_per_t = { log_uniform = [1e5, 1e7] }

[[campaign.correlated]]
keys = ["spacecraft.gyro.noise_deg_s", "environment.ut1_minus_utc_s"]
mean = [0.05, 0.0]
covariance = [[1e-6, 1e-6], [1e-6, 1e-4]]

[campaign.outcomes]
settling_s = { signal = "rate_deg_s", what = { settles_below = 0.3 } }
sun_deg = { signal = { axis = [0, 0, 1], to = "sun" }, what = { mean_after_s = 6000 } }
energy_j = { signal = "coil_energy_j" }

[campaign.success]
settling_s = { below = 20000 }

[campaign.stop]
outcome = "success"
half_width = 0.02
"""
SMALL = """
[campaign]
runs = 1000
vary."initial.attitude" = "uniform"
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "many.toml"
    path.write_text(EXAMPLE.read_text(encoding="utf-8") + TABLE, encoding="utf-8")
    return path


def test_a_file_gives_the_scenario_and_its_campaign(file):
    scenario, campaign = load_campaign(file)
    assert scenario == load_scenario(EXAMPLE).model_copy(update={"name": "many"})
    assert (campaign.runs, campaign.seed, campaign.sampling) == (1000, 7, "sobol")
    assert [*campaign.vary] == [
        "start",
        "initial.attitude",
        "initial.rate_deg_s",
        "spacecraft.body.inertia_kg_m2",
        "spacecraft.magnetometer.noise_nt",
        "spacecraft.magnetometer.bias_nt",
        "control.law.gain_a_m2_s_per_t",
    ]
    assert [*campaign.outcomes] == ["settling_s", "sun_deg", "energy_j"]
    assert campaign.stop.confidence == 0.95 and campaign.stop.least == 100


def test_a_single_run_takes_no_notice_of_the_campaign(file):
    assert load_scenario(file) == load_campaign(file)[0]
    assert torquer.scenario_from_text(file.read_text()) is not None


def test_a_campaign_survives_storage(file):
    scenario, campaign = load_campaign(file)
    again = Campaign.model_validate_json(campaign.model_dump_json())
    assert again == campaign
    for key, values in draw(campaign, scenario, range(5)).items():
        assert repr(draw(again, scenario, range(5))[key]) == repr(values)


def test_a_campaign_without_outcomes_has_the_default_ones():
    assert Campaign(runs=1).outcomes == Campaign(runs=1, outcomes={}).outcomes == DEFAULT


def test_a_grid_knows_its_runs():
    values = {"orbit.raan_deg": {"values": [0, 90]}, "spacecraft.x": Variation(values=(1, 2, 3))}
    assert Campaign(sampling="grid", vary=values).runs == 6
    assert Campaign(sampling="grid", vary=values, runs=6).runs == 6


def test_validate_checks_the_campaign_and_tells_of_it(file, capsys):
    assert cli.validate(file, json=False) == 0
    answer = capsys.readouterr().out
    assert "campaign: 1000 runs, sampling 'sobol'; varied: start, initial.attitude, " in answer
    assert cli.validate(file, json=True) == 0
    assert json.loads(capsys.readouterr().out)["campaign"]["runs"] == 1000
    file.write_text(file.read_text().replace("sigma = 50", "sigma = -50"))
    with pytest.raises(ScenarioError, match=r"bias_nt\".normal.sigma: must be greater than or"):
        cli.validate(file, json=False)
    assert load_scenario(file) is not None


def size_of(file, capsys) -> dict:
    assert cli.validate(file, json=True) == 0
    return json.loads(capsys.readouterr().out)["campaign_size"]


def test_validate_states_what_the_campaign_takes(file, capsys):
    """In words and as numbers; more members take more, longer ones no more memory."""
    assert cli.validate(file, json=False) == 0
    answer = capsys.readouterr().out
    line = next(line for line in answer.splitlines() if line.startswith("campaign: campaign.nc of"))
    assert re.search(r"[\d.]+ MB, twice while it is made; about [\d.]+ MB of memory and ", line)
    assert line.endswith("members one by one (start varies)")
    text = EXAMPLE.read_text(encoding="utf-8") + SMALL
    file.write_text(text, encoding="utf-8")
    first = size_of(file, capsys)
    assert first["why_alone"] == "" and first["runs"] == 1000
    file.write_text(text.replace("runs = 1000", "runs = 100000"), encoding="utf-8")
    more = size_of(file, capsys)
    assert more["disk_bytes"] == pytest.approx(100.0 * first["disk_bytes"])
    assert 20.0 < more["computing_s"] * more["workers"] / first["computing_s"] < 200.0
    assert first["memory_bytes"] < more["memory_bytes"] < 1e9
    long = text.replace("revolutions = 10", "revolutions = 1000")
    file.write_text(long, encoding="utf-8")
    longer = size_of(file, capsys)
    assert longer["computing_s"] > 20.0 * first["computing_s"]
    assert longer["disk_bytes"] == first["disk_bytes"] and longer["memory_bytes"] < 1e9


def test_validate_refuses_a_campaign_that_the_disk_has_no_room_for(file, capsys, monkeypatch):
    monkeypatch.setattr("torquer.campaign.room.free_disk", lambda folder: 1e6)
    message = r"^campaign.runs: 1000 members must fit in the 1 MB that are free here; received a "
    with pytest.raises(ValueError, match=message):
        cli.validate(file, json=False)
    assert cli.validate(file, json=True) == 2
    assert json.loads(capsys.readouterr().out)["valid"] is False


@pytest.mark.parametrize(
    ("key", "variation", "why"),
    [
        ("spacecraft.magnetometer.noise_nt", "{ uniform = [1.0, 9.0] }", True),
        ("spacecraft.coils.lag_s", "{ uniform = [0.1, 0.2] }", True),
        ("spacecraft.magnetometer.bias_nt", "{ normal = { mean = [0, 0, 0], sigma = 9 } }", False),
        ("initial.rate_deg_s", "{ uniform = [[0, 0, 0], [1, 1, 1]] }", False),
    ],
)
def test_validate_knows_of_keys_that_members_flown_together_share(
    file, capsys, key, variation, why
):
    text = EXAMPLE.read_text(encoding="utf-8") + SMALL
    file.write_text(f"{text}vary.{key!r} = {variation}\n", encoding="utf-8")
    assert size_of(file, capsys)["why_alone"] == (f"{key} varies" if why else "")


def test_a_campaign_that_the_disk_has_no_room_for_is_not_flown(tmp_path, monkeypatch):
    scenario, campaign = load_campaign(EXAMPLE.with_name("tip_off_campaign.toml"))
    monkeypatch.setattr("torquer.campaign.room.free_disk", lambda folder: 1e6)
    monkeypatch.setattr("torquer.campaign.fleet.Fleet.fly", None)
    message = r"^campaign.runs: 10000 members must fit in the 1 MB that are free at .*; received a "
    with pytest.raises(ValueError, match=message):
        torquer.fly_campaign(scenario, campaign, to=tmp_path / "campaign.nc")
    assert not any(tmp_path.iterdir())


def test_the_schema_lets_a_campaign_stand():
    assert torquer.scenario_schema()["properties"]["campaign"]["type"] == "object"


def test_a_file_without_a_campaign_is_reported():
    with pytest.raises(ScenarioError, match=r"^campaign: must be given, a table "):
        load_campaign(EXAMPLE)


@pytest.mark.parametrize("value", ["5", "[1]", "'x'"])
def test_a_campaign_is_a_table(value):
    text = f"campaign = {value}\n" + EXAMPLE.read_text(encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"^campaign: must be a table of keys; received "):
        scenario_from_text(text)


NOISE, BIAS = "spacecraft.magnetometer.noise_nt", "spacecraft.magnetometer.bias_nt"
#: (what varies, what is reported of it: after `campaign.vary`).
VARIED = [
    ({"orbit.raan": {"values": [1.0]}},
     '."orbit.raan": must be a known key; received 1.0 (did you mean raan_deg?)'),
    ({"orbit.raan.x": {"values": [1]}},
     '."orbit.raan.x": orbit.raan: must be a table to change a key in it; received no such key '
     "(did you mean raan_deg?)"),
    ({"spacecraft.wheels.lost": {"values": [[0]]}},
     '."spacecraft.wheels.lost": spacecraft.wheels: must be a table to change a key in it; '
     "received none: the whole of it must be given"),
    *(({key: {"values": [1]}}, f'.{json.dumps(key)}: must be a key of the scenario, written like '
       f"spacecraft.coils.limit_a_m2[0]; received {key!r}")
      for key in ("", "orbit..raan_deg", "orbit[raan_deg]", "orbit.raan_deg.", "orbit/raan_deg",
                  "control.law.parameters.a\0")),
    ({"seed": {"values": [1]}}, ".seed: must not vary: each member has its own; received seed"),
    ({"orbit": {"raan_deg": {"values": [1]}}, "orbit.raan_deg": {"values": [2]}},
     '."orbit.raan_deg": must be given once; received it twice'),
    ({"orbit.raan_deg": {"values": [1]}, "orbit": {"values": [{}]}},
     ".orbit: must not overlap with another key; received orbit.raan_deg, too"),
    ({"initial.attitude": "uniform", "initial.euler_deg": {"values": [[0, 0, 1]]}},
     '."initial.euler_deg": must not overlap with another key; received initial.attitude, too'),
    ({"initial.attitude": "normal"},
     '."initial.attitude": must be \'uniform\'; received \'normal\''),
    ({"initial.attitude": {"values": [1]}},
     '."initial.attitude": must be "uniform"; received values'),
    ({NOISE: "uniform"}, f'."{NOISE}": must be a table of a variation: only initial.attitude '
     'takes the word "uniform"; received "uniform"'),
    ({NOISE: 5}, f'."{NOISE}": must be a table of keys; received 5'),
    ({NOISE: {"unifrm": [1, 2]}},
     f'."{NOISE}".unifrm: must be a known key; received [1, 2] (did you mean uniform?)'),
    ({NOISE: {}}, f'."{NOISE}": must have one of values, uniform, log_uniform, normal, '
     "truncated_normal, quantiles, own, direction, relative, rotation; received none"),
    ({NOISE: {"values": [1], "uniform": [1, 2]}}, f'."{NOISE}": must have one of values, uniform, '
     "log_uniform, normal, truncated_normal, quantiles, own, direction, relative, rotation; "
     "received values and uniform"),
    ({NOISE: {"values": []}}, f'."{NOISE}".values: must have 1 or more values; received []'),
    ({NOISE: {"values": [1.0, "a"]}}, f'."{NOISE}": must be a number; received \'a\''),
    ({NOISE: {"uniform": 3}},
     f'."{NOISE}".uniform: must be a list of two, [low, high]; received 3'),
    ({NOISE: {"uniform": [3, 2]}},
     f'."{NOISE}".uniform: must have the lower bound first; received [3, 2]'),
    ({NOISE: {"uniform": [1, True]}}, f'."{NOISE}".uniform: must be numbers; received True'),
    ({BIAS: {"uniform": [[1, 2, 3], 4]}}, f'."{BIAS}".uniform: must have two numbers or two '
     "vectors of equal length; received [[1, 2, 3], 4]"),
    ({BIAS: {"log_uniform": [[], []]}}, f'."{BIAS}".log_uniform: must have two numbers or two '
     "vectors of equal length; received [[], []]"),
    ({"start": {"uniform": ["2012-01-01", "2013-01-01"]}}, ".start.uniform: must be a time with a "
     "zone, such as 2012-03-04T10:31:47Z; received '2012-01-01'"),
    ({"start": {"uniform": ["2013-01-01T00:00Z", "2012-01-01T00:00Z"]}}, ".start.uniform: must "
     "have the lower bound first; received ['2013-01-01T00:00Z', '2012-01-01T00:00Z']"),
    ({NOISE: {"log_uniform": [0, 2]}},
     f'."{NOISE}".log_uniform: must have bounds above 0; received [0, 2]'),
    ({NOISE: {"normal": {"mean": 1}}},
     f'."{NOISE}".normal.sigma: must be given; received nothing'),
    ({NOISE: {"normal": {"mean": "a", "sigma": 1}}},
     f'."{NOISE}".normal.mean: must be a number; received \'a\''),
    ({NOISE: {"normal": {"mean": 1, "sigma": -1}}},
     f'."{NOISE}".normal.sigma: must be greater than or equal to 0; received -1'),
    ({BIAS: {"normal": {"mean": [1, 2, 3], "sigma": [1, 2]}}}, f'."{BIAS}".normal.sigma: must be '
     "a number, or as long as the others; received vectors of 3 and 2 numbers"),
    ({NOISE: {"quantiles": [[0, 1]]}},
     f'."{NOISE}".quantiles: must be pairs [share, value], two or more; received [[0, 1]]'),
    ({NOISE: {"quantiles": [[0, 1], [0.9, 2]]}},
     f'."{NOISE}".quantiles: must have shares that rise from 0 to 1; received [0.0, 0.9]'),
    ({NOISE: {"quantiles": [[0, 1], [0, 3], [1, 4]]}},
     f'."{NOISE}".quantiles: must have shares that rise from 0 to 1; received [0.0, 0.0, 1.0]'),
    ({NOISE: {"quantiles": [[0, 1], [0.5, 3], [1, 2]]}},
     f'."{NOISE}".quantiles: must have values that do not fall; received [1.0, 3.0, 2.0]'),
    ({NOISE: {"truncated_normal": {"mean": 1, "sigma": 0, "low": 0}}},
     f'."{NOISE}".truncated_normal.sigma: must be greater than 0; received 0'),
    ({NOISE: {"truncated_normal": {"mean": 1, "sigma": 1}}}, f'."{NOISE}".truncated_normal: low, '
     "high: one of the two or both must be given; received none"),
    ({NOISE: {"truncated_normal": {"mean": 1, "sigma": 1, "low": 3, "high": 2}}},
     f'."{NOISE}".truncated_normal.low: must be below high, 2.0; received 3.0'),
    ({BIAS: {"direction": "uniform"}},
     f'."{BIAS}".magnitude: must be given for a vector; received none'),
    ({BIAS: {"direction": "up", "magnitude": 1}},
     f'."{BIAS}".direction: must be \'uniform\'; received \'up\''),
    ({BIAS: {"direction": "uniform", "magnitude": {"uniform": [[1, 2], [3, 4]]}}},
     f'."{BIAS}".magnitude: must vary a single number; received a vector'),
    ({BIAS: {"direction": "uniform", "magnitude": {"uniform": [-1, -2]}}},
     f'."{BIAS}".magnitude.uniform: must have the lower bound first; received [-1, -2]'),
    ({NOISE: {"relative": {"values": ["a"]}}},
     f'."{NOISE}".relative: must vary a single number; received values that are not numbers'),
    ({"spacecraft.body.mass_kg": {"relative": {"uniform": [0.5, 2]}}},
     '."spacecraft.body.mass_kg".relative: must apply to numbers that the scenario gives; '
     "received nothing"),
    ({"control.law.kind": {"relative": {"uniform": [0.5, 2]}}},
     '."control.law.kind".relative: must apply to numbers that the scenario gives; '
     "received 'off'"),
    # members that are no scenarios
    ({NOISE: {"uniform": [0, 2e12]}},
     f'."{NOISE}": must be at most 1e+12; received {{}}'),
    ({BIAS: {"uniform": [0, 1]}}, f'."{BIAS}": must be a list; received {{}}'),
    ({BIAS: {"uniform": [[0, 0], [1, 1]]}}, f'."{BIAS}": must have 3 values; received {{}}'),
    ({"initial": {"values": [{"rate_deg_s": [1]}]}},
     ".initial.rate_deg_s: must have 3 values; received [1]"),
    ({"simulation.record_s": {"values": [10.0, 1.5]}},
     '."simulation.record_s": must be a whole multiple of step_s = 1 s; received 1.5 s'),
    ({"simulation.step_s": {"values": [7.0]}}, ": members must be scenarios that can be flown; "
     "received control.sample_s: must be a whole multiple of step_s = 7 s; received 1 s"),
]  # fmt: skip


def message(table, scenario) -> str:
    """The message about a table of a campaign."""
    return message_of(campaign_from_data, table, scenario)


def test_a_mistake_in_what_varies_is_one_line(make):
    found = {line: message({"runs": 100, "vary": vary}, make()) for vary, line in VARIED}
    patterns = {line: re.escape(f"campaign.vary{line}").replace(r"\{\}", ".*") for line in found}
    wrong = {line: text for line, text in found.items() if not re.fullmatch(patterns[line], text)}
    assert wrong == {} and len(found) == len(VARIED)


def together(**changes):
    return {"correlated": [{"keys": [NOISE, "orbit.raan_deg"], "mean": [50, 0],
                            "covariance": [[1, 0], [0, 1]]} | changes]}  # fmt: skip


def changes(kinds, keys=None):
    size = sum({"vector": 3, "rotation": 3, "inertia": 6}.get(kind, 1) for kind in kinds)
    covariance = [[float(i == k) for i in range(size)] for k in range(size)]
    if keys is None:
        return together(mean=None, changes=kinds)
    return together(mean=None, keys=keys, changes=kinds, covariance=covariance)


OUTCOME = {"x": {"signal": "rate_deg_s", "what": {"at_end": True}}}
GRID = {"runs": None, "sampling": "grid", "vary": {NOISE: {"values": [1, 2]}}}
#: (keys of the table, what is reported: after `campaign`).
TABLES = [
    ({"runs": None}, ".runs: must be given; received nothing"),
    ({"runs": 0}, ".runs: must be greater than or equal to 1; received 0"),
    ({"runs": 10**9}, ".runs: must be less than or equal to 100000000; received 1000000000"),
    ({"runs": 1.5}, ".runs: must be a whole number; received 1.5"),
    ({"seed": -1}, ".seed: must be greater than or equal to 0; received -1"),
    ({"sampling": "halton"},
     ".sampling: must be 'random', 'latin_hypercube', 'sobol', 'saltelli' or 'grid'; "
     "received 'halton'"),
    ({"colour": 1}, ".colour: must be a known key; received 1 (known: runs, seed, sampling, vary, "
     "table, correlated, outcomes, success, stop)"),
    ({"vary": 5}, ".vary: must be a table of keys; received 5"),
    ({"sampling": "latin_hypercube", "runs": 10**8, "vary": {NOISE: {"uniform": [1, 2]}}},
     ".sampling: 'latin_hypercube' must have at most 5e+07 numbers in all; received 100000000 "
     "runs of 1"),
    # correlated
    (together(keys=[]), ".correlated[0].keys: must have 1 or more values; received []"),
    (together(mean=[1]), ".correlated[0].mean: must have a number for each of 2 keys; received 1"),
    (together(covariance=[[1, 0]]),
     ".correlated[0].covariance: must be 2 rows of 2; received [[1.0, 0.0]]"),
    (together(covariance=[[1, 0.5], [0, 1]]),
     ".correlated[0].covariance: must be symmetric; received [[1.0, 0.5], [0.0, 1.0]]"),
    (together(covariance=[[1, 2], [2, 1]]), ".correlated[0].covariance: must be positive "
     "semidefinite; received one with the eigenvalue -1"),
    (together(keys=[NOISE, NOISE]),
     f".correlated[0].keys[1]: must not overlap with another key; received {NOISE}, too"),
    (together(mean=[1, 0]), f'.correlated."{NOISE}": must be greater than or equal to 0; '
     "received {}"),
    # changes
    (together(mean=None), ".correlated[0]: mean, changes: one of the two must be given; "
     "received none"),
    (together(changes=["number", "number"]),
     ".correlated[0]: mean, changes: one of the two must be given; received both"),
    (changes(["number"]),
     ".correlated[0].changes: must have a word for each of 2 keys; received 1"),
    (changes(["number", "shift"]), ".correlated[0].changes[1]: must be 'number', 'vector', "
     "'factor', 'rotation' or 'inertia'; received 'shift'"),
    (changes(["number", "vector"]), ".correlated[0].covariance: must be 4 rows of 4; received "
     "[[1.0, 0.0], [0.0, 1.0]]"),
    (changes(["rotation"], keys=[NOISE]), ".correlated[0].changes[0]: must be 'rotation' for "
     f"initial.attitude, and for no other key; received 'rotation' for {NOISE}"),
    (changes(["inertia"], keys=["spacecraft.coils.axes"]), ".correlated[0].changes[0]: must be "
     "'inertia' for an inertia_kg_m2 alone; received 'inertia' for spacecraft.coils.axes"),
    (changes(["vector"], keys=[NOISE]), f'.correlated."{NOISE}": must have a value of shape (3,) '
     "for a change by 'vector'; received {}"),
    (changes(["number"], keys=["orbit.raan"]), '.correlated."orbit.raan": must apply to numbers '
     "that the scenario gives; received nothing"),
    ({"correlated": 2 * changes(["number", "number"])["correlated"]},
     ".correlated: must not have two tables with the same keys"),
    ({"vary": {NOISE: {"values": [1]}}} | changes(["number", "number"]),
     f".correlated[0].keys[0]: must not overlap with another key; received {NOISE}, too"),
    # grid
    (GRID | {"runs": 3}, ".runs: must be left out with sampling 'grid', or be its 2 "
     "combinations; received 3"),
    (GRID | {"vary": {NOISE: {"uniform": [1, 2]}}},
     f'.vary."{NOISE}": must be given by values with sampling \'grid\'; received uniform'),
    (GRID | together(keys=["a", "b"]), ".correlated: must be left out with sampling 'grid'"),
    (GRID | {"stop": {"outcome": "coil_energy_j", "half_width": 1}},
     ".stop: must be left out with sampling 'grid', which must be complete"),
    # outcomes, success, stop
    ({"outcomes": {"x": {"signal": "warp", "what": {"at_end": True}}}},
     ".outcomes.x.signal: must be 'rate_deg_s', 'rate_x_deg_s', 'rate_y_deg_s', 'rate_z_deg_s', "
     "'rate_fastest_axis_deg_s', 'rate_orbital_deg_s', 'attitude_error_deg', 'momentum_n_m_s', "
     "'wheel_momentum_n_m_s', 'coil_energy_j' or 'peak_dipole_a_m2'; received 'warp'"),
    ({"outcomes": {"x": {"signal": {"of_start": "coil_energy_j"}, "what": {"at_end": True}}}},
     ".outcomes.x.signal.of_start: must be 'rate_deg_s', 'rate_x_deg_s', 'rate_y_deg_s', "
     "'rate_z_deg_s', 'rate_fastest_axis_deg_s', 'rate_orbital_deg_s', 'attitude_error_deg', "
     "'momentum_n_m_s' or 'wheel_momentum_n_m_s'; received 'coil_energy_j'"),
    ({"outcomes": {"x": {"signal": {"axis": [0, 0, 1]}, "what": {"at_end": True}}}},
     ".outcomes.x.signal.to: must be given; received nothing"),
    ({"outcomes": {"x": {"signal": {"axis": [0, 0, 0], "to": "sun"}, "what": {"at_end": True}}}},
     ".outcomes.x.signal.axis: must be non-zero vectors of 3 numbers; received [[0.0, 0.0, 0.0]]"),
    ({"outcomes": {"x": {"signal": "rate_deg_s"}}},
     ".outcomes.x.what: must be given for a signal; received none"),
    ({"outcomes": {"x": {"signal": "rate_deg_s", "what": {}}}}, ".outcomes.x.what: must have one "
     "of settles_below, first_below, at_end, greatest_after_s, mean_after_s, part_below; "
     "received none"),
    ({"outcomes": {"x": {"signal": "rate_deg_s", "what": {"at_end": False}}}},
     ".outcomes.x.what.at_end: must be True; received False"),
    ({"outcomes": {"x": {"signal": "coil_energy_j", "what": {"part_below": 1}}}},
     ".outcomes.x.what: must be left out, or at_end = true, of coil_energy_j; received "
     "{'part_below': 1.0}"),
    ({"outcomes": {"x": {"signal": "attitude_error_deg", "what": {"at_end": True}}}},
     ".outcomes.x.signal: attitude_error_deg needs built-in laws that hold an attitude, one "
     "at a time; received laws that hold none (off)"),
    ({"outcomes": {"x": {"signal": "rate_deg_s", "what": {"mean_after_s": 1e4}}}},
     ".outcomes.x.what: must begin before the run ends at 600 s; received 10000 s"),
    *(({"outcomes": {name: OUTCOME["x"]}}, ".outcomes: must be named by letters, digits and '_', "
       "and not 'success', 'succeeded', 'member', 'time', 'seed', 'how_it_ended', 'ended'; "
       f"received '{name}'") for name in ("a b", "success", "seed", "ended")),
    ({"outcomes": OUTCOME, "success": {"y": {"below": 1}}},
     ".success: must be named as outcomes are, x; received 'y'"),
    ({"outcomes": OUTCOME, "success": {"x": {}}},
     ".success.x: must have below or above; received none"),
    ({"outcomes": OUTCOME, "success": {"x": {"below": 1, "above": 0}}},
     ".success.x: must have below or above; received both"),
    ({"outcomes": OUTCOME, "stop": {"outcome": "y", "half_width": 1}},
     ".stop.outcome: must be one of x, success; received 'y'"),
    ({"stop": {"outcome": "success", "half_width": 1}},
     ".stop.outcome: 'success' needs conditions in success; received none"),
    ({"stop": {"outcome": "coil_energy_j", "half_width": 0}},
     ".stop.half_width: must be greater than 0; received 0"),
    ({"stop": {"outcome": "coil_energy_j", "half_width": 1, "confidence": 1}},
     ".stop.confidence: must be less than 1; received 1"),
    ({"stop": {"outcome": "coil_energy_j", "half_width": 1, "least": 1}},
     ".stop.least: must be greater than or equal to 2; received 1"),
]  # fmt: skip


def test_a_mistake_in_the_table_is_one_line(make):
    wrong = []
    for keys, line in TABLES:
        table = {key: value for key, value in ({"runs": 100} | keys).items() if value is not None}
        pattern = re.escape(f"campaign{line}").replace(r"received\ \{\}", "received .*")
        text = message(table, make())
        wrong += [] if re.fullmatch(pattern, text) else [(line, text)]
    assert wrong == []


def test_every_mistake_has_its_line(make):
    vary = {NOISE: {"uniform": [3, 2]}, BIAS: {"uniform": 1}}
    assert len(message({"runs": 0, "vary": vary}, make()).splitlines()) == 3


def test_the_far_end_of_a_distribution_without_ends_is_tried(make):
    """One in two campaigns of a thousand would have a negative noise."""
    vary = {NOISE: {"normal": {"mean": 32.0, "sigma": 10.0}}}
    assert campaign_from_data({"runs": 100, "vary": vary}, make()).runs == 100
    line = message({"runs": 1000, "vary": vary}, make())
    assert line.startswith(f'campaign.vary."{NOISE}": must be greater than or equal to 0; received')


def test_held_attitude_must_not_vary_where_attitude_errors_are_asked(make):
    law = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
    scenario = make({"control.law": law})
    table = {
        "runs": 10,
        "vary": {"control.law.euler_deg": {"uniform": [[0, 0, 0], [10, 0, 0]]}},
        "outcomes": {"x": {"signal": "attitude_error_deg", "what": {"at_end": True}}},
    }
    assert "the attitude that laws hold must not vary" in message(table, scenario)
    assert campaign_from_data(table | {"outcomes": {}}, scenario).runs == 10


def test_campaigns_made_in_python_are_checked_alike(make):
    campaign = Campaign(runs=3, vary={NOISE: Variation(values=(-1.0,))})
    with pytest.raises(ScenarioError, match="must be greater than or equal to 0; received -1"):
        check_campaign(campaign, make())
    with pytest.raises(ValueError, match="must not vary"):
        Campaign(runs=3, vary={"seed": {"values": [1]}})


#: Texts without the words that no message may have: hypothesis finds them in this file.
TEXTS = st.text(max_size=10).filter(lambda text: "function-" not in text and "pydantic" not in text)
ODD = st.one_of(
    st.booleans(),
    st.integers(),
    st.floats(),
    TEXTS,
    st.just(datetime(2012, 1, 1, tzinfo=UTC)),
    st.lists(st.floats() | TEXTS | st.lists(st.floats(), max_size=4), max_size=3),
    st.dictionaries(st.sampled_from(["uniform", "values", "normal", "x"]), st.floats(), max_size=2),
    st.sampled_from(["uniform", "sun", "grid", "success", [1, 2], [[1, 2], [3, 4]], 1e300, 0, -1]),
)
WHOLE = {
    "runs": 10,
    "seed": 1,
    "vary": {
        NOISE: {"uniform": [0, 1]},
        BIAS: {"direction": "uniform", "magnitude": {"normal": {"mean": 5, "sigma": 1}}},
        "orbit.inclination_deg": {"truncated_normal": {"mean": 5, "sigma": 1, "low": 0}},
        "initial.attitude": "uniform",
        "initial.rate_deg_s": {"relative": {"values": [0.5, 1.0]}},
    },
    "correlated": [together(keys=["orbit.raan_deg"], mean=[1], covariance=[[1]])["correlated"][0]],
    "outcomes": {"x": {"signal": {"axis": [1, 0, 0], "to": "sun"}, "what": {"first_below": 1}}},
    "success": {"x": {"below": 2}},
    "stop": {"outcome": "success", "half_width": 0.1},
}


def places(data, place=()):
    """Every place of a value in nested tables."""
    for key, value in data.items():
        yield (*place, key)
        if isinstance(value, dict):
            yield from places(value, (*place, key))


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_no_mutation_gives_anything_but_a_campaign_or_its_error(make, data):
    table = copy.deepcopy(WHOLE)
    for _ in range(data.draw(st.integers(0, 2))):
        place = data.draw(st.sampled_from(sorted(places(table))))
        inner = table
        for key in place[:-1]:
            inner = inner[key]
        action = data.draw(st.sampled_from(["replace", "remove", "add"]))
        if action == "remove":
            del inner[place[-1]]
        else:
            key = place[-1] if action == "replace" else data.draw(TEXTS)
            inner[key] = data.draw(ODD)
    try:
        assert isinstance(campaign_from_data(table, make()), Campaign)
    except ScenarioError as error:
        for line in str(error).split("\n"):
            assert re.match(r"campaign.*: .*(must|needs)", line, re.DOTALL), line
            assert "function-" not in line and "pydantic" not in line, line


@pytest.mark.parametrize("ends", [(-1e-6, 90.0), (90.0, 180.000001)])
def test_both_ends_of_a_range_are_tried(make, ends):
    """No member would have a value that cannot be flown."""
    table = {"runs": 10, "vary": {"orbit.inclination_deg": {"uniform": [0.0, 180.0]}}}
    assert campaign_from_data(table, make()).runs == 10
    table["vary"]["orbit.inclination_deg"]["uniform"] = list(ends)
    line = message(table, make())
    assert line.startswith('campaign.vary."orbit.inclination_deg": must ') and "\n" not in line


def test_a_notebook_shows_what_varies():
    varied = {"initial.rate_deg_s[0]": {"uniform": (1.0, 2.0)}}
    shown = Campaign(runs=8, vary=varied)._repr_html_()
    assert shown.startswith(
        "<p>8 runs, sampling &#x27;random&#x27;; varied: initial.rate_deg_s[0]</p>"
    )
    assert "[campaign]\nruns = 8\n" in shown and "uniform = [1.0, 2.0]" in shown
