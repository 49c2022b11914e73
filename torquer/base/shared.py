"""What many scenarios share: computed for one of them, as long as it reads nothing that differs.

Members of a campaign differ in a few keys. A pure function that reads none of these keys returns
for each member what it returned for the first: it sees the same values in the same order. Which
keys a function reads is not declared anywhere; it is seen while it is called once, with each
reading of an attribute of the specs in question noted. What is not known to be shared is computed.
"""

import functools
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import is_dataclass
from datetime import date
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np
from pydantic import BaseModel

from torquer.base.computing import spread
from torquer.compile.when_compiling import is_plain

F = TypeVar("F", bound=Callable)

#: Attributes that tell all fields of a spec at once: its own, and those of the specs within it.
_OWN = frozenset({"__dict__"})
_WITHIN = frozenset(
    {
        "model_dump",
        "model_dump_json",
        "model_fields_set",
        "__pydantic_fields_set__",
        "__pydantic_serializer__",
        "__pydantic_validator__",
    }
)
#: What holds no spec.
_PLAIN = (int, float, complex, str, bytes, date, np.ndarray, np.generic, type)
#: Classes of specs are watched by one learner at a time.
_LEARNING = threading.Lock()


def shared(function: F) -> F:
    """Mark a function whose result scenarios may share that differ in nothing it reads.

    It must be pure, take its arguments by place, and read what differs through specs alone; nobody
    may change what it returns. Outside a `Sharing` it is called as it is.
    """

    @functools.wraps(function)
    def called(*args):
        sharing = _present.get()
        return function(*args) if sharing is None else sharing.call(function, args)

    return cast(F, called)


def of_all(function: F) -> F:
    """Mark a function of no scenario: called once for its arguments, and what it reads is its own.

    An example of a spec is read there, say, which is of the class of one that varies.
    """

    @functools.cache
    def called(*args):
        before = _present.set(None)
        try:
            return function(*args)
        finally:
            _present.reset(before)

    return cast(F, functools.wraps(function)(called))


class Sharing:
    """What shared functions return for all scenarios that differ in some fields of some specs.

    `varied`: these fields, by the class of their spec, and classes without any that the specs are
    within. `single`: classes of specs of which a scenario has one, where it always is: a function
    of one of them is known by the class, whichever scenario it is of.
    """

    def __init__(self, varied: Mapping[type[BaseModel], frozenset[str]], *single: type[BaseModel]):
        self._varied, self._single = varied, single
        self._kept: dict[tuple, tuple[tuple, Any]] = {}
        self._twice: set[tuple] = set()
        self._has_read: list[bool] | None = None

    @contextmanager
    def learning(self) -> Iterator[None]:
        """Within the block all is computed, for one scenario, and what others share is kept."""
        with _LEARNING, _watching(self._varied):
            self._has_read = [False]
            try:
                with self.used():
                    yield
            finally:
                self._has_read = None

    @contextmanager
    def used(self) -> Iterator[None]:
        """Within the block, in this thread, what is shared is not computed again."""
        before = _present.set(self)
        try:
            yield
        finally:
            _present.reset(before)

    def note(self) -> None:
        """A field was read that differs between scenarios."""
        if self._has_read is not None:
            self._has_read[-1] = True

    def call(self, function: Callable, args: tuple):
        """What the function returns for the arguments."""
        key = (function, is_plain.get(), *map(self._told, args))
        if self._has_read is not None:
            return self._learn(key, function, args, self._has_read)
        kept = self._kept.get(key)
        return spread(key, function, args) if kept is None else kept[1]

    def _told(self, arg):
        """What an argument is known by: a single spec by its class, other objects as they are."""
        if isinstance(arg, self._single):
            return type(arg)
        return (type(arg), arg) if isinstance(arg, frozenset | int | str) else id(arg)

    def _is_alike(self, value) -> bool:
        """Whether what is in a value is the same for all: no spec with fields that differ is."""
        if isinstance(value, BaseModel):
            return not isinstance(value, tuple(self._varied))
        if isinstance(value, Mapping):
            return all(map(self._is_alike, value.values()))
        if isinstance(value, list | tuple | set | frozenset):
            return all(map(self._is_alike, value))
        if is_dataclass(value):
            return all(map(self._is_alike, vars(value).values()))
        if isinstance(value, FunctionType):
            return all(self._is_alike(cell.cell_contents) for cell in value.__closure__ or ())
        return value is None or isinstance(value, _PLAIN)

    def _learn(self, key: tuple, function: Callable, args: tuple, has_read: list[bool]):
        has_read.append(False)
        result = function(*args)
        found = has_read.pop()
        has_read[-1] |= found
        found |= not self._is_alike(result)
        before = self._kept.get(key)
        if before is not None and any(a is not b for a, b in zip(before[0], args, strict=True)):
            self._twice.add(key)  # of two specs of one class nobody knows which it will be
        if found or key in self._twice:
            self._kept.pop(key, None)
        else:
            self._kept[key] = args, result  # with the arguments, whose places in memory are keys
        return result


_present: ContextVar[Sharing | None] = ContextVar("sharing", default=None)


@contextmanager
def _watching(varied: Mapping[type[BaseModel], frozenset[str]]) -> Iterator[None]:
    """Within the block each reading of these fields is noted, in the thread that learns."""
    watched: Mapping[Any, frozenset[str]] = varied
    for spec, names in watched.items():
        told = names | _WITHIN | (_OWN if names else frozenset())
        spec.__getattribute__ = _watched(told)
    try:
        yield
    finally:
        for spec in watched:
            del spec.__getattribute__


def _watched(names: frozenset[str]) -> Callable:
    def read(spec, name):
        if name in names and (sharing := _present.get()) is not None:
            sharing.note()
        return object.__getattribute__(spec, name)

    return read
