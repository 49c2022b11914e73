"""Direct dipole: k = (0, 0, -1), against the Earth's axis. Frames: inertial, Y, S, X.

The forms on a circular orbit take `equatorial_t` = mu_e / r^3 [T], the field's strength over
the equator, the argument of latitude u and the inclination [rad].
"""

import math
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from torquer.compile.engine import kernel
from torquer.environment.field.model import FixedInEarth, rows
from torquer.environment.field.tilted_dipole import M3_IN_KM3, b_dipole_many
from torquer.maths.geometry.vec3 import scale


@kernel
def b_y(equatorial_t, u, inclination):
    """Flux density [T] on a circular orbit in Y. Source: FIELD (1.2)."""
    su, si = math.sin(u), math.sin(inclination)
    turning = -1.5 * si * math.sin(2.0 * u)
    swinging = -1.5 * math.sin(2.0 * inclination) * su * su
    return scale(equatorial_t, (turning, swinging, 1.0 - 3.0 * si * si * su * su))


@kernel
def strength(equatorial_t, u, inclination):
    """Length of the flux-density vector [T] on a circular orbit. Source: FIELD (1.3)."""
    up = math.sin(inclination) * math.sin(u)
    return equatorial_t * math.sqrt(1.0 + 3.0 * up * up)


@kernel
def b_orbital(equatorial_t, u, inclination):
    """Flux density [T] on a circular orbit in X (along the motion, normal, up).

    Source: FIELD (1.4), whose axes are in the order up, along the motion, normal.
    """
    si = math.sin(inclination)
    return scale(equatorial_t, (math.cos(u) * si, math.cos(inclination), -2.0 * math.sin(u) * si))


@kernel
def b_s(equatorial_t, u, inclination):
    """Flux density [T] on a circular orbit in S. Source: FIELD (1.5)."""
    su, si = math.sin(u), math.sin(inclination)
    return scale(
        equatorial_t,
        (-1.5 * math.sin(2.0 * u) * si, si - 3.0 * su * su * si, math.cos(inclination)),
    )


class DirectDipole(FixedInEarth):
    """Dipole at the Earth's centre along its axis; it does not depend on the date."""

    kind: Literal["direct_dipole"] = "direct_dipole"
    in_earth: ClassVar = b_dipole_many
    mu_e_t_km3: float = Field(7.812e6, gt=0.0)
    """Strength mu_e of the dipole."""

    def prepare(self, decimal_year: float) -> tuple:
        """Dipole vector [T m^3], the same in Earth-fixed and inertial axes."""
        return (0.0, 0.0, -self.mu_e_t_km3 * M3_IN_KM3)

    def b_inertial(self, packed, r_inertial, v_inertial, dcm_inertial_to_ecef) -> np.ndarray:
        """Flux density [T] in the inertial frame, its third axis taken as the Earth's."""
        return self.b_earth_fixed(packed, rows("r_inertial", r_inertial, 3))
