"""Scenarios made at random with several devices of a kind, through all that flies them."""

import json
import os
import random
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from random_devices import random_scenario

import torquer
from torquer.analysis.notes.assess import UNEXPECTED
from torquer.analysis.notes.notes import write_notes
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.group import Lanes, Pieces, why_not_in_lanes
from torquer.simulation.setup.run import prepare
from torquer.simulation.setup.usable import checked_size

in_flight = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def valid(numbers, fixed_steps=None):
    """Numbers and scenarios, without the few that lack what their law needs, in one line each."""
    found = {}
    for number in numbers:
        try:
            found[number] = scenario_from_text(random_scenario(number, fixed_steps))
        except ValueError as error:
            assert "\n" not in str(error) and "control.estimator" in str(error), number
    assert len(found) > 0.9 * len(numbers)
    return found


@pytest.fixture(autouse=True)
def _without_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def same(a, b):
    """Whether two results are the same, bit for bit."""
    assert sorted(a.variables) == sorted(b.variables)
    for name in a.variables:
        floats = a[name].dtype.kind == "f"
        assert np.array_equal(a[name].values, b[name].values, equal_nan=floats), name
    return a.attrs == b.attrs


def check(scenario):
    checked_size(scenario)
    notes = write_notes(scenario)
    assert not any(UNEXPECTED in note for note in notes), notes


def test_scenarios_with_several_devices_are_valid():
    for scenario in valid(range(25)).values():
        check(scenario)


@pytest.mark.slow
def test_300_scenarios_with_several_devices_are_valid():
    for scenario in valid(range(300)).values():
        check(scenario)


@pytest.mark.slow
@in_flight
def test_stopped_stored_and_resumed_runs_have_the_same_bits(tmp_path):
    for number, scenario in valid(range(100)).items():
        chance, whole = random.Random(number), torquer.simulate(scenario)
        assert whole.attrs["how_it_ended"] == "complete", number
        stop_s = chance.choice([0.0, 0.5, 13.0, 30.5, chance.uniform(0.0, 60.0)])
        part = torquer.simulate(scenario, until_s=stop_s)
        if number % 2:
            torquer.save(part, tmp_path / f"{number}.nc")
            part = torquer.load(tmp_path / f"{number}.nc")
        if number % 3 == 0:
            part = torquer.resume(part, until_s=chance.uniform(stop_s, 60.0))
        assert same(torquer.resume(part), whole), number


@pytest.mark.slow
@in_flight
@pytest.mark.parametrize(("count", "fixed_steps"), [(12, True), (6, False)])
def test_members_in_lanes_have_the_bits_of_their_own_flights(count, fixed_steps):
    """Some seconds of compiling each: what their devices are is in the code."""
    for number, scenario in valid(range(count), fixed_steps).items():
        run = prepare(scenario)
        if why_not_in_lanes(run):
            continue
        motions = np.tile(np.array(run.state.cells.view(np.float64)[:7]), (21, 1))
        motions[:, 4:] *= np.linspace(0.2, 3.0, 21)[:, None]
        lanes, seeds = Lanes(run, Pieces(run)), np.arange(100, 121)
        flown = lanes.fly(lanes.numbers_of(motions), seeds)
        assert not flown.failed.any(), number
        for row in (0, 7, 20):
            own = prepare(scenario.replace("seed", int(seeds[row])), piece=run.piece)
            own.state.cells.view(np.float64)[:7] = motions[row]
            assert own.advance_to(own.steps) == 0
            rows = own.rows().rows
            kept = np.column_stack([rows[name] for name in rows.dtype.names[1:8]])
            assert np.array_equal(flown.motion[: len(kept), :, row], kept), number


@pytest.mark.slow
@in_flight
@needs_compiler
def test_exports_replay_with_the_same_bits(tmp_path):
    for number, scenario in valid(range(40)).items():
        folder = Path(tmp_path, str(number))
        torquer.export_c(scenario, folder, steps=60)
        sources = [folder / name for name in ("adcs.c", "adcs_tables.c", "test/replay.c")]
        command = [COMPILER, *FLAGS, "-Wall", "-Wextra", "-Werror", f"-I{folder}"]
        command += ["-o", folder / "replay", *sources, "-lm"]
        made = subprocess.run(command, capture_output=True, text=True)
        assert made.returncode == 0, (number, made.stderr)
        replayed = [folder / "replay", folder / "test/recorded.bin"]
        done = subprocess.run(replayed, capture_output=True, text=True)
        assert done.returncode == 0, (number, done.stdout + done.stderr)


_WITHOUT_JIT = """
import json, sys, warnings
import torquer
from torquer.scenario.load import scenario_from_text
warnings.simplefilter("ignore")
results = [torquer.simulate(scenario_from_text(text)) for text in json.load(sys.stdin)]
names = ("q_body_to_inertial", "omega_body", "b_measured", "sun_measured")
print(json.dumps([{name: r[name].values.tolist() for name in names} for r in results]))
"""


@pytest.mark.slow
@in_flight
def test_plain_python_computes_the_same():
    """As far as quanta, limits and gates let it: those turn a last bit into a step of a reading."""
    scenarios = valid(range(30))
    texts = [random_scenario(number) for number in scenarios]
    done = subprocess.run(
        [sys.executable, "-c", _WITHOUT_JIT], input=json.dumps(texts), text=True,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True, check=True, timeout=300,
    )  # fmt: skip
    for number, plain in zip(scenarios, json.loads(done.stdout), strict=True):
        compiled = torquer.simulate(scenarios[number])
        for name, values in plain.items():
            own, theirs = compiled[name].values, np.array(values, float)
            assert np.array_equal(np.isfinite(own), np.isfinite(theirs)), (number, name)
            known = np.isfinite(own)
            scale = max(np.abs(own[known]).max(initial=0.0), 1e-30)
            assert np.abs(own - theirs)[known].max(initial=0.0) < 1e-9 * scale, (number, name)
