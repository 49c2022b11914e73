"""`torquer faults`: table, files, exit code, the worst flown again; mistakes."""

import re
from pathlib import Path

import pytest

from torquer.compile import engine
from torquer.flight.software.faults import load_faults

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
#: A safe mode whose law, guards and conditions share one gyro.
SAFE_MODE = Path(__file__).parents[1] / "data/safe_mode_of_one_gyro.toml"
FILES = {"faults.md", "faults.png", "faults.nc", "faults.json", "worst.toml"}


def test_a_lost_satellite_is_an_exit_code(call, tmp_path, strict_json):
    out = tmp_path / "out"
    code, said, _ = call(
        "faults", SAFE_MODE, "--only", "gyro zeros", "--only", "coil 0 dead", "--at-h", 10,
        "--out", out,
    )  # fmt: skip
    assert code == 1
    assert {file.name for file in out.iterdir()} == FILES
    assert re.search(r"gyro zeros +sun_pointing, 10.0 h +lost +97", said)
    assert re.search(r"coil 0 dead +sun_pointing, 10.0 h +safe", said)
    assert "With guards: 1 safe, 0 degraded, 1 lost" in said
    assert f"torquer run {out / 'worst.toml'}" in said
    assert "| gyro zeros | sun_pointing, 10.0 h | lost | 97" in (out / "faults.md").read_text()
    code, said, _ = call(
        "run", out / "worst.toml", "--out", tmp_path / "again", "--no-report", "--json"
    )
    assert code == 0
    assert strict_json(said)["final_rate_deg_s"] == pytest.approx(97.1, abs=0.1)


def test_no_satellite_lost(call, tmp_path, strict_json):
    options = ("--only", "coil 0 dead", "--at-h", 1, "--hours", 4, "--seed", 7, "--workers", 1)
    code, said, _ = call("faults", SAFE_MODE, *options, "--out", tmp_path, "--json")
    data = strict_json(said)
    assert code == 0
    assert (data["seed"], data["flight_s"], data["guards"][0]) == (7, 14400.0, "growth")
    assert [flight["fault"] for flight in data["flights"]] == ["coil 0 dead"] * 2
    assert data["worst_file"] == str(tmp_path / "worst.toml")


def test_pairs(call, tmp_path, strict_json):
    options = ("--pairs", 3, "--only", "gyro", "--hours", 4, "--seed", 3, "--out", tmp_path)
    code, said, _ = call("faults", SAFE_MODE, *options, "--json")
    data = strict_json(said)
    assert code == (1 if data["counts"]["lost_unnoticed"] else 0)
    assert (data["pairs"], data["seed"], data["flight_s"]) == (3, 3, 14400.0)
    assert data["worst_file"] == str(tmp_path / "worst.toml")
    files = {"pairs.md", "pairs.json", "worst.toml", "worst-faults.toml"}
    assert {file.name for file in tmp_path.iterdir()} == files
    pair = data["worst"]["faults"]
    assert load_faults(tmp_path / "worst-faults.toml").model_dump(exclude_unset=True)["faults"] == (
        *pair,
    )
    code, said, _ = call("faults", SAFE_MODE, *options)
    assert "3 pairs: " in said and "Lost unnoticed, the coils left to work: " in said
    _, said, _ = call(
        "run", tmp_path / "worst.toml", "--out", tmp_path / "again", "--no-report", "--json"
    )
    assert strict_json(said)["final_rate_deg_s"] <= data["worst"]["rate_deg_s"] + 1e-9


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--only", "tuba"), "--only: must be part of the name of a fault, which begins with one"),
        (("--at-h", "25"), "--at-h: must be a time before the end of the flights, 24 h; received"),
        (("--hours", "0"), "--hours: must be a positive number; received 0"),
        (("--seed=-1",), "--seed: must be 0 or more; received -1"),
        (("--workers", "0"), "--workers: must be 1 or more; received 0"),
        (("--pairs", "0"), "--pairs: must lie within 1..1e+06; received 0"),
        (("--pairs", "2", "--only", "gyro zeros"), "--only: must leave two faults or more for"),
    ],
)
def test_mistakes(call, tmp_path, options, expected):
    code, said, err = call("faults", SAFE_MODE, *options, "--out", tmp_path)
    assert code == 2 and not said
    assert err.startswith(f"error: {expected}") and err.count("\n") == 1
