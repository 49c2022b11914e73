"""Specs with columns in place of numbers, checked as pydantic checks each of the numbers.

The schema that pydantic checks by is gone through with columns: bounds are compared for all
scenarios at once, and the package's own checks are called as pydantic calls them. What is not known
here refuses columns: pydantic then checks each scenario.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from pydantic import BaseModel

from torquer.base.columns import Column, Mixed, Own, Refused
from torquer.base.computing import Computing, changed
from torquer.base.spec import Number, is_own_class

#: Bounds of numbers in pydantic's schema, and what must hold.
_BOUNDS = {"gt": np.greater, "ge": np.greater_equal, "lt": np.less, "le": np.less_equal}
#: Parts of its schema for numbers that are handled; all others refuse columns.
_OF_NUMBERS = {*_BOUNDS, "type", "ref", "metadata", "serialization", "allow_inf_nan", "strict"}


class Opened(NamedTuple):
    """A spec, a tuple or a table of which parts are to be others, by their names or numbers."""

    value: Any
    parts: Mapping[str | int, Any]


def opened(value, own: Mapping[tuple, Any]):
    """A spec, or what holds specs, with other values at places within it, to be checked."""
    if () in own:
        return own[()]
    names = dict.fromkeys(place[0] for place in own)
    parts = {}
    for name in names:
        within = {place[1:]: each for place, each in own.items() if place[0] == name}
        if isinstance(value, BaseModel):
            inner = getattr(value, str(name))
        elif isinstance(value, Mapping | tuple | list):
            inner = value[name]
        else:
            raise Refused("no part of it")
        parts[name] = opened(inner, within)
    return Opened(value, parts)


def checked_columns(computing: Computing, opened: Opened) -> Any:
    """The spec with its columns, checked."""
    return _Walk(computing, {}).spec(opened)


class _Walk:
    """A walk through what pydantic checks; `definitions`: schemas by their references."""

    def __init__(self, computing: Computing, definitions: dict[str, dict]):
        self._computing, self._definitions = computing, definitions

    def spec(self, given: Opened):
        """A spec with other fields."""
        kind = type(given.value)
        kind.model_rebuild()
        schema, walk = kind.__pydantic_core_schema__, self
        if schema["type"] == "definitions":
            known = {each["ref"]: each for each in schema["definitions"]}
            schema, walk = schema["schema"], _Walk(self._computing, known)
        return walk.check(schema, given)

    def check(self, schema: dict, value):
        """What pydantic makes of a value by a schema."""
        kind = schema["type"]
        check = getattr(self, "_" + kind.replace("-", "_"), None)
        if check is None:
            raise Refused(kind)
        return check(schema, value)

    def _definition_ref(self, schema, value):
        return self.check(self._definitions[schema["schema_ref"]], value)

    def _function_before(self, schema, value):
        function = schema["function"]["function"]
        if isinstance(function, Number):
            self._in_range(function, value)
        elif function is not is_own_class:
            self._leaves_as_it_is(schema["function"], value)
        return self.check(schema["schema"], value)

    def _in_range(self, function: Number, value) -> None:
        if isinstance(value, Column):
            self._must_hold(function.holds(value.values))
        else:
            function(value)

    @staticmethod
    def _leaves_as_it_is(how: dict, value) -> None:
        """A check before pydantic's own may look at the fields; one that changes any refuses."""
        if how["type"] != "no-info":
            raise Refused("a check that is told more")
        given = value
        if isinstance(value, Opened) and not isinstance(value.value, tuple | list):
            has = value.value.__dict__ if isinstance(value.value, BaseModel) else value.value
            given = {**has, **value.parts}
        found = how["function"](given)
        if found is given:
            return
        if not isinstance(given, Mapping) or not isinstance(found, Mapping):
            raise Refused("a check that changes a value")
        if found.keys() != given.keys() or any(found[k] is not v for k, v in given.items()):
            raise Refused("a check that changes fields")

    def _function_after(self, schema, value):
        function, how = schema["function"]["function"], schema["function"]
        if how["type"] != "no-info":
            raise Refused("a check that is told more")
        checked = self.check(schema["schema"], value)

        def changing(value):
            found = function(value)
            return None if found is value else found

        found = self._computing.call(function, changing, (checked,))
        return checked if found is None else found

    def _model(self, schema, value):
        if not (isinstance(value, Opened) and type(value.value) is schema["cls"]):
            raise Refused("another class")
        fields, own = schema["schema"], {}
        while fields["type"] == "function-before":
            self._leaves_as_it_is(fields["function"], value)
            fields = fields["schema"]
        if fields["type"] != "model-fields" or schema.get("post_init") or schema["custom_init"]:
            raise Refused("a spec of another form")
        for name, part in value.parts.items():
            own[name] = self._field(fields["fields"][name]["schema"], part)
        made = changed(value.value, own)
        self._computing.note(made, own)
        return made

    def _field(self, schema, part):
        if isinstance(part, Own) and not isinstance(part, Column):
            return part  # checked already, or by whoever gave it
        return self.check(schema, part)

    def _default(self, schema, value):
        return self.check(schema["schema"], value)

    _nullable = _default

    def _union(self, schema, value):
        if schema.get("mode", "smart") != "smart":
            raise Refused("a union of another kind")
        for choice in schema["choices"]:
            before = self._computing.has_refused
            try:
                return self.check(choice[0] if isinstance(choice, tuple) else choice, value)
            except Refused:
                self._computing.has_refused = before
        raise Refused("none of a union")

    def _tagged_union(self, schema, value):
        if not isinstance(value, Opened):
            raise Refused("a union of specs")
        return self.spec(value)

    def _dict(self, schema, value):
        if not (isinstance(value, Opened) and isinstance(value.value, Mapping)):
            raise Refused("a table")
        inner = schema["values_schema"]
        own = {name: self.check(inner, part) for name, part in value.parts.items()}
        return {**value.value, **own}

    def _tuple(self, schema, value):
        items, at = schema["items_schema"], schema.get("variadic_item_index")
        values, own = value, None
        if isinstance(value, Opened):
            values, own = value.value, value.parts
        if not isinstance(values, tuple | list):
            raise Refused("no tuple")
        fits = len(values) == len(items) if at is None else len(items) == 1
        least, most = schema.get("min_length", 0), schema.get("max_length") or len(values)
        if not fits or not least <= len(values) <= most:
            raise Refused("a tuple of another length")
        schemas = items if at is None else items * len(values)
        if own is None:
            return tuple(self.check(*each) for each in zip(schemas, values, strict=True))
        made = list(values)
        for k, part in own.items():
            made[k] = self.check(schemas[k], part)
        return tuple(made)

    def _float(self, schema, value):
        if schema.keys() - _OF_NUMBERS:
            raise Refused("a number that must be more than within bounds")
        if not isinstance(value, float | Column):
            raise Refused("no number")
        values = value.values if isinstance(value, Column) else np.array([value])
        self._must_hold(np.isfinite(values))
        for name, holds in _BOUNDS.items():
            if name in schema:
                self._must_hold(holds(values, schema[name]))
        return value

    @staticmethod
    def _must_hold(good: np.ndarray) -> None:
        """Scenarios of which a check does not hold are left to pydantic."""
        if not good.any():
            raise Refused("no scenario fits")
        if not good.all():
            raise Mixed(good)
