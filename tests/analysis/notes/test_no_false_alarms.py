"""What ships with the package is sound: no note on devices and what is assumed of them."""

import tomllib
from pathlib import Path

import pytest
from device_cases import DEVICES
from test_tutorials import PAGES, TOML, blocks_of, merged, without_tables

from torquer.analysis.notes.assumption_notes import assumption_notes
from torquer.analysis.notes.device_notes import device_notes
from torquer.analysis.notes.reach_notes import reach_notes
from torquer.scenario.load import presets, scenario_from_data

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))
START = ROOT / "torquer" / "scenario" / "start.toml"


def notes_of(data, folder=ROOT / "examples"):
    scenario = scenario_from_data(data, folder)
    return [*device_notes(scenario), *reach_notes(scenario), *assumption_notes(scenario)]


def read(path):
    return {"name": path.stem, **tomllib.loads(path.read_text(encoding="utf-8"))}


@pytest.mark.parametrize("path", [*EXAMPLES, START], ids=lambda path: path.stem)
def test_examples_have_no_notes(path):
    assert notes_of(read(path)) == []


def changes():
    """Scenarios of the tutorials: those that they write, and changes of examples."""
    blocks = {each[:2]: each for page in PAGES for each in blocks_of(page)}
    for place, (action, *files) in TOML.items():
        if action == "ends":
            text = blocks[place[0], 0].text + blocks[place].text
            yield pytest.param(tomllib.loads(text), id="-".join(map(str, place)))
        elif action == "changes" and files[0].startswith("examples/"):
            change = tomllib.loads(blocks[place].text)
            base = without_tables(place, read(ROOT / files[0]))
            yield pytest.param(merged(base, change), id="-".join(map(str, place)))


@pytest.mark.parametrize("data", [*changes()])
def test_scenarios_of_tutorials_have_no_notes(data):
    assert notes_of(data) == []


@pytest.mark.parametrize(
    ("place", "name"), [(place, name) for place in DEVICES for name in presets(place)]
)
def test_devices_of_presets_have_no_notes(plain_data, place, name):
    """Each on the plain satellite."""
    data = plain_data({f"spacecraft.{place}": {"preset": name}})
    assert notes_of(data) == []
