"""The worst-case stack by the call graph: against frames made by hand, and what has no bound."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import torquer.flight.c99.export as exporting

TOOLS = "arm-none-eabi-"
needs_target = pytest.mark.skipif(
    not shutil.which(f"{TOOLS}gcc"), reason="not installed: gcc-arm-none-eabi"
)
PROCESSOR = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")
needs_gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="not installed: gcc")
HARNESS = Path(exporting.__file__).parent / "harness"
_SPEC = importlib.util.spec_from_file_location("stack", HARNESS / "stack.py")
assert _SPEC is not None and _SPEC.loader is not None
stack = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(stack)

#: Two ways from `top`, one over 400 bytes of a leaf, one over 80 and the library.
PLAIN = """
#include <math.h>
#include <string.h>
double of_many(double *at) { volatile double kept[50]; kept[0] = *at; return kept[0] * 2.0; }
double of_few(double *at) { volatile double kept[8]; kept[0] = pow(*at, 1.5); return kept[0]; }
double top(double *at) { return at[0] > 0.0 ? of_many(at) + 1.0 : of_few(at) + 2.0; }
int main(void) { volatile double x = 2.0; double y = x; return (int)top(&y); }
"""


def graph_of(text: str, folder: Path):
    """The call graph of a program of one file, without inlining."""
    (folder / "made.c").write_text(text)
    flags = ["-std=c99", "-O1", "-fno-inline", "-fno-optimize-sibling-calls", *PROCESSOR]
    for step in (["-fstack-usage", "-fcallgraph-info=su", "-c", "made.c"],
                 ["--specs=rdimon.specs", "made.o", "-o", "made.elf", "-lm"]):  # fmt: skip
        subprocess.run([f"{TOOLS}gcc", *flags, *step], cwd=folder, check=True)
    return stack.Graph(folder, folder / "made.elf", TOOLS)


@needs_target
def test_the_deepest_chain_is_the_sum_of_its_frames(tmp_path):
    graph = graph_of(PLAIN, tmp_path)
    size, chain = graph.deepest("of_many")
    assert chain == ("of_many",) and 400 <= size <= 424
    within, chain = graph.deepest("of_few")
    assert chain[:2] == ("of_few", "pow")
    assert within == graph.frames["of_few"] + graph.deepest("pow")[0]
    assert graph.deepest("top")[0] == graph.frames["top"] + max(size, within)


#: A leaf with a frame of its own, one whose variable is aligned (its size is dynamic, bounded), a
#: static function between, and two functions of an interface.
EXPORT = """
#include <math.h>
double adcs_few(double x);
double adcs_step(double x);
static double aligned(double x) { volatile double k[20] __attribute__((aligned(64)));
    k[0] = x; return fmod(k[0], 3.0); }
static double between(double x) { volatile double k[30]; k[0] = x; return aligned(k[0]) + 1.0; }
double adcs_few(double x) { return x + 1.0; }
double adcs_step(double x) { volatile double k[40]; k[0] = x; return between(k[0]) + adcs_few(x); }
"""


def stack_of(folder: Path, text: str, **given: str) -> subprocess.CompletedProcess:
    """What `make stack` runs, in the folder of an export of one file."""
    (folder / "test").mkdir(exist_ok=True)
    shutil.copy(HARNESS / "stack.py", folder / "test")
    (folder / "adcs.c").write_text(text)
    command = [sys.executable, folder / "test" / "stack.py"]
    environment = {**os.environ, **given}
    return subprocess.run(command, capture_output=True, text=True, env=environment)


@needs_gcc
@pytest.mark.parametrize("flags", ["-O0", "-O1 -fno-inline", "-O2", "-Os"])
def test_a_header_states_the_stack_of_a_build(flags, tmp_path):
    """The sum of the frames that the compiler states function by function, whatever it inlines."""
    said = stack_of(tmp_path, EXPORT, CC="gcc", CFLAGS=flags)
    assert said.returncode == 0, said.stderr
    text = (tmp_path / "adcs_stack.h").read_text()
    assert text == said.stdout and f"gcc -std=c99 -ffp-contract=off {flags}\n" in text
    assert ": fmod. */" in text
    size = int(text.split()[-1])
    rows = [
        line.split("\t") for line in (tmp_path / "build/stack/adcs.su").read_text().splitlines()
    ]
    frames = {row[0].rpartition(":")[2]: int(row[1]) for row in rows}
    assert 8 * (20 + 30 + 40) <= size == sum(frames.values()) - frames["adcs_few"]
    named = [*re.findall(r"(\w+) \d+", text.partition("Deepest: ")[2].partition(".")[0])]
    assert named[0] == "adcs_step" and set(named) - {"fmod"} == set(frames) - {"adcs_few"}


@needs_gcc
@pytest.mark.parametrize(
    ("text", "given", "said"),
    [
        ("int adcs_f(int n) { return n ? adcs_f(n - 1) * n + 1 : 1; }", {}, "adcs_f calls itself"),
        ("int adcs_f(int n) { int (*volatile g)(int) = 0; return g(n) + 1; }", {}, "its address"),
        ("int adcs_f(int n) { volatile int k[n]; k[0] = n; return k[0]; }", {}, "without a bound"),
        ("int adcs_f(int n) { return m; }", {}, "received .*error"),
        ("int adcs_f(int n);", {"CC": "false"}, "CC must be a GCC .* received no answer"),
    ],
)
def test_a_build_without_a_bound_is_one_line(text, given, said, tmp_path):
    found = stack_of(tmp_path, text, **{"CC": "gcc", "CFLAGS": "-O1", **given})
    assert found.returncode == 1 and found.stderr.count("\n") == 1
    assert re.search(f"^stack: .*{said}", found.stderr)
    assert not (tmp_path / "adcs_stack.h").exists()


@needs_target
def test_library_frames_are_at_least_those_that_gcc_states(tmp_path):
    graph = graph_of(PLAIN, tmp_path)
    for name in ("of_many", "of_few", "top", "main"):
        stated = graph.frames[name]
        graph._of_library(name)
        assert stated <= graph.frames[name] <= stated + 8


@needs_target
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("int f(int n) { return n > 0 ? f(n - 1) * n + 1 : 1; }", "f calls itself"),
        ("int f(int n) { int (*volatile g)(int) = 0; return g(n) + 1; }", "by its address"),
        ("int f(int n) { volatile int k[n]; k[0] = n; return k[0]; }", "without a bound"),
    ],
)  # fmt: skip
def test_what_has_no_bound_is_named(text, said, tmp_path):
    with pytest.raises(SystemExit, match=said):
        graph_of(f"{text}\nint main(void) {{ return f(3); }}\n", tmp_path).deepest("f")


@pytest.mark.parametrize(
    ("instruction", "size"),
    [
        ("push {r4, r5, lr}", 12), ("stmdb sp!, {r4, r5, r6, r7, r8, r9, sl, fp, lr}", 36),
        ("vpush {d8-d11}", 32), ("vpush {d8}", 8), ("sub sp, #44", 44),
        ("sub.w sp, sp, #1024", 1024), ("subw sp, sp, #2052", 2052), ("str.w lr, [sp, #-4]!", 4),
        ("add sp, #44", 0), ("vpush {s16-s19}", 16),
    ],
)  # fmt: skip
def test_bytes_that_an_instruction_puts_on_the_stack(instruction, size):
    assert stack._push(instruction) == size
