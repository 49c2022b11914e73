"""Users' laws in flight: what a reading may be, never out of bounds, always a finite command."""

import ast
import re
import subprocess
from pathlib import Path

import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import EXAMPLES, STRICT, built, replayed, written

import torquer
from torquer.flight.c99 import statements
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import make_texts
from torquer.flight.c99.notes import export_notes
from torquer.flight.c99.precision import computing_in
from torquer.flight.c99.refusal import Refused

LAWS = """
import math
import numba
import torquer

REFERENCE = 0.75


@numba.njit
def decibels(ratio):
    return math.log10(ratio)


@torquer.law(parameters={"gain": 1.0}, log={"a": "1", "b": "1", "c": "1"})
def folded(inputs, parameters, memory):
    reference = REFERENCE
    memory.a = math.log10(abs(REFERENCE))
    memory.b = math.log10(reference)
    memory.c = decibels(REFERENCE)
    return (1e-3 * parameters.gain * memory.a, 1e-3 * memory.b, 1e-3 * memory.c)


@torquer.law(
    parameters={"width_t": 1e-5, "table": (0.02, 0.05, 0.1, 0.2)},
    memory={"hits": (0.0, 0.0, 0.0, 0.0), "next": 7.0},
)
def scheduled(inputs, parameters, memory):
    bx, by, bz = inputs.b_body_t
    k = int(math.sqrt(bx * bx + by * by + bz * bz) / parameters.width_t) - 1
    memory.hits[k] += 1.0
    memory.next = 8.0
    return (parameters.table[k], 0.0, 0.0)


@torquer.law(parameters={"unit_t": 1e-6, "polarity": -1.0})
def steps(inputs, parameters, memory):
    k = int(inputs.b_body_t[0] / parameters.unit_t) // int(parameters.polarity)
    return (float(k) * 1e-5, 0.0, 0.0)


@torquer.law(memory={"seed": 12345.0, "h": 0.0})
def mixer(inputs, parameters, memory):
    s = (int(memory.seed) * 1103515245 + 12345) % 2147483648
    memory.seed = float(s)
    h = s
    for k in range(4):
        h = h * 4503599627370449 + k
    memory.h = float(h)
    return (memory.h * 1e-22, 0.0, 0.0)


def cells(inputs, parameters, memory):
    n = int(1e7 * inputs.b_body_t[1]) // 100
    memory[2:][n] = inputs.b_body_t[2]
    return (memory[n % 5], 0.0, 0.0)
"""
NAMES = ("folded", "scheduled", "steps", "mixer", "cells")
#: A step for each argument: the x component of the field [T]; what is commanded and remembered.
MAIN = r"""
#include "adcs.h"
#include <stdio.h>
#include <stdlib.h>
int main(int count, char **values)
{
    static adcs_state state;
    static adcs_inputs inputs;
    static adcs_command command;
    adcs_init(&state);
    for (int k = 1; k < count; k++) {
        int64_t line;
        inputs.t_s = k;
        inputs.read_at_s[0] = k;
        inputs.b_body_t[0] = atof(values[k]);
        const uint32_t met = adcs_step(&state, &inputs, &command);
        const int64_t failed = adcs_failures(&state, &line);
        printf("%.17g %lld %lld %g %d\n", command.dipole_a_m2[0], (long long)failed,
            (long long)line, adcs_logged(&state, HITS + 4), (met & ADCS_MET_LAW_FAILED) != 0u);
        if (adcs_met(&state) != met) {
            return 1;
        }
    }
    return 0;
}
"""


def scenario_text(names: tuple[str, ...]) -> str:
    laws = "".join(
        f'[control.laws.{name}]\nkind = "user"\nfile = "laws.py"\nfunction = "{name}"\n'
        for name in names
    )
    return f"""
start = 2025-07-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 550
inclination_deg = 97.6
[spacecraft.body]
inertia_kg_m2 = [0.03, 0.03, 0.01]
[spacecraft.coils]
limit_a_m2 = 0.2
[initial]
rate_deg_s = [8, -5, 3]
[control]
sample_s = 1.0
{laws}
[simulation]
revolutions = 1
record_s = 5.0
"""


def scenario_of(names: tuple[str, ...], folder: Path, laws: str = LAWS) -> torquer.Scenario:
    (folder / "laws.py").write_text(laws)
    (folder / "scenario.toml").write_text(scenario_text(names))
    return torquer.load_scenario(folder / "scenario.toml")


