"""Estimators as plug-ins: what the computer believes of attitude and rate.

An estimator is a function `(inputs, parameters, memory)` that returns a `torquer.Estimate`; its
inputs hold the previous estimate. Parameters and memory: see `torquer.computer.blocks.law`.
"""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from torquer.compile.engine import caller, inlined
from torquer.compile.when_compiling import when_compiling
from torquer.computer.blocks.adapter import Kind
from torquer.computer.blocks.block import Block
from torquer.computer.blocks.law import needed_readings
from torquer.computer.inputs import flags, unit_flags
from torquer.computer.interface import (
    NO_UNITS_ISOLATED,
    NONE_ISOLATED,
    UNKNOWN_ESTIMATE,
    Estimate,
)


@inlined  # a host calls it, too
def _numbers(v):
    return (float(v[0]), float(v[1]), float(v[2]))


def _isolate(e):
    """`isolated` and `isolated_units` of an estimate, which may have been made without them."""
    return e.isolated, e.isolated_units


@when_compiling
def _overload() -> None:
    from numba.extending import overload

    @overload(_isolate, inline="always")
    def choose(e):
        """Compiled code has no default values: an estimate may lack its last parts."""
        nothing, no_units = UNKNOWN_ESTIMATE.isolated, UNKNOWN_ESTIMATE.isolated_units
        lacking = len(Estimate._fields) - len(e.types)
        if lacking == 0:
            return lambda e: (e.isolated, e.isolated_units)
        if lacking == 1:
            return lambda e: (e.isolated, no_units)
        return lambda e: (nothing, no_units)


@inlined
def as_estimate(e):
    """What an estimator returned, as numbers of the compiled types."""
    q, (isolated, units) = e.q_body_to_inertial, _isolate(e)
    return Estimate(
        float(e.t_s),
        (float(q[0]), float(q[1]), float(q[2]), float(q[3])),
        _numbers(e.omega_body_rad_s),
        _numbers(e.gyro_bias_rad_s),
        float(e.sigma_rad),
        float(e.sigma_rad_s),
        flags(isolated),
        unit_flags(units, 0),
    )


@inlined
def no_estimate():
    """The answer of an estimator that raised an error: the run ends there, see `has_failed`."""
    nothing = (math.nan, math.nan, math.nan)
    q = (math.nan, math.nan, math.nan, math.nan)
    return Estimate(
        math.nan, q, nothing, nothing, math.nan, math.nan, _NOT_ISOLATED, NO_UNITS_ISOLATED
    )


@inlined
def has_failed(known):
    """Whether the estimator, by what is known on board, has failed: it isolates no number."""
    return math.isnan(known.isolated[0])


@inlined
def _is_whole(v):
    """Whether numbers are finite, or all unknown."""
    finite = unknown = 0
    for each in v:
        finite += math.isfinite(each)
        unknown += math.isnan(each)
    return finite == len(v) or unknown == len(v)


@inlined
def is_usable(e):
    """Whether each part of an estimate is finite, or unknown as a whole: not-a-numbers.

    Its time is that of what it knows: infinitely long ago at first.
    """
    return (
        e.t_s != math.inf
        and _is_whole(e.q_body_to_inertial)
        and _is_whole(e.omega_body_rad_s)
        and _is_whole(e.gyro_bias_rad_s)
        and not math.isinf(e.sigma_rad)
        and not math.isinf(e.sigma_rad_s)
        and math.isfinite(sum_of(e.isolated) + sum_of(e.isolated_units))
    )


@inlined
def sum_of(v):
    """Sum of numbers."""
    total = 0.0
    for each in v:
        total += each
    return total


@inlined
def as_usable_estimate(e):
    """What a user's estimator returned, as numbers; that of a failed one if it cannot be used."""
    found = as_estimate(e)
    if is_usable(found):
        return found
    return no_estimate()


#: What an estimator isolates that has failed.
_NOT_ISOLATED = (math.nan,) * len(NONE_ISOLATED)
ESTIMATE = Kind(
    "estimator",
    "torquer.Estimate",
    UNKNOWN_ESTIMATE,
    as_estimate,
    no_estimate,
    checked=as_usable_estimate,
)
call_estimator = caller(lambda: ESTIMATE.in_loop)


@dataclass(frozen=True)
class Estimator(Block):
    """An estimator ready to fly; see `Block`."""

    @property
    def kind(self) -> Kind:
        """It must return an estimate."""
        return ESTIMATE


def estimator(
    function: Callable | None = None,
    *,
    parameters: Mapping | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    memory: int | tuple | Mapping = 0,
    log: Mapping[str, str] | None = None,
    needs: tuple[str, ...] = (),
    compiled: bool = True,
):
    """Decorator that makes a plain function an estimator.

    Its options are those of `torquer.law`; of `needs` an estimator has "ephemeris" alone.

        @torquer.estimator(parameters={"share": 0.1}, memory={"q": (0, 0, 0, 1)})
        def my_estimator(inputs, parameters, memory):
            ...
            return torquer.Estimate(inputs.t_s, q, omega, (0, 0, 0), sigma_rad, sigma_rad_s)

        >>> @torquer.estimator(memory={"sigma_rad": 0.1}, compiled=False)
        ... def as_read(inputs, parameters, memory):
        ...     sigma = (memory.sigma_rad, memory.sigma_rad, memory.sigma_rad)
        ...     q, omega = inputs.q_body_to_inertial, inputs.omega_body_rad_s
        ...     return torquer.Estimate(inputs.t_s, q, omega, (0.0, 0.0, 0.0), sigma, sigma)
        >>> as_read.name
        'as_read'
    """
    options: dict[str, Any] = {
        "parameters": parameters,
        "limits": limits,
        "memory": memory,
        "log": log,
        "needs": needs,
    }
    if function is None:
        return functools.partial(estimator, **options, compiled=compiled)
    for need in needs:
        if need != "ephemeris":
            raise ValueError(
                f"estimator {function.__name__}: needs must be of ephemeris; received {need!r}"
            )
    read = frozenset(needs) | needed_readings(function)
    cells = cast(Any, memory)
    return Estimator(
        function.__name__, function, parameters or (), cells, log or {}, read, compiled,
        own_limits=limits or {},
    )  # fmt: skip
