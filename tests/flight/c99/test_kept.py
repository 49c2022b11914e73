"""State and inputs of an export hold what its computer uses, and nothing else."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import built, replayed, written
from slow_cases import slow_after

import torquer
from torquer.computer import gate as gates
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import make_texts

EXAMPLES = Path(__file__).parents[3] / "examples"
#: Bytes that the state of a lone B-dot may have, and its inputs.
STATE, INPUTS = 168, 40
#: Instructions of a step, by how many times those of the law written by hand.
COST = 2.0
SIZES = """
#include "adcs.h"
#include <stdio.h>
int main(void)
{
    printf("%zu %zu\\n", sizeof(adcs_state), sizeof(adcs_inputs));
    return 0;
}
"""
#: The law of `tip_off_campaign` within the limits of its coils, as one would write it by hand.
BY_HAND = """
#include <math.h>
#include <stdbool.h>
typedef struct { double t_s, b[3], m[3], shortest_s, gain; } own_state;
void take_step(own_state *s, double t_s, const double b[3], double m[3]);
void take_step(own_state *s, double t_s, const double b[3], double m[3])
{
    const double dt = t_s - s->t_s;
    if (s->shortest_s < 0.0 || dt > 0.0) {
        const bool is_first = s->shortest_s <= 0.0;
        const bool is_due = s->shortest_s >= 0.0 && (is_first || dt <= 2.5 * s->shortest_s);
        const double k_t = is_due ? -s->gain / dt : 0.0;
        double worst = 1.0;
        for (int k = 0; k < 3; k++) {
            s->m[k] = k_t * (b[k] - s->b[k]);
            const double share = fabs(s->m[k]) * (1.0 / 3.2);
            worst = (share > worst) ? share : worst;
            s->b[k] = b[k];
        }
        for (int k = 0; worst > 1.0 && k < 3; k++) {
            s->m[k] /= worst;
        }
        if (s->shortest_s < 0.0) {
            s->shortest_s = 0.0;
        } else if (is_first || dt < s->shortest_s) {
            s->shortest_s = dt;
        } else if (!is_due) {
            s->shortest_s = fmin(dt, 10.0 * s->shortest_s);
        }
        s->t_s = t_s;
    }
    for (int k = 0; k < 3; k++) {
        m[k] = isfinite(s->m[k]) ? s->m[k] : 0.0;
    }
}
static own_state state = {.gain = 5e6, .shortest_s = -1.0};
#define STEP take_step(&state, t_s, b, m)
"""
EXPORTED = """
#include "adcs.h"
static adcs_state state;
static void take(double t_s, const double b[3], double m[3])
{
    adcs_inputs inputs = {t_s, {b[0], b[1], b[2]}, {t_s}};
    adcs_command command;
    (void)adcs_step(&state, &inputs, &command);
    for (int k = 0; k < 3; k++) {
        m[k] = command.dipole_a_m2[k];
    }
}
#define STEP take(t_s, b, m)
"""
#: Readings every 3 s; a command of a plausible size.
MAIN = """
#include <stdio.h>
int main(void)
{
    double sum = 0.0;
    BEGIN;
    for (int n = 0; n < 2000; n++) {
        const double x = 1e-7 * (n % 17), t_s = 3.0 * n;
        const double b[3] = {2e-5 + x, 0.5 * x - 1e-5, 3e-5 - x};
        double m[3];
        STEP;
        sum += m[0] + 2.0 * m[1] + 3.0 * m[2];
    }
    printf("%.9g\\n", sum);
    return 0;
}
"""


def exported(name: str, folder: Path) -> Path:
    computer = find_computer(torquer.load_scenario(EXAMPLES / f"{name}.toml"))
    return written(make_texts(computer, translate_step(computer), 1), folder)


@pytest.fixture(scope="module")
def bdot(tmp_path_factory) -> Path:
    return exported("tip_off_campaign", tmp_path_factory.mktemp("bdot"))


def program(folder: Path, text: str, *sources: Path) -> Path:
    """A program of a text and sources, compiled."""
    (folder / "own.c").write_text(text)
    command = [COMPILER, *FLAGS, "-O2", f"-I{folder}", folder / "own.c", *sources, "-lm"]
    subprocess.run([*command, "-o", folder / "own"], check=True)
    return folder / "own"


def members(text: str, name: str) -> list[str]:
    """Names of the members of a struct."""
    body = re.search(rf"typedef struct \{{\n([^{{}}]*)\}} {name};", text)
    assert body is not None
    return re.findall(r"^ +\w+ (\w+)(?:\[\d+\])*;", body[1], flags=re.M)


@needs_compiler
def test_a_lone_bdot_is_small(bdot):
    said = subprocess.run([program(bdot, SIZES)], capture_output=True, text=True, check=True)
    state, inputs = map(int, said.stdout.split())
    assert (state <= STATE, inputs <= INPUTS) == (True, True), said.stdout


def test_inputs_that_nothing_reads_are_not_there(bdot):
    header, types = (bdot / "adcs.h").read_text(), (bdot / "adcs_types.h").read_text()
    assert members(header, "adcs_inputs") == ["t_s", "b_body_t", "read_at_s"]
    assert members(types, "Known") == ["t_s", "readings", "read_s"]
    assert "readings[1][3];" in types and "read_s[1];" in types
    assert "Chosen" not in types and "ModesNow" not in types


@pytest.mark.parametrize("name", slow_after(2, ["my_law", "magneto_gyro_micro", "turn_to_the_sun"]))
def test_what_is_there_is_read(name, tmp_path):
    """Each input is taken over, and each number that is taken over is read somewhere."""
    folder = exported(name, tmp_path)
    text = (folder / "adcs.c").read_text()
    for each in members((folder / "adcs.h").read_text(), "adcs_inputs"):
        assert f"= inputs->{each}" in text, each
    for each in members((folder / "adcs_types.h").read_text(), "Known"):
        found = re.findall(rf"->{each}\b(?!(\[\w+\])* = )|known\[0\]\.{each}\b", text)
        assert found, each


def test_an_estimate_is_there_with_an_estimator_alone(bdot, tmp_path):
    assert (
        "(double)NAN"
        in re.findall(r"estimate = \{(.*?)\};", (bdot / "adcs.c").read_text(), re.S)[0]
    )
    folder = exported("magneto_gyro_micro", tmp_path)
    known = members((folder / "adcs_types.h").read_text(), "Known")
    assert {"estimate_q_w", "estimate_omega_x", "sigma_rad"} <= {*known}


@needs_compiler
@pytest.mark.parametrize(
    "name",
    slow_after(
        2,
        ["tip_off_campaign", "magneto_gyro_micro", "safe_mode", "which_sensors", "disturbances"],
    ),
)
def test_a_replay_leaves_no_table(name, tmp_path):
    torquer.export_c(torquer.load_scenario(EXAMPLES / f"{name}.toml"), tmp_path, steps=150)
    done = replayed(built(tmp_path, "-O1", "-fsanitize=address,undefined"), tmp_path)
    assert done.stdout == "150 control steps: the same bits in commands and state\n", done.stderr
    assert done.stderr == ""


@needs_compiler
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
def test_a_step_of_a_lone_bdot_costs_little_more_than_by_hand(bdot, tmp_path):
    sources = [bdot / "adcs.c", bdot / "adcs_tables.c"]
    exported_text = EXPORTED + MAIN.replace("BEGIN", "adcs_init(&state)")
    ours = counted(program(bdot, exported_text, *sources), "adcs_step")
    by_hand = counted(program(tmp_path, BY_HAND + MAIN.replace("BEGIN", "")), "take_step")
    assert ours[0] == by_hand[0]  # the same law
    assert ours[1] <= COST * by_hand[1], (ours, by_hand)


def counted(made: Path, function: str) -> tuple[float, int]:
    """What a program says, to six digits, and instructions within a function."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    command += [f"--toggle-collect={function}", str(made)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    assert found is not None, done.stderr
    return float(np.format_float_scientific(float(done.stdout), 5)), int(found[1])


