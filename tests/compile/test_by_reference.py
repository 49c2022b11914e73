"""Long records by reference: the numbers and arrays of the record, in calls and in loops."""

from typing import NamedTuple

import numpy as np
import pytest

from torquer.compile.by_reference import by_record, loaded, stored
from torquer.compile.code_cache import keep_off_disk
from torquer.compile.engine import COMPILED, called, inlined, kernel


class Inner(NamedTuple):
    rows: np.ndarray
    factor: float


class Outer(NamedTuple):
    inner: Inner
    vector: tuple
    count: int
    on: bool
    more: tuple


@inlined
def _weighed(outer, x):
    total = outer.count + x if outer.on else 0.0
    for k in range(outer.inner.rows.shape[0]):
        for j in range(3):
            total += outer.inner.factor * outer.inner.rows[k, j] * outer.vector[j]
    outer.inner.rows[0, 0] += 1.0  # the array itself, no copy
    return total + len(outer.more)


@called
def _weighed_at(place, x):
    return _weighed(loaded(place), x)


weighed = by_record(_weighed, _weighed_at)


@called
def _powers(x):
    total, power = 0.0, 1.0
    for _ in range(50):
        total, power = total + power, power * x
    return total


@inlined
def _twice(x):
    return _powers(x) + _powers(x + 0.0)


@kernel
def _twice_called(x, out):
    out[0] = _twice(x)


@kernel
def fill(outer, out):
    """Another record is stored with each turn: what is read is that of the last one."""
    for k in range(out.shape[0]):
        other = Outer(outer.inner, outer.vector, outer.count + k, outer.on, outer.more)
        s = stored(other)
        out[k] = weighed(s, 0.25) + weighed(s, 0.5)


keep_off_disk(fill, _twice_called)  # code from the disk has no text


def given(numbers: int) -> Outer:
    """A record with so many more numbers."""
    inner = Inner(np.arange(12.0).reshape(4, 3), 0.1)
    return Outer(inner, (1.0, -2.0, 0.3), 7, True, (0.5,) * numbers)


def by_hand(outer: Outer, turns: int) -> np.ndarray:
    """What `fill` writes."""
    rows, out = outer.inner.rows, np.zeros(turns)
    for k in range(turns):
        for x in (0.25, 0.5):
            out[k] += outer.count + k + x + len(outer.more)
            out[k] += outer.inner.factor * (rows @ outer.vector).sum()
            rows[0, 0] += 1.0
    return out


@pytest.mark.parametrize("numbers", [0, 120], ids=["short", "long"])
def test_kernels_see_the_record_as_it_was_stored(numbers):
    out = np.zeros(5)
    fill(given(numbers), out)
    assert out == pytest.approx(by_hand(given(numbers), 5), rel=1e-14)


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize(("numbers", "calls"), [(0, False), (120, True)], ids=["short", "long"])
def test_only_a_long_record_is_handed_over_by_reference(numbers, calls):
    fill(given(numbers), np.zeros(1))
    texts = fill.inspect_asm()
    (text,) = (texts[types] for types in texts if len(types[0][-1]) == numbers)
    assert ("_weighed_at" in text) is calls


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
def test_a_called_kernel_stands_once_in_the_code_of_one_that_is_inlined():
    out = np.zeros(3)
    _twice_called(2.0, out)
    (text,) = _twice_called.inspect_asm().values()
    labels = [line for line in text.splitlines() if "_powers" in line and line.endswith(":")]
    assert len(labels) == 1 and out[0] == 2.0 * sum(2.0**k for k in range(50))
