"""Second preliminary reorientation: the angular momentum's direction is brought to the target.

MAG 3.5: precise reorientation used on a satellite in any rotation, of directions only.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia
from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import InertiaNumbers, NotNegative, OnOff, UnitNumbers
from torquer.computer.laws.spin_axis import Pointed, one_coil, target_body
from torquer.maths.geometry.vec3 import as_symmetric, cross, dot, norm, scale, sub, sym_vec


class Preliminary2Parameters(NamedTuple):
    """Those of `PointedParameters`, inertia (xx, yy, zz, xy, xz, yz) [kg m^2]."""

    gain: NotNegative
    relay: NotNegative
    axis: UnitNumbers
    sun: OnOff
    target: UnitNumbers
    inertia: InertiaNumbers


@kernel
def preliminary_2(inputs, parameters, memory):
    """m = k ((l_f - L/|L|) . (e3 x B)) e3, l_f the unit vector to the target. Source: MAG (3.5.1).

    The print has L in place of L/|L|, but averages with the latter. At rest L/|L| is left out.
    """
    p, missing = parameters, target_body(inputs, parameters)
    if dot(missing, missing) == 0.0:  # a Sun that is not seen
        return (0.0, 0.0, 0.0)
    momentum = sym_vec(p.inertia, inputs.estimate.omega_body_rad_s)
    length = norm(momentum)
    if length > 0.0:
        missing = sub(missing, scale(1.0 / length, momentum))
    return one_coil(p, p.gain * dot(missing, cross(p.axis, inputs.b_body_t)))


class Preliminary2(Pointed):
    """Second preliminary reorientation; the gain in A m^2/T (the same as N m/T^2)."""

    kind: Literal["preliminary_2"] = "preliminary_2"
    gain_a_m2_per_t: float | None = Field(default=None, gt=0.0)
    """Gain of the law; A m^2/T is the same as N m/T^2. Either it or `relay_dipole_a_m2` is given.
    """
    inertia_kg_m2: Inertia
    """Inertia from which the law takes the direction of the momentum J omega: three moments or 3x3.
    """
    gain_key: ClassVar = "gain_a_m2_per_t"
    kernel: ClassVar = preliminary_2
    always_needs: ClassVar = frozenset({"magnetometer", "rate"})

    def parameters(self) -> Preliminary2Parameters:
        """Those of a law with a target, and the inertia."""
        return Preliminary2Parameters(*super().parameters(), as_symmetric(self.inertia_kg_m2))
