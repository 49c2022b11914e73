"""What to cite: every model has its sources, a scenario those that it uses; BibTeX is sound."""

import importlib
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

import torquer
from torquer.analysis.citations import OWN, cited_in_words, select_sources, source_table
from torquer.base.spec import Spec
from torquer.computer.estimation import ESTIMATORS
from torquer.computer.laws.built_in import BUILT_IN
from torquer.environment.earth.atmosphere import ATMOSPHERES
from torquer.environment.orbit import ORBITS
from torquer.scenario.load import scenario_schema

ROOT = Path(__file__).parents[2]
#: May have no source: what is textbook knowledge or the package's own.
PUBLISHED_OR_OWN = {**BUILT_IN, **ESTIMATORS}
NAMES_A_SOURCE = re.compile(r"\b(MAG|SDOT|FIELD|WHEEL|MGS)\b|\((19|20)\d\d\)")
REGISTRIES = (BUILT_IN, ESTIMATORS, torquer.FIELDS, ORBITS, ATMOSPHERES)


def keys_of(scenario) -> dict[str, tuple]:
    return {source.key: source.uses for source in select_sources(scenario)}


@pytest.mark.parametrize("kind", sorted({*torquer.FIELDS, *ATMOSPHERES} - {"user"}))
def test_every_model_of_field_and_air_has_its_sources(kind):
    found = source_table()["used_by"]["value"]["kind"].get(kind)
    assert found and set(found) <= set(source_table()["source"]), kind


def docstrings_of(spec) -> str:
    """Of its module, itself, its kernel."""
    said = [importlib.import_module(spec.__module__), spec, getattr(spec, "kernel", None)]
    return "\n".join(each.__doc__ or "" for each in said)


@pytest.mark.parametrize("kind", PUBLISHED_OR_OWN)
def test_what_names_a_source_has_it_in_the_table(kind):
    """A law without one is the package's own and needs no line."""
    named = NAMES_A_SOURCE.search(docstrings_of(PUBLISHED_OR_OWN[kind]))
    assert not named or source_table()["used_by"]["value"]["kind"].get(kind), named[0]


def test_a_law_that_names_a_source_is_noticed():
    named = [bool(NAMES_A_SOURCE.search(docstrings_of(BUILT_IN[kind]))) for kind in ("bdot", "off")]
    assert named == [True, False]


def test_the_table_names_nothing_that_is_not_there():
    table = source_table()["used_by"]
    kinds = [kind for registry in REGISTRIES for kind in registry if kind != "user"]
    assert len(kinds) == len(set(kinds)) and set(table["value"]["kind"]) <= set(kinds)
    schema = json.dumps(scenario_schema())
    for key in ("earth_rotation", "integrator"):
        for value in table["value"][key]:
            assert f'"{value}"' in schema
    everything = [*table["table"].values()]
    everything += [found for of_key in table["value"].values() for found in of_key.values()]
    used = {key for found in everything for key in found}
    assert OWN not in used and used | {OWN} == set(source_table()["source"])
    for path in table["table"]:
        of: type | None = torquer.Scenario
        for name in path.split("."):
            assert of is not None and name in of.model_fields, path
            given = of.model_fields[name].annotation
            of = next((each for each in (given, *get_args(given)) if is_spec(each)), None)


def is_spec(kind) -> bool:
    return isinstance(kind, type) and issubclass(kind, Spec)


def test_a_source_that_a_docstring_names_is_in_its_entry():
    """Years of sources named in the docstring of a law or estimator's module."""
    sources = source_table()["source"]
    for registry in (BUILT_IN, ESTIMATORS):
        for kind, spec in registry.items():
            text = __import__(spec.__module__, fromlist=["_"]).__doc__
            entry = source_table()["used_by"]["value"]["kind"].get(kind, ())
            years = set(re.findall(r"\((\d{4})\)| (1998), and his", text))
            cited = {sources[key].get("year") for key in entry}
            assert {a or b for a, b in years} <= cited, kind


