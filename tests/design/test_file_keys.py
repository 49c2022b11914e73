"""Every key of scenario files is described: for editors, for `torquer explain`, for the docs."""

import json
import subprocess
import sys
import tomllib

import pytest

from torquer.base import validate
from torquer.campaign.spec import Campaign
from torquer.cli.answer import answer
from torquer.computer.estimation import ESTIMATORS
from torquer.computer.laws import LAWS
from torquer.design import file_keys, stored_keys
from torquer.design.file_keys import design_tables, file_schema, file_tables
from torquer.design.stored_keys import find
from torquer.environment.field import FIELDS
from torquer.ground.telemetry.reading.described import mapping_tables
from torquer.scenario.described import Table
from torquer.scenario.keys import UNITS, key_unit, specs_below
from torquer.scenario.spec import Scenario

TABLES = [*file_tables(), *design_tables(), *mapping_tables()]
KEYS = [(table.title, key) for table in TABLES for key in table.keys]


def test_there_are_as_many_keys_as_the_schema_has():
    assert len(KEYS) > 390
    places = {place for table in TABLES for place in table.places}
    assert {"orbit", "control.law", "campaign.vary.NAME", "spacecraft.gyro.failures[]"} <= places
    kinds = {table.kind for table in TABLES}
    assert kinds >= {*LAWS, *FIELDS, *ESTIMATORS}


def flaws_of(key) -> list[str]:
    """What is missing from the description of a key."""
    text = key.description
    rules = {
        "is no sentence": text.endswith((".", ")")) and text[0] in text[0].upper(),
        "is too short": len(text) >= 6,
        "has no values": bool(key.values),
        # what follows "or" is a kind of value, never the name of a class
        "has an unnamed kind of value": "a value" not in key.values,
    }
    return [flaw for flaw, holds in rules.items() if not holds]


def test_every_key_is_described():
    flaws = {f"{title}.{key.name}": flaws_of(key) for title, key in KEYS}
    assert {name: found for name, found in flaws.items() if found} == {}


def test_every_table_says_what_it_is():
    assert [table.title for table in TABLES if not table.about] == []


def test_units_are_those_of_the_ranges():
    known = {*UNITS, "", "b0", "table_tolerance", "axis", "axes", "direction", "target"}
    known |= {"first_coil", "parameters", "limits", "height_km", "quantum_deg", "a_m2_s_t"}
    named = {ending.removeprefix("gain_") for ending in validate.RANGES}
    assert named <= known
    known = {
        key: key_unit(key) for key in ("rate_deg_s", "gain_a_m2_s_per_t", "limit_a_m2", "f107")
    }
    assert known == {"rate_deg_s": "deg/s", "gain_a_m2_s_per_t": "A m² s/T",
                    "limit_a_m2": "A m²", "f107": ""}  # fmt: skip


def test_ranges_and_defaults_are_those_that_are_checked():
    known = {f"{title}.{key.name}": key for title, key in KEYS}
    inclination = known["orbit, kind = 'circular'.inclination_deg"]
    assert (inclination.values, inclination.default) == ("a number, ≥ 0, ≤ 180", "")
    limit = known["spacecraft.coils.limit_a_m2"]
    assert limit.values == "a number or a list of numbers, > 0, ≤ 1e+09"
    assert known["spacecraft.gyro.bias_deg_s"].values == "a list of 3 numbers, within ±1e+06"
    assert known["simulation.record_s"].default == "10"
    assert known["environment.field"].default == 'kind = "igrf14"'
    for default in (key.default for key in known.values() if key.default.startswith('"')):
        tomllib.loads(f"x = {default}")


def test_the_schema_describes_every_key_with_its_unit():
    schema = file_schema()
    for spec in (*specs_below(Scenario), *specs_below(Campaign)):
        table = schema if spec is Scenario else schema["$defs"][spec.__name__]
        for name, key in table["properties"].items():
            assert key.get("description"), f"{spec.__name__}.{name}"
    altitude = schema["$defs"]["Circular"]["properties"]["altitude_km"]["description"]
    assert altitude.startswith("Altitude above") and altitude.endswith("[km]")


def test_the_schema_takes_campaigns():
    jsonschema = pytest.importorskip("jsonschema")
    checker = jsonschema.validators.validator_for(schema := file_schema())
    checker.check_schema(schema)
    campaign = {"$defs": schema["$defs"], "$ref": "#/$defs/Campaign"}
    given = {"runs": 8, "outcomes": {"end": {"signal": "rate_deg_s", "what": {"at_end": True}}}}
    assert checker(campaign).is_valid(given)
    assert not checker(campaign).is_valid(given | {"run": 9})
    assert checker(campaign).is_valid(given | {"table": "fleet.csv"})
    assert checker(campaign).is_valid(given | {"table": {"orbit.raan_deg": [0, 90]}})
    assert not checker(campaign).is_valid(given | {"table": 3})


