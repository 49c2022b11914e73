"""Lanes: the numbers of several members side by side, shown to kernels as the records of one.

Number k of member l stands at `cells[k * LANES + l]`. In a loop over l, kernels that are written
for one satellite become code that computes LANES of them at once: the compiler sees neighbours in
memory, each LANES numbers from any other of its own member. A lane looks as the records of one
member do: attributes, `rows[i]`, `rows[i, j]`, `shape`, `len`; what is not a float is shared.
"""

import functools
import operator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import (
    NativeValue,
    intrinsic,
    lower_builtin,
    models,
    register_model,
    typeof_impl,
    unbox,
)

from torquer.compile.numba_private import (
    AbstractTemplate,
    AttributeTemplate,
    infer_getattr,
    infer_global,
    lower_getattr_generic,
    lower_setattr_generic,
    signature_of,
)
from torquer.compile.references import short_name

#: Members side by side: two vectors of eight, or four of four.
LANES = 16
_INT = ir.IntType(64)


class Rows(NamedTuple):
    """Arrays in a lane: `shape`, cells of an element, and what an element is (None: a number)."""

    shape: tuple[int, ...]
    size: int
    element: Any = None


class Fields(NamedTuple):
    """A record in a lane: name, place and kind (None: a number) of each field."""

    fields: tuple[tuple[str, int, Any], ...]


class Parts(NamedTuple):
    """Parts of a tuple in a lane: place, (place, `Rows`), `Parts`; or one of those below."""

    parts: tuple


#: Numbers that all members share; arrays that no lane needs, () in their place (a tuple may not
#: hold them: it would not own them).
SHARED, LEFT_OUT = "shared", "left out"


