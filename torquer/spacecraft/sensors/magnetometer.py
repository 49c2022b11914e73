"""Three-axis magnetometer, disturbed by coils that are on while it reads."""

from typing import ClassVar, NamedTuple

from pydantic import Field

from torquer.base.spec import Vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, add_scaled, as_vector, mat_vec, scale
from torquer.spacecraft.actuators.coils import present_dipole
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import FieldFailure
from torquer.spacecraft.sensors.device import Device
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


@inlined
def field_around(sensor, around):
    """The field [T] where the satellite is, inertial."""
    return around.b_inertial


@inlined
def read(sensor, here, b_inertial, noise_sample):
    """What the magnetometer reads, with the field of coils that are on."""
    dipole = (0.0, 0.0, 0.0)
    if sensor.coupling_t_per_a_m2 != 0.0:
        dipole = present_dipole(here.coils, here.coil_state)
    return read_field(sensor, rotate_inverse(here.motion.q, b_inertial), dipole, noise_sample)


class Magnetometer(Sampled):
    """Three-axis magnetometer; ideal by default."""

    sheet: ClassVar = DataSheet(
        name="magnetometer",
        senses="field",
        unit="nT",
        noise="noise_nt",
        bias="bias_nt",
        range="range_nt",
        resolution="resolution_nt",
        scale="scale_error",
        misalignment="misalignment_deg",
        by_coils="coil_disturbance_nt_per_a_m2",
    )
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


DEVICE = Device(
    "magnetometer",
    given="b_body_t",
    said="magnetometer",
    symbol="b",
    units="T",
    meaning="last magnetometer reading",
    spec=Magnetometer,
    read=read,
    sky=field_around,
    draws=((STREAM, ("noise_t",)),),
    quantum="resolution_t",
    measurement="magnetometer",
    several="magnetometers",
    by_coils=True,
)
