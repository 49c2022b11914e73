"""Limits of numbers of a block's parameters: those of the keys that they stand for, or their own.

A number stands for a key if it is the key's value in another unit. That is found by trying: the
block is made again with other values of the key, with which the number, and no other key's, goes in
proportion. A number that follows from several keys, or in another way, has the limits that are
declared with it (`limits`).
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from torquer.base.columns import array_of
from torquer.base.computing import changed
from torquer.base.spec import Spec
from torquer.base.validate import quantity_range
from torquer.computer.blocks.adapter import flat
from torquer.computer.blocks.limits import FREE, Limits, declared_limits

#: A number of a spec: its key, and its place in a list, None for a key that is a number.
Place = tuple[str, int | None]


def find_limits(block) -> tuple[Limits, ...]:
    """Limits of each number that `pack` of a block gives."""
    first, spec = block.pack(), block.spec
    found = [
        _with_first(limits, value)
        for limits, value in zip(declared_limits(block), first.tolist(), strict=True)
    ]
    if not isinstance(spec, Spec):
        return tuple(found)
    try:
        again, moved = _packed(spec), _moved(spec)
    except (ArithmeticError, ValueError):  # with other keys there is no such block
        return tuple(found)
    if len(again) != len(first):
        return tuple(found)
    movers = sum(each.astype(int) for each in moved.values())
    for place, limits in _declared(spec).items():
        alone = moved[place] & (movers == 1) & (again == first) if place in moved else ()
        for number in np.flatnonzero(alone).tolist():
            image = _image(spec, place, limits, number, float(first[number]))
            found[number] = found[number] if image == FREE else image
    return tuple(found)


def _with_first(limits: Limits, first: float) -> Limits:
    """Limits that hold what a parameter begins with: that is always taken, rounded or not."""
    if limits.hold(first):
        return limits
    above, below = (limits.above, 0) if first > limits.least else (0, limits.below)
    return Limits(min(limits.least, first), max(limits.greatest, first), above, below)


def _image(spec: Spec, place: Place, limits: Limits, number: int, now: float) -> Limits:
    """Limits of a number by those of the key that alone moves it; none unless in proportion."""
    try:
        one, two, four = (float(_packed(_with(spec, place, x))[number]) for x in (1.0, 2.0, 4.0))
    except (ArithmeticError, ValueError):
        return FREE
    is_straight = two == 2.0 * one and four == 4.0 * one
    if one == 0.0 or not (is_straight and math.isclose(now, one * _value(spec, place))):
        return FREE
    found = limits.scaled(one)
    return found._replace(least=min(found.least, now), greatest=max(found.greatest, now))


def _packed(spec: Any) -> np.ndarray:
    """Numbers of a spec's block; NaN, which is never the same, for what the scenario gives."""
    block = spec.law() if hasattr(spec, "law") else spec.estimator()
    return array_of(flat(block.parameters))


def _moved(spec: Spec) -> dict[Place, np.ndarray]:
    """Which numbers of the parameters another value of each number of the keys moves.

    Of a key with lists in lists all numbers are moved at once.
    """
    first = _packed(spec)
    return {place: _packed(other) != first for place, other in _others(spec)}


def _others(spec: Spec) -> Iterator[tuple[Place, Spec]]:
    """The spec with one number in another size, for each of them."""
    for name in type(spec).model_fields:
        value = getattr(spec, name)
        if _is_number(value):
            yield (name, None), changed(spec, {name: _other(value)})
        elif isinstance(value, tuple | list) and value and all(map(_is_number, value)):
            for k in range(len(value)):
                yield (name, k), _with(spec, (name, k), _other(value[k]))
        elif (other := _other(value)) is not value:
            yield (name, -1), changed(spec, {name: other})


def _other(value):
    """Numbers, in lists or not, twice as great; 1 in place of 0; anything else as it is."""
    if _is_number(value):
        return 2 * value if value else 1.0
    if isinstance(value, tuple | list) and value:
        others = tuple(map(_other, value))
        return value if all(map(lambda a, b: a is b, others, value)) else others
    return value


def _is_number(value) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _value(spec: Spec, place: Place) -> float:
    name, k = place
    return getattr(spec, name) if k is None else getattr(spec, name)[k]


def _with(spec: Spec, place: Place, value: float) -> Spec:
    """The spec with another value of a number, which is not checked."""
    name, k = place
    if k is None:
        return changed(spec, {name: value})
    own = getattr(spec, name)
    return changed(spec, {name: (*own[:k], value, *own[k + 1 :])})


def _declared(spec: Spec) -> dict[Place, Limits]:
    """Limits of numbers of the keys, as the class of a spec declares them."""
    found: dict[Place, Limits] = {}
    for name, schema in type(spec).model_json_schema()["properties"].items():
        for part in schema.get("anyOf", [schema]):
            if part.get("type") in ("number", "integer"):
                found[name, None] = _within_quantity(name, part)
            for k, each in enumerate(part.get("prefixItems", ())):
                if (own := _own_limits(each)) != FREE:
                    found[name, k] = own
    return found


def _own_limits(schema: dict) -> Limits:
    """Limits that a schema of JSON states."""
    least, greatest = schema.get("minimum"), schema.get("maximum")
    above, below = schema.get("exclusiveMinimum"), schema.get("exclusiveMaximum")
    return Limits(
        max((each for each in (least, above) if each is not None), default=-math.inf),
        min((each for each in (greatest, below) if each is not None), default=math.inf),
        int(above is not None),
        int(below is not None),
    )


def _within_quantity(key: str, schema: dict) -> Limits:
    """Limits of a key that is a number; where it has none itself, those of its quantity."""
    own, (least, greatest) = _own_limits(schema), quantity_range(key)
    if schema["type"] != "number":
        return own
    if own.greatest == math.inf:
        own = own._replace(greatest=greatest)
    if own.least == -math.inf:
        return own._replace(least=-greatest)
    if own.least == 0.0 and own.above and least > 0.0:
        return own._replace(least=least, above=0)
    return own