def lane_rows(array: np.ndarray) -> Rows:
    """How an array of numbers, or of records of numbers, stands in a lane."""
    if array.dtype.names is None:
        return Rows(array.shape, 1)
    return Rows(array.shape, array.dtype.itemsize // 8, record_fields(array.dtype))


@functools.cache
def record_fields(dtype: np.dtype) -> Fields:
    """A record of numbers and of arrays of numbers."""
    fields = ((name, *dtype.fields[name][:2]) for name in dtype.names)
    return Fields(
        tuple((name, at // 8, Rows(kind.shape, 1) if kind.shape else None)
              for name, kind, at in fields)
    )  # fmt: skip


class _Lane(types.Type):
    """Rows or fields of one member: a pointer to its first number."""

    def __init__(self, kind):
        self.kind = kind
        super().__init__(name=short_name("Lane", kind))


@register_model(_Lane)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, manager, of_type):
        super().__init__(manager, of_type, ir.DoubleType().as_pointer())


def _cell_type(kind):
    return types.float64 if kind is None else _Lane(kind)


def _field(kind: Fields, name: str):
    return next(((place, of) for field, place, of in kind.fields if field == name), None)


def _move(builder, pointer, place):
    """Pointer to a cell of the same lane; `place`: a number or a value."""
    if isinstance(place, int):
        return builder.gep(pointer, [_INT(place * LANES)])
    return builder.gep(pointer, [builder.mul(place, _INT(LANES))])


def _show(builder, pointer, kind):
    return builder.load(pointer) if kind is None else pointer


@infer_getattr
class _LaneAttributes(AttributeTemplate):
    key = _Lane

    def generic_resolve(self, lane, name):
        if isinstance(lane.kind, Rows):
            return types.UniTuple(types.intp, len(lane.kind.shape)) if name == "shape" else None
        found = _field(lane.kind, name)
        return None if found is None else _cell_type(found[1])


@lower_getattr_generic(_Lane)
def _get_attribute(context, builder, lane, pointer, name):
    if isinstance(lane.kind, Rows):
        numbers = [_INT(count) for count in lane.kind.shape]
        return context.make_tuple(builder, types.UniTuple(types.intp, len(numbers)), numbers)
    place, kind = _field(lane.kind, name)
    return _show(builder, _move(builder, pointer, place), kind)


@lower_setattr_generic(_Lane)
def _set_attribute(context, builder, of_call, arguments, name):
    lane, given = of_call.args
    place, _ = _field(lane.kind, name)
    number = context.cast(builder, arguments[1], given, types.float64)
    builder.store(number, _move(builder, arguments[0], place))


def _is_place(lane, index) -> bool:
    """Whether an index is one of an element of these rows."""
    if not (isinstance(lane, _Lane) and isinstance(lane.kind, Rows)):
        return False
    if isinstance(index, types.UniTuple):
        return index.count == len(lane.kind.shape) and isinstance(index.dtype, types.Integer)
    return isinstance(index, types.Integer)


def _at(kind: Rows, index):
    """What stands at an index: an element, or a row where there are two axes."""
    if isinstance(index, types.Integer) and len(kind.shape) == 2:
        return Rows(kind.shape[1:], kind.size, kind.element)
    return kind.element


def _as_place(index):
    return types.intp if isinstance(index, types.Integer) else types.UniTuple(types.intp, 2)


@infer_global(operator.getitem)
class _GetElement(AbstractTemplate):
    def generic(self, arguments, _):
        if _is_place(*arguments):
            lane, index = arguments
            return signature_of(_cell_type(_at(lane.kind, index)), lane, _as_place(index))


@infer_global(operator.setitem)
class _SetElement(AbstractTemplate):
    def generic(self, arguments, _):
        lane, index, _ = arguments
        if _is_place(lane, index) and _at(lane.kind, index) is None:
            return signature_of(types.none, lane, _as_place(index), types.float64)


@infer_global(len)
class _Length(AbstractTemplate):
    def generic(self, arguments, _):
        if isinstance(arguments[0], _Lane) and isinstance(arguments[0].kind, Rows):
            return signature_of(types.intp, *arguments)


@lower_builtin(len, _Lane)
def _length(context, builder, of_call, arguments):
    return _INT(of_call.args[0].kind.shape[0])


def _element(builder, kind: Rows, pointer, index):
    return _move(builder, pointer, builder.mul(index, _INT(kind.size)))


def _index_two(builder, kind: Rows, index):
    row, column = (builder.extract_value(index, k) for k in range(2))
    return builder.add(builder.mul(row, _INT(kind.shape[1])), column)


@lower_builtin(operator.getitem, _Lane, types.intp)
def _get_of_row(context, builder, of_call, arguments):
    kind, (pointer, index) = of_call.args[0].kind, arguments
    if len(kind.shape) == 2:
        index = builder.mul(index, _INT(kind.shape[1]))
    found = _at(kind, of_call.args[1])
    return _show(builder, _element(builder, kind, pointer, index), found)


@lower_builtin(operator.getitem, _Lane, types.UniTuple)
def _get_of_two(context, builder, of_call, arguments):
    kind = of_call.args[0].kind
    place = _index_two(builder, kind, arguments[1])
    return builder.load(_element(builder, kind, arguments[0], place))


@lower_builtin(operator.setitem, _Lane, types.intp, types.float64)
def _set_of_row(context, builder, of_call, arguments):
    kind = of_call.args[0].kind
    builder.store(arguments[2], _element(builder, kind, *arguments[:2]))
    return context.get_dummy_value()


@lower_builtin(operator.setitem, _Lane, types.UniTuple, types.float64)
def _set_of_two(context, builder, of_call, arguments):
    kind, (pointer, index, value) = of_call.args[0].kind, arguments
    builder.store(value, _element(builder, kind, pointer, _index_two(builder, kind, index)))
    return context.get_dummy_value()


def _pointer(context, builder, of_array, array):
    return context.make_array(of_array)(context, builder, array).data


def lane_maker(kind):
    """Kernel `(cells, first, lane)` that shows rows or fields from place `first` on."""

    @intrinsic
    def lane_at(typing_context, cells, first, lane):
        def build(context, builder, of_call, arguments):
            pointer = _pointer(context, builder, of_call.args[0], arguments[0])
            pointer = _move(builder, pointer, arguments[1])
            return builder.gep(pointer, [arguments[2]])

        return _Lane(kind)(cells, types.intp, types.intp), build

    return lane_at


@dataclass(frozen=True)
class LaneLayout:
    """Where what stands in a lane: `state`: `Fields`; `plant`: `Parts` of constants.

    Kernels take it as a type: their code is that of one layout.
    """

    state: Fields
    plant: Parts


class _LayoutType(types.Opaque):
    def __init__(self, state, plant):
        self.state, self.plant = state, plant
        super().__init__(name=short_name("LaneLayout", state, plant))


register_model(_LayoutType)(models.OpaqueModel)


@typeof_impl.register(LaneLayout)
def _type_of_layout(layout, _):
    return _LayoutType(layout.state, layout.plant)


@unbox(_LayoutType)
def _unbox_layout(of_type, _, context):
    return NativeValue(context.context.get_dummy_value())


def _lane_state(typing_context, layout, cells, lane):
    """The state of a member."""

    def build(context, builder, of_call, arguments):
        pointer = _pointer(context, builder, of_call.args[1], arguments[1])
        return builder.gep(pointer, [arguments[2]])

    return _Lane(layout.state)(layout, cells, types.intp), build


def _lane_plant(typing_context, layout, cells, lane, plant):
    """The constants of a member's satellite: `plant` with the member's own numbers."""
    made = type_with(plant, layout.plant)

    def build(context, builder, of_call, arguments):
        pointer = _pointer(context, builder, of_call.args[1], arguments[1])
        pointer = builder.gep(pointer, [arguments[2]])
        return _tuple_with(context, builder, pointer, plant, made, layout.plant, arguments[3])

    return made(layout, cells, types.intp, plant), build


#: Kernels `(layout, cells, lane)` and `(layout, cells, lane, plant)`.
lane_state: Any = intrinsic(_lane_state)
lane_plant: Any = intrinsic(_lane_plant)


def type_with(shared, part):
    """Type of a tuple, or of a part of one, with numbers and rows of a lane in it."""
    if part == SHARED:
        return shared
    if part == LEFT_OUT:
        return types.Tuple(())
    if isinstance(part, int):
        return types.float64
    if not isinstance(part, Parts):
        return _Lane(part[1])
    inner = tuple(map(type_with, shared, part.parts))
    if isinstance(shared, types.BaseNamedTuple):
        return types.BaseTuple.from_types(inner, shared.instance_class)
    return types.BaseTuple.from_types(inner)


def _tuple_with(context, builder, pointer, shared, made, part, value):
    if part == SHARED:
        return value
    if part == LEFT_OUT:
        return context.make_tuple(builder, made, ())
    if isinstance(part, int):
        return builder.load(_move(builder, pointer, part))
    if not isinstance(part, Parts):
        return _move(builder, pointer, part[0])
    inner = [
        _tuple_with(context, builder, pointer, t, m, p, builder.extract_value(value, k))
        for k, (t, m, p) in enumerate(zip(shared, made, part.parts, strict=True))
    ]
    return context.make_tuple(builder, made, inner)
