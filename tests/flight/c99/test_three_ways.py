"""Random kernels and laws that may fail: compiled Python and C by two compilers, to the bit."""

import contextlib
from pathlib import Path
from random import Random

import pytest
from flight.c99 import in_c
from flight.c99.generated_laws import number_of, text_of, whole_of
from flight.c99.in_c import TYPES, InC, needs_compiler
from flight.c99.test_generated import module_of
from flight.c99.three_ways import IN_C, numbers_in_c, numbers_of
from numba.core.errors import NumbaError

from torquer.computer.blocks.guarded import guarded_kernel
from torquer.computer.inputs import Inputs
from torquer.flight.c99.program import translate_repeatedly
from torquer.flight.c99.refusal import Refused
from torquer.flight.c99.types import Array, find_type

#: Kernels of a module, and cases that each is asked.
COUNT, CASES = 10, 40
MODULES, LAWS = 100, 30


def case_of(what: str, module, random: Random) -> tuple:
    """Arguments without the memory."""
    v = (number_of(random), number_of(random), number_of(random))
    if what == "kernel":
        x, y, n, m = number_of(random), number_of(random), whole_of(random), whole_of(random)
        return (x, y, n, m, v)
    table = (number_of(random), 0.5, number_of(random))
    parameters = module.Parameters(number_of(random), table, float(whole_of(random)))
    return (Inputs(number_of(random))._replace(b_body_t=v), parameters)


def types_of(what: str, module) -> list:
    if what == "kernel":
        return TYPES
    parameters = module.Parameters(1.0, (1.0, 2.0, 3.0), 1.0)
    return [find_type(Inputs(0.0)), find_type(parameters), Array((6,))]


def taken(made: list, types: list, cases: list, count: int) -> dict:
    """The first that both translators take, with their compiled form: an index that is known may be
    in no table, and Numba does not unify all types.
    """
    found: dict = {}
    for kernel in made:
        in_python = guarded_kernel(kernel)
        with contextlib.suppress(Refused, NumbaError):
            translate_repeatedly(lambda program, kernel=kernel: program.function(kernel, types))
            numbers_of(in_python, *cases[0])
            found[kernel] = in_python
        if len(found) == count:
            break
    assert len(found) == count
    return found


def compare(what: str, seed: int, count: int, folder: Path, monkeypatch) -> None:
    """So many kernels or laws, all cases of each."""
    random = Random(seed)
    module = module_of(text_of(random, 4 * count, what), folder)
    types, ways, failed = types_of(what, module), [], 0
    cases = [
        (case_of(what, module, random), [number_of(random) for _ in range(6)])
        for _ in range(CASES)
    ]  # fmt: skip
    made = [getattr(module, f"{what}_{k}") for k in range(4 * count)]
    kernels = taken(made, types, cases, count)
    for compiler, level in IN_C:
        (folder / compiler).mkdir()
        monkeypatch.setattr(in_c, "COMPILER", compiler)
        ways.append(InC(dict.fromkeys(kernels, types), folder / compiler, (level,)))
    for kernel, in_python in kernels.items():
        for arguments, cells in cases:
            expected = numbers_of(in_python, arguments, cells)
            failed += expected[1]
            for c in ways:
                found = numbers_in_c(c, kernel, arguments, cells)
                assert found == expected, f"{arguments} {cells}\n{c.text(kernel)}"
    assert 0 < failed < count * CASES


@needs_compiler
@pytest.mark.parametrize("what", ["kernel", "law"])
def test_a_few_have_the_same_bits_or_fail_alike(what, tmp_path, monkeypatch):
    compare(what, 1000, 15, tmp_path, monkeypatch)


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(MODULES))
def test_a_thousand_kernels_have_the_same_bits_or_fail_alike(seed, tmp_path, monkeypatch):
    compare("kernel", seed, COUNT, tmp_path, monkeypatch)


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(LAWS))
def test_three_hundred_laws_have_the_same_bits_or_fail_alike(seed, tmp_path, monkeypatch):
    compare("law", seed, COUNT, tmp_path, monkeypatch)
