"""Scenarios between the page and TOML, mistakes with their keys, and which code may run."""

from pathlib import Path

import pytest

from torquer.base.explain import ScenarioError
from torquer.pages.board.text import data_from_toml, files_in, mistakes_in, read_scenario
from torquer.scenario.load import load_scenario
from torquer.scenario.toml_text import toml_from_data

EXAMPLES = sorted(Path("examples").glob("*.toml"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_scenario_survives_the_way_to_the_page_and_back(path):
    data = data_from_toml(path.read_text(encoding="utf-8"))
    again = data_from_toml(toml_from_data(data))
    assert again == data
    code = {file for _, file in files_in(data, path.parent)}
    named = {"name": path.stem, **again}
    assert read_scenario(named, path.parent, code) == load_scenario(path)


def test_mistakes_come_with_their_keys(data):
    data["spacecraft"]["body"]["inertia_kg_m2"] = [0.01, 0.01, 0.05]
    data["control"]["law"]["gain_a_m2_s_per_t"] = -1.0
    data["orbit"]["altitud_km"] = data["orbit"].pop("altitude_km")
    with pytest.raises(ScenarioError) as error:
        read_scenario(data, Path(), ())
    found = mistakes_in(str(error.value))
    keys = {each["key"] for each in found}
    assert {"spacecraft.body.inertia_kg_m2", "control.law.gain_a_m2_s_per_t"} <= keys
    assert any("triangle inequality" in each["text"] for each in found)
    assert any("altitud_km" in each["key"] for each in found)


def test_a_reason_without_a_key_has_none():
    assert mistakes_in("the run is too long") == [{"key": "", "text": "the run is too long"}]


EVIL = {"kind": "user", "file": "evil.py"}


@pytest.mark.parametrize(
    ("table", "part"),
    [
        ("control", {"law": EVIL}),
        ("control", {"laws": {"mine": {"kind": "user", "file": "../evil.py"}}}),
        ("control", {"law": {"kind": "off"}, "estimator": EVIL}),
        ("control", {"law": {"kind": "off"}, "estimators": {"other": EVIL}}),
        ("control", {"law": {"kind": "off"}, "ephemeris": {"orbit": EVIL}}),
        ("orbit", {**EVIL, "revolution_s": 5600.0}),
        ("orbit", {"kind": "file", "file": "/etc/passwd"}),
        ("environment", {"field": EVIL}),
        ("environment", {"atmosphere": EVIL}),
        ("disturbance", {"own": {"jet": EVIL}}),
        ("spacecraft", {"body": {"inertia_kg_m2": [1, 1, 1]}, "own_sensor": EVIL}),
    ],
)
def test_board_executes_and_reads_only_the_files_it_was_opened_with(data, tmp_path, table, part):
    ran = tmp_path / "ran"
    for folder in (tmp_path, tmp_path / "inner"):
        folder.mkdir(exist_ok=True)
        (folder / "evil.py").write_text(f"open({str(ran)!r}, 'w').close()\n", encoding="utf-8")
    data[table] = part
    with pytest.raises(ScenarioError, match="must be a file that the board was opened with"):
        read_scenario(data, tmp_path / "inner", {tmp_path / "my_law.py"})
    assert not ran.exists()
