"""One construct a kernel: compiled C and plain Python to the bit, over many inputs."""

import math
from random import Random

import numba
import numpy as np
import pytest
from flight.c99.by_hand import BY_HAND, whole_numbers_by_zero
from flight.c99.in_c import TYPES, InC, needs_compiler, same_bits
from flight.c99.test_generated import SPECIAL


@pytest.fixture(scope="module")
def c(tmp_path_factory):
    flags = ("-O2", "-Werror=discarded-qualifiers")
    return InC(dict.fromkeys(BY_HAND, TYPES), tmp_path_factory.mktemp("by_hand"), flags)


def inputs(count: int):
    """Arguments and memory: every whole number from -7 to 7, small and special numbers."""
    random = Random(5)

    def number():
        return random.choice(SPECIAL) if random.random() < 0.2 else random.uniform(-4.0, 4.0)

    for k in range(count):
        n, m = k % 15 - 7, random.randint(-7, 7)
        cells = [random.uniform(-4.0, 4.0) for _ in range(6)]
        yield (number(), number(), n, m, (number(), number(), number())), cells


def test_all_kernels_are_tried():
    assert len(BY_HAND) > 20


@needs_compiler
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("kernel", BY_HAND, ids=lambda kernel: kernel.__name__)
def test_a_construct_has_the_bits_of_python(c, kernel):
    compared = 0
    for arguments, cells in inputs(300):
        same = same_bits(c, kernel, arguments, cells)
        assert same is not False, f"{arguments} {cells}\n{c.text(kernel)}"
        compared += same is True
    assert compared > 150


@needs_compiler
def test_the_comparison_of_bits_tells_zeros_apart(c):
    arguments = (0.0, math.inf, 1, 2, (1.0, 2.0, 3.0))
    assert (
        math.copysign(1.0, c(next(k for k in BY_HAND if k.__name__ == "signs"), *arguments)[0]) < 0
    )


@needs_compiler
def test_a_division_of_whole_numbers_by_zero_fails_as_in_compiled_python(c):
    arguments = (0.0, 1.0, 5, 2, (1.0, 2.0, 3.0))
    compiled = numba.njit(error_model="python")(whole_numbers_by_zero)
    with pytest.raises(ZeroDivisionError):
        compiled(*arguments, np.zeros(6))
    assert c(whole_numbers_by_zero, *arguments) == [0.0, 0.0]
    assert c.failed_line == whole_numbers_by_zero.__code__.co_firstlineno + 2
