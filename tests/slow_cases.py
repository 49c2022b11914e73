"""Which cases of a test run every time, and which with the slow tests only."""

from collections.abc import Iterable

import pytest


def slow_after(count: int, values: Iterable) -> list:
    """Parameters of a test, of which those after the first `count` are slow ones."""
    cases = []
    for number, value in enumerate(values):
        several = value if isinstance(value, tuple) else (value,)
        marks = pytest.mark.slow if number >= count else ()
        cases.append(pytest.param(*several, marks=marks))
    return cases
