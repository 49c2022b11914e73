"""A short scenario and the means to call a command on it."""

import json

import pytest

from torquer.cli import main

SCENARIO = """
start = 2012-03-04T10:31:47Z
seed = 5
[orbit]
kind = "circular"
altitude_km = 550
inclination_deg = 60
[environment]
field = { kind = "averaged" }
[spacecraft.body]
inertia_kg_m2 = [1.0, 1.2, 1.5]
[spacecraft.coils]
limit_a_m2 = 3.0
[spacecraft.magnetometer]
noise_nt = 20
[initial]
rate_deg_s = [1.0, -2.0, 3.0]
[control]
sample_s = 2.0
law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }
[simulation]
step_s = 1.0
duration_s = 300
record_s = 5.0
"""


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SCENARIO)
    return path


def caller(capsys, *words):
    """What calls commands that begin with words."""

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in (*words, *arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return left.value.code, out, err

    return run


@pytest.fixture
def call(capsys):
    """`call("run", path)`: exit code, standard output, standard error of a command."""
    return caller(capsys)


@pytest.fixture
def call_ground(capsys):
    """The same of `torquer ground`, whose exit code is a number."""
    run = caller(capsys, "ground")

    def ended(*arguments):
        code, out, err = run(*arguments)
        return code or 0, out, err

    return ended


@pytest.fixture(autouse=True)
def warm(monkeypatch):
    """Nothing is said of compiling, as with a warm cache: the first test of a suite has none."""
    monkeypatch.setattr("torquer.cli.compiling._has_loop", lambda: True)


@pytest.fixture
def no_report(monkeypatch):
    """Runs without pictures: they have tests of their own."""
    monkeypatch.setattr("torquer.report.write_report", lambda result, out, **_: {})


@pytest.fixture
def strict_json():
    """Parser that takes no NaN and no Infinity."""
    return json.JSONDecoder(parse_constant=lambda name: pytest.fail(f"{name} is no JSON")).decode
