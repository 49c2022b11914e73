"""The compute engine: one decorator for every kernel.

A *kernel* is a pure function of numbers, tuples and `float64` arrays: no
allocation, no exceptions, no strings, no globals that change. Vectors are
3-tuples, so they live in registers.
"""

import contextlib
import functools
import gc
import hashlib
from collections.abc import Callable, Iterator
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils, sigutils
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic, overload

from torquer.compile.code_cache import is_own as is_own, kept, kept_with
from torquer.compile.parts import PartCompiler

#: True when kernels are compiled (False under NUMBA_DISABLE_JIT=1, as the coverage run has it).
COMPILED = not numba.config.DISABLE_JIT

#: How all kernels are compiled. No `fastmath`, not even 'contract': which products are fused into
#: an addition would be the compiler's choice, which changes from one compilation to the next.
OPTIONS: Any = {"error_model": "numpy"}
#: Without the code to be called from Python: that unpacks every cell of nested arguments and takes
#: longer to compile than the function itself. (Called from there it ends the process.)
FOR_KERNELS: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
#: How loops over lanes are compiled: they become vectors before LLVM puts them in their place.
LOOP_OPTIONS: Any = {**OPTIONS, **FOR_KERNELS, "forceinline": True}
#: How other functions chosen by type that LLVM is to inline are compiled.
INLINED_OPTIONS: Any = {**LOOP_OPTIONS, "pipeline_class": PartCompiler}
#: New objects after which Python looks for garbage while it compiles; usually 700, with which the
#: searches took 2.4 s of the 27 s that the main example compiles.
_NEW_OBJECTS = 100_000


@contextlib.contextmanager
def rare_collections() -> Iterator[None]:
    """Within the block nobody else compiles, and Python looks for garbage less often."""
    with global_compiler_lock:
        usual = gc.get_threshold()
        gc.set_threshold(_NEW_OBJECTS, *usual[1:])
        try:
            yield
        finally:
            gc.set_threshold(*usual)


class Kernel(CPUDispatcher):
    """A compiled function with two forms: other kernels call the one that Python cannot call."""

    @functools.cached_property
    def for_kernels(self) -> CPUDispatcher:
        """The form for kernels."""
        options = {**self.targetoptions, **FOR_KERNELS}
        made = CPUDispatcher(self.py_func, targetoptions=options, pipeline_class=PartCompiler)
        return kept_with(self, made)

    def compile(self, sig):
        """Compile for a signature, if it is not on the disk; the address for Numba."""
        with rare_collections():
            entry = super().compile(sig)
        whole = self.overloads[tuple(sigutils.normalize_signature(sig)[0])]
        # errors raised in parts of it are made with what belongs to the part
        for each in whole._find_referenced_environments():
            whole.library.codegen.set_env(each.env_name, each)
        return entry

    @property
    def _numba_type_(self):
        return types.Dispatcher(self.for_kernels)


def _decorator(**options) -> Callable:
    all_options = {"nopython": True, "boundscheck": None, **OPTIONS, **options}

    def decorate(function):
        if not COMPILED:
            return function
        return kept(Kernel(function, targetoptions=all_options))

    return decorate


#: The one decorator for kernels.
kernel = _decorator()
#: A kernel that lets other threads run meanwhile: for maps and charts on all cores.
released = _decorator(nogil=True)
#: A small kernel of inner loops: always inlined by LLVM, which removes the reference
#: counting of arrays that cross the call.
inlined = _decorator(forceinline=True)
#: A large kernel that is called, even by one that is inlined itself: Numba hands `forceinline` on.
called = _decorator(forceinline=False)
#: For kernels that take others as arguments: their code becomes part of the calling kernel's.
plugged = numba.njit(inline="always", **OPTIONS)


def with_attributes(value):
    """Arrays of records, also within tuples, with their fields as attributes, for plain Python."""
    if isinstance(value, tuple):
        parts = map(with_attributes, value)
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    named = isinstance(value, np.ndarray) and value.dtype.names is not None
    return value.view(np.recarray) if named else value


def records(value):
    """Records as kernels take them: without the compiler, with their fields as attributes."""
    return value if COMPILED else with_attributes(value)


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


def without_reference_counts(value):
    """Arrays, also within tuples, without their reference counts.

    For a kernel's own arguments, which its caller keeps alive: each call that an array crosses
    would cost two locked instructions. In plain Python there is nothing to cut.
    """
    return value


@overload(without_reference_counts, jit_options=INLINED_OPTIONS)
def _without_reference_counts(value):
    return lambda value: _cut(value)


def bits_of(number):
    """The bits of a float64, as a uint64."""
    return np.float64(number).view(np.uint64)


def float_of(bits):
    """The float64 of these bits."""
    return np.uint64(bits).view(np.float64)


def _same_bits(wanted, stored):
    """Intrinsic that takes the bits of a number for one of another type."""

    @intrinsic
    def cast(typing_context, value):
        def build(context, builder, signature, arguments):
            return builder.bitcast(arguments[0], stored)

        return wanted(value), build

    return cast


_to_bits = _same_bits(types.uint64, ir.IntType(64))
_to_float = _same_bits(types.float64, ir.DoubleType())


@overload(bits_of, jit_options=INLINED_OPTIONS)
def _bits_of(number):
    return lambda number: _to_bits(float(number))


@overload(float_of, jit_options=INLINED_OPTIONS)
def _float_of(bits):
    return lambda bits: _to_float(bits)


class FirstClass(types.WrapperAddressProtocol):
    """A compiled plug-in as kernels take it: an address and a signature.

    What calls it is compiled once for all plug-ins of a kind, and every process finds that code
    in the cache.
    """

    def __init__(self, dispatcher, signature):
        from numba.experimental.function_type import _get_wrapper_address

        self.compiled = dispatcher
        self.address = address_of(dispatcher, signature)
        self._signature = signature
        self._address = _get_wrapper_address(dispatcher, signature)

    def __wrapper_address__(self):
        return self._address

    def signature(self):
        return self._signature


def caller(signature):
    """A function that calls another of this signature by its address, at the speed of a call.

    Which function it is, is a number: what calls it is compiled once for all and found in the
    cache by every process. (Numba's own first-class functions cost 30 us each to hand over.) A
    plain function in place of the address is called as it is.
    """

    def call(function, *arguments):
        return function(*arguments)

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

    return call


def address_of(dispatcher, signature) -> int:
    """Address of a compiled function for `caller`; valid as long as the dispatcher lives."""
    compiled = dispatcher.get_compile_result(signature)
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def addresses(functions: list) -> np.ndarray | tuple:
    """Addresses of `FirstClass` functions for a `caller`; without the compiler, the functions."""
    if not COMPILED:
        return tuple(functions)
    return np.array([function.address for function in functions], dtype=np.int64)


def processor() -> str:
    """Kind of processor that is compiled for: its name and a mark of its instructions."""
    name = numba.config.CPU_NAME or llvm.get_host_cpu_name()
    features = numba.config.CPU_FEATURES
    if features is None:
        features = llvm.get_host_cpu_features().flatten()
    return f"{name} ({hashlib.sha256(features.encode()).hexdigest()[:8]})"
