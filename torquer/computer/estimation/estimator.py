"""Estimators as plug-ins: what the computer believes of attitude and rate.

An estimator is a function `(inputs, parameters, memory)` that returns a `torquer.Estimate`; its
inputs hold the previous estimate. Parameters and memory: see `torquer.computer.blocks.law`.
"""

import math
from dataclasses import dataclass

from torquer.compile.engine import caller, inlined
from torquer.compile.when_compiling import when_compiling
from torquer.computer.blocks.adapter import Kind
from torquer.computer.blocks.block import Block
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
    """The answer of an estimator that raised an error."""
    nothing = (math.nan, math.nan, math.nan)
    q = (math.nan, math.nan, math.nan, math.nan)
    return Estimate(
        math.nan, q, nothing, nothing, math.nan, math.nan, NONE_ISOLATED, NO_UNITS_ISOLATED
    )


ESTIMATE = Kind("estimator", "torquer.Estimate", UNKNOWN_ESTIMATE, as_estimate, no_estimate)
call_estimator = caller(lambda: ESTIMATE.in_loop)


@dataclass(frozen=True)
class Estimator(Block):
    """An estimator ready to fly; see `Block`."""

    @property
    def kind(self) -> Kind:
        """It must return an estimate."""
        return ESTIMATE
