"""Exports in single precision: floats everywhere but for times, which keep their digits."""

import math
import shutil
import subprocess
import sys
from pathlib import Path
from random import Random

import numpy as np
import pytest
from flight.c99.in_c import InC, needs_compiler
from flight.c99.test_export import COMPILERS, EXAMPLES, NAMES, built, written
from flight.c99.test_pil import MISSING, pil

import torquer
from torquer.cli.answer import answer
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import make_texts
from torquer.flight.c99.precision import computing_in
from torquer.flight.c99.program import Program
from torquer.flight.c99.refusal import Refused
from torquer.flight.c99.types import REAL, TIME, Array, Tuple

#: A day and a half, between two numbers of single precision.
LATE_S = 131072.01
CONSTANT = 0.12345678


def polynomial(x, y):
    a = x * x - y / 3.0 + CONSTANT
    return a, min(a, y) - max(x, 0.5) * abs(y), (x + y) % 0.7, x // 0.3


def functions(x, y):
    return math.sin(x), math.atan2(y, x), math.exp(y), math.sqrt(x * x), math.floor(x), -(x**y)


def since_last(t_s, memory):
    since = t_s - memory[0]
    memory[0] = t_s
    return since


def last_of_two(t_s, memory):
    latest = -math.inf
    for k in range(2):
        if memory[k] > latest:
            latest = memory[k]
    memory[1] = memory[0]
    memory[0] = t_s
    return t_s - latest, latest + 0.25


def earlier(t_s, memory):
    return t_s if memory[0] > 0.0 else -math.inf


def through_calls(t_s, memory):
    before, kept = min(earlier(t_s, memory), t_s + 1.0), (t_s, 1.0)
    before -= 0.125
    keep(kept, memory)
    return kept[0] - before, memory[2] - memory[1]


def keep(kept, cells):
    cells[1] = kept[0] - 0.5
    cells[2] = cells[1] + 1.0


def argument_moved(t_s, memory):
    return moved(memory[4], t_s)


def moved(x, t_s):
    for _ in range(2):
        x = max(x + 0.0, t_s)
    return t_s - x


def phase(t_s, memory):
    return t_s * 0.1, t_s % 7.0, t_s // 7.0, abs(t_s) + 0.0


OF_TIMES = [since_last, last_of_two, through_calls, argument_moved, phase]
PARTS = Tuple((REAL, REAL))


@pytest.fixture(scope="module")
def c(tmp_path_factory):
    """Kernels in single precision; those of times with memory of times."""
    kernels = {polynomial: [REAL, REAL], functions: [REAL, REAL]}
    kernels |= {each: [TIME, Array((6,), of=TIME)] for each in OF_TIMES}
    strict = ("-O2", "-Wall", "-Wextra", "-Wdouble-promotion", "-Wconversion", "-Werror")
    return InC(kernels, tmp_path_factory.mktemp("single"), strict, real="float")


@needs_compiler
def test_arithmetic_is_that_of_floats(c):
    random = Random(3)
    for _ in range(300):
        x, y = (np.float32(random.uniform(-4.0, 4.0)) for _ in "xy")
        # a float of Python beside one of NumPy is rounded to it
        expected = polynomial(x, y)
        assert c(polynomial, float(x), float(y)) == [float(each) for each in expected]


@needs_compiler
def test_functions_are_those_of_doubles_rounded(c):
    random = Random(4)
    for _ in range(300):
        x, y = (float(np.float32(random.uniform(0.1, 4.0))) for _ in "xy")
        *found, floor, power = c(functions, x, y)
        *expected, _, _ = functions(x, y)
        assert found[:3] == [float(np.float32(each)) for each in expected[:3]]
        assert found[3] == float(np.sqrt(np.float32(x) * np.float32(x)))
        assert (floor, power) == (math.floor(x), -float(np.float32(x**y)))


