"""Columns: numbers of many scenarios, used as if each were one number.

Arithmetic works element by element, to the bits of each alone. A condition must come out alike for
all; where it does not, `Mixed` tells for which it holds. What cannot be done with columns refuses
them. `torquer.base.computing` computes with them.
"""

import math
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any

import numpy as np

#: The computation for many scenarios that goes on in this thread.
present: ContextVar[Any] = ContextVar("present", default=None)


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
        if (computing := present.get()) is not None:
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


def shape_of(value) -> tuple[int, ...]:
    """Shape of nested tuples of numbers, of each scenario."""
    return np.shape(stacked(value))[1:] if has_columns(value) else np.shape(value)


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
