"""Exports of whole computers: they build without a warning, and replay with the same bits."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from flight.c99 import plain_replay
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler

import torquer
from torquer.cli.answer import answer
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import make_texts
from torquer.flight.c99.notes import export_notes

EXAMPLES = Path(__file__).parents[3] / "examples"
#: All examples that are a scenario.
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.toml"))
#: Those of which other tests build an export, and smaller siblings of the others.
BUILT_ELSEWHERE = {
    "chibis_m_day", "chibis_m_detumble", "looks_at_a_station", "magneto_gyro_micro", "my_law",
    "safe_mode", "tip_off_campaign", "turn_to_the_sun", "which_sensors",
}  # fmt: skip
#: Those that take long to fly with all that they simulate.
LONG = {"chibis_m_flight", "disturbances"}
STRICT = [
    *("-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror"),
]
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]


def written(texts: dict, folder: Path) -> Path:
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def built(folder: Path, *flags: str, compiler: str = COMPILER or "") -> Path:
    """The replay of an export, compiled; fails with the compiler's words."""
    sources = [folder / "adcs.c", folder / "adcs_tables.c", folder / "test/replay.c"]
    command = [compiler, *FLAGS, *STRICT, *flags, f"-I{folder}", "-o", folder / "replay", *sources]
    made = subprocess.run([*command, "-lm"], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return folder / "replay"


def replayed(program: Path, folder: Path) -> subprocess.CompletedProcess:
    command = [program, folder / "test/recorded.bin"]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.fixture(scope="module")
def export(tmp_path_factory) -> Path:
    """The example with a user's law, with 200 control steps."""
    folder = tmp_path_factory.mktemp("export")
    torquer.export_c(torquer.load_scenario(EXAMPLES / "my_law.toml"), folder, steps=200)
    return folder


@needs_compiler
def test_what_the_loop_calls_builds_without_a_warning(export, tmp_path):
    command = [COMPILER, *FLAGS, *STRICT, "-O0", "-c", export / "test/in_the_loop.c"]
    made = subprocess.run([*command, "-o", tmp_path / "o"], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr


@needs_compiler
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in BUILT_ELSEWHERE | LONG else [])
        for name in NAMES
    ],
)
def test_examples_build_without_a_warning_and_replay_their_flight(name, tmp_path):
    torquer.export_c(torquer.load_scenario(EXAMPLES / f"{name}.toml"), tmp_path, steps=100)
    for compiler in COMPILERS:
        done = replayed(built(tmp_path, "-O0", compiler=compiler), tmp_path)
        same = "100 control steps: the same bits in commands and state\n"
        assert (done.returncode, done.stdout) == (0, same), done


@needs_compiler
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_a_users_law_replays_with_the_same_bits(export, compiler, level):
    done = replayed(built(export, level, compiler=compiler), export)
    assert done.stdout == "200 control steps: the same bits in commands and state\n"
    assert done.returncode == 0


@needs_compiler
def test_a_replay_notices_another_bit(export, tmp_path):
    folder = shutil.copytree(export, tmp_path / "spoiled")
    text = (folder / "adcs_tables.c").read_text()
    assert "30000.0" in text
    (folder / "adcs_tables.c").write_text(text.replace("30000.0", "30000.000000000004"))
    done = replayed(built(folder), folder)
    assert done.returncode == 1
    assert done.stdout.startswith("the first difference is at step ")


@needs_compiler
def test_a_replay_refuses_the_record_of_another_export(export, tmp_path):
    data = (export / "test/recorded.bin").read_bytes()
    (tmp_path / "test").mkdir()
    (tmp_path / "test/recorded.bin").write_bytes(data[:16] + b"\x01" + data[17:])
    done = replayed(built(export), tmp_path)
    assert (done.returncode, done.stdout) == (2, "the record is of another export\n")


