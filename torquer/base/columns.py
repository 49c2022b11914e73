"""One computation for many scenarios: columns, used as if each were a number.

Scenarios that differ in a few numbers alone are computed at once: where one has a number, there is
a column of them, on which arithmetic works element by element, to the bits of each alone. A
condition must come out alike for all; where it does not, `Mixed` tells for which it holds, and the
two parts are computed by themselves. What cannot be done with columns refuses them, and is then
done scenario by scenario, at the innermost function that `spread` calls.
"""

import copy
import functools
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar, cast

import numpy as np
from pydantic import BaseModel

from torquer.compile.when_compiling import needs_python

F = TypeVar("F", bound=Callable)


class Mixed(Exception):
    """Scenarios go different ways: `one` (n,) tells which go the same."""

    def __init__(self, one: np.ndarray):
        super().__init__("scenarios go different ways")
        self.one = one


class Refused(Exception):
    """Something cannot be done for many scenarios at once."""


class Own:
    """What each scenario has for itself; nothing can be done with it."""

    __slots__ = ("values",)
    __hash__ = None

    def __init__(self, values):
        self.values = values

    def _refuse(self, *_):
        if (computing := _present.get()) is not None:
            computing.has_refused = True
        raise Refused("not for many scenarios at once")

    __float__ = __int__ = __index__ = __bool__ = _refuse
    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _refuse
    __format__ = __str__ = __repr__ = _refuse
    __array__ = _refuse  # NumPy's products and sums of objects would round in another way
    __array_ufunc__ = None


def has_columns(value) -> bool:
    """Whether there are columns among numbers, vectors and arrays."""
    if isinstance(value, tuple | list):
        return any(map(has_columns, value))
    if isinstance(value, np.ndarray):
        return value.dtype == object
    return isinstance(value, Own | Records)


def guard(holds) -> bool:
    """Whether a condition holds, of all scenarios or of none; else `Mixed`."""
    if np.all(holds):
        return True
    if np.any(holds):
        raise Mixed(holds)
    return False


def _number(value):
    """The numbers of an operand, of Python or NumPy; None for what is none."""
    if isinstance(value, Column):
        return value.values
    return value if isinstance(value, float | int | np.floating) else None


def _binary(operation: Callable) -> tuple[Callable, Callable]:
    """A method and that of the right operand."""

    def forward(self, other):
        number = _number(other)
        return NotImplemented if number is None else Column(operation(self.values, number))

    def backward(self, other):
        number = _number(other)
        return NotImplemented if number is None else Column(operation(number, self.values))

    return forward, backward


def _compared(operation: Callable) -> Callable:
    def compare(self, other):
        number = _number(other)
        return NotImplemented if number is None else guard(operation(self.values, number))

    return compare


class Column(Own):
    """A number of each scenario, `values` (n,).

    Only what rounds alike everywhere: sums, products, quotients, square roots.
    """

    __slots__ = ()
    __hash__ = None
    __add__, __radd__ = _binary(np.add)
    __sub__, __rsub__ = _binary(np.subtract)
    __mul__, __rmul__ = _binary(np.multiply)
    __lt__, __le__ = _compared(np.less), _compared(np.less_equal)
    __gt__, __ge__ = _compared(np.greater), _compared(np.greater_equal)
    __eq__, __ne__ = _compared(np.equal), _compared(np.not_equal)

    def __truediv__(self, other):
        number = _number(other)
        if number is not None and not np.all(number):  # an error of Python's numbers
            self._refuse()
        return NotImplemented if number is None else Column(self.values / number)

    def __rtruediv__(self, other):
        if not self.values.all():
            self._refuse()
        number = _number(other)
        return NotImplemented if number is None else Column(number / self.values)

    def __neg__(self):
        return Column(-self.values)

    def __abs__(self):
        return Column(np.abs(self.values))

    def __bool__(self):
        return guard(self.values != 0.0)

    def is_finite(self) -> bool:
        """Whether it is finite."""
        return guard(np.isfinite(self.values))


class Records:
    """An array of records of numbers of each scenario: `values` (n, ...) of them.

    Nothing can be done with it but to count it and to pass it on.
    """

    def __init__(self, values: np.ndarray):
        self.values = values

    def __len__(self) -> int:
        return self.values.shape[1]

    def columns(self) -> list[Column]:
        """All numbers one after another."""
        flat = self.values.reshape(len(self.values), -1).view(np.float64)
        return [Column(np.ascontiguousarray(column)) for column in flat.T]


