"""The compute engine: one decorator for every kernel.

A *kernel* is a pure function of numbers, tuples and `float64` arrays: no
allocation, no exceptions, no strings, no globals that change. Vectors are
3-tuples, so they live in registers.

No compiler is loaded until the first kernel is called.
"""

import functools
import sys
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from torquer.compile.sources import is_own as is_own
from torquer.compile.when_compiling import (
    COMPILED as COMPILED,
    FOR_KERNELS as FOR_KERNELS,
    LOOP_OPTIONS as LOOP_OPTIONS,
    OPTIONS as OPTIONS,
    is_plain,
    needs_python,
    when_compiling,
)


class Kernel:
    """A function that Numba is given when it is first called, or used by what is being compiled.

    All that Numba's dispatcher has, such as `signatures` and `stats`, it has, too.
    """

    __numba__ = "py_func"  # where Numba finds the function

    def __init__(self, function: Callable, options: dict[str, Any]):
        functools.update_wrapper(self, function)
        self.py_func, self.targetoptions = function, options
        self._dispatcher: Any = None
        self._is_on_disk = True

    @property
    def dispatcher(self):
        """Numba's dispatcher of the function."""
        if self._dispatcher is None:
            from torquer.compile.numba_private import give_dispatcher

            give_dispatcher(self)
        return self._dispatcher

    def __call__(self, *arguments, **named):
        needs = needs_python.get()
        if is_plain.get() or (needs is not None and needs(arguments)):
            return self.py_func(*arguments, **named)
        return self.dispatcher(*arguments, **named)

    def keep_off_disk(self) -> None:
        """From now on compile it for this process alone."""
        self._is_on_disk = False
        if self._dispatcher is not None:
            from torquer.compile.numba_private import keep_off_disk

            keep_off_disk(self._dispatcher)

    def __getattr__(self, name: str):
        if name.startswith("__"):  # what others look for in objects of any kind
            raise AttributeError(name)
        return getattr(self.dispatcher, name)

    @property
    def _numba_type_(self):
        return self.dispatcher._numba_type_

    def __reduce__(self):
        """A kernel of a module is found there again, whichever process asks."""
        module = sys.modules.get(self.__module__)
        found = getattr(module, self.__qualname__, None) is self
        return self.__qualname__ if found else self.dispatcher.__reduce__()

    def __repr__(self) -> str:
        return f"Kernel({self.__module__}.{self.__qualname__})"


def _decorator(**options) -> Callable:
    all_options = {"nopython": True, "boundscheck": None, **OPTIONS, **options}
    return functools.partial(Kernel, options=all_options) if COMPILED else lambda function: function


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
plugged = _decorator(inline="always")


def keep_off_disk(*kernels) -> None:
    """From now on compile these kernels for this process alone."""
    for each in kernels:
        if isinstance(each, Kernel):
            each.keep_off_disk()


def with_attributes(value):
    """Arrays of records, also within tuples, with their fields as attributes, for plain Python."""
    if isinstance(value, tuple):
        parts = map(with_attributes, value)
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    named = isinstance(value, np.ndarray) and value.dtype.names is not None
    return value.view(np.recarray) if named else value


def records(value):
    """Records as kernels take them: in plain Python, with their fields as attributes."""
    return value if COMPILED and not is_plain.get() else with_attributes(value)


def without_reference_counts(value):
    """Arrays, also within tuples, without their reference counts.

    For a kernel's own arguments, which its caller keeps alive: each call that an array crosses
    would cost two locked instructions. In plain Python there is nothing to cut.
    """
    return value


def places(count):
    """`range(count)` for a loop over places whose turns have no part in each other, and no branch.

    In plain Python there is one turn, for the array of all places.
    """
    return (np.arange(count),)


def float_bits(number):
    """The bits of a float64, as a uint64."""
    return np.float64(number).view(np.uint64)


def bits_float(bits):
    """The float64 of these bits."""
    return np.uint64(bits).view(np.float64)


def whole(record):
    """A record in memory (`torquer.compile.arguments`) as a tuple of all its numbers and arrays."""
    return record


def call_host(address, number):
    """Call a Python function by the address of its `torquer.compile.arguments.Callback`."""
    address(number)


@when_compiling
def _overload() -> None:
    from torquer.compile import overloads, views

    views.overload_functions(whole, call_host)
    overloads.overload_functions(without_reference_counts, float_bits, bits_float, places)


def caller(signature):
    """A function that calls another of this signature by its address, at the speed of a call.

    Which function it is, is a number: what calls it is compiled once for all and found in the
    cache by every process. (Numba's own first-class functions cost 30 us each to hand over.) A
    plain function in place of the address is called as it is. `signature`: one of Numba's, or a
    function that makes it when the compiler is loaded.
    """

    def call(function, *arguments):
        return function(*arguments)

    @when_compiling
    def overload_it() -> None:
        from torquer.compile import overloads

        made = signature() if isinstance(signature, FunctionType) else signature
        overloads.overload_call(call, made)

    return call


def addresses(functions: list) -> np.ndarray | tuple:
    """Addresses of `FirstClass` functions for a `caller`; without the compiler, the functions."""
    if not COMPILED:
        return tuple(functions)
    return np.array([function.address for function in functions], dtype=np.int64)
