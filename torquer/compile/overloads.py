"""What Python functions of the engine are in compiled code, and calls by address."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from torquer.compile.numba_private import INLINED_OPTIONS, cgutils, code_address, wrapper_address


def without_owner(context, builder, of_type, value):
    """The value with every array in it, however deep in tuples, cut from its reference count."""
    if isinstance(of_type, types.BaseTuple):
        parts = cgutils.unpack_tuple(builder, value)
        parts = [without_owner(context, builder, t, v) for t, v in zip(of_type, parts, strict=True)]
        return context.make_tuple(builder, of_type, parts)
    if isinstance(of_type, types.Array):
        view = context.make_array(of_type)(context, builder, value)
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()
    return value


@intrinsic
def _cut(typing_context, value):
    def build(context, builder, signature, arguments):
        return without_owner(context, builder, value, arguments[0])

    return value(value), build


def _same_bits(wanted, stored):
    """Intrinsic that takes the bits of a number for one of another type."""

    @intrinsic
    def cast(typing_context, value):
        def build(context, builder, signature, arguments):
            return builder.bitcast(arguments[0], stored)

        return wanted(value), build

    return cast


_to_bits: Any = _same_bits(types.uint64, ir.IntType(64))
_to_float: Any = _same_bits(types.float64, ir.DoubleType())


def overload_functions(without_reference_counts, bits_of, float_of, places) -> None:
    """Say what these functions of the engine are."""

    @overload(without_reference_counts, jit_options=INLINED_OPTIONS)
    def _without_reference_counts(value):
        return lambda value: _cut(value)

    @overload(places, inline="always")
    def _places(count):
        return lambda count: range(count)

    @overload(bits_of, jit_options=INLINED_OPTIONS)
    def _bits_of(number):
        return lambda number: _to_bits(float(number))

    @overload(float_of, jit_options=INLINED_OPTIONS)
    def _float_of(bits):
        return lambda bits: _to_float(bits)


def overload_call(call, signature) -> None:
    """Let `call(address, *arguments)` call a function of this signature by its address."""

    @intrinsic
    def by_address(typing_context, address, arguments):
        def build(context, builder, _, values):
            made = context.call_conv.get_function_type(signature.return_type, signature.args)
            pointer = builder.inttoptr(values[0], made.as_pointer())
            parts = cgutils.unpack_tuple(builder, values[1])
            _, answer = context.call_conv.call_function(
                builder, pointer, signature.return_type, signature.args, parts
            )
            return answer

        return signature.return_type(address, arguments), build

    @overload(call, jit_options=INLINED_OPTIONS)
    def _call(function, *arguments):
        if isinstance(function, types.Integer):
            return lambda function, *arguments: by_address(function, arguments)
        return lambda function, *arguments: function(*arguments)


class FirstClass(types.WrapperAddressProtocol):
    """A compiled plug-in as kernels take it: an address and a signature.

    What calls it is compiled once for all plug-ins of a kind, and every process finds that code
    in the cache.
    """

    def __init__(self, dispatcher, signature):
        self.compiled = dispatcher
        self.address = code_address(dispatcher, signature)
        self._signature = signature
        self._address = wrapper_address(dispatcher, signature)

    def __wrapper_address__(self):
        return self._address

    def signature(self):
        return self._signature
