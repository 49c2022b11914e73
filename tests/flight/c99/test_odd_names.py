"""Names that C would read otherwise: of laws and states in a table, of a user's functions."""

import re
import subprocess

import pytest
from flight.c99.in_c import COMPILER, needs_compiler
from flight.c99.test_export import replayed

import torquer
from torquer.compile import engine
from torquer.flight.c99.program import Program

TEXT = """
start = 2025-06-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 500, inclination_deg = 97.4 }
environment.field = { kind = "igrf14", degree = 4 }
spacecraft.body.inertia_kg_m2 = [0.03, 0.04, 0.02]
spacecraft.coils.limit_a_m2 = 0.2
initial.rate_deg_s = [2, -1.5, 1]
simulation.duration_s = 300
[control]
sample_s = 1.0
"""
#: Names of laws that differ in signs alone; states that words of C are; times that alone move on.
TABLE = """
[control.laws]
"a-b" = { kind = "bdot", gain_a_m2_s_per_t = 2e4 }
"a_b" = { kind = "bdot", gain_a_m2_s_per_t = 1e4 }
"2nd" = { kind = "off" }
"gâin" = { kind = "bdot", gain_a_m2_s_per_t = 5e3 }
main = { kind = "off" }
[control.modes.states.double]
laws = ["a-b"]
transitions = [{ to = "x-y", at_most_s = 7 }]
[control.modes.states."x-y"]
laws = ["a_b", "main"]
transitions = [{ to = "x_y", at_most_s = 7 }]
[control.modes.states."x_y"]
laws = ["gâin", "2nd"]
transitions = [{ to = "double", at_most_s = 7 }]
"""
USER = """
law = { kind = "user", file = "laws.py" }
"""
#: Functions that headers declare or define, words of GNU and of later C, names C keeps to itself.
LAWS = """
import math
import numba
import torquer

DBL_MAX = 2.5


@numba.njit
def gamma(x):
    return 2.0 * x


@numba.njit
def y0(x):
    return 3.0 * x


@numba.njit
def isnormal(x):
    return x > 0.0


@numba.njit
def lroundf(x):
    return math.sqrt(x)


@torquer.law(
    parameters={"gain": 2.0, "asm": 1.0, "typeof": 1.0, "linux": 2.0, "nullptr": 1.0},
    memory={"thread_local": 1.0},
)
def index(inputs, parameters, memory):
    asm, unix = gamma(inputs.b_body_t[0]), y0(inputs.b_body_t[1])
    _Bool = lroundf(asm * asm + unix * unix)
    __x = parameters.asm + parameters.typeof + parameters.linux + parameters.nullptr
    alignas, static_assert, typeof, linux = 1.0, 2.0, 3.0, inputs.t_s
    nullptr = memory.thread_local + alignas + static_assert + typeof + linux
    memory.thread_local = nullptr
    if isnormal(nullptr):
        return (asm * __x, unix, _Bool * nullptr)
    return (asm, unix, DBL_MAX * parameters.gain)
"""
HEADERS = ("float.h", "math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h")


@needs_compiler
@pytest.mark.slow
@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize("what", [TABLE, USER], ids=["table", "user"])
def test_odd_names_replay_in_each_version_of_c(what, tmp_path):
    (tmp_path / "laws.py").write_text(LAWS)
    (tmp_path / "odd.toml").write_text(TEXT + what)
    folder = tmp_path / "c"
    torquer.export_c(torquer.load_scenario(tmp_path / "odd.toml"), folder, steps=40)
    for version in ("c99", "gnu99", "gnu11", "gnu2x"):
        sources = [folder / each for each in ("adcs.c", "adcs_tables.c", "test/replay.c")]
        command = [COMPILER, f"-std={version}", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"]
        command += [f"-I{folder}", "-o", folder / "replay", *sources, "-lm"]
        made = subprocess.run(command, capture_output=True, text=True)
        assert made.returncode == 0, (version, made.stderr)
        done = replayed(folder / "replay", folder)
        assert done.stdout == "40 control steps: the same bits in commands and state\n"


@needs_compiler
@pytest.mark.parametrize("version", ["c99", "gnu99", "gnu11"])
def test_nothing_of_the_headers_is_a_name_of_a_kernel(version):
    text = "".join(f"#include <{name}>\n" for name in HEADERS)
    declared, macros = (
        subprocess.run(
            [COMPILER, f"-std={version}", *flags, "-"], input=text, capture_output=True, text=True,
            check=True,
        ).stdout
        for flags in (["-E", "-P"], ["-E", "-dM"])
    )  # fmt: skip
    found = set(re.findall(r"\b([a-z]\w*) ?\((?!\()", declared))
    found |= set(re.findall(r"^#define ([a-zA-Z]\w*)", macros, re.M))
    assert {"strlen", "isnormal"} <= found
    assert {each for each in found if Program().free_name(each) == each} == set()