@pytest.fixture(scope="module")
def export(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("user_laws")
    torquer.export_c(scenario_of(NAMES, folder), folder, steps=60)
    return folder


def line_of(text: str) -> int:
    """The line of the laws in which a text stands."""
    return 1 + LAWS[: LAWS.index(text)].count("\n")


@needs_compiler
@pytest.mark.parametrize("level", ["-O0", "-O1", "-O2", "-O3", "-Os"])
def test_laws_replay_with_the_same_bits(export, level):
    assert replayed(built(export, level), export).stdout == (
        "60 control steps: the same bits in commands and state\n"
    )


@pytest.fixture(scope="module")
def flown(export):
    """Steps of a build that ends at what is undefined: for readings, the answers."""
    place = 3  # of the memory of `scheduled` behind that of `folded`
    (export / "main.c").write_text(f"#define HITS {place}\n{MAIN}")
    sources = [export / name for name in ("main.c", "adcs.c", "adcs_tables.c")]
    sanitized = ["-g", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover"]
    command = [COMPILER, *FLAGS, *STRICT, "-O1", *sanitized, f"-I{export}", *sources]
    subprocess.run([*command, "-o", export / "main", "-lm"], check=True)

    def fly(*values: str) -> list[list[float]]:
        done = subprocess.run([export / "main", *values], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return [list(map(float, line.split())) for line in done.stdout.splitlines()]

    return fly


BAD = ("6e-5", "1e-2", "nan", "inf", "-inf", "1e20", "-1e300", "1e308", "5e-324")


@needs_compiler
@pytest.mark.parametrize("value", BAD)
def test_no_reading_leads_out_of_a_table(flown, value):
    good, bad, after = flown("3e-5", value, "3e-5")
    assert good[1:] == [0.0, 0.0, 8.0, 0.0]
    fails = value != "5e-324"  # which makes the index -1, the last one
    assert (int(bad[1]), int(bad[2])) == (2 * fails, fails * line_of("memory.hits[k] += 1.0"))
    assert (bad[4], after[4]) == (fails, 0.0)  # the status is that of the step
    assert after[1] == bad[1]  # and what has failed since the start is kept


@needs_compiler
def test_a_law_that_failed_commands_nothing_and_works_again(flown):
    _, bad, again = flown("3e-5", "6e-5", "3e-5")
    others = flown("6e-5", "6e-5", "3e-5")
    assert again[0] == others[2][0]
    assert bad[0] != again[0]
    statuses = [step[4] for step in flown("6e-5", "3e-5", "6e-5", "6e-5", "3e-5", "3e-5")]
    assert statuses == [1.0, 0.0, 1.0, 1.0, 0.0, 0.0]


def test_validate_says_where_laws_may_fail(export, tmp_path):
    scenario = scenario_of(("scheduled", "mixer"), tmp_path)
    lines = [line_of(each) for each in ("k = int(math.sqrt", "memory.hits[k]", "return (param")]
    (note,) = export_notes(scenario)
    assert note == (
        "in flight a law fails, and commands nothing, where it would raise an error: "
        f"laws.py, lines {', '.join(map(str, lines))}"
    )
    assert export_notes(scenario_of(("mixer",), tmp_path)) == []


WHILES = """
import numba
import torquer

@numba.njit
def halvings(x):
    n = 0
    while x > 1.0:
        x, n = 0.5 * x, n + 1
    return n

@torquer.law()
def searched(inputs, parameters, memory):
    x = 1e-3
    while x * halvings(inputs.t_s) > 1.0:
        x = 0.5 * x
    for k in range(3):
        x = x + 1e-6 * k
    return (x, 0.0, 0.0)
"""


def test_loops_that_a_condition_alone_ends_are_told(tmp_path):
    scenario = scenario_of(("searched",), tmp_path, WHILES)
    (note,) = export_notes(scenario)
    told = "`while` goes on until its condition is false; nothing else ends the step"
    assert note == f"in flight {told}: laws.py, lines 8, 15"
    torquer.export_c(scenario, tmp_path / "c", steps=1)
    assert f"* laws.py, lines 8, 15: {told}\n" in (tmp_path / "c/README.md").read_text()


def test_the_readme_lists_where_laws_may_fail(export):
    text = (export / "README.md").read_text()
    assert f"* laws.py, lines {line_of('k = int(math.sqrt')}, {line_of('memory.hits[k]')}," in text


@pytest.mark.parametrize(
    "name, key", [("spinner_modes", "control.modes"), ("five_days", "control")]
)
def test_what_is_refused_in_the_package_is_told_by_a_key_of_the_scenario(name, key, monkeypatch):
    monkeypatch.delitem(statements._HANDLERS, ast.AugAssign)
    with pytest.raises(Refused) as refused:
        translate_step(find_computer(torquer.load_scenario(EXAMPLES / f"{name}.toml")))
    told = str(refused.value)
    assert told.startswith(f"{key}: must have a translation to C; received what needs `")
    assert re.search(r"` \(\w+\.py, line \d+ of torquer\)$", told)


def test_nothing_is_translated_to_assess_what_comes_with_the_package(monkeypatch):
    """All of it is exported and flown by other tests; a user's file beside it is translated."""
    scenarios = [torquer.load_scenario(EXAMPLES / f"{name}.toml") for name in ("spinner", "my_law")]
    monkeypatch.delitem(statements._HANDLERS, ast.Assign)
    assert export_notes(scenarios[0]) == []
    (note,) = export_notes(scenarios[1])
    assert note.startswith("cannot be exported as C: ")


@needs_compiler
def test_laws_build_in_single_precision_without_a_warning(export, tmp_path):
    with computing_in("float"):
        computer = find_computer(torquer.load_scenario(export / "scenario.toml"))
        folder = written(make_texts(computer, translate_step(computer), 1), tmp_path)
    built(folder, "-O2")
