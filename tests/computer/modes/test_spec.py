"""Mode tables as users write them: what they become, and what is refused."""

import math
import tomllib

import numpy as np
import pytest
from flown_modes import Flown, J, two_states
from pydantic import ValidationError

from torquer.base.explain import explain
from torquer.computer.modes import table
from torquer.computer.modes.spec import Modes

TEXT = """
axis = [0, 0, 2]

[states.damping]
laws = ["bdot"]
estimator = "triad"
transitions = [
  { to = "pointing", when = { signal = "rate_deg_s", below = 0.5, back_above = 0.7 }, for_s = 60 },
]

[states.pointing]
laws = { sdot = 1.0, bdot = -0.3 }
coils = "on"
wheels = "off"
set = { "sdot.gain" = 3, "sdot.axis" = [1, 2, 3] }
transitions = [
  { to = "damping", when = [{ signal = "sunlit_fraction", below = 0.1 }], at_most_s = 900 },
]
"""
LAWS, PARAMETERS = (
    {"bdot": 4, "sdot": 2},
    {"bdot.gain": (0, 1), "sdot.gain": (1, 1), "sdot.axis": (2, 3)},
)


def packed(data):
    return Modes.model_validate(data).pack(LAWS, {"triad": 1}, PARAMETERS)


def test_table_is_the_same_from_toml_python_and_storage():
    modes = Modes.model_validate(tomllib.loads(TEXT))
    assert Modes.model_validate_json(modes.model_dump_json()) == modes
    data = tomllib.loads(TEXT)
    whole = {"axis": data.pop("axis"), "regions": {"main": data}}
    assert Modes(**whole) == modes
    assert modes.axis == (0.0, 0.0, 1.0)
    assert [*modes.regions["main"].states] == ["damping", "pointing"]


def test_actions_are_packed_with_numbers_for_names():
    found, _ = packed(tomllib.loads(TEXT))
    first, after = ([row[key] for row in found.states] for key in ("first_action", "after_action"))
    rows = [found.actions[a:b].tolist() for a, b in zip(first, after, strict=True)]
    assert rows[0] == [(table.LAW, 4, 1.0), (table.ESTIMATOR, 1, 0.0)]
    assert rows[1] == [
        (table.LAW, 2, 1.0), (table.LAW, 4, -0.3), (table.SET, 1, 3.0), (table.SET, 2, 1.0),
        (table.SET, 3, 2.0), (table.SET, 4, 3.0), (table.COILS, 0, 1.0), (table.WHEELS, 0, 0.0),
    ]  # fmt: skip


def test_transitions_and_conditions_are_packed_in_si():
    found, state = packed(tomllib.loads(TEXT))
    assert found.transitions.tolist() == [
        (1, 0, 1, pytest.approx(60.0, abs=2e-6), 0.0, math.inf, 1.0, math.inf),
        (0, 1, 2, 0.0, 0.0, pytest.approx(900.0, abs=2e-6), 1.0, math.inf),
    ]
    half, more = math.radians(0.5), math.radians(0.7)
    assert found.conditions["threshold"].tolist() == [half, 0.1]
    assert found.conditions["back"].tolist() == [more, -math.inf]
    assert found.conditions["sign"].tolist() == [-1.0, -1.0]
    assert found.axis == (0.0, 0.0, 1.0) and len(state.transitions) == 2


def test_rows_belong_to_their_regions():
    """Spans of three regions, with transitions from any state and of states, meet end to end."""
    way = [{"to": "b", "at_most_s": 5.0}]
    region = {"states": {"a": {"transitions": way}, "b": {}}, "initial": "b"}
    found, state = packed({"regions": {
        "one": {**region, "transitions": way * 2}, "two": region, "three": {"states": {"b": {}}},
    }})  # fmt: skip
    assert found.regions.tolist() == [(0, 2, 0, 2), (2, 4, 3, 3), (4, 5, 4, 4)]
    assert [tuple(row)[:3] for row in found.states] == [
        (0, 2, 3), (0, 3, 3), (1, 3, 4), (1, 4, 4), (2, 4, 4)
    ]  # fmt: skip
    assert found.transitions["to"].tolist() == [1, 1, 1, 3]
    assert state.regions["state"].tolist() == [1.0, 3.0, 4.0]


def test_every_field_has_eight_bytes():
    for kind in (table.REGION, table.STATE, table.TRANSITION, table.CONDITION, table.ACTION):
        assert all(kind[name].itemsize == 8 for name in kind.names)
    _, state = packed(tomllib.loads(TEXT))
    assert state.flags.dtype == np.float64
    for part in state[:-1]:
        assert all(part.dtype[name].base == np.float64 for name in part.dtype.names)


