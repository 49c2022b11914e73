"""Sun pointing by the cross product: a torque that turns an axis of the body to the Sun.

The restoring part of the laws that SDOT's introduction reviews; nothing brakes, so that B-dot (or
another damping law) works alongside it. The axis need not spin.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import unit_vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import UnitNumbers
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.vec3 import cross, dot, scale


class SunCrossParameters(NamedTuple):
    """Gain [N m], axis in the body."""

    gain: float
    axis: UnitNumbers


@inlined
def dipole_for(wanted_torque_n_m, b_body_t):
    """m = B x M/B^2: its torque is M less its part along the field; none without a field."""
    strength = dot(b_body_t, b_body_t)
    if strength == 0.0:
        return (0.0, 0.0, 0.0)
    return scale(1.0 / strength, cross(b_body_t, wanted_torque_n_m))


@kernel
def sun_cross(inputs, parameters, memory):
    """m = B x M/B^2, M = k e x s: e the axis, s the direction to the Sun; off without it."""
    wanted = scale(parameters.gain, cross(parameters.axis, inputs.sun_body))
    return dipole_for(wanted, inputs.b_body_t)


class SunCross(LawSpec):
    """Sun pointing by the cross product."""

    kind: Literal["sun_cross"] = "sun_cross"
    kernel: ClassVar = sun_cross
    needs: ClassVar = frozenset({"magnetometer", "sun"})
    gain_n_m: float = Field(gt=0.0)
    """Torque commanded on an axis that is 90 deg off."""
    axis: unit_vector("axis") = (0.0, 0.0, 1.0)
    """Axis in the body, of any length, that is turned to the Sun."""

    def parameters(self) -> SunCrossParameters:
        """Gain and axis."""
        return SunCrossParameters(self.gain_n_m, self.axis)
