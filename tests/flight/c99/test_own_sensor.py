"""A law that reads the sensor of the user's own, and their estimator, in C: the same bits."""

import shutil

import numpy as np
import pytest
from flight.c99.in_c import needs_compiler
from flight.c99.test_export import built, replayed
from own_parts import ESTIMATED, MINE, SENSOR, scenario_maker
from simulation.outside.test_library import assert_same_bits

import torquer
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
LATE = SENSOR.replace("noise =", "sample_s = 3.0, delay_s = 1.0, noise =")
FAILED = SENSOR.replace("noise =", "failures = [{ kind = 'stuck', from_s = 60.0 }], noise =")


@pytest.fixture
def scenario(tmp_path):
    """A function that makes the scenario of some lines, beside files of parts."""
    return scenario_maker(tmp_path)


def exported(made, folder, steps=1):
    torquer.export_c(made, folder, steps=steps)
    return folder


@needs_compiler
@pytest.mark.parametrize("line", (SENSOR, LATE, FAILED))
def test_a_replay_of_what_the_sensor_read_has_the_same_bits(scenario, tmp_path, line):
    """And with another factor of a reading the replay tells so."""
    folder = exported(scenario(line, control=MINE), tmp_path / "c", steps=150)
    done = replayed(built(folder), folder)
    same = "150 control steps: the same bits in commands and state\n"
    assert (done.returncode, done.stdout) == (0, same), done
    text = (folder / "adcs.c").read_text()
    assert text.count("0.05 * ") == 1
    (folder / "adcs.c").write_text(text.replace("0.05 * ", "0.06 * "))
    done = replayed(built(folder), folder)
    assert done.returncode != 0 and "same bits" not in done.stdout


@needs_compiler
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("line", (SENSOR, LATE, FAILED))
def test_a_flight_of_the_computer_in_c_has_the_same_bits(scenario, tmp_path, line):
    made = scenario(line, control=MINE)
    without = torquer.simulate(made)
    flown = torquer.simulate(made, computer=exported(made, tmp_path / "c"))
    assert_same_bits(without, flown)
    assert "exported C" in flown.attrs["laws"]
    # the law is one that the sensor moves
    blind = torquer.simulate(scenario(line.replace("noise = 0.05", "noise = 0.06"), control=MINE))
    assert not np.array_equal(without["omega_body"], blind["omega_body"])


@needs_compiler
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_an_estimator_of_the_users_own_flies_in_c(scenario, tmp_path):
    made = scenario(SENSOR, control=ESTIMATED)
    flown = torquer.simulate(made, computer=exported(made, tmp_path / "c"))
    assert_same_bits(torquer.simulate(made), flown)


@needs_compiler
def test_a_sensor_that_fails_stops_the_flight_of_the_computer_in_c(scenario, tmp_path):
    made = scenario(SENSOR, control=MINE)
    folder = exported(made, tmp_path / "c")
    text = (tmp_path / "own.py").read_text()
    fails = (
        "    if here.t_s > 99.5:\n        raise ValueError('boom')\n    b, noise = here.b_body_t"
    )
    (tmp_path / "own.py").write_text(text.replace("    b, noise = here.b_body_t", fails))
    with pytest.raises(torquer.RunStopped) as stopped:
        torquer.simulate(scenario(SENSOR, control=MINE), computer=folder)
    assert str(stopped.value).startswith("spacecraft.own_sensor: must be a function (here) that ")
    assert "received ValueError('boom') at t = 100 s (crosswise in " in str(stopped.value)
