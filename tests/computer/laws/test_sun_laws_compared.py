"""The comparison of Sun-pointing laws in `examples/`: what laws read, what counts as settled."""

import importlib.util
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from torquer import fly_campaign
from torquer.campaign.faults.fly import simulate_or_stop
from torquer.compile import engine

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/tutorials/my-wheels-died.md").read_text(encoding="utf-8")
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def _script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f"examples/{name}.py")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


compared = _script("compare_sun_laws")
LAWS = compared.contenders()
GAINS = json.loads((ROOT / "examples/sun_laws.json").read_text(encoding="utf-8"))
SENSORS = {"magnetometer": "magnetometer", "gyro": "gyro", "sun_sensors": "Sun sensors"}


@needs_jit
@pytest.mark.parametrize("name", LAWS)
def test_a_law_reads_the_sensors_that_the_comparison_says(name):
    """The motion changes with a sensor that reads the reverse only if the law reads it."""
    scenario, _ = compared.scenario_of(LAWS[name], GAINS[name])
    scenario = scenario.replace("simulation.duration_s", 14400)
    reverse = [{"kind": "reversed", "from_s": 0.0}]
    flown = {
        key: simulate_or_stop(
            scenario.replace(f"spacecraft.{key}.failures", reverse) if key else scenario
        ).omega_body.values
        for key in ("", *SENSORS)
    }
    read = [text for key, text in SENSORS.items() if not np.array_equal(flown[key], flown[""])]
    assert ", ".join(read) == LAWS[name].reads


def test_gains_are_those_of_laws_and_within_search_ranges():
    assert list(GAINS) == list(LAWS)
    for name, gains in GAINS.items():
        assert list(gains) == list(LAWS[name].ranges)
        for key, (low, high) in LAWS[name].ranges.items():
            assert low <= gains[key] <= high


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_every_law_has_the_same_number_of_designs(dimensions):
    before: list = []
    for number, (count, _) in enumerate(compared.ROUNDS):
        points = compared.designs_of(number, before, count, dimensions)
        assert points.shape == (count, dimensions)
        assert points.min() >= 0.0 and points.max() <= 1.0
        kept = {tuple(point) for point in before[: compared.PARENTS]}
        assert kept <= {tuple(point) for point in points}  # the best are flown again
        before = list(points)
    assert len({tuple(point) for point in before}) == len(before)


def test_least_energy_decides_between_equally_fast_designs():
    costs = np.array([[2.0, 9.0], [2.4, 5.0], [2.6, 1.0], [5.0, 0.5]])
    assert compared.best_first(costs).tolist() == [1, 0, 2, 3]


def outcomes(**values):
    """Outcomes of a group of four starts; those that are left out are zeros."""
    none = np.zeros((1, 4))
    return compared.Flown(**{name: none for name in compared.Flown._fields} | values)


def test_unsettled_start_counts_in_every_quantile():
    """One settles after 1 h, one is late, one was there and left, one was never there."""
    missing = np.nan
    flown = outcomes(
        succeeded=np.array([[1, 0, 0, 0]]),
        settling_s=np.array([[3600.0, 84000.0, missing, missing]]),
        first_s=np.array([[1800.0, 84000.0, 600.0, missing]]),
        near_sun=np.array([[1.0, 0.4, 0.6, 0.0]]),
        error_deg=np.array([[5.0, 60.0, 100.0, 170.0]]),
    )
    assert compared.settling_h(flown).tolist() == [[1.0, np.inf, np.inf, np.inf]]
    two = compared.Flown(*(np.repeat(each, 2, axis=0) for each in flown))
    cells = re.split(r"\s{2,}", compared.row("a law", two))
    assert cells[1:5] == ["25.0 +- 0.0 %", "not reached", "50.0 %", "75.0 %"]


def test_standard_error_is_that_of_groups_sharing_an_orbit():
    """On one orbit all settle, on the other none: two orbits, not eight starts."""
    settled = np.array([[1] * 4, [0] * 4])
    ones = np.ones((2, 4))
    flown = compared.Flown(settled, *[ones] * (len(compared.Flown._fields) - 1))
    assert "50.0 +- 50.0 %" in compared.row("a law", flown)


# ------------------------------------------------------------------ the tutorial


def test_the_tutorial_shows_all_laws_with_their_sensors_and_gains():
    for name, law in LAWS.items():
        assert re.search(rf"^\| {re.escape(name)} \| {re.escape(law.reads)} \|", PAGE, re.M), name
        numbers = ", ".join(f"{gain:g}" for gain in GAINS[name].values())
        assert re.search(rf"^\| {re.escape(name)} \|.*\| {re.escape(numbers)} \|", PAGE, re.M), name


SHOWN = {
    found[1].strip(): (float(found[2]), float(found[3]))
    for found in re.finditer(r"^(\S.*?) +([\d.]+) \+- +([\d.]+) %", PAGE, re.M)
}


def test_tutorial_table_has_every_laws_row_under_the_script_head():
    assert list(SHOWN) == list(LAWS)
    assert f"\n{compared.HEAD}\n" in PAGE


@needs_jit
@pytest.mark.filterwarnings("ignore::torquer.campaign.fly.OneByOne")
@pytest.mark.parametrize("name", ["cross product, B-dot by gyro", "spin, then to the Sun"])
def test_the_tutorial_s_shares_are_those_of_other_starts(name):
    """Sixteen orbits, with one start each: independent of each other, and of the table's starts."""
    scenario, campaign = compared.scenario_of(LAWS[name], GAINS[name])
    flown = fly_campaign(scenario, campaign.model_copy(update={"runs": 16, "seed": 2}), workers=1)
    settled = int(flown.succeeded.sum())
    assert binomtest(settled, 16, SHOWN[name][0] / 100.0).pvalue > 1e-3
