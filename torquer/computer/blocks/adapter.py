"""The compiled form of a block: one signature for all of a kind, whatever its parameters are.

The adapter makes the record of parameters from the array that the loop holds, shows the memory as
a record, calls the function and unifies its answer. It is compiled with the function inside and
found in the cache by later processes.
"""

import functools
import hashlib
import sys
import threading
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import NamedTuple

import numpy as np

from torquer.base.columns import shape_of
from torquer.base.user_source import cache_beside, plain_function, source_file
from torquer.compile import engine
from torquer.computer.blocks import plugin, reasons
from torquer.computer.blocks.guarded import guarded_kernel
from torquer.computer.inputs import Inputs, read_inputs
from torquer.computer.interface import KNOWN

#: Threads that need the same function wait for the first: a second copy would push the first one,
#: whose address may be in use, out of the cache.
_ONE_AT_A_TIME = threading.RLock()


@functools.cache
def find_inputs_type():
    """Numba's type of the inputs, handed over by value."""
    import numba

    return numba.typeof(Inputs(0.0))


@functools.cache
def _numba_types() -> tuple:
    """Types of an array of numbers and of the inputs as the loop holds them, a record."""
    import numba

    return numba.types.float64[::1], numba.from_dtype(KNOWN)[::1]


class Kind(NamedTuple):
    """A kind of block: what it is called in messages, what it must return, how that is unified.

    `answer`: an example of the unified answer; `unify`: kernel that makes it of what a function
    returns; `failed`: kernel for the answer of a user's function that has raised; `plainly`: how a
    user has one run as plain Python, "" if there is no way. `checked`: kernel that unifies what a
    user's function returns, where it checks more than that of the package's own.
    """

    name: str
    returns: str
    answer: object
    unify: Callable
    failed: Callable
    plainly: str = ""
    checked: Callable | None = None

    @property
    def signature(self):
        """Signature of the compiled block, for inputs handed over by value."""
        return self._signature_for(find_inputs_type())

    @property
    def in_loop(self):
        """Signature of the compiled block for the loop, which holds the inputs as a record."""
        return self._signature_for(_numba_types()[1])

    def _signature_for(self, inputs):
        import numba

        array, _ = _numba_types()
        return numba.typeof(self.answer)(inputs, array, array)


_NESTED = (tuple, list, np.ndarray)


def flat(value) -> list:
    """All numbers of nested tuples, in order."""
    if not isinstance(value, _NESTED):
        return [value]
    found = []
    for part in value:
        if isinstance(part, _NESTED):
            found += flat(part)
        else:
            found.append(part)
    return found


def memory_names(memory) -> tuple | None:
    """Name and shape of each part of a memory with names, () for a number; None of cells."""
    if not isinstance(memory, Mapping):
        return None
    return tuple((name, shape_of(value)) for name, value in memory.items())


def memory_layout(names: tuple) -> np.dtype:
    """The record that a memory with names is."""
    return np.dtype([(name, np.float64, shape) for name, shape in names])


class Shape:
    """The structure of a record of parameters: equal for equal types and sizes."""

    def __init__(self, example):
        self.example = example
        classes: dict[str, type] = {}
        self.source, _ = _expression(example, 0, classes)
        self.classes = tuple(classes.items())
        self.fixed = all(_is_importable(made) for made in classes.values())

    def __hash__(self):
        return hash(self.source)

    def __eq__(self, other):
        return (self.source, self.classes) == (other.source, other.classes)


def _is_importable(made: type) -> bool:
    return getattr(sys.modules.get(made.__module__), made.__qualname__, None) is made


def _expression(value, at: int, classes: dict) -> tuple[str, int]:
    """Source text that makes a record of cells p[at], p[at + 1], ..., and the next place."""
    if not isinstance(value, tuple | list):
        return f"p[{at}]", at + 1
    parts = []
    for part in value:
        text, at = _expression(part, at, classes)
        parts.append(text)
    if hasattr(value, "_fields"):
        known = next((k for k, made in classes.items() if made is type(value)), None)
        name = known or f"T{len(classes)}"
        classes[name] = type(value)
        return f"{name}({', '.join(parts)})", at
    return f"({''.join(part + ', ' for part in parts)})", at


def record_maker(shape: Shape) -> Callable:
    """Kernel that makes the record of parameters from the array that holds them."""
    names = dict(shape.classes)
    exec(f"def named(p):\n    return {shape.source}", names)
    return inlined_on_the_spot(names["named"])


def inlined_on_the_spot(function: Callable) -> Callable:
    """A function that was made at run time, compiled into what calls it."""
    if not engine.COMPILED:
        return function
    import numba

    from torquer.compile.numba_private import INLINED_OPTIONS

    return numba.njit(**INLINED_OPTIONS)(function)


def _memory_view(names: tuple | None) -> Callable:
    """Kernel that shows memory cells as the function takes them."""
    if names is None:
        return _same
    layout = memory_layout(names)
    if not engine.COMPILED:
        return lambda cells: cells.view(layout).view(np.recarray)[0]
    import numba

    record = numba.from_dtype(layout)

    @numba.extending.intrinsic
    def view(typing_context, cells):
        def build(context, builder, signature, arguments):
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            return builder.bitcast(array.data, context.get_value_type(record))

        return record(cells), build

    return view


