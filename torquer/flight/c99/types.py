"""Types of the C text: numbers, tuples by value, records and arrays in memory.

A kernel's expressions have types that follow from those of its arguments, as for Numba. Tuples are
values: a `NamedTuple` is a struct with its fields, a tuple of equal parts a struct with one array
`v`, which can be indexed by a variable. Records (rows of structured arrays, named memory) and
float64 arrays are places in memory, which a kernel may write.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from torquer.flight.c99.precision import real_text
from torquer.flight.c99.prefix import is_of_prefix

_Kind = TypeVar("_Kind")
#: Numbers from which on a tuple is handed over by its address.
_LARGE = 8


_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while bool true false NAN INFINITY NULL isnan isinf isfinite signbit
    fpclassify errno
    alignas alignof asm constexpr nullptr static_assert thread_local typeof typeof_unqual linux unix
"""
#: Words that no variable and no member can have in C; the last line: of GNU, or from C23 on.
KEYWORDS = frozenset(_KEYWORDS.split())


def c_word(name: str) -> str:
    """How C names a field of this name."""
    taken = name in KEYWORDS or name.startswith("ADCS_") or is_of_prefix(name)
    return f"{name}_" if taken else name


def _once(kind: type[_Kind]) -> type[_Kind]:
    """A class of values whose hash and text are worked out once: they are asked for by millions."""
    for name in ("__hash__", "__repr__"):
        setattr(kind, name, _kept(getattr(kind, name), name.strip("_")))
    return kind


def _kept(work_out: Callable, name: str) -> Callable:
    def known(self):
        if name not in self.__dict__:
            self.__dict__[name] = work_out(self)
        return self.__dict__[name]

    return known


@dataclass(frozen=True)
class Number:
    """A number or truth: its type in C, which for a float is that of the program's precision."""

    c: str


REAL, INT, BOOL = Number("real"), Number("int64_t"), Number("bool")
#: Times where all else is in single precision; see `torquer.flight.c99.precision`.
TIME = Number("double")
#: What a function without an answer returns.
NOTHING = Number("void")


@_once
@dataclass(frozen=True)
class Tuple:
    """A tuple by value: types of its parts; names of the fields and of the class of a NamedTuple.

    `of`: the class itself, which tells two of one name apart.
    """

    parts: tuple
    fields: tuple[str, ...] | None = None
    name: str | None = None
    of: Any = field(default=None, repr=False)

    @cached_property
    def is_array(self) -> bool:
        """Whether it is one array in C: parts of one type, without names."""
        return self.fields is None and len(set(self.parts)) == 1

    @cached_property
    def size(self) -> int:
        """How many numbers it holds."""
        return sum(part.size if isinstance(part, Tuple) else 1 for part in self.parts)

    @property
    def is_large(self) -> bool:
        """Whether it is handed over by its address, as pointer to const."""
        return self.size > _LARGE

    def member(self, place: int) -> str:
        """How C names a part."""
        if self.is_array:
            return f".v[{place}]"
        return f".{c_word(self.fields[place]) if self.fields else f'v{place}'}"


@_once
@dataclass(frozen=True)
class Record:
    """A record in memory: its name in C, its fields with their types.

    `const`: never written. `bounds`: least and greatest value of its whole numbers, where known.
    """

    name: str
    fields: tuple[tuple[str, Any], ...]
    const: bool = False
    bounds: tuple[tuple[str, tuple[float, float]], ...] = ()


@_once
@dataclass(frozen=True)
class Array:
    """Numbers in memory, doubles; a length of None: not known here.

    `of`: what a cell is when it is read; `is_real`: whether cells have the program's precision;
    `kept`: how many places of each dimension there are in C, None for all.
    """

    shape: tuple[int | None, ...]
    const: bool = False
    of: Number = REAL
    is_real: bool = False
    kept: tuple[int, ...] | None = None

    @property
    def in_c(self) -> tuple[int | None, ...]:
        """Its shape in C."""
        return self.shape if self.kept is None else self.kept


@_once
@dataclass(frozen=True)
class Rows:
    """Records in memory, one after another."""

    record: Record
    count: int


class Static:
    """What is known while translating and has no place in C: a function, a class, a module, ()."""

    def __init__(self, value):
        self.value = value

    def __eq__(self, other):
        return isinstance(other, Static) and self.value is other.value

    def __hash__(self):
        return hash(id(self.value))


Type = Number | Tuple | Record | Array | Rows | Static
#: Least and greatest value of a whole number; infinite where it is not known.
Bounds = tuple[float, float]
UNBOUNDED: Bounds = (-math.inf, math.inf)
#: Types that are places in memory.
PLACES = (Record, Array, Rows)


def find_type(value) -> Type | None:
    """Type of a number or of a tuple of such; None for what is neither."""
    if isinstance(value, bool | np.bool_):
        return BOOL
    if isinstance(value, int | np.integer):
        return INT
    if isinstance(value, float | np.floating):
        return REAL
    if isinstance(value, tuple) and value:
        parts = tuple(map(find_type, value))
        return None if None in parts else tuple_type(parts, type(value))
    return None


def tuple_type(parts: tuple, of: type = tuple) -> Tuple:
    """Type of a tuple of these parts; `of`: its class, with the fields of a NamedTuple."""
    fields = getattr(of, "_fields", None)
    if fields:
        return Tuple(parts, fields, of.__name__, of)
    return Tuple((TIME,) * len(parts) if set(parts) == {REAL, TIME} else parts)


def in_words(kind: Type) -> str:
    """A type for a message."""
    words = {
        REAL: "a float",
        TIME: "a float",
        INT: "an integer",
        BOOL: "a truth",
        NOTHING: "nothing",
    }
    if isinstance(kind, Number):
        return words[kind]
    if isinstance(kind, Tuple):
        return kind.name or f"a tuple of {len(kind.parts)}"
    if isinstance(kind, Static):
        return f"{getattr(kind.value, '__name__', kind.value)!s}"
    return "a record" if isinstance(kind, Record | Rows) else "an array"


def number_text(value: float | int | bool) -> str:
    """A number as C writes it; a float in the program's precision."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    return real_text(float(value))
