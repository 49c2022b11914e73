"""Arguments of a kernel in memory: the kernel takes their address.

A record of numbers, arrays and further records is written down once, one word of eight bytes after
another; the kernel reads from there what it uses. Nothing is compiled to hand it over, no reference
is counted, and a kernel compiled for one type of record is called by another that does not know it.
"""

import ctypes
import itertools
import struct
from collections.abc import Callable

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

from torquer.compile.engine import COMPILED, OPTIONS, caller
from torquer.compile.numba_private import (
    INLINED_OPTIONS,
    AttributeTemplate,
    cgutils,
    code_address,
    infer_getattr,
    keep_compiled,
    lower_getattr_generic,
    rare_collections,
    wrapper_address,
)

_WORD = ir.IntType(64)
#: What an entry is given is alive as long as it runs: nothing counts references. Numba hands this
#: on to what it compiles for an entry.
_ENTRY = {**OPTIONS, "no_cpython_wrapper": True, "_nrt": False}


class _Address(types.Type):
    """Where a record stands in memory."""

    def __init__(self, record):
        self.record = record
        super().__init__(name=f"Address({record})")


@register_model(_Address)
class _AddressModel(models.PrimitiveModel):
    def __init__(self, manager, of_type):
        super().__init__(manager, of_type, _WORD)


def _put(value, kinds: list, form: list[str], words: list) -> None:
    """Add the words of a value, how each is packed, and the kinds of all parts.

    The words of an array are its address and its shape. Equal kinds are of one type.
    """
    if isinstance(value, tuple):
        kinds += (type(value), len(value))
        for part in value:
            _put(part, kinds, form, words)
    elif isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise TypeError(f"arguments: arrays must be contiguous; received {value!r}")
        kinds += (value.dtype, value.ndim)
        form.append("q" * (1 + value.ndim))
        words.append(value.ctypes.data)
        words += value.shape
    elif isinstance(value, int | float | np.generic):
        kinds.append(type(value))
        form.append("d" if isinstance(value, float) else "q")
        words.append(value)
    else:  # a value whose type says all
        kinds.append(value)


#: Types of records by the kinds of their parts; a type's number is how `Entry` knows it.
_types: dict[tuple, tuple[int, types.Type]] = {}
_numbers = itertools.count()


class Arguments:
    """A record in memory; it keeps alive what the record refers to.

    Without the compiler `address` is the record itself.
    """

    def __init__(self, record: tuple):
        self.record = record
        if not COMPILED:
            self.address = record
            return
        kinds, form, words = [], [], []
        _put(record, kinds, form, words)
        key = tuple(kinds)
        if key not in _types:
            _types[key] = next(_numbers), numba.typeof(record)
        self.number, self.type = _types[key]
        self._memory = ctypes.create_string_buffer(struct.pack("".join(form), *words))
        self.address = ctypes.addressof(self._memory)


class _View(types.Type):
    """A record in memory as kernels see it: its numbers and arrays are read when they are used."""

    def __init__(self, record):
        self.record, self.instance_class = record, record.instance_class
        super().__init__(name=f"View({record})")


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
def _view_at(typing_context, address):
    def build(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], _WORD.as_pointer())

    return _View(address.record)(address), build


@intrinsic
def _read_whole(typing_context, view):
    def build(context, builder, signature, arguments):
        return _Reader(context, builder, arguments[0], whole=True).read(view.record)

    return view.record(view), build


def record_at(address):
    """The record that stands at an address, as a view; without the compiler it is the address."""
    return address


@overload(record_at, jit_options=INLINED_OPTIONS)
def _record_at(address):
    return lambda address: _view_at(address)


def whole(record):
    """A record as a tuple of all its numbers and arrays."""
    return record


@overload(whole, jit_options=INLINED_OPTIONS)
def _whole(record):
    if isinstance(record, _View):
        return lambda record: _read_whole(record)
    return lambda record: record


class Entry:
    """A kernel `(address, *numbers) -> number` of whole numbers, called from Python and by kernels.

    It is compiled for the type of the record at that address. From Python it runs without the
    interpreter's lock.
    """

    def __init__(self, function: Callable, numbers: int):
        self.function = function
        self._numbers = numbers
        self._known: dict[int, tuple[int, Callable]] = {}
        if COMPILED:
            self.kernel = keep_compiled(numba.njit(**_ENTRY)(function))
            self._type = ctypes.CFUNCTYPE(*[ctypes.c_int64] * (numbers + 2))

    def _compiled(self, arguments: Arguments) -> tuple[int, Callable]:
        """Address for kernels and function for Python, by the type of the arguments."""
        if arguments.number not in self._known:
            signature = self._signature(arguments)
            with rare_collections():
                self.kernel.compile(signature)
            call = self._type(wrapper_address(self.kernel, signature))
            self._known[arguments.number] = code_address(self.kernel, signature), call
        return self._known[arguments.number]

    def _signature(self, arguments: Arguments):
        return types.int64(_Address(arguments.type), *[types.int64] * self._numbers)

    def of(self, arguments: Arguments) -> Callable:
        """The kernel for arguments of this type, to be called from Python."""
        return self._compiled(arguments)[1] if COMPILED else self.function

    def address(self, arguments: Arguments):
        """The kernel for arguments of this type, to be called by a kernel; see `entry_caller`."""
        return self._compiled(arguments)[0] if COMPILED else self.function

    def __call__(self, arguments: Arguments, *numbers: int) -> int:
        return self.of(arguments)(arguments.address, *numbers)


def entry_caller(numbers: int):
    """Kernel `(function, address, *numbers)` that calls an `Entry` by its address."""
    return caller(types.int64(types.int64, *[types.int64] * numbers))


#: What a `Callback` calls: it takes a number.
_CALLED = ctypes.CFUNCTYPE(None, ctypes.c_int64)


class Callback:
    """A Python function `(number)` that kernels can call, by its `address`, through `call_host`.

    It must not raise. Without the compiler the address is the function itself.
    """

    def __init__(self, function: Callable):
        self.address, self._kept = function, None
        if COMPILED:
            self._kept = _CALLED(function)
            self.address = ctypes.cast(self._kept, ctypes.c_void_p).value


@intrinsic
def _call_c(typing_context, address, number):
    def build(context, builder, signature, arguments):
        made = ir.FunctionType(ir.VoidType(), [_WORD])
        builder.call(builder.inttoptr(arguments[0], made.as_pointer()), [arguments[1]])
        return context.get_dummy_value()

    return types.none(types.int64, types.int64), build


def call_host(address, number):
    """Call a Python function by the address of its `Callback`."""
    address(number)


@overload(call_host, jit_options=OPTIONS)
def _call_host(address, number):
    return lambda address, number: _call_c(address, number)