def test_target_and_inertia_reach_the_kernel():
    found = Flown(target="sun", inertia_kg_m2=J, **two_states(at_most_s=1.0)).table
    assert found.target_is_sun == 1.0 and found.inertia_kg_m2[:3] == (1.0, 1.1, 1.5)
    found = Flown(target=(3, 0, 4), **two_states(at_most_s=1.0)).table
    assert found.target_is_sun == 0.0 and found.target == (0.6, 0.0, 0.8)


RATE = {"signal": "rate_deg_s", "below": 1.0}
WAY = "states.a.transitions[0]"


def condition(**keys):
    return two_states(when={"signal": "rate_deg_s", **keys})


@pytest.mark.parametrize(
    ("data", "line"),
    [
        ({"states": {}}, "states: must hold one state or more; received none"),
        ({"regions": {}}, "regions: must hold one region or more; received none"),
        ({}, "states: must be given; received nothing"),
        ({"regions": {"entries": {"states": {"a": {}}}}},
         "regions.entries: must not be named entered or entries: mode_entries is another variable"),
        ({**two_states(when=RATE), "initial": "x"}, "initial: must be one of a, b; received 'x'"),
        ({"states": {"a": {"transitions": [{"to": "x", "when": RATE}]}, "b": {}}},
         f"{WAY}.to: must be one of a, b; received 'x'"),
        (two_states(), f"{WAY}.when: must have a condition, or give at_least_s or at_most_s"),
        (two_states(at_most_s=1.0, for_s=2.0), f"{WAY}.for_s: needs a condition that is to hold"),
        (two_states(when=RATE, at_most_s=0.0), f"{WAY}.at_most_s: must be greater than 0"),
        (two_states(when=RATE, until=3), f"{WAY}.until: must be a known key; received 3"),
        (two_states(when={"signal": "speed", "below": 1.0}),
         "signal: must be one of rate_deg_s, spin_deg_s, nutation_deg, momentum_rate_deg_s,"),
        (condition(), "above, below: one of the two must be given; received none"),
        (condition(above=1.0, below=2.0), "one of the two must be given; received both"),
        (condition(above=1.0, back_below=1.0), "back_below: must be less than 'above', 1;"),
        (condition(below=1.0, back_above=0.5), "back_above: must be greater than 'below', 1;"),
        (condition(below=1.0, back_below=0.5), "back_below: must not be given with 'below';"),
        (condition(below=1.0, state="a"), "state: must not be given for rate_deg_s; received 'a'"),
        (condition(below=1.0, region="a"), "region: must be given with a state; received 'a'"),
        (condition(signal="time_s", above=1.0, since_entry=True),
         "since_entry: must not be given for time_s, a time, count or yes/no; received true"),
        ({**two_states(when=RATE), "transitions": [
            {"to": "a", "when": {"signal": "rate_deg_s", "above": 1.0, "since_entry": True}}]},
         "transitions[0].when.since_entry: must stand in a state's own transition;"),
        (condition(signal="entries", above=1.0), "state: must be given for entries; received none"),
        (condition(signal="entries", above=1.0, state="x"),
         f"{WAY}.when[0].state: must be one of a, b; received 'x'"),
        (condition(signal="reading_age_s", above=1.0), "sensor: must be given for reading_age_s"),
        (condition(signal="coil_suspected", above=0.5), "coil: must be given for coil_suspected"),
        (condition(signal="coil_suspected", coil="1", above=0.5),
         "coil: must be one of x, y, z; received '1'"),
        (condition(signal="flag", above=0.5), "flag: must be given for flag; received none"),
        (condition(signal="flag", flag="lost", above=0.5),
         f"{WAY}.when[0].flag: must be one of none; received 'lost'"),
        ({**condition(signal="flag", flag="lost", above=0.5), "flags": ["found"]},
         f"{WAY}.when[0].flag: must be one of found; received 'lost'"),
        ({**condition(below=1.0), "flags": ["a", "b", "a"]},
         "flags: must hold each name once; received 'a' twice"),
        (two_states(when=[{"signal": "rate_deg_s", "above": 0.5, "threshold": "slow"},
                          {"signal": "rate_deg_s", "below": 0.7, "threshold": "slow"}]),
         f"{WAY}.when[1].threshold: must be of rate_deg_s and 0.5 as at {WAY}.when[0], which "
         "has the name 'slow' too; received rate_deg_s and 0.7"),
        (condition(signal="sensor_suspected", sensor="gyro", above=0.5),
         "noise: must be given for the signal sensor_suspected; received none"),
        (condition(signal="spin_deg_s", above=1.0),
         "axis: must be given for the signal spin_deg_s; received none"),
        (condition(signal="momentum_to_target_deg", below=1.0),
         "target: must be given for the signal momentum_to_target_deg; received none"),
        ({**condition(signal="nutation_deg", below=1.0), "axis": [0, 0, 1]},
         "inertia_kg_m2: must be given for the signal nutation_deg; received none"),
        ({"states": {"a": {"laws": ["x", "x"]}}}, "states.a.laws: must be names, each once;"),
        ({"states": {"a": {"laws": 3}}}, "states.a.laws: must be a table of keys; received 3"),
        ({"states": {"a": {"coils": "maybe"}}}, "states.a.coils: must be 'on' or 'off'; received"),
        ({"states": {"a": {"final": True, "transitions": [{"to": "a", "at_most_s": 1.0}]}}},
         "states.a.final: must not be true of a state with transitions; received true"),
        ({"states": {"a": {}}, "target": "moon"}, "target: must be 'sun'"),
        ({"states": {"a": {}}, "speed": 3}, "speed: must be a known key; received 3"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_reported_in_one_line(data, line):
    with pytest.raises(ValidationError) as error:
        Modes.model_validate(data)
    (answer,) = explain(error.value, data, Modes)
    assert line in answer and "\n" not in answer and "main" not in answer


TWICE = {"states": {"on": {}, "off": {}}}


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"state": "on"}, "regions.c.states.a.transitions[0].when[0].region: must be one of "
         "one, two, which all have a state 'on'; received none"),
        ({"state": "on", "region": "x"}, "when[0].region: must be one of one, two, c;"),
        ({"state": "x", "region": "two"}, "when[0].state: must be one of on, off; received 'x'"),
        ({"state": "x"}, "when[0].state: must be one of on, off, a, b; received 'x'"),
    ],
)  # fmt: skip
def test_a_state_of_another_region_is_named_without_doubt(keys, line):
    region = condition(signal="in_state", above=0.5, **keys)
    data = {"regions": {"one": TWICE, "two": TWICE, "c": region}}
    with pytest.raises(ValidationError) as error:
        Modes.model_validate(data)
    assert line in explain(error.value, data, Modes)[0]


