"""Records in memory as compiled kernels see them: views that read what is used, when it is used.

Records are handed over by their address (`torquer.compile.arguments`).
"""

from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

from torquer.compile.numba_private import (
    INLINED_OPTIONS,
    AttributeTemplate,
    cgutils,
    infer_getattr,
    lower_getattr_generic,
)
from torquer.compile.references import short_name
from torquer.compile.when_compiling import OPTIONS

_WORD = ir.IntType(64)


class Address(types.Type):
    """Where a record stands in memory."""

    def __init__(self, record):
        self.record = record
        super().__init__(name=short_name("Address", record))


@register_model(Address)
class _AddressModel(models.PrimitiveModel):
    def __init__(self, manager, of_type):
        super().__init__(manager, of_type, _WORD)


class _View(types.Type):
    """A record in memory as kernels see it: its numbers and arrays are read when they are used."""

    def __init__(self, record):
        self.record, self.instance_class = record, record.instance_class
        super().__init__(name=short_name("View", record))


@register_model(_View)
class _ViewModel(models.PrimitiveModel):
    def __init__(self, manager, of_type):
        super().__init__(manager, of_type, _WORD.as_pointer())


def _show(of_type):
    """Type of a part of a record as it is read: records in it are views again."""
    if isinstance(of_type, types.BaseNamedTuple):
        return _View(of_type)
    if isinstance(of_type, types.BaseTuple):
        return types.BaseTuple.from_types(tuple(map(_show, of_type)))
    return of_type


def _size(of_type) -> int:
    """Number of words of a value."""
    if isinstance(of_type, types.BaseTuple):
        return sum(map(_size, of_type))
    if isinstance(of_type, types.Array):
        return 1 + of_type.ndim
    return 0 if isinstance(of_type, types.Opaque) else 1


class _Reader:
    """Reads words one after another; as views or, `whole`, with all that is in records."""

    def __init__(self, context, builder, words, whole=False):
        self.context, self.builder, self.words, self.whole = context, builder, words, whole
        self.place = 0

    def word(self):
        """The next word. It does not change as long as the kernel runs."""
        found = self.builder.load(self.builder.gep(self.words, [_WORD(self.place)]))
        found.set_metadata("invariant.load", self.builder.module.add_metadata([]))
        self.place += 1
        return found

    def read(self, of_type):
        """What stands there, as kernels take it."""
        if isinstance(of_type, types.BaseNamedTuple) and not self.whole:
            place, self.place = self.place, self.place + _size(of_type)
            return self.builder.gep(self.words, [_WORD(place)])
        if isinstance(of_type, types.BaseTuple):
            parts = [self.read(part) for part in of_type]
            made = of_type if self.whole else _show(of_type)
            return self.context.make_tuple(self.builder, made, parts)
        if isinstance(of_type, types.Array):
            return self._array(of_type)
        if isinstance(of_type, types.Opaque):
            return self.context.get_dummy_value()
        word, kind = self.word(), self.context.get_value_type(of_type)
        if isinstance(of_type, types.Float):
            return self.builder.bitcast(word, kind)
        return self.builder.trunc(word, kind) if kind.width < _WORD.width else word

    def _array(self, of_type):
        context, builder = self.context, self.builder
        data, shape = self.word(), [self.word() for _ in range(of_type.ndim)]
        size = context.get_constant(
            types.intp, context.get_abi_sizeof(context.get_data_type(of_type.dtype))
        )
        strides, bytes_in_all, items = [], size, _WORD(1)
        for length in reversed(shape):
            strides.insert(0, bytes_in_all)
            bytes_in_all, items = builder.mul(bytes_in_all, length), builder.mul(items, length)
        array = context.make_array(of_type)(context, builder)
        array.data = builder.inttoptr(data, array.data.type)
        array.nitems, array.itemsize = items, size
        array.shape = cgutils.pack_array(builder, shape, _WORD)
        array.strides = cgutils.pack_array(builder, strides, _WORD)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()


@infer_getattr
class _ViewAttributes(AttributeTemplate):
    key = _View

    def generic_resolve(self, view, name):
        fields = view.record.fields
        return _show(view.record[fields.index(name)]) if name in fields else None


@lower_getattr_generic(_View)
def _get_attribute(context, builder, view, words, name):
    reader, place = _Reader(context, builder, words), view.record.fields.index(name)
    reader.place = sum(_size(view.record[k]) for k in range(place))
    return reader.read(view.record[place])


@intrinsic
def view_at(typing_context, address):
    def build(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], _WORD.as_pointer())

    return _View(address.record)(address), build


@intrinsic
def _read_whole(typing_context, view):
    def build(context, builder, signature, arguments):
        return _Reader(context, builder, arguments[0], whole=True).read(view.record)

    return view.record(view), build


@intrinsic
def _call_c(typing_context, address, number):
    def build(context, builder, signature, arguments):
        made = ir.FunctionType(ir.VoidType(), [_WORD])
        builder.call(builder.inttoptr(arguments[0], made.as_pointer()), [arguments[1]])
        return context.get_dummy_value()

    return types.none(types.int64, types.int64), build


def overload_functions(whole: Callable, call_host: Callable) -> None:
    """Tell Numba what these functions of `torquer.compile.engine` are in compiled code."""

    @overload(whole, jit_options=INLINED_OPTIONS)
    def whole_of(record):
        if isinstance(record, _View):
            return lambda record: _read_whole(record)
        return lambda record: record

    @overload(call_host, jit_options=OPTIONS)
    def call(address, number):
        return lambda address, number: _call_c(address, number)
