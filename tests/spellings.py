"""Every way to write a table, derived from its spec: which keys stand for others, which values.

A table is first written in each of the smallest ways that its spec accepts (`radius_km` alone or
`altitude_km` alone); then each other key is added to each of these, with each kind of value.
"""

import itertools
import types
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from torquer.scenario.keys import key_unit

TLE = [
    "1 54380U 22162B   22345.68941756  .08877519  80912-5  18379-3 0  9996",
    "2 54380  41.4618 212.0662 0014777 219.1379 204.8125 16.45663364  1954",
]
#: Values of keys that mean nothing without another key.
OF_KEYS: dict[str, Any] = {
    "tle": TLE,
    "altitude_km": 600.0,
    "radius_km": 7000.0,
    "semi_major_axis_km": 7000.0,
    "eccentricity": 0.01,
    "perigee_altitude_km": 500.0,
    "apogee_altitude_km": 700.0,
    "position_km": [7000.0, 100.0, -50.0],
    "velocity_km_s": [0.1, 3.0, 6.9],
    "quaternion": [0.0, 0.6, 0.0, 0.8],
    "sequence": "313",
    "inertia_kg_m2": [1.0, 1.3, 1.7],
    "table_tolerance": 1e-6,
    "held_at_year": 2022.0,
    "ut1_minus_utc_s": 0.1,
    "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "boresight": [0, 0, 1],
    "edge": [1, -1, 0],
    "remanence_t": 0.004,
    "up": [1, 0, 0],
    "sun_heads": {"one": {"axes": [[1, 0, 0]], "half_field_deg": 60.0}},
}
#: Values of all other numbers by their unit.
OF_UNITS = {
    "s": 10.0, "km": 500.0, "deg": 5.0, "kg": 10.0, "m": 0.1, "m2": 0.1, "deg/s": 0.1, "nT": 50.0,
    "rpm": 3000.0, "N m": 1e-3, "N m s": 0.05, "A m²": 0.1, "days": 3.0, "W": 1.0,
    "A/m": 12.0, "m³": 1e-7,
}  # fmt: skip
#: So many keys at most must be added to those that are required.
_MOST = 4


def tables(spec: type[BaseModel]) -> list[dict]:
    """The table in all its ways, each as plain data; none for what these values cannot write."""
    return list(_tables(spec))


@cache
def _tables(spec: type[BaseModel]) -> tuple[dict, ...]:
    shortest = [*_shortest(spec)]
    found = [*shortest]
    for begun in shortest:
        for key, field in spec.model_fields.items():
            values = [] if key in begun else _values(field.annotation, key)
            tried = ({**begun, key: value} for value in values)
            found += [table for table in tried if is_accepted(spec, table)]
    return (*found, *_pairs(spec, shortest, {key for table in found for key in table}))


def _pairs(spec: type[BaseModel], shortest: list[dict], seen: set[str]) -> Iterator[dict]:
    """Keys that are still missing, each with another one or in place of one."""
    for key in [key for key in spec.model_fields if key not in seen]:
        for begun, other in itertools.product(shortest[:1], spec.model_fields):
            own, with_it = (_values(spec.model_fields[x].annotation, x)[:1] for x in (key, other))
            kept = {x: value for x, value in begun.items() if x != other}
            pairs = (
                {**kept, key: a} | more
                for a in own
                for more in ({}, *({other: b} for b in with_it))
            )
            yield from (table for table in pairs if is_accepted(spec, table))


def _shortest(spec: type[BaseModel]) -> Iterator[dict]:
    """The required keys, with the fewest others that make a table of them."""
    values = {key: _values(f.annotation, key) for key, f in spec.model_fields.items()}
    required = {key: values[key] for key, f in spec.model_fields.items() if f.is_required()}
    required |= {"kind": values["kind"][:1]} if values.get("kind") else {}
    if not all(required.values()):
        return
    first = {key: value[0] for key, value in required.items()}
    free = [key for key in values if values[key] and key not in first]
    for count in range(_MOST + 1):
        tried = (
            first | {key: values[key][0] for key in keys}
            for keys in itertools.combinations(free, count)
        )
        if accepted := [table for table in tried if is_accepted(spec, table)]:
            yield from accepted
            for key, several in required.items():
                yield from (accepted[0] | {key: value} for value in several[1:])
            return


def is_accepted(spec: type[BaseModel], table: dict) -> bool:
    """Whether a spec takes a table."""
    try:
        spec.model_validate(table)
    except ValidationError:
        return False
    return True


def _values(annotation: Any, key: str) -> list:
    """Values of every kind that a key may have."""
    if key in OF_KEYS:
        return [OF_KEYS[key]]
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _values(inner[0], key)
    if origin in (Union, types.UnionType):
        return [value for each in inner for value in _values(each, key)]
    if origin is Literal:
        return [*inner]
    if origin is tuple and inner[-1] is Ellipsis:
        return [[value] for value in _values(inner[0], key)]
    if origin is tuple:
        parts = [_values(part, key) for part in inner]
        return [[part[0] for part in parts]] if all(parts) else []
    if origin is dict:
        return [{"one": value} for value in _values(inner[1], key)]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return tables(annotation)
    plain = {bool: [True, False], int: [2], float: [OF_UNITS.get(key_unit(key), 0.5)]}
    return plain.get(annotation, [])
