"""Options of the commands: each stated once, with type, range and help, as a field of a spec.

A spec is a frozen dataclass. cyclopts takes its fields for options (`altitude_km` for
`--altitude-km`) and the strings below them for their help; a command hands it to its work.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, NamedTuple, TypeVar, dataclass_transform

from cyclopts import Parameter

T = TypeVar("T")
Json = Annotated[bool, Parameter(help="Print machine-readable JSON.")]
Three = tuple[float, float, float]


def whole(kind, tokens) -> int:
    """A whole number as it is written; cyclopts would round 1.5 to 2."""
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"must be a whole number; received {text}") from None


#: A whole number, or none.
Whole = Annotated[int | None, Parameter(converter=whole)]


@dataclass_transform(frozen_default=True, kw_only_default=True)
def options(kind: type[T]) -> type[T]:
    """Decorator of a spec."""
    made = dataclass(frozen=True, kw_only=True, repr=False, eq=False)(kind)  # faster to make
    return Parameter(name="*")(made)


@options
class CodeOptions:
    """Whether the Python files that a scenario names may be executed."""

    no_user_code: bool = False
    """Refuse laws in Python files, which are executed."""
    code_from_anywhere: bool = False
    """Allow laws in files outside SCENARIO's folder."""


class Range(NamedTuple):
    """What must hold of a number, in words and as a function; `size_of`: the key of scenario files
    whose greatest and least size it shares."""

    must: str
    holds: Callable[[float], bool]
    size_of: str = ""

    def check(self, name: str, value: float) -> None:
        """ValueError for a number outside."""
        must = "" if self.holds(value) else self.must
        if not must and self.size_of:
            from torquer.base.validate import out_of_range

            size = out_of_range(self.size_of, value, 0.0)
            must = size and f"be {size}"
        if must:
            raise ValueError(f"{name}: must {must}; received {value:g}")


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


def option(key: str) -> str:
    """A field's name as users write it."""
    return f"--{key.replace('_', '-')}"


def check_ranges(spec) -> None:
    """ValueError for a number of a spec that is outside its range."""
    for field in fields(spec):
        value = getattr(spec, field.name)
        for limit in getattr(field.type, "__metadata__", ()):
            if isinstance(limit, Range) and value is not None:
                limit.check(option(field.name), value)


def given(spec, *keys: str) -> dict:
    """Values, by name, of those of the named fields of a spec that are not None."""
    return {key: value for key in keys if (value := getattr(spec, key)) is not None}
