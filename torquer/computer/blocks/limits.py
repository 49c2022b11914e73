"""Within what limits numbers of a block's parameters may be set: what is declared beside them.

A parameter of a law or estimator of the package declares them by the type of its field
(`parameters`), one of a user's block by its decorator. Limits that keys have: see `key_limits`.
"""

import functools
import math
from numbers import Real
from typing import Any, NamedTuple, get_type_hints

from torquer.base.columns import Column


class Limits(NamedTuple):
    """Least and greatest value of a number [SI]; `above`, `below`: 1 if that itself is barred."""

    least: float = -math.inf
    greatest: float = math.inf
    above: int = 0
    below: int = 0

    def hold(self, value: float) -> bool:
        """Whether a number is within the limits."""
        is_barred = (self.above and value == self.least) or (self.below and value == self.greatest)
        return self.least <= value <= self.greatest and not is_barred

    def scaled(self, factor: float) -> "Limits":
        """Those of the number that is `factor` times as great."""
        least, greatest = factor * self.least, factor * self.greatest
        if factor > 0.0:
            return Limits(least, greatest, self.above, self.below)
        return Limits(greatest, least, self.below, self.above)

    def __str__(self):
        """In words, to follow 'must be'; "" for none."""
        sides = (
            (self.least, "above" if self.above else "at least"),
            (self.greatest, "below" if self.below else "at most"),
        )
        return ", ".join(f"{word} {side:.9g}" for side, word in sides if math.isfinite(side))


#: Those of a number that may be any.
FREE = Limits()


def declared_limits(block) -> list[Limits]:
    """Limits of each number as its parameter declares them."""
    if not block.values():
        return []
    found = _of_record(block.parameters)
    for name, (first, count) in block.places().items():
        if name in block.own_limits:
            found[first : first + count] = [Limits(*block.own_limits[name])] * count
    return found


def _of_record(record: tuple) -> list[Limits]:
    """Limits of each number of a record, in order, by the types of its fields."""
    found: list[Limits] = []
    declared = _hints(type(record))
    for name, value in zip(record._fields, record, strict=True):
        if hasattr(value, "_fields"):
            found += _of_record(value)
            continue
        count, limits = _count(value), declared.get(name, FREE)
        found += [limits] * count if isinstance(limits, Limits) else limits
    return found


@functools.cache
def _hints(record: type) -> dict[str, Any]:
    """What the fields of a record declare: limits, or a tuple of them."""
    hints = get_type_hints(record, include_extras=True)
    return {name: of.__metadata__[0] for name, of in hints.items() if hasattr(of, "__metadata__")}


def _count(value) -> int:
    return sum(map(_count, value)) if isinstance(value, tuple | list) else 1


def check_own_limits(block) -> None:
    """ValueError unless the limits that a user's block declares are two numbers for a parameter of
    it, and hold the value that it has."""
    values = block.values()
    for name, pair in block.own_limits.items():
        if name not in values:
            known = ", ".join(values) or "none"
            raise ValueError(f"{block.said}: limits must be of one of: {known}; received {name!r}")
        if not _is_pair(pair):
            raise ValueError(
                f"{block.said}: limits of {name} must be two numbers, the least and a greater one; "
                f"received {pair!r}"
            )
        limits = Limits(*pair)
        for value in _numbers(values[name]):
            if not limits.hold(value):
                raise ValueError(f"{block.parameter_key(name)} must be {limits}; received {value}")


def _is_pair(pair) -> bool:
    if not (isinstance(pair, tuple | list) and len(pair) == 2):
        return False
    return all(isinstance(each, Real) for each in pair) and bool(pair[0] < pair[1])


def _numbers(value) -> list:
    """Those of a parameter that can be compared; others are told by `pack`."""
    if isinstance(value, tuple | list):
        return [number for part in value for number in _numbers(part)]
    is_number = isinstance(value, Real) and not isinstance(value, bool) and value == value
    return [value] if is_number or isinstance(value, Column) else []
