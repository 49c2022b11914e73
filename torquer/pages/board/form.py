"""The form of a scenario: its tables and keys as fields and sliders, from the specs.

Texts, units and bounds are those of the specs (`torquer.scenario.keys`). A slider spans what is
usual for the quantity, around the present value; a field takes any value that the scenario does.
"""

from __future__ import annotations

import math
import types
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from torquer.base.explain import ScenarioError
from torquer.scenario.described import Key
from torquer.scenario.keys import first_sentence, key_bounds, key_words, spec_keys
from torquer.scenario.load import presets, with_presets
from torquer.scenario.spec import Scenario

#: What a slider of a key spans, by how the key ends; the longest ending counts.
_SPANS = {
    "altitude_km": (200.0, 2000.0),
    "eccentricity": (0.0, 0.9),
    "inclination_deg": (0.0, 180.0),
    "raan_deg": (0.0, 360.0),
    "argument_of_latitude_deg": (0.0, 360.0),
    "argument_of_perigee_deg": (0.0, 360.0),
    "mean_anomaly_deg": (0.0, 360.0),
    "true_anomaly_deg": (0.0, 360.0),
    "euler_deg": (-180.0, 180.0),
    "rate_deg_s": (-20.0, 20.0),
    "revolutions": (0.5, 30.0),
}
#: What is usual of a quantity, by its unit, for sliders of keys that are 0.
_USUAL = {
    "deg": 10.0, "deg/s": 1.0, "kg m²": 0.1, "kg": 10.0, "m": 1.0, "m²": 1.0, "km": 100.0,
    "N m": 1e-6, "N m s": 0.01, "A m²": 0.1, "T": 1e-6, "nT": 200.0, "s": 2.0, "W": 1.0,
    "rpm": 1000.0, "": 1.0, "ppm": 100.0,
}  # fmt: skip
#: How far a slider without ends of its own goes up and down from the value.
_FACTOR = 10.0
#: Tables that are too large for a form: they stay as the text has them.
_LEFT_TO_TEXT = ("control.modes", "control.estimators")
#: Not offered: kinds that only Python makes, or that need files.
_NOT_OFFERED = ("given_in_python", "user", "file", "scheme")


class _Kinds(NamedTuple):
    """The specs that may stand at a key, by kind ("" for a table without kinds)."""

    specs: dict[str, type[BaseModel]]
    default: str
    optional: bool


def make_form(data: dict) -> list[dict]:
    """Tables of a scenario's data, each with its fields, in the order of the specs.

    A table: its `key`, `title`, `about`, `present`, `optional`, the `kind` with its `choices` or
    None, the `presets` that fit, and its `fields`. A field: see `_field`.
    """
    try:
        known = with_presets(data)
    except ScenarioError:
        known = data
    return [*_tables(Scenario, known, data, "", "scenario")]


def _tables(spec: type[BaseModel], known: dict, given: dict, place: str, title: str) -> Iterator:
    """The table of a spec with data, and all below it."""
    below, fields = [], []
    keys = {key.name: key for key in _keys(spec)}
    for name, field in spec.model_fields.items():
        where = f"{place}.{name}".lstrip(".")
        if name == "kind" or where in _LEFT_TO_TEXT:
            continue
        kinds = _field_kinds(field)
        if kinds is None:
            if (found := _field(where, keys[name], field, known, given)) is not None:
                fields.append(found)
        elif get_origin(_bare(field.annotation)) is dict:
            for each in known.get(name) or {}:
                inner = (_part(_part(data, name), each) for data in (known, given))
                below.append((kinds._replace(optional=False), *inner, f"{where}.{each}", each))
        else:
            inner = (_part(data, name) for data in (known, given))
            below.append((kinds, *inner, where, name))
    yield {
        "key": place, "title": title, "about": first_sentence(spec), "present": True,
        "optional": False, "kind": None, "presets": [], "fields": fields,
    }  # fmt: skip
    for kinds, known_inner, given_inner, where, name in below:
        yield from _inner(kinds, known_inner, given_inner, where, name)


def _inner(kinds: _Kinds, known: dict | None, given: dict | None, place: str, name: str):
    """The tables at a key: one that is left out has no fields."""
    kind = str((known or {}).get("kind", kinds.default))
    spec = kinds.specs.get(kind) or next(iter(kinds.specs.values()))
    choices = [each for each in kinds.specs if each not in _NOT_OFFERED or each == kind]
    about = {
        "optional": kinds.optional,
        "kind": {"value": kind, "choices": choices} if len(kinds.specs) > 1 else None,
        "presets": _presets(name),
    }
    title = name.replace("_", " ")
    if known is None and kinds.optional:
        yield {
            "key": place, "title": title, "about": first_sentence(spec), "present": False,
            "fields": [], **about,
        }  # fmt: skip
        return
    first, *rest = _tables(spec, known or {}, given or {}, place, title)
    yield {**first, **about}
    yield from rest


def _field(place: str, key: Key, field: FieldInfo, known: dict, given: dict) -> dict | None:
    """A key as a field; None for lists of tables that are not given.

    `type`: number, whole, numbers (three of them, or as many as there are), choice, flag, text, or
    data, which is written as JSON. `parts`: a name for each of its numbers. `slider`: see
    `_slider`; None for what has none.
    """
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    value = known.get(key.name, _plain(default))
    kind, choices = _field_type(field, value)
    is_empty_list = value == [] and not _has_tables(_members(field.annotation))
    if kind == "data" and key.name not in known and not is_empty_list:
        return None
    if kind == "numbers" and value is None and _is_vector(field):
        value = [0.0, 0.0, 0.0] if field.is_required() else None
    return {
        "key": place, "name": key_words(key.name), "about": key.description, "unit": key.unit,
        "values": key.values, "default": key.default, "required": field.is_required(),
        "given": key.name in given, "value": value, "type": kind, "choices": choices,
        "parts": _parts(key.name, field, value) if kind == "numbers" else [],
        "slider": _slider(key, field, kind, value),
    }  # fmt: skip


