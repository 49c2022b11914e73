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
from numba import types
from numba.extending import overload

from torquer.compile.engine import COMPILED, OPTIONS, caller
from torquer.compile.numba_private import (
    INLINED_OPTIONS,
    code_address,
    keep_compiled,
    rare_collections,
    wrapper_address,
)
from torquer.compile.views import Address, view_at

#: What an entry is given is alive as long as it runs: nothing counts references. Numba hands this
#: on to what it compiles for an entry.
_ENTRY = {**OPTIONS, "no_cpython_wrapper": True, "_nrt": False}


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


def record_at(address):
    """The record that stands at an address, as a view; without the compiler it is the address."""
    return address


@overload(record_at, jit_options=INLINED_OPTIONS)
def _record_at(address):
    return lambda address: view_at(address)


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
        return types.int64(Address(arguments.type), *[types.int64] * self._numbers)

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
    """A Python function `(number)` that kernels can call, by its `address`, through
    `torquer.compile.engine.call_host`.

    It must not raise. Without the compiler the address is the function itself.
    """

    def __init__(self, function: Callable):
        self.address, self._kept = function, None
        if COMPILED:
            self._kept = _CALLED(function)
            self.address = ctypes.cast(self._kept, ctypes.c_void_p).value
