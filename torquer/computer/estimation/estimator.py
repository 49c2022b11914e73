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
from torquer.computer.interface import NONE_ISOLATED, UNKNOWN_ESTIMATE, Estimate


@inlined  # a host calls it, too
def _numbers(v):
    return (float(v[0]), float(v[1]), float(v[2]))


@inlined
def _flags(v):
    return (
        float(v[0]), float(v[1]), float(v[2]), float(v[3]),
        float(v[4]), float(v[5]), float(v[6]), float(v[7]),
    )  # fmt: skip


def _isolate(e):
    """`isolated` of an estimate, which may have been made without it."""
    return e.isolated


@when_compiling
def _overload() -> None:
    from numba.extending import overload

    @overload(_isolate, inline="always")
    def choose(e):
        """Compiled code has no default values: an estimate may lack its last part."""
        if len(e.types) == len(Estimate._fields):
            return lambda e: e.isolated
        nothing = UNKNOWN_ESTIMATE.isolated
        return lambda e: nothing


@inlined
def as_estimate(e):
    """What an estimator returned, as numbers of the compiled types."""
    q = e.q_body_to_inertial
    return Estimate(
        float(e.t_s),
        (float(q[0]), float(q[1]), float(q[2]), float(q[3])),
        _numbers(e.omega_body_rad_s),
        _numbers(e.gyro_bias_rad_s),
        float(e.sigma_rad),
        float(e.sigma_rad_s),
        _flags(_isolate(e)),
    )


@inlined
def no_estimate():
    """The answer of an estimator that raised an error."""
    nothing = (math.nan, math.nan, math.nan)
    q = (math.nan, math.nan, math.nan, math.nan)
    return Estimate(math.nan, q, nothing, nothing, math.nan, math.nan, NONE_ISOLATED)


ESTIMATE = Kind("estimator", "torquer.Estimate", UNKNOWN_ESTIMATE, as_estimate, no_estimate)
call_estimator = caller(lambda: ESTIMATE.in_loop)


@dataclass(frozen=True)
class Estimator(Block):
    """An estimator ready to fly; see `Block`."""

    @property
    def kind(self) -> Kind:
        """It must return an estimate."""
        return ESTIMATE
