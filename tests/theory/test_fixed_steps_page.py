"""docs/theory/fixed-steps.md: its tables are the record's, and a row of the record is measured."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from loaded_scripts import loaded

from torquer.compile import engine
from torquer.maths.integrate.rk4 import rk4_damping, rk4_lag
from torquer.scenario.resolution import step_that_keeps

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/theory/fixed-steps.md").read_text(encoding="utf-8")
RECORD = json.loads((ROOT / "benchmarks/fixed_steps.json").read_text(encoding="utf-8"))
ANGLES, FREE = np.array(RECORD["angles"]), RECORD["free"]
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="thousands of steps")


@pytest.fixture(scope="module")
def script():
    """The script that makes the record."""
    return loaded(ROOT / "benchmarks/fixed_steps.py")


def a_turn(summed) -> list[float]:
    """What a function of the kernels adds up in a turn, at each angle within a step."""
    return [summed(z * z, 1.0, 2.0 * math.pi / z) for z in ANGLES]


def cells(first: str) -> list[str]:
    (line,) = [line for line in PAGE.splitlines() if line.startswith(f"| {first} |")]
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


@pytest.mark.parametrize(
    ("row", "values"),
    [
        ("lag a turn, formula [deg]", np.degrees(a_turn(rk4_lag))),
        ("lag a turn, run [deg]", np.degrees(FREE["lag"]["RK4"])),
        ("nutation lost a turn, formula [%]", 100.0 * np.array(a_turn(rk4_damping))),
        ("nutation lost a turn, run [%]", 100.0 * np.array(FREE["nutation"]["RK4"])),
        ("momentum lost a turn, run [%]", 100.0 * np.array(FREE["momentum"]["RK4"])),
    ],
)
def test_tables_of_the_free_motion(row, values):
    assert [float(cell) for cell in cells(row)] == pytest.approx(values, rel=6e-3)


@pytest.mark.parametrize(
    ("row", "key"),
    [
        ("RK4, 1 step a control step", "RK4, 1 a control step"),
        ("RK4, 10 steps a control step", "RK4, 10 a control step"),
        ("splitting, 1 step a control step", "splitting, 1 a control step"),
        ("default", "default"),
    ],
)
def test_the_table_of_sampled_control(row, key):
    assert cells(row) == [f"{part:.5f}" for part in RECORD["bdot"][key]]


def test_the_formulas_are_the_first_terms_of_what_runs_do():
    """The next terms: 1 - 5 (z/2)^2/14 of the lag, 1 - z^2/8 of the damping."""
    lag, lost = np.array(FREE["lag"]["RK4"]), np.array(FREE["nutation"]["RK4"])
    assert lag / a_turn(rk4_lag) == pytest.approx(1.0 - 5.0 * ANGLES**2 / 56.0, abs=5e-3)
    assert lost / a_turn(rk4_damping) == pytest.approx(1.0 - ANGLES**2 / 8.0, abs=5e-3)


def test_momentum_falls_with_the_fifth_power():
    slope = np.polyfit(np.log(ANGLES[:4]), np.log(FREE["momentum"]["RK4"][:4]), 1)[0]
    assert slope == pytest.approx(5.0, abs=0.03)


@pytest.mark.parametrize("kind", FREE)
def test_splitting_and_the_default_do_neither(kind):
    assert np.abs(FREE[kind]["splitting"]).max() < 1e-12
    assert np.degrees(np.abs(FREE[kind]["default"]).max()) < 1e-9


def test_the_rule_for_the_step():
    steps = [step_that_keeps(0.01, math.radians(rate), 86400.0) for rate in (1.0, 10.0, 300.0)]
    said = "the step is {:.2g} s; at 10 deg/s it is {:.2g} s, at 300 deg/s it is {:.2g} s"
    assert said.format(*steps) in " ".join(PAGE.split())


@needs_jit
def test_the_record_is_what_runs_give(script):
    place, z = 2, RECORD["angles"][2]
    for kind, run in script.KINDS.items():
        expected = FREE[kind]["RK4"][place]
        assert run(z, script.INTEGRATORS["RK4"]) == pytest.approx(expected, rel=1e-4)
    left = script.bdot_left(z, script.INTEGRATORS["default"], 1)
    assert left == pytest.approx(RECORD["bdot"]["default"][place], rel=1e-9)
