"""Random kernels and laws that may fail: compiled Python and C by two compilers, to the bit."""

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


def is_translated(kernel, types: list) -> bool:
    """Whether it is not refused: an index that is known may be in no table."""
    try:
        translate_repeatedly(lambda program: program.function(kernel, types) and None)
    except Refused:
        return False
    return True


def compare(what: str, seed: int, count: int, folder: Path, monkeypatch) -> None:
    """So many kernels or laws, all cases of each."""
    random = Random(seed)
    module = module_of(text_of(random, 2 * count, what), folder)
    types, ways = types_of(what, module), []
    made = [getattr(module, f"{what}_{k}") for k in range(2 * count)]
    kernels = [each for each in made if is_translated(each, types)][:count]
    assert len(kernels) == count
    for compiler, level in IN_C:
        (folder / compiler).mkdir()
        monkeypatch.setattr(in_c, "COMPILER", compiler)
        ways.append(InC(dict.fromkeys(kernels, types), folder / compiler, (level,)))
    tried = failed = 0
    for kernel in kernels:
        in_python = guarded_kernel(kernel)
        for _ in range(CASES):
            arguments = case_of(what, module, random)
            cells = [number_of(random) for _ in range(6)]
            try:
                expected = numbers_of(in_python, arguments, cells)
            except NumbaError:  # of types that Numba does not unify
                break
            for c in ways:
                found = numbers_in_c(c, kernel, arguments, cells)
                assert found == expected, f"{arguments} {cells}\n{c.text(kernel)}"
            tried, failed = tried + 1, failed + expected[1]
    assert tried >= 0.7 * count * CASES, f"{tried} of {count * CASES}"
    assert 0 < failed < tried


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
