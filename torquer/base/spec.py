"""Specs: frozen, validated descriptions of things. Their keys carry units; kernels get SI.

A spec is checked once, on creation; `pack()`, where a spec has it, gives the tuples or the
`float64` array that kernels take.
"""

import copy
import functools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple, Self, TypeVar, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    ValidationError,
)
from pydantic_core import CoreSchema, PydanticCustomError
from pydantic_core.core_schema import no_info_before_validator_function

from torquer.base import validate
from torquer.base.columns import unstacked
from torquer.base.explain import ScenarioError, explain, quote, validate_tables
from torquer.base.validate import out_of_range, quantity_range


def _tensor(value):
    return unstacked(validate.inertia_tensor("inertia_kg_m2", value), 2)


def _moments(value):
    validate.inertia_tensor("inertia_kg_m2", value)
    return value


#: Three numbers.
Vector = tuple[float, float, float]


def unit_vector(key: str):
    """Type of a direction: any non-zero vector, kept as one of length one."""
    return Annotated[Vector, AfterValidator(lambda v: _unit_rows(key, v)[0])]


def unit_vectors(key: str):
    """Type of several directions: non-zero vectors, kept as ones of length one."""
    return Annotated[tuple[Vector, ...], AfterValidator(lambda rows: _unit_rows(key, rows))]


def _unit_rows(key: str, rows) -> tuple:
    return tuple(map(tuple, validate.unit_rows(key, rows).tolist()))


#: Value of `inertia_kg_m2`: what a body can have, given as three moments or 3x3, kept as 3x3.
Inertia = Annotated[Vector | tuple[Vector, Vector, Vector], AfterValidator(_tensor)]
#: Value of an inertia whose axes must be principal: three moments.
Moments = Annotated[Vector, AfterValidator(_moments)]


def symmetric_tensor(key: str, value) -> np.ndarray:
    """Tensor (3, 3) of a number, three principal values or a tensor."""
    given = validate.finite(key, value)
    return given if given.ndim == 2 else np.diag(np.broadcast_to(given, 3))


def damping_tensor(key: str, what: str):
    """Type of a tensor that brakes: a number, three principal values or 3x3, kept as given.

    `what` would drive the body if a principal value were negative.
    """

    def check(value):
        tensor = symmetric_tensor(key, value)
        size = np.abs(tensor).max()
        if not np.allclose(tensor, tensor.T, rtol=0.0, atol=1e-9 * size):
            raise ValueError(f"{key}: must be symmetric; received {tensor.tolist()}")
        least = float(np.linalg.eigvalsh(tensor)[0])
        if least < -1e-9 * size:
            raise ValueError(
                f"{key}: must have no negative principal value, or the {what} would drive the "
                f"body; received {least:g}"
            )
        return value

    number = Annotated[float, Field(ge=0.0)]
    return Annotated[number | Vector | tuple[Vector, Vector, Vector], AfterValidator(check)]


#: What pydantic would read as a number ("500" as 500, true as 1), and is none.
_NO_NUMBERS = (bool, np.bool_, str, bytes)


class Number(NamedTuple):
    """Check of a number before pydantic's own: a number, and in the range of its key.

    `low`: 0 for a quantity that is not negative, None for any other. `own`: it has a greatest
    value of its own.
    """

    key: str
    low: float | None
    own: bool

    def __call__(self, value):
        """The value as it is, for pydantic to go on with."""
        if isinstance(value, _NO_NUMBERS):
            raise PydanticCustomError("float_parsing", "Input should be a valid number")
        must = out_of_range(self.key, _as_float(value), self.low)
        if must and (not self.own or must.startswith("at least")):
            raise PydanticCustomError("out_of_range", "Input should be {must}", {"must": must})
        return value

    def holds(self, values: np.ndarray) -> np.ndarray:
        """Whether each of some numbers (n,) is in the range."""
        least, greatest = quantity_range(self.key)
        small = (values > 0.0) & (values < least) if self.low == 0.0 else np.zeros(1, bool)
        return ~small & (self.own | ~(np.abs(values) > greatest))


def _as_float(value) -> float:
    """The number, infinite for a longer integer; 0 for what pydantic is to reject."""
    if not isinstance(value, int | float | np.number):
        return 0.0
    try:
        return float(value) if math.isfinite(value) else 0.0
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _whole_number(value):
    if isinstance(value, _NO_NUMBERS):
        raise PydanticCustomError("int_parsing", "Input should be a valid integer")
    if isinstance(value, int) and abs(value) >= 2**64:
        raise PydanticCustomError("int_parsing_size", "Input should be an integer of 64 bits")
    return value


def _truth(value):
    if not isinstance(value, bool | np.bool_):
        raise PydanticCustomError("bool_type", "Input should be a valid boolean")
    return value


def _check_before(schema: dict, key: str):
    """The check that goes before pydantic's own."""
    if schema["type"] != "float":
        return _whole_number if schema["type"] == "int" else _truth
    low = 0.0 if max(schema.get("gt", -1.0), schema.get("ge", -1.0)) >= 0.0 else None
    return Number(key, low, "le" in schema or "lt" in schema)


