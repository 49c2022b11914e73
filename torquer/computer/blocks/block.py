"""Blocks of the on-board computer: a function with named parameters and memory, compiled once.

A block is a function `(inputs, parameters, memory)`: a law answers with a command, an estimator
with an estimate. The function reads its parameters by name from a record; what it remembers it
keeps in a record of its own, or in an array of cells. The loop holds both as `float64` arrays, so
that one type of function serves all blocks of a kind: an adapter, compiled with the function,
stands between the two (`adapter`).
"""

import functools
import json
import math
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from keyword import iskeyword
from numbers import Real
from typing import Any, NamedTuple, Self

import numpy as np

from torquer.base.columns import Column, array_of, shape_of
from torquer.base.user_source import plain_function, source_file
from torquer.base.validate import storable_name, storable_text
from torquer.compile.sources import is_own
from torquer.computer.blocks.adapter import (
    Kind,
    compile_block,
    fill,
    flat,
    floats,
    memory_layout,
    memory_names,
)
from torquer.computer.blocks.key_limits import find_limits
from torquer.computer.blocks.limits import Limits, check_own_limits
from torquer.computer.inputs import Inputs


class Axis(NamedTuple):
    """A dimension of a logged value: its name, a label for each place along it, their units."""

    name: str
    labels: tuple[str, ...]
    units: tuple[str, ...]


class Logged(NamedTuple):
    """A logged part of a block's memory: its first cell, its shape, and its unit or its axes.

    `axes`: one for each dimension of the shape; () for a part of one unit.
    """

    first: int
    shape: tuple[int, ...]
    unit: str
    axes: tuple[Axis, ...] = ()

    @property
    def cells(self) -> int:
        """Number of its cells."""
        return math.prod(self.shape)


