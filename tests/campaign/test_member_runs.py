"""Members of a campaign are prepared as alone: whatever varies, what they share changes no bit."""

import random
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from pydantic import BaseModel
from tip_off import TABLE

from torquer.campaign.fleet import Fleet
from torquer.campaign.sampling import member_scenario
from torquer.campaign.spec import Campaign
from torquer.scenario.change import value_at
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.run import prepare

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Fields of runs that are not compared: where they are computed, and what is made for flying.
_NOT_COMPARED = {"_ready", "keep", "spec", "function"}
#: Keys that are drawn at random for each example.
_KEYS = 5


def number_keys(value, key=""):
    """Dotted keys of a scenario that have numbers, or vectors of numbers."""
    if isinstance(value, BaseModel):
        for name in type(value).model_fields:
            yield from number_keys(getattr(value, name), f"{key}.{name}".lstrip("."))
    elif isinstance(value, dict):
        for name, part in value.items():
            yield from number_keys(part, f"{key}.{name}")
    elif isinstance(value, float):
        yield key
    elif isinstance(value, tuple) and value:
        if all(isinstance(each, float) for each in value):
            yield key
        else:
            for k, part in enumerate(value):
                yield from number_keys(part, f"{key}[{k}]")


def drawn_keys(scenario, seed):
    """Some keys with numbers, drawn by a seed; none of them within another."""
    known = [key for key in number_keys(scenario) if not key.startswith("simulation")]
    return random.Random(seed).sample(known, _KEYS)


def variation_of(scenario, key, spread):
    """A variation near the scenario's own value."""
    own = np.array(value_at(scenario, key), float)
    if not own.any():
        return {"uniform": [np.zeros_like(own).tolist(), np.full_like(own, spread).tolist()]}
    return {"relative": {"uniform": [1.0 - spread, 1.0 + spread]}}


def parts(value, place=""):
    """All that a run is made of, to the bit, with its place."""
    if isinstance(value, float):
        yield place, value.hex()
    elif isinstance(value, np.ndarray):
        yield place, (value.dtype.descr, value.shape, value.tobytes())
    elif isinstance(value, BaseModel):
        yield place, value
    elif isinstance(value, dict):
        for name, part in value.items():
            yield from parts(part, f"{place}[{name}]")
    elif isinstance(value, list | tuple):
        yield place, (type(value), len(value))
        for k, part in enumerate(value):
            yield from parts(part, f"{place}[{k}]")
    elif is_dataclass(value):
        for each in fields(value):
            if each.name not in _NOT_COMPARED:
                yield from parts(getattr(value, each.name), f"{place}.{each.name}")
    else:
        yield place, value


def differences(fleet, chunk, row):
    """Places at which a member's run is another than that of the same member alone."""
    alone = fleet._prepared(chunk, row)
    said = chunk.ended[row]
    with fleet._sharing.used():
        shared = fleet._prepared(chunk, row)
    assert chunk.ended[row] == said
    one, other = (dict(parts(run)) for run in (alone, shared))
    return [place for place in one.keys() | other.keys() if one.get(place) != other.get(place)]


#: Examples; those whose filters compile for long are slow ones.
EXAMPLE_NAMES = ["disturbances", "spinner", "tip_off_campaign"]
SLOW = ["chibis_m_flight", "several_sensors", "spinner_modes", "sun_pointing", "wheels_in_flight"]
CASES = [(name, seed) for name in EXAMPLE_NAMES for seed in range(4)]
CASES += [pytest.param(name, seed, marks=pytest.mark.slow) for name in SLOW for seed in range(6)]


@pytest.mark.parametrize("spread", [0.01, 0.9])
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_members_are_prepared_as_alone_whatever_varies(name, seed, spread):
    scenario = load_scenario(EXAMPLES / f"{name}.toml")
    keys = drawn_keys(scenario, f"{name} {seed}")
    vary = {key: variation_of(scenario, key, spread) for key in keys}
    campaign = Campaign.model_validate({**TABLE, "vary": vary, "success": {}})
    fleet = Fleet(scenario, campaign)
    chunk = fleet.unflown(np.arange(6))
    for row in range(6):
        assert differences(fleet, chunk, row) == [], keys


def alone_in_lanes(fleet, row):
    """Numbers in its lane of a member that is prepared by itself; None if it has none."""
    try:
        run = prepare(member_scenario(fleet.scenario, fleet.campaign, row))
    except ValueError:
        return None
    return fleet._taken(fleet._lanes, run)