@engine.inlined
def _same(value):
    return value


def _plain_adapter(inputs, parameters, memory):
    return _unify(_function(_inputs(inputs), _named(parameters), _cells(memory)))  # noqa: F821


def _guarded_adapter(inputs, parameters, memory):
    try:
        return _unify(_function(_inputs(inputs), _named(parameters), _cells(memory)))  # noqa: F821
    except Exception:
        return _failed()  # noqa: F821


@engine.inlined
def _first_record(records):
    return read_inputs(records[0])


def compile_block(
    kind: Kind, function: Callable, parameters: tuple, names: tuple | None, in_loop: bool = False
):
    """A block's function behind its adapter; ValueError of one line if it does not compile.

    A user's function is guarded: bounds are checked, and one that raises an error answers with
    not-a-numbers. `parameters`: an example; `names`: of the memory, as `names_of` tells them.
    `in_loop`: for inputs as the loop holds them.
    """
    with _ONE_AT_A_TIME:
        return _compile_block(kind, function, Shape(parameters), names, in_loop)


@functools.cache
def _compile_block(
    kind: Kind, function: Callable, shape: Shape, names: tuple | None, in_loop: bool
):
    plain = plain_function(function)
    own = engine.is_own(plain)
    must = f"{kind.name} {plain.__name__}: must compile as (inputs, parameters, memory) -> "
    must += kind.returns
    parts = {
        "_function": function,
        "_inputs": _first_record if in_loop else _same,
        "_unify": kind.unify if own else kind.checked or kind.unify,
        "_failed": kind.failed,
        "_named": record_maker(shape),
        "_cells": _memory_view(names),
    }
    adapter = _plain_adapter if own else _guarded_adapter
    if not engine.COMPILED:
        return place_adapter(adapter, plain, shape, names, parts)
    signature = kind.in_loop if in_loop else kind.signature
    plugin.check_arguments(plain, 3, must)
    parts["_function"] = inner = make_inner(function, own, shape)
    file = source_file(plain)
    known = file is not None and plain.__closure__ is None
    with cache_beside(file if known and not own else None):
        place = place_adapter(adapter, plain, shape, names, parts)
        try:
            made = plugin.compile_plugin(place, signature, must, keep=known, error_model="numpy")
        except ValueError:
            _explain(inner, shape, names, must, kind.plainly)
            raise
    from torquer.compile.overloads import FirstClass

    return FirstClass(made, signature)


def make_inner(function: Callable, own: bool, shape: Shape):
    """The function itself, to be compiled into the adapter.

    On its own it is kept on disk only where that can be found again: a record of parameters that
    is made on the spot is another type in each process.
    """
    plain = plain_function(function)
    if own and shape.fixed:
        return function if function is not plain else engine.kernel(plain)
    if not own:
        return guarded_kernel(plain, **engine.FOR_KERNELS)
    import numba

    return numba.njit(error_model="numpy", **engine.FOR_KERNELS)(plain)


def _explain(inner, shape: Shape, names, must: str, plainly: str) -> None:
    """Compile a function alone, so that the message is of its own mistake."""
    import numba

    memory = _numba_types()[0] if names is None else numba.from_dtype(memory_layout(names))
    parameters = numba.typeof(floats(shape.example))
    own = plain_function(inner)
    alone = plugin.compile_plugin(
        own, (find_inputs_type(), parameters, memory), must, plainly=plainly
    )
    returned = str(alone.nopython_signatures[0].return_type)
    received = reasons.returned_in_words(returned)
    raise ValueError(f"{must}; received one that returns {received}")


def fill(example, numbers):
    """Records like an example, with other numbers (an iterator) in them."""
    if not isinstance(example, tuple | list):
        return next(numbers)
    parts = [fill(part, numbers) for part in example]
    return type(example)(*parts) if hasattr(example, "_fields") else tuple(parts)


def floats(value):
    """Nested numbers as floats, in the same records."""
    if not isinstance(value, tuple | list):
        return float(value)
    parts = map(floats, value)
    return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)


def place_adapter(
    adapter: FunctionType, plain, shape: Shape, names, parts: dict, form: str = ""
) -> FunctionType:
    """The adapter of one function, which passes for a function of that function's own file.

    There, by a name that tells functions of one line, records of other structure and other answers
    apart, the cache looks for it. (A closure over the function is never found by another process.)
    """
    own = plain.__code__
    records = [(c.__qualname__, c._fields) for _, c in shape.classes]
    answer = plain_function(parts["_unify"]).__name__
    structure = f"{shape.source} {records} {names} {answer} {form}"
    numbers = repr([c for c in own.co_consts if isinstance(c, int | float)])
    mark = hashlib.sha256(own.co_code + numbers.encode() + structure.encode())
    name = f"{plain.__name__}_{mark.hexdigest()[:12]}"
    place = {"co_filename": own.co_filename, "co_firstlineno": own.co_firstlineno}
    code = adapter.__code__.replace(co_name=name, co_qualname=name, **place)
    made = FunctionType(code, {**parts, "__builtins__": __builtins__}, name)
    made.__qualname__, made.__module__ = name, plain.__module__
    return made
