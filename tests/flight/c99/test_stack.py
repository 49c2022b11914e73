"""The worst-case stack by the call graph: against frames made by hand, and what has no bound."""

import importlib.util
import shutil
import subprocess
from pathlib import Path

import pytest

import torquer.flight.c99.export as exporting

TOOLS = "arm-none-eabi-"
needs_target = pytest.mark.skipif(
    not shutil.which(f"{TOOLS}gcc"), reason="not installed: gcc-arm-none-eabi"
)
PROCESSOR = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")
_SPEC = importlib.util.spec_from_file_location(
    "stack", Path(exporting.__file__).parent / "harness/stack.py"
)
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