class Computing:
    """A computation for `count` scenarios at once.

    `one_by_one`: what is known to refuse columns, kept from one computation to the next.
    """

    def __init__(self, count: int, one_by_one: set):
        self.count, self._one_by_one = count, one_by_one
        self.has_refused = False
        self._specs: dict[int, tuple[BaseModel, dict[str, Any]]] = {}
        self._lists: dict[int, list[BaseModel]] = {}

    @contextmanager
    def present(self) -> Iterator[None]:
        """Within the block, in this thread, `spread` is about these scenarios."""
        before = _present.set(self), needs_python.set(has_columns)
        try:
            with np.errstate(all="ignore"):
                yield
        finally:
            _present.reset(before[0])
            needs_python.reset(before[1])

    def note(self, spec: BaseModel, own: dict[str, Any]) -> None:
        """A spec has columns, or specs with such, in some of its fields."""
        self._specs[id(spec)] = spec, own

    def call(self, key, function: Callable, args: tuple):
        """What a pure function returns; `key`: what it is known by."""
        if key not in self._one_by_one:
            before, self.has_refused = self.has_refused, False
            try:
                result = function(*args)
            except Mixed:
                raise
            except Exception:  # whatever it is: each scenario says it for itself
                self.has_refused = True
            finally:
                refused, self.has_refused = self.has_refused, before
            if not refused:
                return result
            self._one_by_one.add(key)
        return self._call_each(function, args)

    def _call_each(self, function: Callable, args: tuple):
        lists = [*map(self.each, args)]
        if all(each is None for each in lists):
            return function(*args)
        rows = _together(args, lists)
        results, good = [], np.ones(self.count, bool)
        before = _present.set(None), needs_python.set(None)
        try:
            for k, row in enumerate(rows):
                try:
                    results.append(function(*row))
                except ValueError:
                    good[k] = False
        finally:
            _present.reset(before[0])
            needs_python.reset(before[1])
        if not good.any():
            raise Refused("no scenario can be computed")
        if not good.all():
            raise Mixed(good)
        return joined(results)

    def each(self, value) -> list | None:
        """A value of each scenario; None for one in which they do not differ."""
        if isinstance(value, Own):
            return value.values.tolist() if isinstance(value, Column) else value.values
        if isinstance(value, BaseModel):
            return self._each_spec(value) if id(value) in self._specs else None
        if isinstance(value, tuple | list):
            lists = [*map(self.each, value)]
            if all(each is None for each in lists):
                return None
            make = getattr(type(value), "_make", type(value))
            return [make(row) for row in _together(value, lists)]
        if isinstance(value, dict):
            each = self.each(tuple(value.values()))
            return each and [dict(zip(value, row, strict=True)) for row in each]
        if isinstance(value, Records):
            return [*value.values]
        if isinstance(value, np.ndarray) and value.dtype == object:
            return [*as_numbers(value, self.count)]
        return self._each_record(value) if is_dataclass(value) else None

    def _each_spec(self, spec: BaseModel) -> list[BaseModel]:
        if id(spec) not in self._lists:
            _, own = self._specs[id(spec)]
            values = tuple(own.values())
            rows = self.each(values) or [values] * self.count
            made = [changed(spec, dict(zip(own, row, strict=True))) for row in rows]
            self._lists[id(spec)] = made
        return self._lists[id(spec)]

    def _each_record(self, record) -> list | None:
        own = {each.name: self.each(getattr(record, each.name)) for each in fields(record)}
        own = {name: values for name, values in own.items() if values is not None}
        if not own:
            return None
        copies = [copy.copy(record) for _ in range(self.count)]
        for name, values in own.items():
            for one, value in zip(copies, values, strict=True):
                object.__setattr__(one, name, value)
        return copies


_present: ContextVar[Computing | None] = ContextVar("computing", default=None)


def spread(key, function: Callable, args: tuple):
    """What a pure function returns, of one scenario or of many; `key`: what it is known by."""
    computing = _present.get()
    return function(*args) if computing is None else computing.call(key, function, args)


def by_scenario(function: F) -> F:
    """Mark a pure function whose arithmetic may refuse columns: each scenario then calls it."""

    @functools.wraps(function)
    def called(*args):
        return spread(function, function, args)

    return cast(F, called)


def _together(values, lists: list) -> Iterator[tuple]:
    """Values of each scenario; those of `values` where they do not differ."""
    count = next(len(each) for each in lists if each is not None)
    parts = (
        [value] * count if each is None else each for value, each in zip(values, lists, strict=True)
    )
    return zip(*parts, strict=True)


def changed(spec: BaseModel, values: Mapping[str, Any]) -> BaseModel:
    """A copy of a spec with other values, which are checked already."""
    made = type(spec).__new__(type(spec))
    object.__setattr__(made, "__dict__", {**spec.__dict__, **values})
    for name in ("__pydantic_fields_set__", "__pydantic_extra__", "__pydantic_private__"):
        object.__setattr__(made, name, getattr(spec, name))
    return made


