"""One computation for many scenarios, with columns in place of numbers.

Scenarios that differ in a few numbers alone are computed at once. Where they go different ways,
`Mixed` parts them, and the parts are computed by themselves. What refuses columns is done scenario
by scenario, at the innermost function that `spread` calls.
"""

import copy
import functools
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar, cast

import numpy as np
from pydantic import BaseModel

from torquer.base.columns import (
    Column,
    Mixed,
    Own,
    Records,
    Refused,
    as_numbers,
    guard,
    has_columns,
    present,
)
from torquer.compile.when_compiling import needs_python

F = TypeVar("F", bound=Callable)


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
        before = present.set(self), needs_python.set(has_columns)
        try:
            with np.errstate(all="ignore"):
                yield
        finally:
            present.reset(before[0])
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
        before = present.set(None), needs_python.set(None)
        try:
            for k, row in enumerate(rows):
                try:
                    results.append(function(*row))
                except ValueError:
                    good[k] = False
        finally:
            present.reset(before[0])
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


def spread(key, function: Callable, args: tuple):
    """What a pure function returns, of one scenario or of many; `key`: what it is known by."""
    computing = present.get()
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
