"""The form: every key of the scenario as a field, with a slider that can hold its value."""

from pathlib import Path

import pytest

from torquer.pages.board.form import make_form
from torquer.pages.board.text import data_from_toml, files_in, read_scenario
from torquer.scenario.change import value_at
from torquer.scenario.keys import spec_keys
from torquer.spacecraft.actuators.coils import Coils

EXAMPLES = sorted(Path("examples").glob("*.toml"))


def fields_of(data):
    return {field["key"]: field for table in make_form(data) for field in table["fields"]}


def tables_of(data):
    return {table["key"]: table for table in make_form(data)}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_values_are_those_of_the_scenario_and_within_their_sliders(path):
    data = data_from_toml(path.read_text(encoding="utf-8"))
    code = {file for _, file in files_in(data, path.parent)}
    scenario = read_scenario(data, path.parent, code)
    fields = fields_of(data)
    assert len(fields) > 40
    for key, field in fields.items():
        if not field["given"] or field["type"] not in ("number", "numbers", "whole"):
            continue
        assert field["value"] == pytest.approx(as_given(value_at(scenario, key), field["value"]))
        if field["slider"] is None:
            continue
        numbers = field["value"] if field["type"] == "numbers" else [field["value"]]
        low, high = field["slider"]["low"], field["slider"]["high"]
        assert low < high and (low > 0.0 or not field["slider"]["log"]), key
        assert all(low <= x <= high for x in numbers), key


def as_given(value, given):
    """A tensor as the three moments that stand for it."""
    if isinstance(given, list) and value and isinstance(value[0], tuple | list):
        return [row[k] for k, row in enumerate(value)]
    return list(value) if isinstance(value, tuple) else value


def test_texts_units_and_bounds_are_those_of_the_specs(data):
    fields = fields_of(data)
    for key in spec_keys(Coils):
        field = fields.get(f"spacecraft.coils.{key.name}")
        if key.name == "failures" or field is None:  # a list of tables, not given
            continue
        assert (field["about"], field["unit"]) == (key.description, key.unit)
    inertia = fields["spacecraft.body.inertia_kg_m2"]
    assert inertia["type"] == "numbers" and inertia["slider"]["log"] and inertia["given"]
    assert not inertia["required"]  # box_m or parts may stand in its place
    assert fields["orbit.inclination_deg"]["slider"] == {"low": 0.0, "high": 180.0, "log": False}
    assert fields["simulation.integrator"]["choices"] == ["auto", "rk4", "splitting"]
    assert fields["environment.gravity_gradient"]["type"] == "flag"
    assert fields["control.sample_s"]["given"] and not fields["control.measure_s"]["given"]


def test_tables_that_are_left_out_can_be_added(data):
    tables = tables_of(data)
    assert not tables["spacecraft.wheels"]["present"] and tables["spacecraft.wheels"]["optional"]
    assert tables["spacecraft.wheels"]["presets"] == ["chibis_m_wheels"]
    data["spacecraft"]["wheels"] = {"preset": "chibis_m_wheels"}
    fields = fields_of(data)
    assert fields["spacecraft.wheels.torque_limit_n_m"]["value"] > 0.0
    assert not fields["spacecraft.wheels.torque_limit_n_m"]["given"]
    lost = fields["spacecraft.wheels.lost"]
    assert (lost["type"], lost["value"]) == ("data", [])  # else there would be nothing to write in


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_each_of_several_numbers_has_a_name(path):
    fields = fields_of(data_from_toml(path.read_text(encoding="utf-8")))
    for key, field in fields.items():
        if field["type"] == "numbers":
            assert len(field["parts"]) == len(field["value"] or [0.0] * 3) > 0, key
    assert fields["initial.rate_deg_s"]["parts"] == ["x", "y", "z"]  # axes of the body
    if "initial.euler_deg" in fields:
        assert fields["initial.euler_deg"]["parts"] == ["1", "2", "3"]  # in their sequence


def test_other_kind_has_its_own_fields_and_required_ones(data):
    tables = tables_of(data)
    kind = tables["control.law"]["kind"]
    assert kind["value"] == "bdot" and {"sdot", "three_axis"} <= set(kind["choices"])
    assert not {"user", "given_in_python", "scheme"} & set(kind["choices"])
    data["control"]["law"] = {"kind": "three_axis"}
    field = fields_of(data)["control.law.angle_gain_n_m_per_t2"]
    assert field["required"] and field["value"] is None


def test_a_form_is_made_of_wrong_data_too(data):
    data["orbit"] = {"kind": "elliptic"}
    data["spacecraft"]["body"]["inertia_kg_m2"] = "heavy"
    data["spacecraft"]["coils"] = 5
    data["control"] = {"preset": "none"}
    assert fields_of(data)["orbit.inclination_deg"]["value"] is None
