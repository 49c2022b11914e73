"""What a user's kernel must not do: in C as in compiled Python, and never out of bounds."""

import math
from random import Random

import pytest
from flight.c99.guarded import GUARDED
from flight.c99.in_c import TYPES, InC, needs_compiler
from flight.c99.three_ways import numbers_in_c, numbers_of

from torquer.computer.blocks.guarded import guarded_kernel

SPECIAL = (0.0, -0.0, 1.0, -1.5, 5e-324, 1e308, 1e20, -1e20, math.inf, -math.inf, math.nan, 9.3e18)
WHOLE = (0, 1, -1, 2, -2, 3, -3, 5, 6, -6, -7, 40, -(2**63), 2**53)


@pytest.fixture(scope="module")
def c(tmp_path_factory):
    return InC(dict.fromkeys(GUARDED, TYPES), tmp_path_factory.mktemp("guarded"), ("-O2",))


def inputs(count: int):
    """Arguments and memory: all pairs of special whole numbers come, and special floats."""
    random = Random(11)

    def number():
        return random.choice(SPECIAL) if random.random() < 0.4 else random.uniform(-4.0, 4.0)

    for k in range(count):
        n, m = WHOLE[k % len(WHOLE)], WHOLE[k // len(WHOLE) % len(WHOLE)]
        yield (number(), number(), n, m, (number(), number(), number())), [number() for _ in TYPES]


@needs_compiler
@pytest.mark.parametrize("kernel", GUARDED, ids=lambda kernel: kernel.__name__)
def test_a_kernel_answers_fails_and_leaves_memory_as_compiled_python(c, kernel):
    in_python, ended = guarded_kernel(kernel), set()
    for arguments, cells in inputs(2 * len(WHOLE) ** 2):
        expected = numbers_of(in_python, arguments, cells)
        found = numbers_in_c(c, kernel, arguments, cells)
        assert found == expected, f"{arguments} {cells}\n{c.text(kernel)}"
        ended.add(expected[1])
    assert False in ended


@needs_compiler
def test_kernels_fail_where_they_must(c):
    failed = {k.__name__ for k in GUARDED for a, cells in inputs(400)
              if numbers_in_c(c, k, a, cells)[1]}  # fmt: skip
    never = {
        "index_clamped", "made_whole", "whole_of_constants", "least_and_greatest",
        "hash_of_whole_numbers", "loops_near_the_ends",
    }  # fmt: skip
    assert {k.__name__ for k in GUARDED} - failed == never


@pytest.mark.parametrize(
    "name, checks", [("index_clamped", 0), ("index_by_a_reading", 3), ("index_of_a_tuple", 2)]
)
def test_an_index_that_is_proved_is_not_checked(c, name, checks):
    kernel = next(each for each in GUARDED if each.__name__ == name)
    assert c.text(kernel).count("failures->raised = ") == checks
