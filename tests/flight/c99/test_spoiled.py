"""Spoiled inputs by the thousand: an export under sanitizers is flown by a program in C."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import EXAMPLES, NAMES, STRICT

import torquer
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.interface import inputs_for

SANITIZED = ["-g", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover"]
STEPS, WAYS = 150, 10
#: Steps of flights whose modes take longer to let the laws go on: 600 s without the coils.
LONGER = {"chibis_m_day": 2200}


def limits(scenario: torquer.Scenario) -> str:
    """The limits of coils and wheels as tables in C: no vector may have more than 1 along a row;
    and where the times of readings stand among the inputs."""
    computer = find_computer(scenario)
    gate, inputs = computer.gate, inputs_for(computer, translate_step(computer))
    names = [each.name for each in inputs for _ in range(each.count)]
    times = names.count("read_at_s")
    first = names.index("read_at_s") if times else 0
    text = f"#include <stddef.h>\nstatic const size_t first_time = {first}, times = {times};\n"
    for name, axes, others in (
        ("of_dipole", gate.dipole_axes, gate.dipole),
        ("of_torque", gate.torque_axes, gate.torque),
    ):
        along = np.diag(axes.tolist()[0]).tolist() if len(axes) else []
        rows = [*along, *others.tolist()] or [(0.0, 0.0, 0.0)]
        numbers = ", ".join(f"{{{x!r}, {y!r}, {z!r}}}" for x, y, z in rows)
        text += f"static const double {name}[{len(rows)}][3] = {{{numbers}}};\n"
    return text


def flown(name: str, cases: int, folder: Path) -> subprocess.CompletedProcess:
    """So many cases of each way to spoil the inputs of an example."""
    steps = LONGER.get(name, STEPS)
    try:
        scenario = torquer.load_scenario(EXAMPLES / f"{name}.toml")
        torquer.export_c(scenario, folder, steps=steps)
    except ValueError as error:
        pytest.skip(f"not a scenario of a flight: {error}")
    (folder / "limits.h").write_text(limits(scenario))
    driver = Path(__file__).with_name("spoiled.c")
    sources = [driver, folder / "adcs.c", folder / "adcs_tables.c"]
    options = ["-O1", f"-DSTEPS={steps}u", *SANITIZED, f"-I{folder}"]
    command = [COMPILER, *FLAGS, *STRICT, *options, *sources]
    subprocess.run([*command, "-o", folder / "spoiled", "-lm"], check=True)
    command = [folder / "spoiled", folder / "test/recorded.bin", str(cases)]
    return subprocess.run(command, capture_output=True, text=True)


@needs_compiler
def test_a_few_spoiled_inputs_leave_a_good_command_that_comes_back(tmp_path):
    done = flown("my_law", 100, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "1000 cases; 1000 end with the command of the sound flight\n"


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_six_hundred_of_each_kind_leave_a_good_command_that_comes_back(name, tmp_path):
    done = flown(name, 600, tmp_path)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert re.match(rf"{600 * WAYS} cases; \d+ end with", done.stdout)
