"""The precision in which a program computes: double, or single with times in double precision.

In single precision every number is a `float` but for times: `t_s` counts from the start, and a
float resolves 8 ms after a day. A number is a time if it is read as one, or is a time plus or minus
a number; what lies between two times is a number again (`torquer.flight.c99.times`). Memory keeps
doubles, so that its layout is that of the simulation; what is read from it is rounded.
"""

import contextlib
import math
from collections.abc import Iterator
from contextvars import ContextVar

import numpy as np

from torquer.flight.c99.refusal import Impossible

_SINGLE = ContextVar("single", default=False)
#: Least and greatest magnitude of a number that a float holds to all its digits.
_LEAST, _GREATEST = (float(each) for each in (np.finfo("f4").tiny, np.finfo("f4").max))

HELD = f"0 or a number from {_LEAST:.3g} to {_GREATEST:.3g}"


@contextlib.contextmanager
def computing_in(real: str) -> Iterator[None]:
    """Within the block programs are translated and printed for `real`: "double" or "float"."""
    token = _SINGLE.set(real == "float")
    try:
        yield
    finally:
        _SINGLE.reset(token)


def is_single() -> bool:
    """Whether numbers are floats in C."""
    return _SINGLE.get()


def real_word() -> str:
    """The type of a number in C."""
    return "float" if is_single() else "double"


def real_text(value: float) -> str:
    """A float of Python as C writes it, to all digits that it has there.

    `Impossible` for one that single precision cannot hold.
    """
    if not is_single():
        return double_text(value)
    if not is_held(value):
        raise Impossible(f"in single precision use {HELD} (here: {value:g})")
    if not math.isfinite(value):
        return double_text(value).replace("double", "float")
    return f"{np.float32(value)!s}f"


def is_held(value: float) -> bool:
    """Whether a float holds a number to all its digits."""
    return not math.isfinite(value) or value == 0.0 or _LEAST <= abs(value) <= _GREATEST


def double_text(value: float) -> str:
    """A double as C writes it, to all its digits."""
    if math.isnan(value):
        return "(double)NAN"
    if math.isinf(value):
        return "(double)INFINITY" if value > 0.0 else "-(double)INFINITY"
    return repr(value)
