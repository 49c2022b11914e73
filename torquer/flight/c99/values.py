"""Typed expressions in C, and how they are put together with as few brackets as C allows."""

import enum
import math
from dataclasses import dataclass, field, replace
from typing import Any

from torquer.flight.c99.precision import double_text, is_single, real_word
from torquer.flight.c99.refusal import Impossible
from torquer.flight.c99.types import (
    BOOL,
    INT,
    REAL,
    TIME,
    UNBOUNDED,
    Array,
    Bounds,
    Number,
    Record,
    Rows,
    Static,
    Tuple,
    Type,
    c_word,
    number_text,
)

_UNKNOWN: Any = object()
#: Greatest whole number up to which a float holds every one.
_EXACT = 2**53


class Rank(enum.IntEnum):
    """How tightly C binds: what is in brackets or a name most, a choice least."""

    ATOM, SIGN, PRODUCT, SUM, ORDER, EQUAL = range(12, 6, -1)
    BIT_AND, BIT_XOR, BIT_OR, AND, OR, CHOICE = range(6, 0, -1)


class Form(enum.Enum):
    """How a struct is at hand: as a variable, by its address, or as what a call has returned."""

    VARIABLE = enum.auto()
    ADDRESS = enum.auto()
    RESULT = enum.auto()


@dataclass(frozen=True)
class Value:
    """An expression. `rank`: how tightly it binds.

    `reads`: whether it reads memory that a call may change; `roots`: names of those arguments in
    whose memory it is a place; `bounds`: least and greatest value of a whole number, infinite where
    unknown; `known`: its value if that is constant; `stored`: the place in memory that is read,
    where it holds a double and the value is a float; `settled`: whether it is a variable that is
    set to a constant somewhere of which a compiler makes another power, see `is_settled`.
    """

    text: str
    type: Type
    rank: int = Rank.ATOM
    form: Form = Form.VARIABLE
    reads: bool = False
    roots: frozenset[str] = frozenset()
    bounds: Bounds = UNBOUNDED
    known: Any = field(default=_UNKNOWN, compare=False)
    stored: str = ""
    settled: bool = False

    @property
    def is_known(self) -> bool:
        """Whether its value is constant."""
        return self.known is not _UNKNOWN

    @property
    def is_settled(self) -> bool:
        """Whether a compiler that finds out its value takes another function for a power of it:
        where it is a multiple of 0.5 (products, roots) or a power of two (2.0 ** x).
        """
        if not self.is_known or isinstance(self.known, tuple):
            return self.settled
        number = self.known if isinstance(self.known, int | float) else 0.0
        return not math.isfinite(number) or (
            float(2 * number).is_integer() or abs(math.frexp(number)[0]) == 0.5
        )

    @property
    def is_simple(self) -> bool:
        """Whether it may be written down twice: a constant or a variable of the function."""
        return self.is_known or (self.rank == Rank.ATOM and self.text.isidentifier())

    def within(self, rank: int) -> str:
        """Its text, in brackets unless it binds at least so tightly."""
        return self.text if self.rank >= rank else f"({self.text})"

    @property
    def address(self) -> str:
        """The address of a struct."""
        return self.text if self.form is Form.ADDRESS else f"&{self.within(Rank.ATOM)}"

    @property
    def content(self) -> "Value":
        """A struct as a value."""
        if self.form is not Form.ADDRESS:
            return self
        if self.text.startswith("&"):
            return replace(self, text=self.text[1:], form=Form.VARIABLE)
        return replace(self, text=f"*{self.within(Rank.SIGN)}", rank=Rank.SIGN, form=Form.VARIABLE)

    def member(self, name: str) -> str:
        """The text of a member; `name` as `.x` or `.v[0]`."""
        if self.form is Form.ADDRESS:
            return f"{self.within(Rank.ATOM)}->{name[1:]}"
        return f"{self.within(Rank.ATOM)}{name}"


def constant(value: float | int | bool) -> Value:
    """A number that is known; `Impossible` for a whole one that a float would round."""
    if isinstance(value, int) and abs(value) > _EXACT:
        raise Impossible("use whole numbers up to 2**53, or write a float")
    kind = BOOL if isinstance(value, bool) else INT if isinstance(value, int) else REAL
    text = number_text(value)
    bounds = (int(value), int(value)) if kind == INT else UNBOUNDED
    return Value(
        text, kind, Rank.SIGN if text[0] in "-(" else Rank.ATOM, bounds=bounds, known=value
    )


def static(value) -> Value:
    """What is known while translating and has no place in C."""
    return Value("", Static(value), known=value)