@needs_compiler
@pytest.mark.parametrize("kernel", OF_TIMES, ids=lambda kernel: kernel.__name__)
def test_times_keep_their_digits(c, kernel):
    """What lies between times has the digits of a float; times themselves those of a double."""
    for t_s in (LATE_S, 10.0 * LATE_S, 3.25):
        cells = [t_s - 0.01, t_s - 0.03, t_s, 0.0, t_s + 0.02, 0.0]
        in_python, in_c = np.array(cells), np.array(cells)
        expected = np.ravel(kernel(t_s, in_python))
        assert c(kernel, t_s, in_c) == pytest.approx(expected, rel=1.2e-7)
        assert in_c.tolist() == in_python.tolist()


def test_times_are_found_in_all_memory():
    """What is a time follows from the inputs: in filters, modes and the estimate, and no more."""
    computer = find_computer(torquer.load_scenario(EXAMPLES / "which_sensors.toml"))
    with computing_in("float"):
        found = {
            each
            for each in translate_step(computer, again=0).program.times
            if isinstance(each, str)
        }
    times = {"t_s", "read_s", "gyro_s", "doubted_s", "watched", "past"}
    assert {f"kalman_gyro_memory.{name}" for name in times} <= found
    assert {"Known.t_s", "Known.estimate_s", "TransitionNow.true_since_s"} <= found
    assert {f"GateNow.{name}" for name in ("offset_s", "t_s", "other_s")} <= found
    values = {"q", "states", "covariance", "gyro_rad_s", "innovation_sun"}
    assert not found & {f"kalman_gyro_memory.{name}" for name in values}
    assert not found & {"Known.estimate_q_x", "Known.b_x", "ConditionNow.latched"}


def test_a_number_of_single_precision_would_not_do():
    assert abs((np.float32(LATE_S) - np.float32(LATE_S - 0.01)) / 0.01 - 1.0) > 0.1


def too_small(x):
    return x + 1e-42


def test_a_constant_beyond_single_precision_is_refused():
    said = r"line \d+: `1e-42` has no translation to C; in single precision use 0 or a number from"
    with computing_in("float"), pytest.raises(Refused, match=said):
        Program().function(too_small, [REAL])
    Program().function(too_small, [REAL])


def test_a_parameter_beyond_single_precision_is_refused(tmp_path):
    text = (EXAMPLES / "my_law.toml").read_text().replace("gain = 3e4", "gain = 1e-42")
    (tmp_path / "odd.toml").write_text(text)
    shutil.copy(EXAMPLES / "my_law.py", tmp_path)
    scenario = torquer.load_scenario(tmp_path / "odd.toml")
    with pytest.raises(ValueError, match=r"^real: must be 'double' .*; received 1e-42 in law.gain"):
        torquer.export_c(scenario, tmp_path / "out", real="float")


def test_another_precision_is_refused(tmp_path, capsys):
    scenario = torquer.load_scenario(EXAMPLES / "my_law.toml")
    with pytest.raises(ValueError, match="real: must be 'double' or 'float'; received 'half'"):
        torquer.export_c(scenario, tmp_path, real="half")
    command = ["export", "c", str(EXAMPLES / "my_law.toml"), "--out", str(tmp_path)]
    assert answer([*command, "--real", "half"]) == 2
    assert "--real" in capsys.readouterr().err


def single(name: str, folder: Path) -> Path:
    """The texts of an example's export in single precision."""
    computer = find_computer(torquer.load_scenario(EXAMPLES / f"{name}.toml"))
    with computing_in("float"):
        return written(make_texts(computer, translate_step(computer, again=0), 1), folder)


@needs_compiler
def test_an_export_builds_without_a_warning(tmp_path):
    folder = single("spinner_modes", tmp_path)
    for compiler in COMPILERS:
        built(folder, "-O0", "-Wfloat-conversion", compiler=compiler)


