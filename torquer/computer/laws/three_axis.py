"""Three-axis attitude by magnetorquers alone: damping and a restoring torque across the field.

MAG ch. 4. The torque of m = k (w x B) + k_a (S x B) is that of a damper and a spring, less its
part along the field, which no coil can make: the field must turn for three axes to be held.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import OnOff, UnitNumbers
from torquer.computer.laws.pointing import HeldAttitude, deviation, reference_motion
from torquer.maths.geometry.vec3 import add, cross, scale


class ThreeAxisParameters(NamedTuple):
    """k, k_a, 1 for an orbital reference, wanted attitude to the reference (quaternion)."""

    rate_gain: float
    angle_gain: float
    orbital: OnOff
    q_wanted: UnitNumbers


@kernel
def three_axis(inputs, parameters, memory):
    """m = -k B x w - k_a B x S, w the rate relative to the reference. Source: MAG (4.1.5).

    S = (d23 - d32, d31 - d13, d12 - d21), D = direction cosines from the wanted attitude to the
    body: 2 x the turn vector where it is small.
    """
    p = parameters
    q_reference, turning = reference_motion(inputs, p.orbital)
    error, omega = deviation(inputs, p.q_wanted, q_reference, turning)
    s = scale(4.0 * error[3], (error[0], error[1], error[2]))
    return cross(add(scale(p.rate_gain, omega), scale(p.angle_gain, s)), inputs.b_body_t)


class ThreeAxis(HeldAttitude):
    """Three-axis attitude relative to a reference frame."""

    kind: Literal["three_axis"] = "three_axis"
    kernel: ClassVar = three_axis
    rate_gain_n_m_s_per_t2: float = Field(gt=0.0)
    """Rate gain k."""
    angle_gain_n_m_per_t2: float = Field(ge=0.0)
    """Angle gain k_a."""

    def parameters(self) -> ThreeAxisParameters:
        """Gains and wanted attitude."""
        gains = self.rate_gain_n_m_s_per_t2, self.angle_gain_n_m_per_t2
        return ThreeAxisParameters(*gains, float(self.orbital), self.q_wanted())
