"""Generated kernels over every construct: compiled C and plain Python to the bit."""

import importlib.util
import math
import tempfile
from pathlib import Path
from random import Random

import pytest
from flight.c99.generated import module_text
from flight.c99.in_c import TYPES, InC, needs_compiler, same_bits
from hypothesis import HealthCheck, Phase, given, settings, strategies as st

SPECIAL = (0.0, -0.0, 1.0, -1.5, 0.1, 5e-324, -2.2e-308, 1e308, math.inf, -math.inf, math.nan, 7.0)
NUMBERS = st.one_of(st.sampled_from(SPECIAL), st.floats(allow_subnormal=True))
SMALL = st.integers(-7, 7)
ARGUMENTS = st.tuples(NUMBERS, NUMBERS, SMALL, SMALL, st.tuples(NUMBERS, NUMBERS, NUMBERS))
CELLS = st.lists(NUMBERS, min_size=6, max_size=6)
KERNELS = 25


def module_of(text: str, folder: Path):
    """A module of this text, in a file of its own."""
    file = folder / "made.py"
    file.write_text(text)
    spec = importlib.util.spec_from_file_location(f"made_{folder.name}", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def generated(modules: int):
    """So many modules of kernels, and cases to ask them."""
    of_hypothesis = settings(
        max_examples=modules, deadline=None, derandomize=True,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],  # compiling a hundred times to find a shorter one takes too long
    )  # fmt: skip
    cases = st.lists(st.tuples(ARGUMENTS, CELLS), min_size=8, max_size=20)
    return lambda test: of_hypothesis(given(st.integers(0, 2**32), cases)(test))


@needs_compiler
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@generated(2)
def test_generated_kernels_answer_with_the_bits_of_python(seed, cases):
    answer_with_the_bits_of_python(seed, cases)


@needs_compiler
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@generated(12)
def test_many_generated_kernels_answer_with_the_bits_of_python(seed, cases):
    answer_with_the_bits_of_python(seed, cases)


def answer_with_the_bits_of_python(seed, cases):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        module = module_of(module_text(Random(seed), KERNELS), folder)
        kernels = {getattr(module, f"kernel_{k}"): TYPES for k in range(KERNELS)}
        c, compared = InC(kernels, folder), 0
        for kernel in kernels:
            for arguments, cells in cases:
                same = same_bits(c, kernel, arguments, cells)
                assert same is not False, f"{arguments} {cells}\n{c.text(kernel)}"
                compared += same is True
        assert compared > 0.3 * len(kernels) * len(cases)
