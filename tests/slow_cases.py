"""Which cases of a test run every time, and which with the slow tests only."""

from collections.abc import Iterable

import pytest


def slow_after(count: int, values: Iterable, names: int = 1) -> list:
    """Values for the `names` parameters of a test; those after the first `count` are slow cases."""
    cases = []
    for number, value in enumerate(values):
        marks = pytest.mark.slow if number >= count else ()
        cases.append(pytest.param(*([value] if names == 1 else value), marks=marks))
    return cases
