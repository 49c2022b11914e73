"""Linear periodic systems as plug-ins: a function that fills A(t), compiled once.

A(t, parameters, out): `parameters` is a float64 array, the named ones first, in the order in
which they are declared, then the numbers of `data` (a table of field values, say); `out` is the
square matrix to fill, every entry of it.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numba import types

from torquer.base import validate
from torquer.base.user_source import plain_function
from torquer.computer.blocks import plugin

SIGNATURE = types.void(types.float64, types.float64[::1], types.float64[:, ::1])


@dataclass(frozen=True)
class PeriodicSystem:
    """x' = A(t) x with A(t + period) = A(t): the function, its order, and its parameters."""

    name: str
    function: Callable
    order: int
    period: float
    parameters: Mapping[str, float] = field(default_factory=dict)
    data: tuple[float, ...] = ()

    def __post_init__(self):
        if not (isinstance(self.order, int) and self.order >= 1):
            raise ValueError(f"{self.name}: order must be 1 or more; received {self.order!r}")
        if not 0.0 < self.period < float("inf"):
            raise ValueError(f"{self.name}: period must be positive; received {self.period!r}")
        if "data" in self.parameters:
            raise ValueError(f"{self.name}: parameter must not be called data, the name is taken")

    def with_parameters(self, **values: float) -> "PeriodicSystem":
        """The system with other parameters; unknown names are errors."""
        for name in values:
            if name == "data":
                raise ValueError(f"{self.name}: data must be set by with_data")
            self.places(name)
        return replace(self, parameters={**self.parameters, **values})

    def with_data(self, data) -> "PeriodicSystem":
        """The system with other `data`."""
        array = validate.finite(f"{self.name}: data", data).ravel()
        return replace(self, data=tuple(array.tolist()))

    def places(self, name: str) -> list[int]:
        """Indices of a parameter, or of all "data", among the packed numbers."""
        if name == "data":
            first = len(self.parameters)
            return list(range(first, first + len(self.data)))
        if name not in self.parameters:
            known = ", ".join(self.parameters) or "none"
            raise ValueError(f"{self.name}: parameter must be one of: {known}; received {name!r}")
        return [list(self.parameters).index(name)]

    def pack(self) -> np.ndarray:
        """All numbers for the kernel; ValueError if one is missing or not finite."""
        named = [
            float(validate.finite(f"{self.name}: {name}", value, ()))
            for name, value in self.parameters.items()
        ]
        return np.array([*named, *self.data], dtype=np.float64)

    def matrix(self, t: float) -> np.ndarray:
        """A(t) by the plain Python function, for trying it by hand."""
        out = np.full((self.order, self.order), np.nan)
        plain_function(self.function)(float(t), self.pack(), out)
        return out


def periodic_system(*, order: int, period: float, parameters: Mapping | None = None, data=()):
    """Decorator that makes `A(t, parameters, out)` a `PeriodicSystem`."""

    def made(function: Callable) -> PeriodicSystem:
        numbers = tuple(float(x) for x in data)
        name = function.__name__
        return PeriodicSystem(name, function, order, float(period), dict(parameters or {}), numbers)

    return made


@functools.cache
def compile_matrix(function: Callable):
    """The function compiled against `SIGNATURE`; ValueError with one clear line if it does not."""
    name = plain_function(function).__name__
    must = f"system {name}: must compile as A(t, parameters, out)"
    return plugin.first_class(function, SIGNATURE, must)
