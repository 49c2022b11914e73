"""Functions of the library: no compiler works them out itself; builds that round otherwise show."""

import math
import shutil
import subprocess
from pathlib import Path

import numba
import pytest
from flight.c99.in_c import COMPILER, InC, bits, needs_compiler
from flight.c99.test_generated import module_of

from torquer.flight.c99.arithmetic import OF_FLOATS, OF_TWO
from torquer.flight.c99.texts import self_test

#: Every function of floats that the translator has, by its name in Python.
FUNCTIONS = {f"{'math' if f.__name__ in vars(math) and getattr(math, f.__name__) is f else 'np'}."
             f"{f.__name__}": (f, name in OF_TWO) for f, name in OF_FLOATS.items()}  # fmt: skip
#: Arguments, many of which glibc and a correct rounding answer with other bits.
NUMBERS = (0.07, 0.1, 0.2, 0.36, 0.5, 0.61, 0.75, 0.83, 0.947, 0.99, 1e-5, 1e-310)
#: Numba has it under NumPy's name alone.
NOT_COMPILED = {"math.fmod"}
LEVELS = ("-O0", "-O1", "-O2", "-O3", "-Os")


def constant_kernels() -> str:
    """A kernel for each function, which calls it with constants that a compiler finds out."""
    lines = ["import math", "import numba", "import numpy as np"]
    for k, (name, (_, of_two)) in enumerate(FUNCTIONS.items()):
        arguments = [f"{x!r}, 0.3" if of_two else repr(x) for x in NUMBERS]
        calls = ", ".join(f"through_{k}({each})" for each in arguments)
        take = "x, y" if of_two else "x"
        lines += [
            f"@numba.njit\ndef through_{k}({take}):\n    return {name}({take})",
            f"def kernel_{k}():\n    return ({calls},)",
        ]
    return "\n".join(lines) + "\n"


def test_all_functions_of_one_number_are_tried():
    assert len(FUNCTIONS) > 20
    assert {"math.log10", "math.tanh", "math.atan2", "np.floor"} <= set(FUNCTIONS)


@pytest.fixture(scope="module")
def module(tmp_path_factory):
    return module_of(constant_kernels(), tmp_path_factory.mktemp("constants"))


@needs_compiler
@pytest.mark.parametrize("level", LEVELS)
def test_what_is_constant_after_inlining_has_the_bits_of_the_library(level, module, tmp_path):
    kernels = [getattr(module, f"kernel_{k}") for k in range(len(FUNCTIONS))]
    c = InC({kernel: [] for kernel in kernels}, tmp_path, (level,))
    for kernel, (name, (function, of_two)) in zip(kernels, FUNCTIONS.items(), strict=True):
        expected = [function(x, 0.3) if of_two else function(x) for x in NUMBERS]
        assert list(map(bits, c(kernel))) == list(map(bits, map(float, expected))), name


@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name not in NOT_COMPILED])
def test_compiled_python_has_these_bits_of_constants_too(name, module):
    kernel = getattr(module, f"kernel_{list(FUNCTIONS).index(name)}")
    function, of_two = FUNCTIONS[name]
    expected = [function(x, 0.3) if of_two else function(x) for x in NUMBERS]
    assert list(map(bits, numba.njit(kernel)())) == list(map(bits, map(float, expected)))


MAIN = """
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
{exact}
static bool tested(void)
{{
    return {is_exact};
}}
bool (*volatile self_test)(void) = tested; /* what only main calls is compiled as if for once */
int main(void)
{{
    return self_test() ? 0 : 3;
}}
"""
#: Builds whose arithmetic has other bits: flags, and what they may say.
OTHERWISE = {
    "finite": ["-ffinite-math-only"],
    "reciprocal": ["-freciprocal-math"],
    "associative": ["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"],
    "fast": ["-ffast-math"],
    "unsafe": ["-funsafe-math-optimizations"],
    "fused": ["-mfma", "-ffp-contract=fast"],
    "x87": ["-mfpmath=387"],
}
#: Of these no sum, product or quotient tells; the preprocessor does.
SEEN_BY_THE_PREPROCESSOR = {"no sign of zeros": ["-fno-signed-zeros"]}
RIGHT = {level: [level] for level in LEVELS} | {"no built-in": ["-O2", "-fno-builtin"]}


