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


def tip_off_fleet(vary):
    """Members of the example that vary in some keys, not flown."""
    scenario = load_scenario(EXAMPLES / "tip_off_campaign.toml")
    campaign = Campaign.model_validate({**TABLE, "vary": vary, "success": {}})
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
