"""A distribution of one's own is code of a user's: where it is executed, and where not."""

import json

import pytest
from tip_off import SCENARIO

PLACE = "campaign.vary.initial.rate_deg_s.own.file"
SATELLITE = (
    SCENARIO
    + """
[campaign]
runs = 6
[campaign.vary]
initial.rate_deg_s = { own = { file = "trace.py", draws = 2 } }
"""
)
TRACE = """
from pathlib import Path
Path(__file__).with_suffix(".executed").touch()

def rates(u):
    return u[0], u[1], 0.5
"""


@pytest.fixture
def traced(tmp_path):
    (tmp_path / "trace.py").write_text(TRACE)
    (tmp_path / "c.toml").write_text(SATELLITE)
    return tmp_path


@pytest.mark.parametrize("command", ["campaign", "validate", "campaign --member 1"])
def test_it_is_not_executed_where_no_code_is_allowed(call, traced, command):
    words = [*command.split(), traced / "c.toml", "--no-user-code"]
    more = [] if command == "validate" else ["--out", traced / "out"]
    code, _, told = call(*words, *more)
    assert code == 2 and f"{PLACE}: must not be given with --no-user-code; received " in told
    assert not (traced / "trace.executed").exists()


def test_it_lies_in_the_folder_of_the_scenario(call, traced):
    (traced / "inner").mkdir()
    (traced / "inner" / "c.toml").write_text(SATELLITE.replace("trace.py", "../trace.py"))
    code, _, told = call("validate", traced / "inner" / "c.toml")
    expected = "must lie in the scenario's folder, or be allowed by --code-from-anywhere; received"
    assert code == 2 and f"{PLACE}: {expected}" in told
    assert not (traced / "trace.executed").exists()


def test_validate_names_it(call, traced):
    code, said, _ = call("validate", traced / "c.toml", "--json")
    assert not code and json.loads(said)["executes"] == [str(traced / "trace.py")]
    assert (traced / "trace.executed").exists()
