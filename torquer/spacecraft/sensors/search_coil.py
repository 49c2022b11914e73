"""Three-axis search coil: the field's rate of change as the body sees it.

Where the control cycle has a time to measure it is read then, as a magnetometer is: what coils
that are on induce in it is not modelled.
"""

from typing import ClassVar, NamedTuple

from pydantic import Field

from torquer.base.spec import Vector
from torquer.compile.engine import inlined
from torquer.environment.table import rate_from
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, add_scaled, as_vector, cross, mat_vec, scale, sub
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import FieldRateFailure
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sensing import mounting_matrix, through_electronics

STREAM = 52
#: Range [nT/s] that nothing reaches.
_NO_RANGE_NT_S = 1e9


class SearchCoilSet(NamedTuple):
    """Constants of the search coil for kernels [T/s]."""

    mounting: tuple
    bias_t_s: tuple
    noise_t_s: float
    range_t_s: float
    resolution_t_s: float


@inlined
def field_and_rate(sensor, around):
    """The field [T] and its rate of change along the orbit [T/s], inertial."""
    return around.b_inertial, rate_from(around.orbit, around.t_s, 3)


@inlined
def rate_in_body(motion, b_inertial, b_rate_inertial):
    """Rate of change of the field [T/s] in body axes."""
    turning = rotate_inverse(motion.q, b_rate_inertial)
    return sub(turning, cross(motion.omega, rotate_inverse(motion.q, b_inertial)))


@inlined
def read_field_rate(coil, b_rate_body_t_s, noise_sample):
    """Reading [T/s] in body axes; `noise_sample`: three standard normal numbers."""
    reading = add(mat_vec(coil.mounting, b_rate_body_t_s), coil.bias_t_s)
    if coil.noise_t_s > 0.0:
        reading = add_scaled(reading, coil.noise_t_s, noise_sample)
    return through_electronics(reading, coil.range_t_s, coil.resolution_t_s)


@inlined
def read(sensor, here, sky, noise_sample):
    """What the search coil reads."""
    b_inertial, b_rate_inertial = sky
    seen = rate_in_body(here.motion, b_inertial, b_rate_inertial)
    return read_field_rate(sensor, seen, noise_sample)


class SearchCoil(Sampled):
    """Three-axis search coil (induction coils): the rate of change of the field in body axes."""

    sheet: ClassVar = DataSheet(
        name="search coil",
        senses="field_rate",
        unit="nT/s",
        noise="noise_nt_s",
        bias="bias_nt_s",
        range="range_nt_s",
        resolution="resolution_nt_s",
        scale="scale_error",
        misalignment="misalignment_deg",
    )
    failures: tuple[FieldRateFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""

    range_nt_s: float = Field(default=_NO_RANGE_NT_S, gt=0.0)
    """Range: readings of each axis are clipped there."""
    noise_nt_s: float = Field(default=0.0, ge=0.0)
    """Standard deviation of each reading along each axis."""
    bias_nt_s: Vector = (0.0, 0.0, 0.0)
    """Constant bias, as of an amplifier with an offset."""
    scale_error: Vector = (0.0, 0.0, 0.0)
    """Relative scale-factor error of each axis."""
    misalignment_deg: Vector = (0.0, 0.0, 0.0)
    """Rotation vector of the misalignment, small."""
    resolution_nt_s: float = Field(default=0.0, ge=0.0)
    """Quantisation step; 0: none."""

    def pack(self) -> SearchCoilSet:
        """Constants for kernels."""
        return SearchCoilSet(
            mounting_matrix(self.scale_error, self.misalignment_deg),
            scale(1e-9, as_vector(self.bias_nt_s)),
            1e-9 * self.noise_nt_s,
            1e-9 * self.range_nt_s,
            1e-9 * self.resolution_nt_s,
        )


#: For kernels: an ideal search coil. (`pack` would load kernels at the import.)
IDEAL_SEARCH_COIL = SearchCoilSet(
    mounting=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    bias_t_s=(0.0, 0.0, 0.0),
    noise_t_s=0.0,
    range_t_s=1e-9 * _NO_RANGE_NT_S,
    resolution_t_s=0.0,
)
DEVICE = Device(
    "search_coil",
    given="b_rate_body_t_s",
    said="search coil",
    symbol="b_rate",
    units="T/s",
    meaning="last reading of the search coil",
    spec=SearchCoil,
    ideal=IDEAL_SEARCH_COIL,
    absent=IDEAL_SEARCH_COIL,
    need="search_coil",
    read=read,
    sky=field_and_rate,
    draws=((STREAM, ("noise_t_s",)),),
    quantum="resolution_t_s",
    by_coils=True,
)
