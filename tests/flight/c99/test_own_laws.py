"""Laws of the user's that keep what one bad reading makes of their memory: they begin again."""

import math

import numpy as np
import pytest
from flight.c99.in_c import needs_compiler
from flight.c99.test_gate import Exported
from flight.c99.test_user_laws import scenario_text

import torquer
from torquer.computer import gate as gates
from torquer.computer.interface import MAGNETOMETER, PLACES
from torquer.spacecraft.sensors.device import MOST_PARTS

LAWS = """
import math
import torquer


@torquer.law(memory={"kept": 0.0})
def compares(inputs, parameters, memory):
    memory.kept = 0.5 * memory.kept + 0.5 * inputs.b_body_t[0]
    if memory.kept > 0.0:
        return (0.1, 0.0, 0.0)
    return (-0.1, 0.0, 0.0) if memory.kept <= 0.0 else (0.0, 0.0, 0.0)


@torquer.law(memory={"kept": 0.0})
def clips(inputs, parameters, memory):
    memory.kept = 0.5 * memory.kept + 0.5 * inputs.b_body_t[0]
    return (max(-0.1, min(0.1, 1e3 * memory.kept)), 0.0, 0.0)


@torquer.law(memory={"rows": ((0.0, 0.0), (0.0, 0.0)), "steps": 0.0})
def counts(inputs, parameters, memory):
    memory.rows[1, 1] = 0.5 * memory.rows[1, 1] + 0.5 * inputs.b_body_t[0]
    share = min(1.0, 1e4 * abs(memory.rows[1, 1]))
    return (0.1 * share, 0.0, 0.0)


@torquer.law(memory={"before": math.nan, "kept": 0.0})
def waits(inputs, parameters, memory):
    memory.kept = min(memory.kept + 0.01, 0.1)
    known = math.isfinite(memory.before)
    memory.before = inputs.b_body_t[0]
    return (memory.kept if known else 0.0, 0.0, 0.0)


@torquer.law(memory={"kept": 0.0, "until_s": 5.0})
def never(inputs, parameters, memory):
    if memory.until_s <= inputs.t_s:
        memory.until_s = math.inf
    return (0.1 if memory.until_s > 1e9 else 0.0, 0.0, 0.0)
"""
BAD, STEPS = 60, 120
KEEPS = ("clips", "compares", "counts")


def written(names: tuple[str, ...], folder) -> None:
    """A scenario with some of the laws, named after the first."""
    (folder / "laws.py").write_text(LAWS)
    (folder / f"{names[0]}.toml").write_text(scenario_text(names))


def spoiled(name: str, number: float, folder):
    """Commands and statuses of a law with one bad reading, and the commands without it."""
    written((name,), folder)
    own = Exported(str(folder / name), folder / "out")
    rows = own.inputs[:STEPS].copy()
    rows[BAD, own.places.index(PLACES["readings"].start + MOST_PARTS * MAGNETOMETER)] = number
    commands, statuses = own.both(rows)
    return commands, statuses, own.both(own.inputs[:STEPS])[0]


@needs_compiler
@pytest.mark.verifies("REQ-BRD-002")
@pytest.mark.parametrize("number", [-math.inf, math.inf, math.nan])
@pytest.mark.parametrize("name", KEEPS)
def test_a_law_that_keeps_no_number_begins_again(name, number, tmp_path):
    commands, statuses, sound = spoiled(name, number, tmp_path)
    begun = (statuses & gates.BEGUN_ANEW) != 0
    assert np.flatnonzero(begun).tolist() == [BAD]
    assert commands[:BAD].tobytes() == sound[:BAD].tobytes()
    assert np.abs(commands - sound)[BAD + 40 :].max() < 1e-3 * np.abs(sound).max()


@needs_compiler
def test_what_is_no_number_at_the_start_may_be_none_again(tmp_path):
    commands, statuses, sound = spoiled("waits", math.nan, tmp_path)
    assert not (statuses & gates.BEGUN_ANEW).any()
    assert np.flatnonzero((commands != sound).any(axis=1)).tolist() == [BAD + 1]


@pytest.mark.parametrize("names", [("never",), ("never", "clips"), ("clips", "never")])
def test_a_law_that_would_begin_again_in_a_sound_flight_is_refused(names, tmp_path):
    written(names, tmp_path)
    scenario = torquer.load_scenario(tmp_path / f"{names[0]}.toml")
    with pytest.raises(ValueError, match=r"^control: law never must keep .* inf at t = 5 s$"):
        torquer.export_c(scenario, tmp_path / "out", steps=20)
    torquer.export_c(scenario, tmp_path / "out", steps=5)