def _parts(key: str, field: FieldInfo, value: list | None) -> list[str]:
    """A name for each of a key's numbers: the axis, or the number of an angle or a device."""
    if _is_vector(field) and not key.endswith("euler_deg"):
        return ["x", "y", "z"]
    return [str(k + 1) for k in range(len(value or [0.0] * 3))]


def _slider(key: Key, field: FieldInfo, kind: str, value) -> dict | None:
    """Ends of a slider, and whether it is logarithmic."""
    if kind not in ("number", "numbers"):
        return None
    low, high = key_bounds(field)
    numbers = [x for x in (value if isinstance(value, list) else [value]) if _is_number(x)]
    span = _longest(_SPANS, key.name)
    if span is not None:
        return {"low": min(*span, *numbers), "high": max(*span, *numbers), "log": False}
    sizes = [abs(x) for x in numbers if x]
    if low is not None and high is not None and high <= 1000.0 * max(abs(low), 1e-3):
        return {"low": low, "high": high, "log": False}
    is_positive = (low is not None and low >= 0.0) or key.name in _POSITIVE
    if sizes and is_positive and len(sizes) == len(numbers) and min(numbers) > 0.0:
        ends = min(sizes) / _FACTOR, max(sizes) * _FACTOR
        least = max(ends[0], low) if low else ends[0]
        return {"low": least, "high": ends[1] if high is None else min(ends[1], high), "log": True}
    size = max([*sizes, _USUAL.get(key.unit, 1.0)])
    size = size if high is None else min(size, high)
    return {"low": 0.0 if is_positive else -size, "high": size, "log": False}


def _is_number(value) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


#: Positive by what they are, though the spec checks this elsewhere.
_POSITIVE = ("inertia_kg_m2", "limit_a_m2", "gain_a_m2_s_per_t")


def _longest(table: dict, name: str):
    endings = [ending for ending in table if f"_{name}".endswith(f"_{ending}")]
    return table[max(endings, key=len)] if endings else None


def _field_type(field: FieldInfo, value) -> tuple[str, list[str]]:
    """How a key is shown, and its choices."""
    members = [_bare(each) for each in _members(field.annotation)]
    literals = [x for each in members if get_origin(each) is Literal for x in get_args(each)]
    if literals and all(isinstance(each, str) for each in literals):
        if isinstance(value, list):
            return "data", []
        return ("choice", literals) if len(members) <= 2 else ("text", literals)
    if _has_tables(members):
        return "data", []
    if isinstance(value, list):
        is_plain = all(isinstance(x, int | float) for x in value) and 1 <= len(value) <= 8
        return ("numbers" if is_plain else "data"), []
    if bool in members:
        return "flag", []
    if float in members:
        return "number", []
    if int in members:
        return "whole", []
    if _is_vector(field):
        return "numbers", []
    return ("data" if isinstance(value, dict) or _has_lists(members) else "text"), []


def _is_vector(field: FieldInfo) -> bool:
    """Whether a key holds three numbers, or a tensor that three of them can stand for."""
    for each in map(_bare, _members(field.annotation)):
        if get_origin(each) is tuple and [_bare(x) for x in get_args(each)] == [float] * 3:
            return True
    return False


def _has_tables(members: list) -> bool:
    parts = [_bare(x) for each in members for x in get_args(each)]
    inner = [member for each in parts for member in _members(each)]
    return any(isinstance(each, type) and issubclass(each, BaseModel) for each in inner)


def _has_lists(members: list) -> bool:
    return any(get_origin(each) in (tuple, list, dict) for each in members)


@cache
def _presets(table: str) -> list[str]:
    return [*presets(table)]


@cache
def _keys(spec: type[BaseModel]) -> list[Key]:
    return spec_keys(spec)


def _field_kinds(field: FieldInfo) -> _Kinds | None:
    """The specs that a key holds; None for a key without, or with a list of them."""
    annotation = _bare(field.annotation)
    if get_origin(annotation) is dict:
        annotation = _bare(get_args(annotation)[1])
    members = [_bare(each) for each in _members(annotation)]
    specs = [each for each in members if isinstance(each, type) and issubclass(each, BaseModel)]
    if not specs or any(each in (float, str) or get_origin(each) for each in members):
        return None
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    by_kind = {kind: each for each in specs for kind in _kinds_in(each)}
    kind = str(getattr(default, "kind", next(iter(by_kind))))
    return _Kinds(by_kind, kind, type(None) in _members(field.annotation) and default is None)


def _kinds_in(spec: type[BaseModel]) -> tuple[str, ...]:
    field = spec.model_fields.get("kind")
    return get_args(field.annotation) if field else ("",)


def _members(annotation) -> list:
    """The types of a union, whatever annotations are around them."""
    bare = _bare(annotation)
    if get_origin(bare) in (Union, types.UnionType):
        return [member for each in get_args(bare) for member in _members(each)]
    return [bare]


def _bare(annotation) -> Any:
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    return annotation


def _part(data, name: str) -> dict | None:
    found = data.get(name) if isinstance(data, dict) else None
    return found if isinstance(found, dict) else None


def _plain(value):
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    return value if isinstance(value, bool | int | float | str | dict) else None