#: Readings with each of these numbers in each place; what the step says and commands.
ODD = """
#include "adcs.h"
#include <math.h>
#include <stdio.h>
int main(void)
{
    static const double odd[] = {NAN, -NAN, INFINITY, -INFINITY, 1.7e308, -1.7e308, 5e-324, -0.0,
        1e-5};
    static adcs_state state;
    adcs_init(&state);
    for (int n = 0; n < 27; n++) {
        adcs_inputs inputs = {3.0 * n, {2e-5, -1e-5, -3e-5}, {3.0 * n}};
        adcs_command command;
        inputs.b_body_t[n % 3] = odd[n / 3];
        printf("%u ", (unsigned)adcs_step(&state, &inputs, &command));
        printf("%a %a %a\\n", command.dipole_a_m2[0], command.dipole_a_m2[1],
            command.dipole_a_m2[2]);
    }
    return 0;
}
"""


@needs_compiler
def test_numbers_are_known_by_their_words_where_doubles_are_software(bdot, tmp_path):
    folder = shutil.copytree(bdot, tmp_path / "soft")
    sources = [folder / "adcs.c", folder / "adcs_tables.c"]
    said = []
    for text in ("", "#define __SOFTFP__ 1\n"):
        (folder / "adcs.c").write_text(text + (bdot / "adcs.c").read_text())
        made = program(folder, ODD, *sources)
        done = subprocess.run([made], capture_output=True, text=True, check=True)
        said.append(done.stdout.splitlines())
    assert said[0] == said[1]
    statuses = [int(line.split()[0]) for line in said[0]]
    assert all(each & gates.READING_NOT_FINITE for each in statuses[:12])
    assert not any(each & gates.READING_NOT_FINITE for each in statuses[12:])
