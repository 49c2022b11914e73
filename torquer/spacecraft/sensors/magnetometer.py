"""Three-axis magnetometer, disturbed by coils that are on while it reads and by iron around it."""

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, add_scaled, as_matrix, as_vector, mat_vec, scale
from torquer.spacecraft.actuators.coils import are_driven, flowing_dipole, present_dipole
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import FieldFailure
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sensing import mounting_matrix, through_electronics

STREAM = 1
#: Most coils whose field at a magnetometer may be given coil by coil.
MOST_COUPLED = 6
_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class MagnetometerSet(NamedTuple):
    """Constants of the magnetometer for kernels [T].

    `is_disturbed`: 1 for one with any of what follows, else 0. `soft_iron`: matrix on the outside
    field; `by_coil_t_per_a_m2`: field by the dipole of each coil, zeros beyond the last one;
    `driver_t`: field while any coil is driven.
    """

    mounting: tuple
    bias_t: tuple
    noise_t: float
    range_t: float
    resolution_t: float
    coupling_t_per_a_m2: float
    is_disturbed: float
    soft_iron: tuple
    by_coil_t_per_a_m2: tuple
    driver_t: tuple


@inlined
def disturbed_field(magnetometer, b_body_t, coils, state):
    """Field at the sensor [T, body]: the outside one through soft iron, and that of each coil."""
    seen, of_coil = mat_vec(magnetometer.soft_iron, b_body_t), magnetometer.by_coil_t_per_a_m2
    # written out: an index that the compiler does not know costs a tuple a check of its range
    first, second = flowing_dipole(coils, state, 0), flowing_dipole(coils, state, 1)
    third, fourth = flowing_dipole(coils, state, 2), flowing_dipole(coils, state, 3)
    fifth, sixth = flowing_dipole(coils, state, 4), flowing_dipole(coils, state, 5)
    seen = add_scaled(add_scaled(seen, first, of_coil[0]), second, of_coil[1])
    seen = add_scaled(add_scaled(seen, third, of_coil[2]), fourth, of_coil[3])
    seen = add_scaled(add_scaled(seen, fifth, of_coil[4]), sixth, of_coil[5])
    return add_scaled(seen, are_driven(coils, state), magnetometer.driver_t)


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
    seen = rotate_inverse(here.motion.q, b_inertial)
    if sensor.is_disturbed != 0.0:
        seen = disturbed_field(sensor, seen, here.coils, here.coil_state)
    return read_field(sensor, seen, dipole, noise_sample)


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
        by_each_coil="coil_coupling_nt_per_a_m2",
        by_driver="coil_offset_nt",
        soft_iron="soft_iron",
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
    coil_coupling_nt_per_a_m2: tuple[Vector, ...] | None = None
    """Field at the sensor, in body axes, per unit of the dipole that flows in each coil: a vector
    for each coil. It takes the place of `coil_disturbance_nt_per_a_m2`, and leaves out the residual
    dipole; left out: none.
    """
    coil_offset_nt: Vector = (0.0, 0.0, 0.0)
    """Constant field of the coils' driver at the sensor, in body axes, while it drives any coil."""
    soft_iron: tuple[Vector, Vector, Vector] = _IDENTITY
    """Matrix that soft iron makes of the outside field, three rows in body axes, before the errors
    of the sensor itself. Hard iron is `bias_nt`.
    """

    @model_validator(mode="after")
    def _one_coupling(self):
        given = self.coil_coupling_nt_per_a_m2
        if given is not None and not 0 < len(given) <= MOST_COUPLED:
            raise ValueError(
                f"coil_coupling_nt_per_a_m2: must have 1 to {MOST_COUPLED} vectors, one for each "
                f"coil; received {len(given)}"
            )
        if self.coil_coupling_nt_per_a_m2 and self.coil_disturbance_nt_per_a_m2:
            raise ValueError(
                "coil_disturbance_nt_per_a_m2: must be left out with coil_coupling_nt_per_a_m2; "
                f"received {self.coil_disturbance_nt_per_a_m2:g}"
            )
        if not abs(np.linalg.det(self.soft_iron)) > 1e-6:
            raise ValueError(
                "soft_iron: must be a matrix that can be inverted; received one of determinant "
                f"{np.linalg.det(self.soft_iron):.3g}"
            )
        return self

    def coupling_to(self, coils) -> np.ndarray:
        """Field [T] (3, 3) per A m^2 of a commanded dipole, both in body axes, of sound `Coils`."""
        if self.coil_coupling_nt_per_a_m2 is None:
            return 1e-9 * self.coil_disturbance_nt_per_a_m2 * np.eye(3)
        return 1e-9 * np.transpose(self.coil_coupling_nt_per_a_m2) @ coils.shares()

    def _is_disturbed(self) -> bool:
        given = self.coil_coupling_nt_per_a_m2 is not None or any(self.coil_offset_nt)
        return given or self.soft_iron != _IDENTITY

    def pack(self) -> MagnetometerSet:
        """Constants for kernels."""
        by_coil = np.zeros((MOST_COUPLED, 3))
        for row, vector in zip(by_coil, self.coil_coupling_nt_per_a_m2 or (), strict=False):
            row[:] = 1e-9 * np.array(vector)
        return MagnetometerSet(
            mounting_matrix(self.scale_error, self.misalignment_deg),
            scale(1e-9, as_vector(self.bias_nt)),
            1e-9 * self.noise_nt,
            1e-9 * self.range_nt,
            1e-9 * self.resolution_nt,
            1e-9 * self.coil_disturbance_nt_per_a_m2,
            float(self._is_disturbed()),
            as_matrix(self.soft_iron),
            tuple(map(as_vector, by_coil)),
            scale(1e-9, as_vector(self.coil_offset_nt)),
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