def _is_checked(schema: dict) -> bool:
    check = schema["function"]["function"]
    return isinstance(check, Number) or check in (_whole_number, _truth)


#: Parts of pydantic's schema that hold no schema of a value.
_NO_SCHEMA = ("default", "metadata", "serialization")


def _with_checks(schema, key: str = ""):
    """A copy of pydantic's schema with our checks before its own; done twice it is done once.

    `key`: that of the field which the schema is about.
    """
    if isinstance(schema, list | tuple):
        return type(schema)(_with_checks(part, key) for part in schema)
    if not isinstance(schema, dict):
        return schema
    kind = schema.get("type")
    if kind == "model-fields":
        fields = {name: _with_checks(part, name) for name, part in schema["fields"].items()}
        return {**schema, "fields": fields}
    if kind == "function-before" and _is_checked(schema):
        return schema
    if isinstance(kind, str) and kind in ("float", "int", "bool"):
        return no_info_before_validator_function(_check_before(schema, key), schema)
    return {k: part if k in _NO_SCHEMA else _with_checks(part, key) for k, part in schema.items()}


class Spec(BaseModel):
    """Base of all specs: frozen, unknown keys are errors, numbers must be finite.

    A number must lie in the range of its quantity, which the key's unit names
    (`validate.RANGES`): no satellite lies beyond it, and floats would soon overflow.
    Text and booleans are not numbers, and only true and false are booleans; a whole number may
    stand for any number, and 5.0 for 5. A mistake is a `ScenarioError`, a line for each.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)
    #: Whether a file may name it: what is given in Python alone is not offered as a kind.
    in_files: ClassVar[bool] = True

    if not TYPE_CHECKING:  # so that checkers and editors keep the keys of each spec

        def __init__(self, /, **keys):
            try:
                super().__init__(**keys)
            except ValidationError as error:
                lines = explain(error, keys, type(self), type(self).__name__)
                raise ScenarioError("\n".join(lines)) from None

        # pydantic then makes the specs within a spec itself, at the speed of compiled code
        __init__.__pydantic_base_init__ = True

        def __setattr__(self, name, value):
            raise ScenarioError(
                f"{name}: must stay as it is: only a copy can have another, "
                f"model_copy(update={{{name!r}: ...}}); received {quote(value)}"
            )

    @classmethod
    def __get_pydantic_core_schema__(cls, source, handler: GetCoreSchemaHandler) -> CoreSchema:
        """What pydantic checks; that numbers are numbers, booleans booleans, specs our own."""
        schema = _with_checks(handler(source))
        # the name under which other schemas refer to it is that of the whole
        ref = schema.pop("ref", None)
        return no_info_before_validator_function(is_own_class, schema, ref=ref)

    def model_copy(self, *, update: Mapping | None = None, deep: bool = False) -> Self:
        """A copy with some keys changed, checked as on creation (`ScenarioError`).

        A spec within the changes is checked again, however it was made.
        """
        if not update:
            return super().model_copy(deep=deep)
        kept = {name: getattr(self, name) for name in self.model_fields_set}
        values = {**(copy.deepcopy(kept) if deep else kept), **as_data(dict(update))}
        return type(self)(**values)


def by_kind(union) -> dict[str, type[Any]]:
    """The specs of a union by the `kind` that a table names: the registry of that union."""
    return {get_args(spec.model_fields["kind"].annotation)[0]: spec for spec in get_args(union)}


def is_own_class(value):
    """The value, unless it is a subclass of the user's own: as data it would become its base."""
    if isinstance(value, Spec) and (base := _derived_from(type(value))):
        raise ValueError(
            "must be of a class of the package, or of kind 'user' where there is one; received "
            f"{type(value).__name__}, a subclass of {base}, as which it would be flown"
        )
    return value


@functools.cache
def _derived_from(spec: type) -> str:
    """The spec of the package that a class from outside it derives from; "" if it does not."""
    if _is_own(spec):
        return ""
    bases = (base for base in spec.__mro__ if base is not Spec and issubclass(base, Spec))
    return next((base.__name__ for base in bases if _is_own(base)), "")


def _is_own(spec: type) -> bool:
    return spec.__module__.partition(".")[0] == __name__.partition(".")[0]


def as_data(value):
    """A value with every spec in it, however deep, as plain data, to be checked again.

    A subclass of the user's own stays as it is: the check then refuses it.
    """
    if isinstance(value, BaseModel) and not _derived_from(type(value)):
        return {name: as_data(part) for name, part in value.__dict__.items()}
    if isinstance(value, Mapping):
        return {name: as_data(part) for name, part in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(as_data, value))
    return value


AnySpec = TypeVar("AnySpec", bound=Spec)


def check_spec(spec: AnySpec) -> AnySpec:
    """The spec, checked again: it may have been changed or made behind pydantic's back."""
    return validate_tables(type(spec), as_data(spec))
