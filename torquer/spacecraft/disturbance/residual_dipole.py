"""Residual dipole of the satellite: a constant one, and one that oscillates with the orbit."""

import math
from typing import NamedTuple

from pydantic import Field

from torquer.base.spec import Spec, Vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add_scaled, as_vector, cross


class OscillatingDipole(NamedTuple):
    """Constants of the residual dipole for kernels; `is_on`: 1, or 0 for none."""

    is_on: float
    constant_a_m2: tuple
    amplitude_a_m2: tuple
    cycles_per_orbit: float
    phase_rad: float


_ZERO = (0.0, 0.0, 0.0)
NO_DIPOLE = OscillatingDipole(0.0, _ZERO, _ZERO, 0.0, 0.0)


@inlined
def residual_dipole_torque(dipole, local_body, omega_body):
    """Torque [N m, body] of the dipole m0 + m1 sin(n u + phase) in the field."""
    if dipole.is_on == 0.0:
        return (0.0, 0.0, 0.0)
    swing = math.sin(dipole.cycles_per_orbit * local_body.orbit_angle[0] + dipole.phase_rad)
    m = add_scaled(dipole.constant_a_m2, swing, dipole.amplitude_a_m2)
    return cross(m, local_body.b_t)


class ResidualDipole(Spec):
    """Residual dipole besides that of the coils (`spacecraft.coils.residual_dipole_a_m2`).

    constant + amplitude sin(cycles u + phase): u is the argument of latitude at the start, from
    where it grows with the mean orbital rate. Currents in solar panels make such dipoles; half a
    cycle per orbit is that of SDOT, section 3.2. The magnetometer's `coil_disturbance_nt_per_a_m2`
    does not count it.
    """

    constant_a_m2: Vector = _ZERO
    """Constant part, in body axes."""
    amplitude_a_m2: Vector = _ZERO
    """Amplitude of the oscillating part, in body axes."""
    cycles_per_orbit: float = Field(default=1.0, gt=0.0, le=1000.0)
    """Oscillations per orbit."""
    phase_deg: float = 0.0
    """Phase of the oscillation."""

    def pack(self, parts) -> OscillatingDipole:
        """Constants for kernels; the body's `parts` do not matter."""
        return OscillatingDipole(
            1.0,
            as_vector(self.constant_a_m2),
            as_vector(self.amplitude_a_m2),
            self.cycles_per_orbit,
            math.radians(self.phase_deg),
        )
