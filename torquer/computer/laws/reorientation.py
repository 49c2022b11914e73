"""Precise reorientation of a spinning satellite: the angular momentum is brought to a target.

MAG 3.3. One coil, about the spin axis, which is taken to lie along the angular momentum.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia
from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import InertiaNumbers, NotNegative, OnOff, UnitNumbers
from torquer.computer.laws.spin_axis import Pointed, one_coil, target_body
from torquer.maths.geometry.vec3 import as_symmetric, cross, dot, scale, sub, sym_vec


class ReorientationParameters(NamedTuple):
    """Those of `PointedParameters`, |L_f| [N m s], inertia (xx, yy, zz, xy, xz, yz) [kg m^2]."""

    gain: NotNegative
    relay: NotNegative
    axis: UnitNumbers
    sun: OnOff
    target: UnitNumbers
    momentum: float
    inertia: InertiaNumbers


@kernel
def reorientation(inputs, parameters, memory):
    """m = k ((L_f - L) . (e3 x B)) e3, L = J omega. Source: MAG (3.3.1)."""
    p, direction = parameters, target_body(inputs, parameters)
    if dot(direction, direction) == 0.0:  # a Sun that is not seen
        return (0.0, 0.0, 0.0)
    momentum = sym_vec(p.inertia, inputs.estimate.omega_body_rad_s)
    missing = sub(scale(p.momentum, direction), momentum)
    return one_coil(p, p.gain * dot(missing, cross(p.axis, inputs.b_body_t)))


class Reorientation(Pointed):
    """Precise reorientation; the gain in A m^2/(N m s T), the same as 1/(s T^2)."""

    kind: Literal["reorientation"] = "reorientation"
    gain_a_m2_per_n_m_s_t: float | None = Field(default=None, gt=0.0)
    """Gain of the law; A m^2/(N m s T) is the same as 1/(s T^2). Either it or `relay_dipole_a_m2`
    is given.
    """
    momentum_n_m_s: float = Field(gt=0.0)
    """Wanted length of the angular momentum L_f."""
    inertia_kg_m2: Inertia
    """Inertia from which the law takes the momentum L = J omega: three moments or 3x3."""
    gain_key: ClassVar = "gain_a_m2_per_n_m_s_t"
    kernel: ClassVar = reorientation
    always_needs: ClassVar = frozenset({"magnetometer", "rate"})

    def parameters(self) -> ReorientationParameters:
        """Those of a law with a target, wanted momentum, inertia."""
        own = self.momentum_n_m_s, as_symmetric(self.inertia_kg_m2)
        return ReorientationParameters(*super().parameters(), *own)