def test_the_schema_asks_for_runs_unless_these_follow():
    """As `Campaign` itself: a table has a run a row, a grid one a combination."""
    jsonschema = pytest.importorskip("jsonschema")
    checker = jsonschema.validators.validator_for(schema := file_schema())
    campaign = checker({"$defs": schema["$defs"], "$ref": "#/$defs/Campaign"})
    grid = {"sampling": "grid", "vary": {"orbit.raan_deg": {"values": [0, 90]}}}
    for given, runs in ({"table": {"orbit.raan_deg": [0, 90, 180]}}, 3), (grid, 2):
        assert campaign.is_valid(given) and Campaign.model_validate(given).runs == runs
    for given in ({}, {"seed": 3}, grid | {"sampling": "sobol"}):
        assert not campaign.is_valid(given)
        with pytest.raises(ValueError, match="runs"):
            Campaign.model_validate(given)


@pytest.mark.parametrize(
    ("name", "titles"),
    [
        ("limit_a_m2", ["spacecraft.coils"]),
        ("spacecraft.coils.limit_a_m2[1]", ["spacecraft.coils"]),
        ("control.laws.mine.gain_a_m2_s", ["control.law, kind = 'sdot'",
                                           "control.law, kind = 'sdot_rate'"]),
        ("orbit.start.position_km", ["orbit.start, kind = 'state_vector'"]),
        ("campaign.vary.any.sigma", []),
    ],
)  # fmt: skip
def test_keys_are_found_by_their_ends(name, titles):
    if not titles:
        with pytest.raises(ValueError, match="KEY: must be a key or table"):
            find(name)
        return
    assert [table.title for table, _ in find(name)[1]] == titles


def test_tables_are_found_by_place_and_by_kind():
    assert [table.title for table in find("spacecraft.wheels")[0]] == ["spacecraft.wheels"]
    assert [table.title for table in find("igrf14")[0]] == ["environment.field, kind = 'igrf14'"]
    assert isinstance(find("gyro")[0][0], Table) and find("gyro")[1]  # the table and its key


def test_stored_tables_are_those_of_the_specs():
    stored = stored_keys.FILE.read_text(encoding="utf-8")
    assert stored == file_keys.stored_tables(mapping_tables()), "run docs/generate.py"
    assert stored_keys.file_tables() == file_keys.file_tables()
    own = [*file_keys.own_design_tables(), *mapping_tables()]
    assert stored_keys.all_tables() == [*file_keys.file_tables(), *own]


def test_explain_imports_no_spec():
    code = (
        "import sys; from torquer.cli.answer import answer; answer(['explain', 'limit_a_m2']); "
        "print([m for m in ('numba', 'numpy', 'pydantic', 'xarray') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_explain_prints_all_about_a_key(capsys):
    assert answer(["explain", "sample_s"]) in (0, None)
    shown = capsys.readouterr().out
    assert "Interval between control steps." in shown and "spacecraft.gyro" in shown
    assert "  default  1\n" in shown and "a number, > 0, ≤ 1e+10" in shown
    assert answer(["explain", "limit_a_m2", "--json"]) in (0, None)
    (found,) = json.loads(capsys.readouterr().out)["keys"]
    assert found["unit"] == "A m²" and found["table"] == "spacecraft.coils"
    assert answer(["explain"]) in (0, None)
    assert len(capsys.readouterr().out.splitlines()) == len(file_tables())


def test_explain_says_where_cited_texts_are_listed(capsys):
    assert answer(["explain", "tilt_deg"]) in (0, None)
    shown = capsys.readouterr().out
    assert shown.endswith("FIELD, MAG: see docs/sources.md for these texts\n")
    assert answer(["explain", "limit_a_m2"]) in (0, None)
    assert "sources.md" not in capsys.readouterr().out


def test_keys_of_wheel_designs_are_explained_below_design(capsys):
    assert answer(["explain", "demand"]) in (0, None)
    shown = capsys.readouterr().out
    assert shown.startswith("DESIGN.demand\n") and "acceleration_deg_s2" in shown


def test_a_misspelt_key_is_answered_with_the_nearest_ones(capsys):
    assert answer(["explain", "altitud_km"]) == 2
    reported = capsys.readouterr().err
    assert reported.startswith(
        "error: KEY: must be a key or table of scenario files, wheel designs or mappings; "
    )
    assert "did you mean altitude_km" in reported and "Traceback" not in reported


@pytest.mark.parametrize(
    ("name", "end"),
    [
        ("noise_deg_sqrt_h",
         "did you mean noise_deg_s? It is the angle random walk in deg/sqrt(h) / 60 / "
         "sqrt(sample_s)"),
        ("altitude_m", "did you mean altitude_km or apogee_altitude_km? 1 m is 0.001 km"),
        ("limit_ma_m2", "did you mean limit_a_m2? 1 mA m^2 is 0.001 A m^2"),
        ("altitud_km", "did you mean altitude_km or apogee_altitude_km?"),
    ],
)  # fmt: skip
def test_a_name_in_another_unit_is_answered_by_the_conversion(name, end):
    with pytest.raises(ValueError) as error:
        find(name)
    assert str(error.value).endswith(f"; {end}")
