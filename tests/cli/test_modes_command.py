"""`torquer modes`, and what `validate` and `run` say of modes."""

import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from torquer.computer.modes.spec import Modes
from torquer.scenario.load import load_scenario

EXAMPLES = Path(__file__).parents[2] / "examples"
MODES = """
[control.laws]
damping = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }
weak = { kind = "bdot", gain_a_m2_s_per_t = 1e5 }
[control.modes.states.fast]
laws = ["damping"]
transitions = [{ to = "slow", when = { signal = "rate_deg_s", below = 0.5 } }]
[control.modes.states.slow]
laws = ["weak"]
"""
BACK = '\ntransitions = [{ to = "fast", when = { signal = "rate_deg_s", above = 0.7 } }]\n'
TRAP = "main.slow: nothing leads out; declare it final = true if it is meant so"
NOTE = f"modes: {TRAP}"


@pytest.fixture
def with_modes(scenario):
    """`with_modes(more)`: the scenario with two modes, `more` in the table of the second."""

    def write(more=""):
        text = scenario.read_text()
        law = 'law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }\n'
        assert law in text
        scenario.write_text(text.replace(law, MODES + more))
        return scenario

    return write


def test_states_transitions_and_findings_in_words(call, with_modes):
    code, out, err = call("modes", with_modes(BACK))
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "fast (initial): damping",
        "  -> slow: rate below 0.5 deg/s",
        "slow: weak",
        "  -> fast: rate above 0.7 deg/s",
        "modes: main: fast -> slow -> fast has no least time; what prevents chatter is that "
        "rate_deg_s must go above 0.7 and below 0.5",
    ]


def test_a_fault_is_a_note_of_every_command(call, with_modes, no_report, strict_json, tmp_path):
    path = with_modes()
    assert call("modes", path)[1].splitlines()[-1] == f"note: {TRAP}"
    code, out, err = call("validate", path)
    assert (code, err, out.splitlines()[-1]) == (0, "", f"note: {NOTE}")
    answer = strict_json(call("validate", path, "--json")[1])
    assert answer["valid"] and answer["notes"] == [NOTE]
    (found,) = answer["modes"]
    assert (found["kind"], found["region"], found["states"]) == ("trap", "main", ["slow"])
    code, out, err = call("run", path, "--out", tmp_path / "out", "--json")
    assert code == 0 and f"note: {NOTE}" in err
    assert strict_json(out)["modes"]["main"]["fast"]["entries"] == 1


def test_validate_tells_what_is_no_fault_apart_from_the_notes(call, with_modes, strict_json):
    path = with_modes(BACK)
    code, out, _ = call("validate", path)
    assert code == 0 and "note" not in out
    *_, modes, faults = out.splitlines()
    assert modes.startswith("modes: main: fast -> slow -> fast has no least time")
    assert faults.startswith("faults:")
    answer = strict_json(call("validate", path, "--json")[1])
    assert answer["notes"] == [] and [f["kind"] for f in answer["modes"]] == ["hysteresis"]


GUARD = """
[control.modes.regions.main.states.fast]
laws = ["damping", "weak"]
transitions = [{ to = "slow", when = { signal = "rate_deg_s", below = 0.5 }, for_s = 60 }]
[control.modes.regions.main.states.slow]
coils = "on"
transitions = [{ to = "fast", when = { signal = "rate_deg_s", above = 0.7 }, for_s = 60 }]
[control.modes.regions.guard]
preset = "zero_field_guard"
"""


def test_a_conflict_is_shown_as_it_comes_about(call, scenario, strict_json):
    """A strip of the states of all regions; none in the notes, which are lines."""
    text = scenario.read_text()
    law = 'law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }\n'
    table = MODES.partition("[control.modes")[0] + GUARD
    scenario.write_text(text.replace(law, table))
    note = "main.slow and guard.no_field can be active together, and set the coils on and off"
    strip = [
        "   main  guard      because",
        "0  fast  plausible  start",
        "1  slow  no_field   main: rate below 0.5 deg/s, for 60 s; "
        "guard: field below 5000 nT, for 3 s",
    ]
    out = call("modes", scenario)[1].splitlines()
    at = out.index(f"note: {note}")
    assert [line.removeprefix("    ") for line in out[at + 1 : at + 4]] == strip
    assert f"%%     {strip[-1]}" in call("modes", scenario, "--mermaid")[1].splitlines()
    (found,) = [
        each
        for each in strict_json(call("modes", scenario, "--json")[1])["findings"]
        if each["kind"] == "conflict"
    ]
    assert found["strip"] == strip
    assert f"note: modes: {note}" in call("validate", scenario)[1].splitlines()


