"""Spin about an axis, then turn the spinning satellite to the Sun: two steps, as flown.

First the angular momentum is brought to the axis and to its wanted length, in the body; then to the
Sun. Both by m = k B x d/B^2, whose torque is k d less its part along the field. Nutation
within the angle at which the second step begins is not damped there.
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia, unit_vector
from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import Cosine, InertiaNumbers, UnitNumbers
from torquer.computer.laws.law_spec import LawSpec
from torquer.computer.laws.sun_cross import dipole_for
from torquer.maths.geometry.vec3 import as_symmetric, dot, norm, scale, sub, sym_vec

#: The second step begins once the momentum lies within the angle of the axis and has this part of
#: its wanted length; it ends beyond twice the angle, or below half of that length.
_ENOUGH = 0.8


class SpinToSunParameters(NamedTuple):
    """Gain [N m], axis, wanted momentum [N m s], its inertia (xx, yy, zz, xy, xz, yz), cosines of
    the angles at which the second step begins and ends."""

    gain: float
    axis: UnitNumbers
    momentum: float
    inertia: InertiaNumbers
    cos_begin: Cosine
    cos_end: Cosine


@kernel
def spin_to_sun(inputs, parameters, memory):
    """m = k B x (e - h)/B^2, then k B x (s - h)/B^2; h = J omega over the wanted length.

    Without the Sun, or a reading of it, the first step goes on. Memory: 1 in the second step.
    """
    p = parameters
    h = scale(1.0 / p.momentum, sym_vec(p.inertia, inputs.estimate.omega_body_rad_s))
    length, along = norm(h), dot(h, p.axis)
    if memory.turning == 0.0:
        is_spinning = along >= p.cos_begin * length and along >= _ENOUGH
    else:
        is_spinning = along >= p.cos_end * length and along >= 0.5 * _ENOUGH
    memory.turning = 1.0 if is_spinning else 0.0
    sun = inputs.sun_body
    target = sun if is_spinning and 0.0 < dot(sun, sun) < math.inf else p.axis
    return dipole_for(scale(p.gain, sub(target, h)), inputs.b_body_t)


class SpinToSun(LawSpec):
    """Spin about an axis and turn it to the Sun, in two steps."""

    kind: Literal["spin_to_sun"] = "spin_to_sun"
    kernel: ClassVar = spin_to_sun
    memory: ClassVar = {"turning": 0.0}
    needs: ClassVar = frozenset({"magnetometer", "sun", "rate"})
    bears: ClassVar = frozenset({"sun"})
    gain_n_m: float = Field(gt=0.0)
    """Torque commanded where the momentum is off by its wanted length."""
    momentum_n_m_s: float = Field(gt=0.0)
    """Wanted length of the angular momentum."""
    inertia_kg_m2: Inertia
    """Inertia from which the law takes the momentum J omega: three moments or 3x3."""
    axis: unit_vector("axis") = (0.0, 0.0, 1.0)
    """Spin axis in the body, of any length."""
    begin_deg: float = Field(default=15.0, gt=0.0, lt=45.0)
    """Angle of the momentum from the axis below which the second step begins; it ends beyond twice
    this angle.
    """

    def parameters(self) -> SpinToSunParameters:
        """Gain, axis, wanted momentum, inertia, angles of the switch."""
        begin, end = math.radians(self.begin_deg), math.radians(2.0 * self.begin_deg)
        inertia = as_symmetric(self.inertia_kg_m2)
        return SpinToSunParameters(
            self.gain_n_m, self.axis, self.momentum_n_m_s, inertia, math.cos(begin), math.cos(end)
        )
