"""Faults that a mode table can have: each is found and nothing else; sound ones are not accused."""

import time
import tomllib
from pathlib import Path

import pytest
from hostile_modes import FACTS, TABLES, table_of

from torquer.analysis.notes.mode_notes import mode_facts, mode_findings
from torquer.computer.modes.check import faults
from torquer.computer.modes.signals import SIGNALS
from torquer.computer.modes.spec import Modes, Region, SensorNoise
from torquer.scenario.load import load_scenario, presets

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))
#: Of the hour of wrong capture only sunlight counts; a Sun that is not seen is no wrong capture.
MEANT = {key: ["waits for the unknown"] for key in ("sun_pointing", "safe_mode", "chibis_m_flight")}
#: Presets that follow each other's states, and the states of regions of the example.
FLIGHT = "chibis_m_flight_"


@pytest.mark.parametrize("name", TABLES)
def test_a_fault_is_found_and_nothing_else(name):
    _, kind, text = TABLES[name]
    (found,) = faults(Modes.model_validate(table_of(name)), FACTS)
    assert found.kind == kind and text in found.message and found.is_fault
    assert "\n" not in found.message
    for region, state in found.places if kind in ("conflict", "deadlock") else []:
        column = found.strip[0].split().index(region)  # of numbers, regions, reasons
        assert found.strip[-1].split()[1 + column] == state


@pytest.mark.parametrize(
    ("first", "second", "is_hidden"),
    [
        ("at_least_s = 60", "at_least_s = 60, back_off = 2", True),
        ("at_least_s = 60, most_entries = 1", "at_least_s = 60, back_off = 2", False),
        ("at_least_s = 60, most_entries = 1", "at_least_s = 60, most_entries = 3", False),
        ("at_least_s = 60, most_entries = 3", "at_least_s = 60, most_entries = 3", True),
        ("at_least_s = 60, most_entries = 3", "at_least_s = 60, most_entries = 1", True),
        ("at_least_s = 60, back_off = 2", "at_least_s = 60", False),
        ("at_most_s = 50, back_off = 2", "at_least_s = 100", False),
        ("at_most_s = 50, most_entries = 2", "at_least_s = 100", False),
        ("at_most_s = 50", "at_least_s = 100, back_off = 2", True),
    ],
)
def test_what_comes_first_at_some_entries_only_hides_nothing(first, second, is_hidden):
    back = {"to": "a", "when": {"signal": "field_nt", "below": 20000}, "for_s": 60}
    ways = [{"to": "b", **tomllib.loads(each.replace(", ", "\n"))} for each in (first, second)]
    states = {"a": {"transitions": ways}, "b": {"transitions": [back]}}
    found = faults(Modes.model_validate({"states": states}), FACTS)
    assert ["never taken" in each.message for each in found] == [True] * is_hidden


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_not_accused(path):
    found = [each.kind for each in mode_findings(load_scenario(path)) if each.is_fault]
    assert found == MEANT.get(path.stem, [])


@pytest.mark.parametrize("name", [n for n in presets("region") if not n.startswith(FLIGHT)])
def test_presets_are_not_accused(name):
    """Each by itself; the one that follows another region with that."""
    regions = {"it": presets("region")[name]}
    if name == "chibis_m_stabilisation":
        regions = {"determination": presets("region")["chibis_m_determination"], **regions}
    noise = dict.fromkeys(SensorNoise.model_fields, 1.0)
    table = {"inertia_kg_m2": [1, 1.1, 1.5], "attitude": {"reference": "orbital"}, "noise": noise}
    assert faults(Modes.model_validate({**table, "regions": regions})) == []


def test_presets_of_the_flight_software_are_those_of_the_example():
    """They need each other: the example, which is not accused, has all of them as they are."""
    example = load_scenario(next(p for p in EXAMPLES if p.stem == "chibis_m_flight"))
    flown = example.control.modes.regions
    for name, preset in presets("region").items():
        if name.startswith(FLIGHT):
            assert flown[name.removeprefix(FLIGHT)] == Region.model_validate(preset)


def test_regions_with_too_many_choices_are_explored_in_pairs():
    """Of ten regions with four ways each; what is found then is the same as of a few."""
    limits = {"rate_deg_s": 1.0, "field_nt": 2e4, "sun_in_view": 0.5, "sunlit_fraction": 0.5}
    ways = [
        {"to": to, "when": {"signal": signal, "above": limit}, "for_s": 1}
        for to, (signal, limit) in zip("bcde", limits.items(), strict=True)
    ]
    states = {"a": {"transitions": ways}, **{name: {"final": True} for name in "bcde"}}
    states["e"] = {"transitions": [{"to": "a", "at_most_s": 5}]}

    def accused(count):
        table = {"regions": {f"r{k}": {"states": states} for k in range(count)}}
        return {(f.kind, f.region) for f in faults(Modes.model_validate(table)) if f.region == "r0"}

    assert accused(10) == accused(2)


@pytest.mark.parametrize("count", [8, 10])
def test_any_to_any_takes_no_time(count):
    """All cycles of ten states are a million, their witness is one."""
    name = {8: "eight", 10: "ten"}[count] + " states, any to any"
    modes = Modes.model_validate(table_of(name))
    began = time.process_time()
    faults(modes, FACTS)
    assert time.process_time() - began < 2.0


def test_the_tutorial_shows_a_strip_as_it_is_printed():
    table = Modes.model_validate(table_of("two regions that come to wait for each other"))
    (found,) = faults(table, FACTS)
    lines = [f"note: {found.message}", *(f"    {line}" for line in found.strip)]
    tutorial = EXAMPLES[0].parents[1] / "docs" / "tutorials" / "modes.md"
    assert "\n".join(lines) in tutorial.read_text(encoding="utf-8")


def test_every_signal_may_have_several_values():
    assert all(low < high for low, high in (signal.range for signal in SIGNALS.values()))


def test_the_facts_are_those_of_the_scenario():
    facts = mode_facts(load_scenario(next(p for p in EXAMPLES if p.stem == "chibis_m_day")))
    assert facts.step_s == 1.0 and facts.kinds["hold"].startswith("wheel")
    assert facts.drives["damping"] == {"coils"} and facts.drives["hold"] == {"wheels"}
    assert facts.gives["field_rate"] == {"rate"} and facts.gives["none"] == set()
    assert facts.gives["mag_dss"] == {"attitude", "rate", "sigma"}
    assert "tachometers" in facts.sensors and "search_coil" not in facts.sensors


def test_a_fault_needs_the_satellite_around_it():
    """The same table with the sensor, the estimator or the longer control step is sound."""
    for name in ("the age of a sensor that is not there", "at_most_s below the control step"):
        table = Modes.model_validate(tomllib.loads(TABLES[name][0]))
        assert faults(table) == []
