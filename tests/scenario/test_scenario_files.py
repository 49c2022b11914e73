"""Scenario files as they are read: names, presets, law files, the schema, and notes."""

import tomllib
from datetime import datetime
from pathlib import Path

import pytest

from torquer.analysis.notes.notes import write_notes
from torquer.computer.modes.spec import Region
from torquer.scenario.load import (
    check_orbit_environment,
    load_scenario,
    presets,
    scenario_from_text,
    scenario_schema,
)
from torquer.scenario.spec import Scenario

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
CHIBIS = next(path for path in EXAMPLES if path.stem == "chibis_m_detumble")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_is_valid_and_survives_storage(path):
    scenario = load_scenario(path)
    assert scenario.name == path.stem
    assert Scenario.model_validate_json(scenario.model_dump_json()) == scenario


def test_a_preset_fills_in_and_keys_next_to_it_win():
    text = CHIBIS.read_text().replace('preset = "hmr2300r"', 'preset = "hmr2300r"\nnoise_nt = 7.0')
    magnetometer = scenario_from_text(text).spacecraft.magnetometer
    assert magnetometer.noise_nt == 7.0
    assert magnetometer.range_nt == 200000.0


@pytest.mark.parametrize("name", presets())
def test_every_preset_fits_the_one_table_that_it_names(name):
    fields = Scenario.model_fields["spacecraft"].annotation.model_fields
    parts = {part: field.annotation for part, field in fields.items()} | {"region": Region}
    (part,) = [part for part in parts if name in presets(part)]
    kinds = (parts[part], *getattr(parts[part], "__args__", ()))
    (spec,) = [kind for kind in kinds if hasattr(kind, "model_fields")]
    assert spec.model_validate(presets(part)[name]) is not None
    assert presets(part)[name] == presets()[name]


@pytest.mark.parametrize(
    ("stem", "name"),
    [("my run", "my_run"), ("2012-03", "2012-03"), ("a.b", "a.b"), (".hidden", "_hidden"),
     ("größe", "größe")],
)  # fmt: skip
def test_the_file_names_the_run(tmp_path, stem, name):
    path = tmp_path / f"{stem}.toml"
    path.write_text(CHIBIS.read_text(), encoding="utf-8")
    assert load_scenario(path).name == name


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    path = tmp_path / "run.toml"
    path.write_text(CHIBIS.read_text(), encoding="utf-8-sig")
    assert load_scenario(path).seed == 20120304


def test_law_files_are_looked_up_next_to_the_scenario(tmp_path, monkeypatch):
    law = 'kind = "user"\nfile = "laws/mine.py"'
    text = CHIBIS.read_text().replace('kind = "bdot"\ngain_a_m2_s_per_t = 5e6', law)
    (tmp_path / "run.toml").write_text(text)
    monkeypatch.chdir(tmp_path.parent)
    scenario = load_scenario(Path(tmp_path.name) / "run.toml")
    assert scenario.control.law.file == (tmp_path / "laws" / "mine.py").resolve()


def plain(value):
    """TOML data as JSON has it."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    return value.isoformat() if isinstance(value, datetime) else value


def test_the_schema_takes_the_examples_and_no_misspelt_key():
    jsonschema = pytest.importorskip("jsonschema")
    schema = scenario_schema()
    checker = jsonschema.validators.validator_for(schema)
    checker.check_schema(schema)
    validator = checker(schema)
    for path in EXAMPLES:
        data = plain(tomllib.loads(path.read_text()))
        assert [error.message for error in validator.iter_errors(data)] == []
        for change in ("orbits", "simulation.steps", "orbit.kind", "spacecraft.body.preset"):
            *tables, key = change.split(".")
            wrong = plain(tomllib.loads(path.read_text()))
            table = wrong
            for name in tables:
                table = table[name]
            table[key] = "mistaken"
            assert not validator.is_valid(wrong), change
    misplaced = plain(tomllib.loads(CHIBIS.read_text()))
    misplaced["spacecraft"]["body"] = {"preset": "chibis_m_coils"}
    assert not validator.is_valid(misplaced)
    incomplete = plain(tomllib.loads(CHIBIS.read_text()))
    incomplete["spacecraft"]["body"] = {"mass_kg": 3.0}
    assert not validator.is_valid(incomplete)


def test_the_schema_knows_every_key_without_the_package():
    definitions = scenario_schema()["$defs"]
    assert set(definitions["Coils"]["properties"]) >= {"limit_a_m2", "axes", "lag_s", "preset"}
    assert definitions["Body"]["anyOf"] == [
        {"required": ["inertia_kg_m2"]},
        {"required": ["box_m", "mass_kg"]},
        {"required": ["parts"]},
        {"required": ["preset"]},
    ]


def test_steps_cover_the_duration_in_whole_records(make):
    assert make().steps() == 600
    assert make({"simulation.duration_s": 601.0}).steps() == 610
    scenario = make({"simulation": {"revolutions": 2, "step_s": 0.5, "record_s": 10.0}})
    assert 0.0 <= scenario.steps() * 0.5 - 2.0 * scenario.orbit.period_s < 10.0


def test_notes_tell_of_too_long_a_step(make):
    fast = {"initial.rate_deg_s": [0.0, 0.0, 60.0]}
    (note,) = write_notes(make(fast))
    assert note.startswith("the body rotates by 60 deg within one step of 1 s: take shorter steps")
    assert write_notes(make(fast | {"simulation.integrator": "splitting"})) == []
    assert write_notes(make({"initial.rate_deg_s": [0.0, 0.0, 20.0]})) == []


def test_notes_tell_that_wheels_degrade_the_splitting_at_large_steps(make):
    fast = {"initial.rate_deg_s": [0.0, 0.0, 60.0], "simulation.integrator": "splitting"}
    wheels = {"spacecraft.body.wheel_momentum_n_m_s": [0.0, 0.5, 0.0]}
    (note,) = write_notes(make(fast | wheels))
    assert "with wheels the splitting is of order 2 only: their 0.5 N m s rotate the rate" in note
    slow = {"initial.rate_deg_s": [0.0, 0.0, 0.1], "simulation.integrator": "splitting"}
    assert write_notes(make(slow | wheels)) == []


def test_notes_tell_of_old_two_line_elements():
    text = CHIBIS.read_text(encoding="utf-8")
    assert write_notes(load_scenario(CHIBIS)) == []
    late = scenario_from_text(text.replace("start = 2012-03-04", "start = 2012-06-04"))
    (note,) = write_notes(late)
    assert note.startswith("the start is 98 days after the epoch of the two-line elements")


def test_two_line_elements_that_tell_no_place_are_refused():
    """After a year and a half drag has moved the satellite by 26 revolutions."""
    text = CHIBIS.read_text(encoding="utf-8")
    late = scenario_from_text(text.replace("start = 2012-03-04", "start = 2013-09-04"))
    with pytest.raises(ValueError, match="555 days from the epoch of the elements their error is"):
        check_orbit_environment(late)


@pytest.mark.parametrize("given", ["2016-12-31T23:59:60Z", '"2017-01-01T02:59:60+03:00"'])
def test_a_run_may_start_in_a_leap_second(given):
    """As a time of TOML, which its reader refuses, and as text; what is stored has it, too."""
    text = CHIBIS.read_text(encoding="utf-8")
    start = next(line for line in text.splitlines() if line.startswith("start = "))
    scenario = scenario_from_text(text.replace(start, f"start = {given}"))
    stored = scenario.model_dump_json()
    assert '"start":"2016-12-31T23:59:60Z"' in stored
    assert Scenario.model_validate_json(stored).start.fold == 1