#: Steps late in a flight, by a clock that is set in between; what the computer's own says.
LATE = r"""
#include "adcs_types.h"
#include <math.h>
#include <stdio.h>
int main(void)
{
    static adcs_state state;
    static adcs_inputs inputs;
    static adcs_command command;
    const double late_s = 4e8;
    const double shift_s = -123456789.125;
    adcs_init(&state);
    for (int k = 0; k < 20; k++) {
        const double given_s = late_s + 0.25 * k + ((k < 10) ? 0.0 : shift_s);
        inputs.t_s = given_s;
        for (size_t n = 0; n < sizeof inputs.read_at_s / sizeof inputs.read_at_s[0]; n++) {
            inputs.read_at_s[n] = given_s;
        }
        if (k == 10 && adcs_rebase(&state, shift_s) != ADCS_DONE) {
            return 1;
        }
        const uint32_t met = adcs_step(&state, &inputs, &command);
        const Held *held = (const Held *)&state;
        printf("%.17g %u\n", held->now.board.known[0].t_s - late_s, (unsigned)(met & 63u));
    }
    return 0;
}
"""


@needs_compiler
def test_late_times_are_not_rounded_at_the_boundary(tmp_path):
    folder = single("my_law", tmp_path)
    (folder / "late.c").write_text(LATE)
    sources = [folder / each for each in ("late.c", "adcs.c", "adcs_tables.c")]
    command = [COMPILERS[0], "-std=c99", "-ffp-contract=off", f"-I{folder}", *sources]
    subprocess.run([*command, "-o", folder / "late", "-lm"], check=True)
    said = subprocess.run([folder / "late"], capture_output=True, text=True, check=True).stdout
    assert said.splitlines() == [f"{0.25 * k:.17g} 0" for k in range(20)]


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_all_examples_build_without_a_warning(name, tmp_path):
    try:
        folder = single(name, tmp_path)
    except ValueError as error:
        pytest.skip(f"not a scenario of a flight: {error}")
    for compiler in COMPILERS:
        built(folder, "-O0", "-Wfloat-conversion", compiler=compiler)


@pytest.fixture(scope="module")
def filtered(tmp_path_factory) -> Path:
    """A filter and wheels in single precision, with 100 control steps."""
    folder = tmp_path_factory.mktemp("filtered")
    scenario = torquer.load_scenario(EXAMPLES / "which_sensors.toml")
    torquer.export_c(scenario, folder, steps=100, real="float")
    return folder


def differences(folder: Path) -> str:
    """The table of differences between the record and this machine's answers."""
    program = built(folder, "-O1")
    record, answers = folder / "test/recorded.bin", folder / "answers.bin"
    subprocess.run([program, record, answers], check=True, capture_output=True)
    command = [sys.executable, folder / "test/differences.py", record, answers]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@needs_compiler
def test_a_filter_differs_by_the_digits_of_a_float(filtered):
    text = differences(filtered)
    cells = dict((row.split("|")[1].strip(), row.split("|")[2:4]) for row in text.splitlines()[2:])
    mean, greatest = cells["estimated attitude [deg]"]
    assert 1e-6 < float(mean) < float(greatest.split(",")[0]) < 0.002
    assert 0.0 < float(cells["estimated rate [deg/s]"][0]) < 1e-5
    assert float(cells["steps with an attitude in one of them alone"][0]) == 0.0


@needs_compiler
def test_an_export_flies_in_the_loop(tmp_path):
    """In closed loop it differs from double precision by the digits of a float, no more."""
    scenario = torquer.load_scenario(EXAMPLES / "my_law.toml")
    torquer.export_c(scenario, tmp_path, steps=1, real="float")
    before, after = torquer.simulate(scenario), torquer.simulate(scenario, computer=tmp_path)
    moved = np.abs(before.omega_body - after.omega_body).max() / np.abs(before.omega_body).max()
    assert 0.0 < moved < 1e-5


@pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
def test_an_emulated_processor_takes_the_same_bits(tmp_path):
    scenario = torquer.load_scenario(EXAMPLES / "spinner_modes.toml")
    torquer.export_c(scenario, tmp_path, steps=100, real="float")
    done = pil(tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    text = (tmp_path / "README.md").read_text()
    assert "Cortex-M4F" in text
    assert "100 control steps: the same bits in commands and state" in text
    assert "| difference over 100 steps |" in text
