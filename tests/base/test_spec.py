"""Specs are checked however they come about: created, copied with changes, or changed by force."""

import re
from pathlib import Path

import numpy as np
import pytest
from slow_cases import slow_after

from torquer.base.explain import ScenarioError
from torquer.base.spec import as_data, check_spec
from torquer.computer.laws import Bdot
from torquer.scenario.change import value_at, with_values
from torquer.scenario.load import load_scenario
from torquer.scenario.spec import Control, Simulation
from torquer.simulation.setup.simulate import simulate
from torquer.spacecraft.body import Body

EXAMPLES = Path(__file__).parents[2] / "examples"


def lines(call) -> list:
    """What is said of a mistake, a line each."""
    with pytest.raises(ScenarioError) as caught:
        call()
    return str(caught.value).split("\n")


@pytest.mark.parametrize(
    "update",
    [
        {"duration_s": -1.0},
        {"duration_s": "500"},
        {"step_s": float("nan")},
        {"record_s": True},
        {"revolutions": 3.0},  # beside duration_s: what the whole must hold
        {"integrator": "euler"},
        {"unknown": 1.0},
    ],
)
def test_a_changed_copy_is_checked_as_on_creation(update):
    spec = Simulation(duration_s=100.0)
    created = lines(lambda: Simulation(**{"duration_s": 100.0} | update))
    assert lines(lambda: spec.model_copy(update=update)) == created


def test_valid_change_is_as_created_and_keeps_set_fields():
    changed = Simulation(duration_s=100.0).model_copy(update={"step_s": 5})
    assert changed == Simulation(duration_s=100.0, step_s=5)
    assert changed.model_fields_set == {"duration_s", "step_s", "integrator"}  # a step means RK4
    same = Simulation(duration_s=100.0, record_s=5.0).model_copy()
    assert same.model_fields_set == {"duration_s", "record_s"}
    body = Body(inertia_kg_m2=(1.0, 1.1, 1.2)).model_copy(update={"inertia_kg_m2": [1, 1.2, 1.5]})
    assert body.inertia_kg_m2 == ((1.0, 0.0, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 1.5))


def test_specs_within_a_change_are_checked_however_they_were_made():
    control = Control(law=Bdot(kind="bdot", gain_a_m2_s_per_t=1e5))
    bad = Bdot.model_construct(kind="bdot", gain_a_m2_s_per_t=-1.0)
    (mistake,) = lines(lambda: control.model_copy(update={"law": bad}))
    assert mistake.startswith("law.gain_a_m2_s_per_t: must be ")
    empty = Bdot.model_construct(kind="bdot")
    (mistake,) = lines(lambda: control.model_copy(update={"law": empty}))
    assert mistake == "law.gain_a_m2_s_per_t: must be given; received nothing"
    good = Bdot(kind="bdot", gain_a_m2_s_per_t=2e5)
    assert control.model_copy(update={"law": good}).law == good


def test_a_deep_copy_shares_nothing():
    array = np.array([1.0, 1.1, 1.2])
    body = Body(inertia_kg_m2=array)
    copy = Control(law={"kind": "user", "file": "a.py", "parameters": {"k": 1.0}})
    other = copy.model_copy(update={"sample_s": 2.0}, deep=True)
    other.law.parameters["k"] = 2.0
    assert copy.law.parameters == {"k": 1.0}
    assert body.model_copy(deep=True) == body


def test_the_whole_of_a_scenario_is_checked_in_a_copy(make):
    scenario = make()
    longer = scenario.simulation.model_copy(update={"step_s": 7.0})
    with pytest.raises(ValueError, match="must be a whole multiple of step_s = 7 s"):
        scenario.model_copy(update={"simulation": longer})


def keys_in(value, place=""):
    """Dotted keys of all that stands in plain data."""
    if isinstance(value, dict):
        inner = [(f"{place}.{key}".lstrip("."), each) for key, each in value.items()]
    elif isinstance(value, tuple) and any(isinstance(each, dict) for each in value):
        inner = [(f"{place}[{k}]", each) for k, each in enumerate(value)]
    else:
        return [place]
    if place.endswith(".set"):  # parameters of laws, whose names have dots
        return [place]
    return [found for key, each in inner for found in keys_in(each, key)]


def one_of_each_kind(keys):
    """Of the keys that differ only by places in lists and by names of regions and states, the first
    and the last: a table of modes has a thousand of a dozen kinds."""
    kinds = {}
    for key in keys:
        kind = re.sub(r"\[\d+\]", "[]", re.sub(r"(regions|states)\.\w+", r"\1", key))
        kinds.setdefault(kind, []).append(key)
    return list(dict.fromkeys(key for alike in kinds.values() for key in (alike[0], alike[-1])))


#: Examples that have few keys, and between them all kinds of tables but those of a whole flight.
SMALL = (
    *("bench", "chibis_m_detumble", "disturbances", "five_days", "spinner_modes", "sun_laws"),
    "which_sensors",
)


@pytest.mark.parametrize(
    "path",
    slow_after(
        len(SMALL),
        sorted(EXAMPLES.glob("*.toml"), key=lambda path: (path.stem not in SMALL, path.stem)),
    ),
    ids=lambda path: path.stem,
)
def test_value_at_a_key_makes_a_new_scenario_only(path):
    """What stands next to the key is not checked again, and is the same."""
    scenario = load_scenario(path)
    before = scenario.model_dump_json()
    keys = keys_in(as_data(scenario))
    assert len(keys) > 50
    for key in one_of_each_kind(keys):
        again = with_values(scenario, {key: value_at(scenario, key)})
        assert again == scenario
        stored = again.model_dump_json(exclude_unset=True)
        assert type(scenario).model_validate_json(stored) == scenario
    longer = with_values(scenario, {"simulation.record_s": 2 * scenario.simulation.record_s})
    assert longer == check_spec(longer) != scenario
    assert scenario.model_dump_json() == before


def test_what_is_next_to_a_changed_key_must_fit(make):
    with pytest.raises(ValueError, match=r"control.sample_s: must be a whole multiple of step_s"):
        make().replace("simulation.step_s", 7.0)
    with pytest.raises(ValueError, match=r"wheels: their rotors' inertia .* must be below half"):
        load_scenario(EXAMPLES / "wheels_in_flight.toml").replace(
            "spacecraft.body.inertia_kg_m2", [1e-5, 1e-5, 1e-5]
        )


@pytest.mark.parametrize("changes", [{}, {"control.sample_s": 5.0}])
def test_checked_again_a_scenario_is_the_same(make, changes):
    scenario = make(changes)
    assert check_spec(scenario) == scenario
    assert check_spec(scenario).model_dump_json() == scenario.model_dump_json()


def test_simulate_flies_checked_scenarios_only(make):
    scenario = make()
    made = type(scenario).model_construct(**scenario.__dict__ | {"seed": -1})
    with pytest.raises(ValueError, match="greater than or equal to 0"):
        simulate(made)
    object.__setattr__(scenario.simulation, "step_s", -1.0)
    with pytest.raises(ValueError, match="greater than 0"):
        simulate(scenario)
    scenario = make()
    scenario.orbit.__dict__["altitude_km"] = float("nan")
    with pytest.raises(ValueError, match="must be finite"):
        simulate(scenario)