@dataclass(frozen=True)
class Block:
    """A function ready to fly, its parameters and its initial memory.

    `parameters`: a NamedTuple of numbers, vectors and such NamedTuples, or a mapping of them;
    `memory`: a number of cells (zeros at first), their initial values, or a mapping of names to
    initial numbers, vectors and matrices; `log`: units of the parts that the result records,
    by name (what is not in the memory is added to it); for a vector or matrix whose components
    have names or units of their own, an `Axis` for each dimension instead. `needs`: what the
    computer must provide: "ephemeris" (and which part of it: "place", "model_field", "model_sun"),
    "magnetometer", "search_coil", "sun", "tachometers", "horizon", "sun_cells", "coil_dipole",
    "attitude", "rate". `compiled`: False for a function that runs as plain
    Python. `spec`: what a scenario says of it, for a block made from its spec. `key`: that of the
    scenario which names its file, as messages about it begin; "" for a block of no such file.
    `fixed`: parameters that shape the block (what it estimates, how it counts) and are therefore
    not set in flight. `own_limits`: least and greatest value of parameters, by name, in the
    scenario and in flight; for a vector, of each of its numbers.
    """

    name: str
    function: Callable
    parameters: Any = ()
    memory: tuple | Mapping = ()
    log: Mapping[str, str | tuple[Axis, ...]] = field(default_factory=dict)
    needs: frozenset[str] = frozenset()
    compiled: bool = True
    spec: object = field(default=None, compare=False, repr=False)
    key: str = field(default="", compare=False, repr=False, kw_only=True)
    fixed: frozenset[str] = field(default=frozenset(), compare=False, repr=False, kw_only=True)
    own_limits: Mapping[str, tuple[float, float]] = field(default_factory=dict, kw_only=True)

    def __post_init__(self):
        storable_text("name", self.name)
        object.__setattr__(self, "parameters", _as_record(self.name, self.parameters))
        object.__setattr__(self, "memory", _as_memory(self.name, self.memory, self.log))
        for name, of in self.log.items():
            _check_log(f"{self.name}: log", name, of)
        object.__setattr__(self, "needs", frozenset(self.needs))
        check_own_limits(self)

    @property
    def kind(self) -> Kind:
        """What it must return."""
        raise NotImplementedError

    @property
    def is_built_in(self) -> bool:
        """Whether its function comes with the package."""
        return is_own(plain_function(self.function))

    def values(self) -> dict:
        """Parameters by name."""
        return self.parameters._asdict() if self.parameters else {}

    def with_parameters(self, **values) -> Self:
        """This block with other parameters; unknown names and other shapes are errors."""
        known = self.values()
        for name, value in values.items():
            if name not in known:
                where = self.parameter_key(name) if self.key else f"{self.said}: parameter"
                raise ValueError(
                    f"{where} must be one of: {', '.join(known) or 'none'}; received {name!r}"
                )
            if _sizes(value) != _sizes(known[name]):
                shape = _say_sizes(_sizes(known[name]))
                raise ValueError(f"{self.parameter_key(name)} must be {shape}; received {value!r}")
        made = {name: fill(known[name], iter(flat(value))) for name, value in values.items()}
        parameters = self.parameters._replace(**made) if made else self.parameters
        return replace(self, parameters=parameters, spec=None)

    def pack(self) -> np.ndarray:
        """Parameters for the kernel; ValueError if one is missing or not finite."""
        for name, value in self.values().items():
            if not all(map(_is_finite_number, flat(value))):
                raise ValueError(
                    f"{self.parameter_key(name)} must be {_what(value)}; received {value!r}"
                )
        return array_of(flat(self.parameters))

    def with_memory(self, cells) -> Self:
        """This block with other memory at the start, as cells."""
        if len(cells) != len(self.first_memory()):
            where = f"{self.key}.memory:" if self.key else f"{self.said}: memory"
            raise ValueError(
                f"{where} must have {len(self.first_memory())} cells, as the block has; received "
                f"{len(cells)}"
            )
        if not isinstance(self.memory, Mapping):
            return replace(self, memory=tuple(cells), spec=None)
        numbers = iter(cells)
        memory = {name: fill(value, numbers) for name, value in self.memory.items()}
        return replace(self, memory=memory, spec=None)

    def structure(self) -> tuple:
        """Names and sizes of parameters and memory."""
        names = memory_names(self.memory)
        return list(self.places().items()), len(self.first_memory()) if names is None else names

    def places(self) -> dict[str, tuple[int, int]]:
        """Where each parameter stands in what `pack` gives: first place, number of places."""
        return _places(self.values())

    @functools.cached_property
    def limits(self) -> tuple[Limits, ...]:
        """Within what limits each number that `pack` gives may be set in flight."""
        return find_limits(self)

    def memory_places(self) -> dict[str, tuple[int, int]]:
        """Where each named part of the memory stands: first cell, number of cells."""
        return _places(self.memory) if isinstance(self.memory, Mapping) else {}

    def first_memory(self) -> np.ndarray:
        """Memory at the start, as cells."""
        values = self.memory.values() if isinstance(self.memory, Mapping) else self.memory
        return array_of(flat(tuple(values)))

    def record_from(self, cells: np.ndarray) -> tuple:
        """Parameters as the function takes them, of what `pack` gives."""
        return fill(self.parameters, iter(cells.tolist()))

    def record_of(self, cells: np.ndarray):
        """What the function sees of memory cells: the cells, or a record that shares them."""
        names = memory_names(self.memory)
        return cells if names is None else cells.view(memory_layout(names)).view(np.recarray)[0]

    def logged(self) -> dict[str, Logged]:
        """The logged parts of the memory, by name."""
        if not self.log:
            return {}
        assert isinstance(self.memory, Mapping)  # cells without names cannot be logged
        places, found = self.memory_places(), {}
        for name, of in self.log.items():
            unit, axes = (of, ()) if isinstance(of, str) else ("", tuple(of))
            # axes may have labels for the first rows alone
            shape = tuple(len(axis.labels) for axis in axes) or shape_of(self.memory[name])
            found[name] = Logged(places[name][0], shape, unit, axes)
        return found

    def compile(self):
        """The function with its inputs by value; ValueError of one line if it does not compile."""
        return self._compiled(in_loop=False)

    def in_loop(self):
        """The function as the loop calls it: with its inputs as a record."""
        return self._compiled(in_loop=True)

    def _compiled(self, in_loop: bool):
        names = memory_names(self.memory)
        try:
            return compile_block(self.kind, self.function, self.parameters, names, in_loop)
        except ValueError as error:
            if not self.key:
                raise
            rest = str(error).partition(": ")[2]
            raise ValueError(f"{self.said}: {rest}{self.place_in(rest)}") from None

    def described(self) -> str:
        """Name and parameters, as a result keeps them."""
        values = {name: floats(value) for name, value in self.values().items()}
        return json.dumps({"name": self.name, "parameters": values})

    @property
    def said(self) -> str:
        """What messages about it begin with."""
        return self.key or f"{self.kind.name} {self.name}"

    def parameter_key(self, name: str) -> str:
        """What messages about a parameter begin with."""
        return f"{self.key}.parameters.{name}:" if self.key else f"{self.said}: parameter {name}"

    def place_in(self, text: str) -> str:
        """Its name and file, to follow a message that begins with a key and names neither."""
        file = source_file(plain_function(self.function))
        if not self.key or file is None or f"({file.name}, line" in text:
            return ""
        return f" ({self.name} in {file})"

    def __call__(self, inputs: Inputs, parameters=None, memory=None):
        """The plain Python function, for trying the block by hand.

        Parameters and memory: as the function takes them, those of the block unless given.
        """
        parameters = self.parameters if parameters is None else parameters
        memory = self.record_of(self.first_memory()) if memory is None else memory
        return plain_function(self.function)(inputs, parameters, memory)


