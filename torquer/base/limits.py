"""Requests: what a function, or the command of the same name, is asked; with the ranges of numbers.

A request is a frozen dataclass. Its numbers are checked when it is made, by the same rule for a
caller in Python and for the command line, which takes the fields for options (`altitude_km` for
`--altitude-km`) and the strings below them for their help.

    @request
    class SweepRequest:
        \"\"\"What `sweep` is asked.\"\"\"

        runs: Annotated[int, at_least(1)] = 10
        \"\"\"Number of runs.\"\"\"
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar, dataclass_transform, get_type_hints

T = TypeVar("T")
Three = tuple[float, float, float]


class RequestError(ValueError):
    """A mistake in one key of a request; the command line names its option instead of the key."""

    def __init__(self, key: str, problem: str):
        self.key, self.problem = key, problem
        super().__init__(f"{key}: {problem}")


class Range(NamedTuple):
    """What must hold of a number, in words and as a function; `size_of`: the key of scenario files
    whose greatest and least size it shares."""

    must: str
    holds: Callable[[float], bool]
    size_of: str = ""

    def check(self, name: str, value: float) -> None:
        """RequestError for a number outside."""
        must = "" if self.holds(value) else self.must
        if not must and self.size_of:
            from torquer.base.validate import out_of_range

            size = out_of_range(self.size_of, value, 0.0)
            must = size and f"be {size}"
        if must:
            raise RequestError(name, f"must {must}; received {value:g}")


def within(low: float, high: float, unit: str = "") -> Range:
    """The range between two ends, both allowed."""
    must = f"lie within {low:g}..{high:g} {unit}".rstrip()
    return Range(must, lambda value: low <= value <= high)


def at_least(low: float) -> Range:
    """The range of finite numbers from one on."""
    return Range(f"be {low:g} or more", lambda value: low <= value < math.inf)


def positive(size_of: str = "") -> Range:
    """The range of positive numbers."""
    return Range("be a positive number", lambda value: 0.0 < value < math.inf, size_of)


def _ranges_of(kind: type) -> list[tuple[str, Range]]:
    """Ranges that the fields of a class state, however its annotations are kept."""
    hints = get_type_hints(kind, include_extras=True)
    return [
        (name, each)
        for name, hint in hints.items()
        for each in getattr(hint, "__metadata__", ())
        if isinstance(each, Range)
    ]


@dataclass_transform(frozen_default=True, kw_only_default=True)
def request(kind: type[T]) -> type[T]:
    """Decorator of a request: a frozen dataclass, whose numbers are checked when it is made."""
    further, ranges = getattr(kind, "__post_init__", None), _ranges_of(kind)

    def check(self) -> None:
        for name, each in ranges:
            if (value := getattr(self, name)) is not None:
                each.check(name, value)
        if further is not None:
            further(self)

    kind.__post_init__ = check  # type: ignore[attr-defined]
    return dataclass(frozen=True, kw_only=True)(kind)


def given(spec, *keys: str) -> dict:
    """Values, by name, of those of the named fields of a request that are not None."""
    return {key: value for key in keys if (value := getattr(spec, key)) is not None}
