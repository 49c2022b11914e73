"""Portable functions of angles: the nearest double, and the same bits in C."""

import math
from random import Random

import mpmath
import pytest
from flight.c99.in_c import InC, bits, needs_compiler

from torquer.flight.c99.portable import PORTABLE
from torquer.flight.c99.types import REAL

SPECIAL = (0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1e-310, 1e308, math.inf, -math.inf, math.nan)
WITH_ONE = [name for name in PORTABLE if name != "atan2"]
#: Angles beyond 2^27 rad have the same bits everywhere, but are not accurate.
LARGEST_RAD = 2.0**27


def arguments(name: str) -> list[tuple]:
    """Many arguments of all sizes; for sine and cosine those next to quarters of a turn too."""
    random = Random(3)

    def number(least=-12.0, most=8.0):
        return random.choice((-1.0, 1.0)) * 10.0 ** random.uniform(least, most)

    if name == "atan2":
        return [(number(), number()) for _ in range(400)] + [
            (number(-300.0, 300.0), number(-300.0, 300.0)) for _ in range(200)
        ]
    if name in ("asin", "acos"):
        near_one = [(1.0 - 10.0 ** random.uniform(-16.0, -1.0),) for _ in range(200)]
        return near_one + [(number(-20.0, 0.0),) for _ in range(400)]
    return [(number(),) for _ in range(400)] + [(0.5 * k * math.pi,) for k in range(1, 200)]


@pytest.mark.parametrize("name", PORTABLE)
def test_the_answer_is_the_double_nearest_to_the_true_value(name):
    with mpmath.workprec(240):
        for each in arguments(name):
            true = float(getattr(mpmath, name)(*map(mpmath.mpf, each)))
            assert PORTABLE[name](*each) == true, each


@pytest.mark.parametrize("name", WITH_ONE)
def test_special_numbers_are_answered_as_the_library_does(name):
    for x in SPECIAL:
        if name in ("sin", "cos") and LARGEST_RAD < abs(x) < math.inf:
            assert abs(PORTABLE[name](x)) <= 1.0
            continue
        try:
            expected = getattr(math, name)(x)
        except ValueError:
            expected = math.nan
        assert bits(PORTABLE[name](x)) == bits(expected), x


def test_atan2_of_special_numbers_is_that_of_the_library():
    for y in SPECIAL:
        for x in SPECIAL:
            assert bits(PORTABLE["atan2"](y, x)) == bits(math.atan2(y, x)), (y, x)


@needs_compiler
@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_c_has_the_bits_of_python(level, tmp_path):
    kernels = {each: [REAL] * (1 + (name == "atan2")) for name, each in PORTABLE.items()}
    c = InC(kernels, tmp_path, (level,))
    for name, kernel in PORTABLE.items():
        special = [(x,) if name in WITH_ONE else (x, y) for x in SPECIAL for y in SPECIAL]
        for each in arguments(name) + special:
            assert bits(c(kernel, *each)[0]) == bits(kernel(*each)), (name, each)
