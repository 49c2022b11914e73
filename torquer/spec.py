"""Specs: frozen, validated descriptions of things. Their keys carry units; kernels get SI.

A spec is checked once, on creation; `pack()`, where a spec has it, gives the tuples or the
`float64` array that kernels take.
"""

import copy
from collections.abc import Mapping
from typing import Annotated, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError
from pydantic_core.core_schema import no_info_before_validator_function

from torquer import validate


def _tensor(value):
    return tuple(map(tuple, validate.inertia_tensor("inertia_kg_m2", value).tolist()))


def _moments(value):
    validate.inertia_tensor("inertia_kg_m2", value)
    return value


#: Three numbers.
Vector = tuple[float, float, float]
#: Value of `inertia_kg_m2`: what a body can have, given as three moments or 3x3, kept as 3x3.
Inertia = Annotated[Vector | tuple[Vector, Vector, Vector], AfterValidator(_tensor)]
#: The same where axes must be principal: three moments.
Moments = Annotated[Vector, AfterValidator(_moments)]
#: What pydantic would read as a number ("500" as 500, true as 1), and is none.
_NO_NUMBERS = (bool, np.bool_, str, bytes)


def _number(value):
    if isinstance(value, _NO_NUMBERS):
        raise PydanticCustomError("float_parsing", "Input should be a valid number")
    return value


def _whole_number(value):
    if isinstance(value, _NO_NUMBERS):
        raise PydanticCustomError("int_parsing", "Input should be a valid integer")
    return value


def _truth(value):
    if not isinstance(value, bool | np.bool_):
        raise PydanticCustomError("bool_type", "Input should be a valid boolean")
    return value


_CHECKS = {"float": _number, "int": _whole_number, "bool": _truth}
#: Parts of pydantic's schema that hold no schema of a value.
_NO_SCHEMA = ("default", "metadata", "serialization")


def _with_checks(schema):
    """A copy of pydantic's schema with our checks before its own; done twice it is done once."""
    if isinstance(schema, list | tuple):
        return type(schema)(_with_checks(part) for part in schema)
    if not isinstance(schema, dict):
        return schema
    kind = schema.get("type")
    if kind == "function-before" and schema["function"]["function"] in _CHECKS.values():
        return schema
    if isinstance(kind, str) and kind in _CHECKS:
        return no_info_before_validator_function(_CHECKS[kind], schema)
    return {k: part if k in _NO_SCHEMA else _with_checks(part) for k, part in schema.items()}


class Spec(BaseModel):
    """Base of all specs: frozen, unknown keys are errors, numbers must be finite.

    Texts and truth values are no numbers, and only true and false are truth values; a whole
    number may stand for any number, and 5.0 for 5.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_core_schema__(cls, source, handler: GetCoreSchemaHandler) -> CoreSchema:
        """What pydantic checks, and that numbers are numbers, truth values such."""
        return _with_checks(handler(source))

    def model_copy(self, *, update: Mapping | None = None, deep: bool = False) -> Self:
        """A copy, with some keys changed: checked as on creation, `ValidationError` likewise.

        A spec within the changes is checked again, however it was made.
        """
        if not update:
            return super().model_copy(deep=deep)
        kept = {name: getattr(self, name) for name in self.model_fields_set}
        values = {**(copy.deepcopy(kept) if deep else kept), **_as_data(dict(update))}
        return type(self).model_validate(values)


def _as_data(value):
    """A value with every spec in it, however deep, as plain data, to be checked anew."""
    if isinstance(value, BaseModel):
        return {name: _as_data(part) for name, part in value.__dict__.items()}
    if isinstance(value, Mapping):
        return {name: _as_data(part) for name, part in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(_as_data, value))
    return value


def checked(spec: Spec) -> Spec:
    """The spec, checked anew: it may have been changed or made behind pydantic's back."""
    return type(spec).model_validate(_as_data(spec))