def as_real(value: Value) -> Value:
    """A number as a float of Python; whole numbers are exact up to 2^53, or 2^24 if single."""
    if value.type == REAL:
        return value
    if value.is_known:
        return constant(float(value.known))
    return replace(value, text=_cast(real_word(), value), type=REAL, rank=Rank.SIGN)


def as_time(value: Value) -> Value:
    """A number as a time: as memory holds it, where it is read from there."""
    if value.type == TIME:
        return value
    if value.is_known:
        text = double_text(float(value.known))
        return replace(
            value, text=text, type=TIME, rank=Rank.SIGN if text[0] in "-(" else Rank.ATOM
        )
    if value.stored:
        return replace(value, text=value.stored, type=TIME, rank=Rank.ATOM, stored="")
    return replace(value, text=_cast("double", value), type=TIME, rank=Rank.SIGN)


def _cast(word: str, value: Value) -> str:
    """A number as one of a floating type; a whole one of 32 bits as such, for processors of 32."""
    low, high = value.bounds
    is_small = value.type == INT and -(2**31) <= low <= high < 2**31
    return f"({word}){'(int32_t)' * is_small}{value.within(Rank.SIGN)}"


def as_float(value: Value) -> Value:
    """A number, which is a time if it is one, else a float of Python."""
    return value if value.type == TIME else as_real(value)


def _read(place: Value) -> Value:
    """What a place in memory that holds a double is read as."""
    if place.type != REAL or not is_single():
        return place
    text = f"({real_word()}){place.text}"
    return replace(place, text=text, rank=Rank.SIGN, stored=place.text)


def as_whole(value: Value) -> Value:
    """A truth as 0 or 1; other numbers as they are."""
    if value.type != BOOL:
        return value
    if value.is_known:
        return constant(int(value.known))
    text = f"(int64_t){value.within(Rank.SIGN)}"
    return replace(value, text=text, type=INT, rank=Rank.SIGN, bounds=(0, 1))


def select_part(value: Value, place: int) -> Value:
    """A part of a tuple that is at hand as a variable or by its address."""
    assert isinstance(value.type, Tuple)
    return Value(value.member(value.type.member(place)), value.type.parts[place], reads=value.reads)


def select_field(value: Value, name: str, times: set) -> Value:
    """A field of a record in memory: a number, or a further place; `times`: names of times."""
    record = value.type
    assert isinstance(record, Record)
    kind = dict(record.fields)[name]
    if isinstance(kind, Static):
        return constant(kind.value) if isinstance(kind.value, int) else static(kind.value)
    kind, reads = _constant_if(record.const, kind), not record.const or value.reads
    bounds = dict(record.bounds).get(name, UNBOUNDED)
    if record.const and bounds[0] == bounds[1]:  # the same in all rows
        return constant(int(bounds[0]) if kind == INT else float(bounds[0]))
    roots, own = value.roots, f"{record.name}.{name}"
    roots = frozenset([each for each in roots if "." not in each] + [own])
    if is_single():
        kind = _holds_times(kind) if own in times else kind
    roots = frozenset() if record.const else roots
    place = Value(value.member(f".{c_word(name)}"), kind, reads=reads, roots=roots, bounds=bounds)
    return _read(place)


def _holds_times(kind: Type) -> Type:
    if isinstance(kind, Array):
        return replace(kind, of=TIME)
    return TIME if kind == REAL else kind


def _constant_if(const: bool, kind: Type) -> Type:
    """A place within a record that is never written is never written either."""
    if not const or isinstance(kind, Number | Tuple | Static):
        return kind
    if isinstance(kind, Rows):
        return replace(kind, record=replace(kind.record, const=True))
    return replace(kind, const=True)


def select_row(value: Value, index: Value, text: str) -> Value:
    """A record of several; `text`: the index as it is to be written."""
    assert isinstance(value.type, Rows)
    record = value.type.record
    reads = value.reads or index.reads
    return Value(f"{value.text}[{text}]", record, reads=reads, roots=value.roots)


def select_cell(value: Value, indices: list[Value], texts: list[str]) -> Value:
    """A number of an array, or its rows where fewer indices are given than it has dimensions."""
    array = value.type
    assert isinstance(array, Array)
    text = value.within(Rank.ATOM) + "".join(f"[{each}]" for each in texts)
    reads = value.reads or any(index.reads for index in indices)
    if len(indices) == len(array.shape):
        roots = frozenset() if array.const else value.roots
        place = Value(text, array.of, reads=reads or not array.const, roots=roots)
        return place if array.is_real else _read(place)
    kept = array.kept[len(indices) :] if array.kept else None
    rest = replace(array, shape=array.shape[len(indices) :], kept=kept)
    return Value(text, rest, reads=reads, roots=value.roots)
