"""Kernels three ways: compiled Python as laws are compiled, and C by two compilers."""

import shutil

import numpy as np
from flight.c99.in_c import bits, flat

#: The compilers in C: which, and how they optimise.
IN_C = [(name, level) for name, level in (("gcc", "-O2"), ("clang", "-O3")) if shutil.which(name)]


def numbers_of(kernel, arguments: tuple, cells: list[float]) -> tuple[list[bytes], bool]:
    """Bits of what compiled Python answers and leaves in the memory, and whether it raised."""
    memory = np.array(cells)
    try:
        answer = flat_exactly(kernel(*arguments, memory))
    except (ZeroDivisionError, IndexError):
        return list(map(bits, memory)), True
    return [*answer, *map(bits, memory)], False


def flat_exactly(value) -> list[bytes]:
    """Bits of all numbers of an answer, as C hands them over."""
    return [bits(each) for each in flat(value if isinstance(value, tuple) else (value,))]


def numbers_in_c(c, kernel, arguments: tuple, cells: list[float]) -> tuple[list[bytes], bool]:
    """The same of C."""
    memory = np.array(cells)
    answer = c(kernel, *arguments, memory)
    left = list(map(bits, memory))
    return ([*map(bits, answer), *left], False) if not c.failed_line else (left, True)