def at_once_and_alone(fleet, count):
    """Numbers of members that are prepared at once, by rows, and of each alone: the same bits."""
    chunk = fleet.unflown(np.arange(count))
    found = fleet._at_once.numbers(fleet._lanes, chunk.drawn, chunk.seeds)
    alone = {row: alone_in_lanes(fleet, row) for row in range(count)}
    for row, numbers in found.items():
        assert alone[row] is not None, fleet.campaign.vary
        assert numbers.tobytes() == alone[row].tobytes(), fleet.campaign.vary
    return found, alone


#: Keys of which members do not share the tables that lanes share.
_NOT_SHARED = ("simulation", "initial", "orbit", "start", "environment", "control.ephemeris")


@pytest.mark.parametrize(
    "name",
    [
        "magnetic_hold",
        *(
            pytest.param(each, marks=pytest.mark.slow)
            for each in ("magneto_gyro", "several_sensors", "wheels_in_flight", "disturbances")
        ),
        pytest.param("satellites/small_150kg_wheels", marks=pytest.mark.slow),
    ],
)
def test_any_number_that_varies_alone_is_prepared_at_once(name):
    scenario = load_scenario(EXAMPLES / f"{name}.toml")
    one_by_one = []
    for key in number_keys(scenario):
        if key.startswith(_NOT_SHARED):
            continue
        vary = {key: variation_of(scenario, key, 0.01)}
        campaign = Campaign.model_validate({**TABLE, "runs": 10, "vary": vary, "success": {}})
        fleet = Fleet(scenario, campaign)
        if fleet._lanes is None:
            continue
        found, alone = at_once_and_alone(fleet, 10)
        # where some members are refused, too few of the others may be left for one computation
        if not found and all(numbers is not None for numbers in alone.values()):
            one_by_one.append(key)
    assert one_by_one == []


@pytest.mark.parametrize("spread", [0.01, 0.9])
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_members_prepared_at_once_have_the_bits_of_each_alone(name, seed, spread):
    """Of some keys at random, and of attitude and rate."""
    scenario = load_scenario(EXAMPLES / f"{name}.toml")
    rate = {"direction": "uniform", "magnitude": {"uniform": [0.0, 3.0]}}
    vary = {"initial.attitude": "uniform", "initial.rate_deg_s": rate}
    for key in drawn_keys(scenario, f"{name} {seed} at once"):
        made = {key: variation_of(scenario, key, spread)}
        if key.startswith(_NOT_SHARED):
            continue
        campaign = Campaign.model_validate({**TABLE, "vary": made, "success": {}})
        if Fleet(scenario, campaign)._lanes is not None:
            vary |= made
    campaign = Campaign.model_validate({**TABLE, "runs": 20, "vary": vary, "success": {}})
    fleet = Fleet(scenario, campaign)
    if fleet._lanes is None:
        return
    found, alone = at_once_and_alone(fleet, 20)
    fitting = sum(numbers is not None for numbers in alone.values())
    shares_keys = any(
        ".stages[" in key for key in vary
    )  # its check before pydantic's fills them in
    assert len(found) == fitting or shares_keys or spread > 0.5, vary


#: Keys of which all are prepared at once: what everybody varies.
COMMON = {
    "spacecraft.body.inertia_kg_m2": {"relative": {"uniform": [0.9, 1.1]}},
    "spacecraft.coils.limit_a_m2": {"relative": {"uniform": [0.9, 1.1]}},
    "spacecraft.coils.residual_dipole_a_m2": {"normal": {"mean": [0, 0, 0], "sigma": 0.1}},
    "spacecraft.magnetometer.bias_nt": {"normal": {"mean": [0, 0, 0], "sigma": 50}},
    "spacecraft.magnetometer.scale_error": {"normal": {"mean": [0, 0, 0], "sigma": 0.01}},
    "spacecraft.gyro.misalignment_deg": {"normal": {"mean": [0, 0, 0], "sigma": 1.0}},
    "spacecraft.sun_sensors.axes[1]": {"normal": {"mean": [1, 1, 0], "sigma": 0.01}},
    "control.law.gain_a_m2_s_per_t": {"log_uniform": [1e6, 1e7]},
    "initial.euler_deg": {"uniform": [[0, 0, 0], [360, 9, 360]]},
    "initial.attitude": "uniform",
}