def test_names_that_cannot_be_stored_are_refused_with_their_key(call, with_modes):
    code, out, err = call("validate", with_modes("\n[control.modes.states.'a/b']\nfinal = true\n"))
    assert (code, out) == (2, "") and err == (
        "error: control.modes.states: a name must be of letters, digits, '_' and '-' (not first), "
        "to be stored; received 'a/b'\n"
    )


def test_mermaid_alone_is_a_diagram(call, with_modes, strict_json):
    """Findings are comments of the diagram."""
    path = with_modes()
    code, out, err = call("modes", path, "--mermaid")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "stateDiagram-v2" and lines[-1] == f"%% note: {TRAP}"
    assert "  main_fast --> main_slow : rate below 0.5 deg/s" in lines
    answer = strict_json(call("modes", path, "--json")[1])
    assert answer["mermaid"].splitlines() == lines[:-1]
    assert [f["message"] for f in answer["findings"]] == [TRAP]


def test_the_picture_is_written(call, with_modes, tmp_path):
    path, picture = with_modes(BACK), tmp_path / "modes.svg"
    code, out, err = call("modes", path, "--svg", picture)
    assert (code, err, out.splitlines()[-1]) == (0, "", str(picture))
    texts = [e.text for e in ElementTree.parse(picture).iter() if e.tag.endswith("}text")]
    assert {"fast", "slow", "rate above 0.7 deg/s"} <= set(texts)
    code, out, err = call("modes", path, "--svg", tmp_path / "no" / "modes.svg")
    assert (code, out) == (2, "")
    assert err.startswith("error: --svg: must be a file that can be written; received ")


def test_a_scheme_has_modes(call):
    code, out, err = call("modes", EXAMPLES / "spinner.toml")
    assert (code, err) == (0, "") and out.startswith("stage_1 (initial): ")
    assert "  -> stage_2: nutation below 5 deg" in out and "note" not in out


def test_a_law_that_always_works_has_none(call, scenario):
    code, out, err = call("modes", scenario)
    assert (code, out) == (2, "")
    assert err == (
        "error: control.modes: must be given, or a scheme as control.law; received none\n"
    )


def test_validate_knows_the_parameters_that_states_set(call, with_modes):
    code, out, err = call("validate", with_modes("\nset = { 'weak.gian' = 1e4 }\n"))
    assert (code, out) == (2, "")
    assert "weak.gian" in err and "weak.gain" in err and len(err.splitlines()) == 1


def test_sun_pointing_has_the_logic_of_the_source():
    """The example's table is the one that the tests of modes are made with, and checks besides."""
    path = Path(__file__).parents[1] / "data" / "sun_pointing_modes.toml"
    expected = Modes.model_validate(tomllib.loads(path.read_text()))
    example = load_scenario(EXAMPLES / "sun_pointing.toml").control.modes
    assert example.axis == expected.axis
    for region, source in expected.regions.items():
        for name, state in source.states.items():
            found = example.regions[region].states[name]
            assert found.laws == state.laws
            for way in state.transitions:
                plain = [
                    other.model_copy(update={"when": way.when})
                    for other in found.transitions
                    if set(way.when) <= set(other.when)
                ]
                assert way in plain, (region, name)


@pytest.mark.parametrize("name", ["sun_pointing", "spinner_modes"])
def test_examples_can_be_shown(call, name):
    path = EXAMPLES / f"{name}.toml"
    code, out, err = call("modes", path)
    assert (code, err) == (0, "")
    for state in load_scenario(path).control.modes.states():
        assert all(law in out for law in state.laws)
