"""Precise reorientation of a spinning satellite: the angular momentum is brought to a target.

MAG 3.3. One coil, about the spin axis, which is taken to lie along the angular momentum.
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
from torquer.geometry.vec3 import cross, dot, scale, sub, sym_vec
from torquer.spec import Inertia


@kernel
def reorientation(measured, parameters, memory):
    """m = k ((L_f - L) . (e3 x B)) e3, L = J omega. Source: MAG (3.3.1).

    Parameters after the target: |L_f| [N m s], inertia (xx, yy, zz, xy, xz, yz) [kg m^2].
    """
    p, direction = parameters, target_body(measured, parameters)
    if dot(direction, direction) == 0.0:  # a Sun that is not seen
        return (0.0, 0.0, 0.0)
    inertia = (p[END + 1], p[END + 2], p[END + 3], p[END + 4], p[END + 5], p[END + 6])
    missing = sub(scale(p[END], direction), sym_vec(inertia, measured.omega_body_rad_s))
    return one_coil(p, p[0] * dot(missing, cross(axis_of(p), measured.b_body_t)))


class Reorientation(Pointed):
    """Precise reorientation; the gain in A m^2/(N m s T), the same as 1/(s T^2).

    `momentum_n_m_s`: wanted length of the angular momentum L_f; `inertia_kg_m2`: three moments or
    3x3, from which the law takes L = J omega.
    """

    kind: Literal["reorientation"] = "reorientation"
    gain_a_m2_per_n_m_s_t: float | None = Field(default=None, gt=0.0)
    momentum_n_m_s: float = Field(gt=0.0)
    inertia_kg_m2: Inertia
    gain_key: ClassVar = "gain_a_m2_per_n_m_s_t"

    def law(self) -> Law:
        """The law with this gain or relay."""
        inertia = inertia_parameters(self.inertia_kg_m2)
        own = {"momentum": self.momentum_n_m_s, **inertia}
        parameters = {**self.parameters(), **own}
        return Law(self.kind, reorientation, parameters, needs_sun=self.needs_sun, spec=self)