def _places(values: Mapping) -> dict[str, tuple[int, int]]:
    """First place and number of places of named values that stand one after another."""
    places, at = {}, 0
    for name, value in values.items():
        count = len(flat(value))
        places[name] = (at, count)
        at += count
    return places


def _is_finite_number(value) -> bool:
    """Whether it is a real number, of Python or NumPy, that a float can hold; truth is none."""
    if isinstance(value, Column):
        return value.is_finite()
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _what(value) -> str:
    return "finite numbers" if isinstance(value, tuple | list) else "a finite number"


def _sizes(value) -> tuple | None:
    """How numbers are nested: None for a number, a tuple of these for what holds several."""
    if isinstance(value, tuple | list | np.ndarray):
        return tuple(map(_sizes, value))
    return None


def _say_sizes(sizes: tuple | None) -> str:
    if sizes is None:
        return "a number"
    if all(size is None for size in sizes):
        return f"{len(sizes)} numbers"
    return f"({', '.join(map(_say_sizes, sizes))})"


def _nest(value):
    """Lists and arrays, however deep, as tuples."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return value
    return tuple(map(_nest, value)) if isinstance(value, list | tuple) else value


def _as_record(name: str, parameters):
    if isinstance(parameters, Mapping):
        for key in parameters:
            if not (isinstance(key, str) and key.isidentifier()) or iskeyword(key) or key[0] == "_":
                raise ValueError(
                    f"{name}: parameters must be named as variables in Python are, and not begin "
                    f"with '_'; received {key!r}"
                )
        values = [_nest(value) for value in parameters.values()]
        return namedtuple("Parameters", parameters)(*values) if values else ()
    return parameters


def _check_log(key: str, name: str, of) -> None:
    """ValueError unless a result can store what is logged under a name: its unit, or its axes."""
    storable_name(key, name)
    if isinstance(of, tuple) and all(isinstance(axis, Axis) for axis in of):
        for axis in of:
            storable_name(key, axis.name)
    else:
        storable_text(f"{key} {name}: unit", of)


def _as_memory(name: str, memory, log: Mapping):
    if isinstance(memory, int):
        memory = (0.0,) * memory
    if log and not isinstance(memory, Mapping):
        if memory:
            raise ValueError(
                f"{name}: memory must be given by names for a log; received cells without names"
            )
        memory = {}
    if isinstance(memory, Mapping):
        # in plain Python the record would answer with NumPy's attribute
        if taken := [key for key in (*memory, *log) if hasattr(np.record, key)]:
            raise ValueError(
                f"{name}: a name in memory must not be an attribute of NumPy's records; "
                f"received {taken[0]!r}"
            )
        added = {key: 0.0 for key in log if key not in memory}
        return {key: _nest(value) for key, value in {**memory, **added}.items()}
    return tuple(float(cell) for cell in memory)