def as_column(values: np.ndarray):
    """A value of each scenario (n, ...) as columns within tuples."""
    if values.ndim == 1:
        return Column(np.ascontiguousarray(values, float))
    return tuple(as_column(values[:, k]) for k in range(values.shape[1]))


def as_numbers(array: np.ndarray, count: int) -> np.ndarray:
    """Numbers (count, ...) of an array with columns among its elements."""
    out = np.empty((count, array.size))
    for k, value in enumerate(array.flat):
        number = _number(value)
        if number is None:
            raise Refused("an array of what is no number")
        out[:, k] = number
    return out.reshape(count, *array.shape)


def joined(results: list):
    """What scenarios have, as one value: numbers that differ become columns."""
    first = results[0]
    if all(each is first for each in results):
        return first
    if any(type(each) is not type(first) for each in results):
        raise Refused("values of different kinds")
    if isinstance(first, float):
        values = np.array(results, float)
        same = (values.view(np.int64) == values[:1].view(np.int64)).all()
        return first if same else Column(values)
    if isinstance(first, tuple | list):
        if any(len(each) != len(first) for each in results):
            raise Refused("values of different lengths")
        parts = [joined([*part]) for part in zip(*results, strict=True)]
        return getattr(type(first), "_make", type(first))(parts)
    if isinstance(first, np.ndarray):
        return _joined_arrays(results)
    if isinstance(first, dict):
        if any(each.keys() != first.keys() for each in results):
            raise Refused("tables of different keys")
        return {key: joined([each[key] for each in results]) for key in first}
    if isinstance(first, BaseModel) or is_dataclass(first):
        raise Refused("values of a kind that is not joined")
    return first if guard(np.array([each == first for each in results])) else None


def _joined_arrays(arrays: list[np.ndarray]):
    first = arrays[0]
    if any(each.shape != first.shape or each.dtype != first.dtype for each in arrays):
        raise Refused("arrays of different forms")
    if all(each.tobytes() == first.tobytes() for each in arrays):
        return first
    if first.dtype == np.float64:
        found = np.empty(first.size, object)
        for k, values in enumerate(np.array(arrays).reshape(len(arrays), -1).T):
            found[k] = Column(np.ascontiguousarray(values))
        return found.reshape(first.shape)
    names = first.dtype.names
    if not names or any(first.dtype[name].base != np.float64 for name in names):
        raise Refused("an array of what are no numbers")
    return Records(np.array(arrays))


def number(value):
    """A float, or a column of them."""
    return value if isinstance(value, Column) else float(value)


def radians(degrees):
    """An angle in radians."""
    return degrees * (math.pi / 180.0)


def root(value):
    """The square root of a number that is not negative."""
    return Column(np.sqrt(value.values)) if isinstance(value, Column) else math.sqrt(value)


def array_of(numbers) -> np.ndarray:
    """Numbers (k,) as float64; as objects if there are columns among them."""
    numbers = [*map(number, numbers)]
    if not any(isinstance(each, Column) for each in numbers):
        return np.array(numbers, np.float64)
    found = np.empty(len(numbers), object)
    for k, each in enumerate(numbers):
        found[k] = each
    return found


def stacked(value) -> np.ndarray:
    """Nested tuples of numbers (...) as an array; (n, ...) of all scenarios with columns."""
    if not has_columns(value):
        return np.asarray(value, np.float64)
    if isinstance(value, Column):
        return value.values
    parts = [stacked(each) if has_columns(each) else np.asarray(each, float) for each in value]
    count = next(len(s) for s, each in zip(parts, value, strict=True) if has_columns(each))
    whole = [
        s if has_columns(each) else np.broadcast_to(s, (count, *s.shape))
        for s, each in zip(parts, value, strict=True)
    ]
    return np.stack(whole, axis=1)


def unstacked(array: np.ndarray, dimensions: int):
    """Nested tuples of so many dimensions, of floats; of columns if the array has one more."""
    if array.ndim > dimensions:
        return as_column(array)
    return array.item() if not dimensions else tuple(unstacked(k, dimensions - 1) for k in array)


def put_numbers(records, place: int, numbers: np.ndarray):
    """Records of numbers with others from a place on: the same ones, or those of each scenario."""
    after = place + len(numbers)
    if numbers.dtype != object and isinstance(records, np.ndarray):
        records.view(np.float64)[place:after] = numbers
        return records
    if isinstance(records, np.ndarray):
        count = next(len(each.values) for each in numbers if isinstance(each, Column))
        records = Records(np.repeat(records[None], count, axis=0))
    count = len(records.values)
    flat = records.values.view(np.float64).reshape(count, -1)
    flat[:, place:after] = as_numbers(numbers, count)
    return records