@needs_compiler
def test_a_board_without_files_replays_the_first_steps_from_an_array(export, tmp_path):
    array, program = export / "test/recorded.c", tmp_path / "replay"
    sources = [export / name for name in ("adcs.c", "adcs_tables.c", "test/replay.c")]
    command = [COMPILER, *FLAGS, *STRICT, "-DADCS_RECORDED", f"-I{export}", *sources, array]
    subprocess.run([*command, "-o", program, "-lm"], check=True)
    done = subprocess.run([program], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (
        0, "40 control steps: the same bits in commands and state\n"
    )  # fmt: skip
    words = re.findall(r"UINT64_C\((0x[0-9a-f]{16})\)", array.read_text())
    record = (export / "test/recorded.bin").read_bytes()
    data = b"".join(int(each, 16).to_bytes(8, "little") for each in words)
    assert data[:8] == record[:8] and data[32:] == record[32 : len(data)]
    assert int.from_bytes(data[8:16], "little") == 40


WORDS = """
#define main replay_main
#include "replay.c"
#undef main
int main(int count, char **arguments)
{
    const uint8_t bytes[8] = {0x01, 0x23, 0x45, 0x67, 0x89, 0xab, 0xcd, 0xef};
    FILE *file = (count > 0) ? fopen(arguments[1], "wb") : NULL;
    bool same = word_of(bytes) == UINT64_C(0xefcdab8967452301);
    (void)replay_main;
    same = same && is_word_written(file, UINT64_C(0x3ff0000000000001)) && fclose(file) == 0;
    return same ? 0 : 1;
}
"""


@needs_compiler
def test_words_of_a_record_begin_with_the_lowest_byte_on_every_processor(export, tmp_path):
    (tmp_path / "words.c").write_text(WORDS)
    sources = [export / "adcs.c", export / "adcs_tables.c", tmp_path / "words.c"]
    command = [COMPILER, *FLAGS, f"-I{export}", f"-I{export}/test", *sources]
    subprocess.run([*command, "-o", tmp_path / "words", "-lm"], check=True)
    subprocess.run([tmp_path / "words", tmp_path / "word"], check=True)
    assert (tmp_path / "word").read_bytes() == bytes.fromhex("010000000000f03f")
    text = (export / "test/replay.c").read_text()
    reads = re.findall(r"\bf(?:read|write)\(([^,]+),", text)
    assert reads == ["bytes", "bytes"]  # whatever is read or written goes through such words


@needs_compiler
def test_arithmetic_that_gives_other_bits_does_not_build(export):
    with pytest.raises(AssertionError, match="compile without -ffast-math"):
        built(export, "-ffast-math")


@needs_compiler
def test_fused_products_are_found_by_the_self_test(export, tmp_path):
    if "fma" not in Path("/proc/cpuinfo").read_text().split():
        pytest.skip("the processor has no fused products")
    folder = shutil.copytree(export, tmp_path / "fused")
    program = built(folder, "-O2", "-mfma", "-ffp-contract=fast")
    done = replayed(program, folder)
    assert done.returncode == 2
    assert "-ffp-contract=off" in done.stdout


def test_plain_python_answers_with_the_same_bits(export):
    command = [sys.executable, plain_replay.__file__, EXAMPLES / "my_law.toml"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    environment["PYTHONPATH"] = os.pathsep.join(sys.path)
    done = subprocess.run(
        [*command, export / "test/recorded.bin"], capture_output=True, text=True, env=environment
    )
    assert done.stdout == "200 control steps: the same bits in commands and state\n", done.stderr


def test_the_header_names_what_the_computer_has(tmp_path):
    computer = find_computer(torquer.load_scenario(EXAMPLES / "spinner_modes.toml"))
    text = make_texts(computer, translate_step(computer, again=0), 1)["adcs.h"]
    modes = computer.scenario.control.named().modes
    assert modes is not None
    for region, of in modes.regions.items():
        for state in of.states:
            assert f"ADCS_STATE_{region}_{state}".upper() in text


LAW = """
import math
import torquer

@torquer.law
def odd(inputs, parameters, memory):
    b = inputs.b_body_t
    return (math.hypot(b[0], b[1]), 0.0, 0.0)
"""


def test_unexportable_law_is_named_in_one_line(tmp_path, capsys):
    (tmp_path / "my_law.py").write_text(LAW)
    text = (EXAMPLES / "my_law.toml").read_text().replace("parameters = { gain = 3e4 }", "")
    (tmp_path / "odd.toml").write_text(text)
    said = "my_law.py, line 8: `math.hypot(b[0], b[1])` has no translation to C; write math.sqrt"
    (note,) = export_notes(torquer.load_scenario(tmp_path / "odd.toml"))
    assert note.startswith(f"cannot be exported as C: {said}")
    code = answer(["export", "c", str(tmp_path / "odd.toml"), "--out", str(tmp_path / "out")])
    assert code == 2
    error = capsys.readouterr().err
    assert said.split(":")[0] in error.replace("\n", " ")


@needs_compiler
@pytest.mark.skipif(None in map(shutil.which, ("cmake", "ctest")), reason="no CMake")
@pytest.mark.skipif(os.name == "nt", reason="the line is for a shell of POSIX")
def test_the_line_that_is_printed_builds_and_replays_from_there(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    command = ["export", "c", str(EXAMPLES / "my_law.toml"), "--out", "my flight", "--steps", "20"]
    assert answer(command) == 0
    printed = capsys.readouterr().out.splitlines()
    (line,) = [each for each in printed if each.startswith("build and replay: ")]
    done = subprocess.run(line.partition(": ")[2], shell=True, capture_output=True, text=True)
    assert done.returncode == 0 and "100% tests passed" in done.stdout, done


@pytest.mark.parametrize("steps", [0, -1, True, 1.5])
def test_steps_must_be_a_whole_number(steps, tmp_path):
    scenario = torquer.load_scenario(EXAMPLES / "my_law.toml")
    with pytest.raises(ValueError, match=r"steps: must be a whole number of 1 or more; received"):
        torquer.export_c(scenario, tmp_path, steps)


HOLD = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
TABLES = {
    "times alone": {
        "nadir": {"laws": ["nadir"], "transitions": [{"to": "tilted", "at_most_s": 8}]},
        "tilted": {"laws": ["tilted"], "transitions": [{"to": "nadir", "at_most_s": 6}]},
    },
    "no transition": {"one": {"laws": ["nadir"]}},
    "a state without laws": {
        "off": {"laws": [], "transitions": [{"to": "on", "at_most_s": 5}]},
        "on": {"laws": ["nadir"]},
    },
}


@needs_compiler
@pytest.mark.parametrize("states", TABLES.values(), ids=TABLES)
def test_a_table_of_modes_without_conditions_replays_with_the_same_bits(states, make, tmp_path):
    laws = {"nadir": HOLD, "tilted": HOLD | {"euler_deg": [0, 30, 0]}}
    named = {name: laws[name] for state in states.values() for name in state["laws"]}
    control = {"sample_s": 1.0, "laws": named, "modes": {"states": states}}
    scenario = make({"control": control})
    assert export_notes(scenario) == []
    torquer.export_c(scenario, tmp_path, steps=60)  # past several transitions
    done = replayed(built(tmp_path), tmp_path)
    assert done.stdout == "60 control steps: the same bits in commands and state\n"