def ran(folder: Path, flags: list[str], reals=("double", "float"), checks: bool = False) -> int:
    """What the self-test of numbers returns when it is built so; -1 if it does not build."""
    parts = self_test(reals)
    text = MAIN.format(**parts)
    if checks:
        text = text.replace("{exact}", "").replace(
            "#include <stdbool.h>\n", f"#include <stdbool.h>\n{parts['checks']}"
        )
    return code_of(folder, flags, text)


def code_of(folder: Path, flags: list[str], text: str, compiler: str = COMPILER or "") -> int:
    """What a program of this text returns; -1 if it does not build for an `#error`."""
    source, program = folder / "test.c", folder / "test"
    source.write_text(text)
    command = [compiler, "-std=c99", "-O2", *flags, "-Wall", "-o", program, source, "-lm"]
    made = subprocess.run(command, capture_output=True, text=True)
    if made.returncode:
        assert "#error" in made.stderr, made.stderr
        return -1
    return subprocess.run([program]).returncode


def skip_without(flags: list[str]):
    if "-mfma" in flags and "fma" not in Path("/proc/cpuinfo").read_text().split():
        pytest.skip("the processor has no fused products")


@needs_compiler
@pytest.mark.parametrize("reals", [("double",), ("float",)], ids=str)
@pytest.mark.parametrize("name", OTHERWISE)
def test_the_self_test_sees_a_build_that_computes_otherwise(name, reals, tmp_path):
    skip_without(OTHERWISE[name])
    assert ran(tmp_path, OTHERWISE[name], reals) == 3


@needs_compiler
@pytest.mark.parametrize("name", [*OTHERWISE, *SEEN_BY_THE_PREPROCESSOR])
def test_such_a_build_is_refused_or_says_so(name, tmp_path):
    flags = (OTHERWISE | SEEN_BY_THE_PREPROCESSOR)[name]
    skip_without(flags)
    assert ran(tmp_path, flags, checks=True) in (-1, 3)


#: A product less a number beside a product and a number: 3 where they are fused.
PAIRS = """
static void pairs(const double *a, const double *b, double *restrict to)
{
    to[0] = (a[0] * a[0]) - b[0];
    to[1] = (a[1] * a[1]) + b[1];
}
void (*volatile hidden)(const double *, const double *, double *restrict) = pairs;
int main(void)
{
    const double a[2] = {1.0 + 0x1p-27, 1.0 + 0x1p-27}, b[2] = {1.0 + 0x1p-26, -1.0 - 0x1p-26};
    double to[2];
    hidden(a, b, to);
    return (to[0] == 0.0 && to[1] == 0.0) ? 0 : 3;
}
"""


@needs_compiler
@pytest.mark.parametrize("reals", [("double",), ("float",)], ids=str)
@pytest.mark.parametrize("level", ["-O1", "-O2", "-O3"])
@pytest.mark.parametrize("compiler", [each for each in ("gcc", "clang") if shutil.which(each)])
def test_the_self_test_sees_pairs_that_a_vectoriser_fuses(compiler, level, reals, tmp_path):
    """GCC 12 fuses them although -ffp-contract=off says no; others do not, and are not refused."""
    flags = [level, "-ffp-contract=off", "-mfma"]
    skip_without(flags)
    text = MAIN.format(**self_test(reals))
    is_fused = code_of(tmp_path, flags, PAIRS, compiler)
    assert code_of(tmp_path, flags, text, compiler) == is_fused
    assert code_of(tmp_path, [*flags, "-fno-tree-slp-vectorize"], text, compiler) == 0


@needs_compiler
@pytest.mark.parametrize("name", RIGHT)
def test_the_self_test_passes_where_bits_are_right(name, tmp_path):
    assert ran(tmp_path, RIGHT[name], checks=True) == 0


def test_every_function_of_the_library_hides_its_arguments():
    from torquer.flight.c99.helpers import LIBRARY, helper_texts

    called = {name for name in OF_FLOATS.values() if name.endswith("_of")}
    assert called == {f"{name}_of" for name in LIBRARY}
    for name, text in helper_texts().items():
        if name in called:
            assert text.count("const volatile double") == len(LIBRARY[name[:-3]])