def test_only_what_the_scenario_uses_is_cited():
    day = keys_of(torquer.load_scenario(ROOT / "examples/chibis_m_day.toml"))
    assert {"torquer", "IGRF14", "WHEEL", "MAG", "SDOT", "Lefferts1982", "Black1964"} <= set(day)
    assert not {"Vallado2006", "Pavlis2012", "GOST", "WMM2025", "Flatley1994"} & set(day)
    assert day["MAG"] == ("control.laws.damping (bdot)",)
    assert next(iter(day)) == "torquer" and day["torquer"] == ()
    far = keys_of(torquer.load_scenario(ROOT / "examples/five_days.toml"))
    assert far["Pavlis2012"] == ("orbit (numerical)",)
    assert "orbit.drag.atmosphere (gost)" in far["GOST"] and "Lefferts1982" not in far


def test_a_disturbance_that_is_not_there_is_not_cited():
    scenario = torquer.load_scenario(ROOT / "examples/disturbances.toml")
    assert {"Wertz1978", "Markley2014", "Flatley1994"} <= set(keys_of(scenario))
    without = scenario.replace("disturbance", {}).replace("spacecraft.sun_sensors", None)
    assert not {"Wertz1978", "Markley2014", "Flatley1994"} & set(keys_of(without))
    rods = torquer.load_scenario(ROOT / "examples/passive_magnet.toml")
    assert "Flatley1995" in keys_of(rods) and "Flatley1995" not in keys_of(scenario)


def test_what_a_scenario_has_none_of_is_not_cited():
    """Of every table and list that calls for a source, whatever stands for none of it."""
    table = torquer.load_scenario(ROOT / "examples/chibis_m_detumble.toml")
    plain = table.model_dump(mode="json")
    for uses in keys_of(table).values():
        for use in uses:
            value = plain
            for name in use.partition(" (")[0].split("."):
                value = value[name]
            assert value not in (None, [], 0.0), use


def test_a_tilted_dipole_has_the_coefficients_of_its_model():
    scenario = torquer.load_scenario(ROOT / "examples/spinner.toml")
    for source, key in (("igrf14", "IGRF14"), ("wmm2025", "WMM2025")):
        field = {"kind": "tilted_dipole", "source": source, "held_at_year": 2025.5}
        found = keys_of(scenario.replace("environment.field", field))
        assert key in found and "FIELD" in found
        assert len({"IGRF14", "WMM2025"} & set(found)) == 1


def test_bibtex_has_balanced_braces_unique_keys_and_no_bare_signs():
    scenario = torquer.load_scenario(ROOT / "examples/disturbances.toml")
    text = torquer.citations(scenario)
    assert text.count("{") == text.count("}")
    keys = re.findall(r"^@\w+\{(\w+),$", text, re.M)
    assert keys == list(keys_of(scenario)) and len(keys) == len(set(keys))
    for key, fields in source_table()["source"].items():
        entry = select_sources(scenario)[0]._replace(key=key, fields=fields)
        assert not re.search(r"(?<!\\)[&#%]", entry.as_bibtex())
        assert "{" not in entry.in_words() and ".." not in entry.in_words()
    assert f"version = {{{torquer.__version__}}}" in text


def test_the_package_is_cited_as_its_own_file_says():
    given = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    own = source_table()["source"][OWN]
    assert f'title: "{own["title"]}"' in given and own["author"].strip("{}") in given


def test_a_result_is_cited_as_its_scenario(make):
    scenario = make()
    result = torquer.simulate(scenario)
    assert torquer.citations(result) == torquer.citations(scenario)
    assert result.torquer.citations() == torquer.citations(scenario)
    assert torquer.summarise(result)["cite"] == cited_in_words(scenario)
    assert list(cited_in_words(scenario)) == list(keys_of(scenario))
    saltelli = result.assign_attrs(campaign='{"sampling": "saltelli"}')
    assert "Saltelli2010" in keys_of(saltelli) and "Saltelli2010" not in keys_of(result)


def test_what_has_no_scenario_is_refused(make):
    with pytest.raises(ValueError, match=r"must be of a Scenario or a result; received str$"):
        torquer.citations("chibis_m_day.toml")


def test_citations_do_not_load_xarray():
    code = "import sys, torquer; torquer.citations; print('xarray' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
