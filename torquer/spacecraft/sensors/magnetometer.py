"""Three-axis magnetometer, disturbed by coils that are on while it reads."""

from typing import NamedTuple

from pydantic import Field

from torquer.base.spec import Vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add, add_scaled, as_vector, mat_vec, scale
from torquer.spacecraft.failures import FieldFailure
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sensing import mounting_matrix, through_electronics

STREAM = 1


class MagnetometerSet(NamedTuple):
    """Constants of the magnetometer for kernels [T]."""

    mounting: tuple
    bias_t: tuple
    noise_t: float
    range_t: float
    resolution_t: float
    coupling_t_per_a_m2: float


@inlined
def read_field(magnetometer, b_body_t, dipole_body_a_m2, noise_sample):
    """Reading [T] in body axes; `noise_sample`: three standard normal numbers."""
    m = magnetometer
    seen = add_scaled(b_body_t, m.coupling_t_per_a_m2, dipole_body_a_m2)
    reading = add(mat_vec(m.mounting, seen), m.bias_t)
    if m.noise_t > 0.0:
        reading = add_scaled(reading, m.noise_t, noise_sample)
    return through_electronics(reading, m.range_t, m.resolution_t)


class Magnetometer(Sampled):
    """Three-axis magnetometer; ideal by default."""

    failures: tuple[FieldFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""

    range_nt: float = Field(default=1e9, gt=0.0)
    """Range: readings of each axis are clipped there."""
    noise_nt: float = Field(default=0.0, ge=0.0)
    """Standard deviation of each reading along each axis."""
    bias_nt: Vector = (0.0, 0.0, 0.0)
    """Constant bias."""
    scale_error: Vector = (0.0, 0.0, 0.0)
    """Relative scale-factor error of each axis."""
    misalignment_deg: Vector = (0.0, 0.0, 0.0)
    """Rotation vector of the misalignment, small."""
    resolution_nt: float = Field(default=0.0, ge=0.0)
    """Quantisation step; 0: none."""
    coil_disturbance_nt_per_a_m2: float = 0.0
    """Field at the sensor per unit of coil dipole, parallel to the dipole, while the coils are on.
    """

    def pack(self) -> MagnetometerSet:
        """Constants for kernels."""
        return MagnetometerSet(
            mounting_matrix(self.scale_error, self.misalignment_deg),
            scale(1e-9, as_vector(self.bias_nt)),
            1e-9 * self.noise_nt,
            1e-9 * self.range_nt,
            1e-9 * self.resolution_nt,
            1e-9 * self.coil_disturbance_nt_per_a_m2,
        )