@pytest.mark.parametrize("key", sorted(COMMON))
def test_what_everybody_varies_is_prepared_at_once(key, monkeypatch):
    fleet, chunk = tip_off_fleet({key: COMMON[key]}, runs=12)
    alone = [alone_in_lanes(fleet, row) for row in range(len(chunk.members))]
    monkeypatch.setattr(Fleet, "_prepared", None)
    found = fleet._numbers_of(fleet._lanes, chunk)
    assert sorted(found) == [*range(len(chunk.members))]
    for row, numbers in found.items():
        assert numbers.tobytes() == alone[row].tobytes()


def test_members_that_go_different_ways_are_prepared_in_parts():
    """Some have no scale error, and some are no scenarios at all."""
    vary = {
        "spacecraft.magnetometer.bias_nt": {"uniform": [[-50, 0, 0], [50, 9, 9]]},
        "spacecraft.gyro.bias_deg_s": {"uniform": [[0, 0, 0], [1, 1, 1]]},
        "control.law.gain_a_m2_s_per_t": {"uniform": [-1e6, 1e6]},
    }
    scenario = load_scenario(EXAMPLES / "tip_off_campaign.toml")
    table = {**TABLE, "runs": 64, "vary": vary, "success": {}}
    fleet = Fleet(scenario, Campaign.model_validate(table))
    chunk = fleet.unflown(np.arange(64))
    found = fleet._at_once.numbers(fleet._lanes, chunk.drawn, chunk.seeds)
    sound = np.flatnonzero(chunk.drawn["control.law.gain_a_m2_s_per_t"] > 0.0)
    assert sorted(found) == sound.tolist()
    for row in found:
        assert found[row].tobytes() == alone_in_lanes(fleet, row).tobytes()


def tip_off_fleet(vary, **changes):
    """Members of the example that vary in some keys, not flown."""
    scenario = load_scenario(EXAMPLES / "tip_off_campaign.toml")
    campaign = Campaign.model_validate({**TABLE, "vary": vary, "success": {}, **changes})
    fleet = Fleet(scenario, campaign)
    return fleet, fleet.unflown(np.arange(campaign.runs))


def test_what_does_not_vary_is_made_once():
    bias = {"spacecraft.magnetometer.bias_nt": {"uniform": [[-50, 0, 0], [50, 9, 9]]}}
    fleet, chunk = tip_off_fleet(bias)
    with fleet._sharing.used():
        run = fleet._prepared(chunk, 0)
    own, base = run.plan.plant.sensors, fleet.base.plan.plant.sensors
    differing = [name for name in base._fields if getattr(own, name) is not getattr(base, name)]
    assert differing == ["magnetometer"]
    assert run.plan.timetable is fleet.base.plan.timetable
    assert run.plan.plant.coils is fleet.base.plan.plant.coils
    assert run.dynamics.rigid is fleet.base.dynamics.rigid


@pytest.mark.parametrize(
    ("key", "variation", "expected"),
    [
        ("control.law.gain_a_m2_s_per_t", {"uniform": [-1e6, 1e6]}, "control.law.gain"),
        ("initial.rate_deg_s", {"uniform": [[0, 0, 0], [300, 0, 0]]}, "simulation.step_s: must"),
        ("spacecraft.body.inertia_kg_m2", {"uniform": [[1, 1, 1], [1, 1, 3]]}, "spacecraft.body"),
        ("spacecraft.coils.lag_s", {"uniform": [-1, 1]}, "spacecraft.coils.lag_s: must"),
        ("spacecraft.gyro.noise_deg_s", {"uniform": [-1, 1]}, "spacecraft.gyro.noise_deg_s: must"),
        ("spacecraft.magnetometer.delay_s", {"uniform": [0, 1]}, "spacecraft.magnetometer"),
    ],
)
def test_members_that_are_no_scenarios_say_what_they_say_alone(key, variation, expected):
    fleet, chunk = tip_off_fleet({key: variation, "spacecraft.body.mass_kg": {"uniform": [40, 41]}})
    with fleet._sharing.used():
        prepared = [fleet._prepared(chunk, row) for row in range(len(chunk.members))]
    said = []
    for row, run in enumerate(prepared):
        try:
            prepare(member_scenario(fleet.scenario, fleet.campaign, row))
        except ValueError as error:
            said.append(" ".join(str(error).split("\n")))
            assert run is None
            assert chunk.ended[row] == said[-1]
        else:
            assert run is not None
    assert any(expected in line for line in said)
