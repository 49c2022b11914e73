"""Fine (digital) Sun sensor: two crossed slits before a detector, by which it reads two tangents.

Frame of the head: z the boresight, y the component of `up` across it, x = y x z. A slit at the
height f above the detector throws its light to f tan(angle): noise and quanta are those of the
tangents sx/sz and sy/sz of the direction s to the Sun, the same over the whole field.
"""

import math
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Vector, unit_vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate_inverse, to_dcm
from torquer.maths.geometry.vec3 import add_scaled, as_matrix, as_vector, mat_vec, scale
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import PlainFailure
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sensing import through_electronics
from torquer.spacecraft.sensors.sunlight import sun_and_light

STREAM = 15
#: Sine of the angle between boresight and `up` below which they give no frame.
_LEAST_SINE = 0.01


def head_frame(key: str, boresight, up) -> tuple:
    """Axes x, y, z of a head in the body, by rows; ValueError that names `key` if there are none.

    z is the boresight, of length one, and y the component of `up` across it.
    """
    z = np.array(boresight)
    x = np.cross(up, z)
    if np.linalg.norm(x) < _LEAST_SINE:
        raise ValueError(f"{key}: must not be along boresight; received {up} for {boresight}")
    x /= np.linalg.norm(x)
    return as_matrix((x, np.cross(z, x), z))


class FineSunSensorSet(NamedTuple):
    """Constants of the fine Sun sensor for kernels.

    `head`: axes x, y, z of the head as it is mounted [body], by rows; `limit`: tangent of the half
    field; `noise`, `quantum`: of the tangents.
    """

    head: tuple
    limit: float
    noise: float
    quantum: float


@inlined
def read_tangents(sensor, sun_body, sunlit_fraction, noise_sample):
    """(Tangents sx/sz and sy/sz, 1), or zeros where the sensor does not see the Sun.

    The field is square: both tangents are within the limit. `sunlit_fraction` is the visible
    fraction of the Sun's disc; half a disc is enough to read. `noise_sample`: three standard normal
    numbers, of which two are used.
    """
    x, y, z = mat_vec(sensor.head, sun_body)
    most = sensor.limit * z
    if z <= 0.0 or abs(x) > most or abs(y) > most or sunlit_fraction < 0.5:
        return (0.0, 0.0, 0.0)
    seen = add_scaled((x / z, y / z, 0.0), sensor.noise, noise_sample)
    a, b, _ = through_electronics(seen, sensor.limit, sensor.quantum)
    return (a, b, 1.0)


@inlined
def sun_around(sensor, around):
    """Direction to the Sun, visible part of it."""
    return sun_and_light(around.shadow, around.orbit, around.sun, around.t_s)


@inlined
def read(sensor, here, sky, noise_sample):
    """What the sensor reads of this Sun."""
    direction, sunlit_fraction = sky
    sun_body = rotate_inverse(here.motion.q, direction)
    return read_tangents(sensor, sun_body, sunlit_fraction, noise_sample)


class FineSunSensor(Sampled):
    """Fine Sun sensor with one head: the tangents of two angles of the Sun from its boresight.

    There is no reading (zeros, with a third number that is 1 otherwise) while the Sun is outside
    the square field of view or more than half hidden by the Earth.
    """

    sheet: ClassVar = DataSheet(
        name="fine Sun sensor",
        senses="sun",
        unit="deg",
        noise="noise_deg",
        resolution="quantum_deg",
        misalignment="bias_deg",
        axes="boresight",
    )
    failures: tuple[PlainFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""
    boresight: unit_vector("boresight")
    """Axis of the head in the body, of any length: normal of the detector."""
    up: unit_vector("up")
    """Where the head's axis y points, in the body, of any length; only the component across the
    boresight counts.
    """
    half_field_deg: float = Field(gt=0.0, lt=90.0)
    """Greatest angle of the Sun from the boresight along x and along y of the head: half the side
    of a square field.
    """
    noise_deg: float = Field(default=0.0, ge=0.0)
    """Standard deviation of each angle of a reading at the boresight; that of the tangents is the
    same elsewhere.
    """
    quantum_deg: float = Field(default=0.0, ge=0.0, lt=90.0)
    """Quantum of each angle at the boresight; that of the tangents is the same elsewhere; 0: none.
    """
    bias_deg: Vector = (0.0, 0.0, 0.0)
    """Fixed small rotation of the reading about the body axes, a mounting error."""

    @model_validator(mode="after")
    def _up_across(self):
        self.frame()
        return self

    def frame(self) -> tuple:
        """Axes x, y, z of the head in the body, by rows, without its mounting error."""
        return head_frame("up", self.boresight, self.up)

    def pack(self) -> FineSunSensorSet:
        """Constants for kernels."""
        turn = to_dcm(from_rotation_vector(scale(math.radians(1.0), as_vector(self.bias_deg))))
        return FineSunSensorSet(
            as_matrix(np.array(self.frame()) @ np.array(turn)),
            math.tan(math.radians(self.half_field_deg)),
            math.radians(self.noise_deg),
            math.tan(math.radians(self.quantum_deg)),
        )


#: For kernels: none.
NO_FINE_SUN_SENSOR = FineSunSensorSet(
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), limit=-1.0, noise=0.0, quantum=0.0
)
DEVICE = Device(
    "fine_sun_sensor",
    given="sun_tangents",
    said="fine Sun sensor",
    symbol="tangents",
    units="1",
    meaning="last reading of the fine Sun sensor: two tangents in the frame of its head, 1 where "
    "it sees the Sun; zeros where it does not",
    frame="head",
    spec=FineSunSensor,
    absent=NO_FINE_SUN_SENSOR,
    need="fine_sun",
    read=read,
    sky=sun_around,
    draws=((STREAM, ("noise",)),),
    quantum="quantum",
    by_sunlight=lambda sensor: True,
    measurement="fine_sun_sensor",
    nothing="zeros",
    several="fine_sun_sensors",
    combines=False,
)