@pytest.mark.parametrize(
    ("state", "line"),
    [
        ({"laws": ["bdot", "x"]}, "states.a.laws: must be one of bdot, sdot; received 'x'"),
        ({"laws_off": ["x"]}, "states.a.laws_off: must be one of bdot, sdot; received 'x'"),
        ({"estimator": "x"}, "states.a.estimator: must be one of triad; received 'x'"),
        ({"set": {"sdot.x": 1.0}},
         "states.a.set: must be one of sdot.gain, sdot.axis; received 'sdot.x'"),
        ({"set": {"x.gain": 1.0}},
         "states.a.set: must be one of bdot.gain, sdot.gain, sdot.axis; received 'x.gain'"),
        ({"set": {"sdot.axis": 1.0}}, "states.a.set: sdot.axis must have 3 numbers; received 1"),
    ],
)  # fmt: skip
def test_names_of_laws_estimators_and_parameters_must_be_known(state, line):
    with pytest.raises(ValueError) as error:
        packed({"states": {"a": state}})
    assert str(error.value) == line


NAME = "a name must be of letters, digits, '_' and '-' (not first), to be stored; received"


@pytest.mark.parametrize(
    "name", ["", "a/b", "a b", "a.b", "'a'", '"a"', "a\0", "-a", "a\n", "a%", "cafe\u0301"]
)
def test_names_that_cannot_be_stored_are_refused(name):
    """In regions, in states of one region and of several."""
    one = {"states": {name: {}}}
    for data, key in (
        ({"regions": {name: {"states": {"a": {}}}}}, "regions"),
        (one, "states"),
        ({"regions": {"x": one}}, "regions.x.states"),
    ):
        with pytest.raises(ValidationError) as caught:
            Modes.model_validate(data)
        assert f"{key}: {NAME} {name!r}" in explain(caught.value, data, Modes)


def test_names_in_any_script_and_no_longer_than_files_allow():
    assert [*Modes(states={"гашение-1": {}, "_2": {}, "café": {}}).regions["main"].states]
    with pytest.raises(ValueError, match="at most 100 bytes, to be stored; received 101"):
        Modes(states={"a" * 101: {}})
