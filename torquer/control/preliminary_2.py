"""Second preliminary reorientation: the angular momentum's direction is brought to the target.

MAG 3.5: precise reorientation used on a satellite in any rotation, of directions only.
"""

from typing import ClassVar, Literal

from pydantic import Field

from torquer.control.law import Law
from torquer.control.spin_axis import (
    END,
    Pointed,
    axis_of,
    inertia_parameters,
    one_coil,
    target_body,
)
from torquer.engine import kernel
from torquer.geometry.vec3 import cross, dot, norm, scale, sub, sym_vec
from torquer.spec import Inertia


@kernel
def preliminary_2(measured, parameters, memory):
    """m = k ((l_f - L/|L|) . (e3 x B)) e3, l_f the unit vector to the target. Source: MAG (3.5.1).

    The print has L in place of L/|L|, but averages with the latter. At rest L/|L| is left out.
    """
    p, missing = parameters, target_body(measured, parameters)
    if dot(missing, missing) == 0.0:  # a Sun that is not seen
        return (0.0, 0.0, 0.0)
    inertia = (p[END], p[END + 1], p[END + 2], p[END + 3], p[END + 4], p[END + 5])
    momentum = sym_vec(inertia, measured.omega_body_rad_s)
    length = norm(momentum)
    if length > 0.0:
        missing = sub(missing, scale(1.0 / length, momentum))
    return one_coil(p, p[0] * dot(missing, cross(axis_of(p), measured.b_body_t)))


class Preliminary2(Pointed):
    """Second preliminary reorientation; the gain in A m^2/T (the same as N m/T^2).

    `inertia_kg_m2`: three moments or 3x3, from which the law takes the direction of J omega.
    """

    kind: Literal["preliminary_2"] = "preliminary_2"
    gain_a_m2_per_t: float | None = Field(default=None, gt=0.0)
    inertia_kg_m2: Inertia
    gain_key: ClassVar = "gain_a_m2_per_t"

    def law(self) -> Law:
        """The law with this gain or relay."""
        inertia = inertia_parameters(self.inertia_kg_m2)
        parameters = {**self.parameters(), **inertia}
        return Law(self.kind, preliminary_2, parameters, needs_sun=self.needs_sun, spec=self)
