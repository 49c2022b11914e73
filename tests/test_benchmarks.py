"""Benchmarks on a machine that lacks some of the other programs."""

import json
from pathlib import Path

import pytest
from loaded_scripts import loaded

ROOT = Path(__file__).parents[1]
RESULTS = json.loads((ROOT / "benchmarks/results.json").read_text(encoding="utf-8"))


measured_before = loaded(ROOT / "benchmarks/measured_before.py").measured_before


def test_what_is_not_measured_again_stays_with_its_day():
    kept = measured_before(ROOT / "benchmarks/results.json", "slow", "basilisk")
    assert kept["basilisk_to_torquer"] == RESULTS["slow"]["basilisk_to_torquer"]
    assert kept["basilisk_measured_on"] and not any(key.startswith("scipy") for key in kept)


@pytest.mark.parametrize("text", [None, "{}", '{"slow": {"scipy_to_c++": 2.0}}'])
def test_what_was_never_measured_is_left_out(tmp_path, text):
    if text is not None:
        (tmp_path / "results.json").write_text(text)
    assert measured_before(tmp_path / "results.json", "slow", "basilisk") == {}
