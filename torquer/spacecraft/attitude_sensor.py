"""Attitude sensor: a star tracker, or a stand-in for a filter of known accuracy."""

import math
from typing import NamedTuple

from pydantic import Field

from torquer.compile.engine import inlined
from torquer.geometry.quaternion import from_rotation_vector, multiply
from torquer.geometry.vec3 import as_vector, norm, scale
from torquer.noise import cos_sin
from torquer.spacecraft.failures import DirectionFailure
from torquer.spacecraft.sampling import Sampled
from torquer.spec import Vector

STREAM = 5


class AttitudeSensorSet(NamedTuple):
    """Constants of the attitude sensor for kernels."""

    q_error: tuple
    noise_rad: float


@inlined
def read_attitude(sensor, q_body_to_inertial, noise_sample):
    """Measured attitude: the true one after the fixed and the random rotation, in body axes.

    `noise_sample`: three standard normal numbers.
    """
    q = multiply(q_body_to_inertial, sensor.q_error)
    if sensor.noise_rad == 0.0:
        return q
    return multiply(q, _turn(scale(sensor.noise_rad, noise_sample)))


@inlined
def _turn(phi):
    """`from_rotation_vector` up to 720 deg without branches or calls, which lanes need."""
    angle = norm(phi)
    cosine, sine = cos_sin(angle / (4.0 * math.pi))
    s = sine / (angle + 1e-300)
    return (s * phi[0], s * phi[1], s * phi[2], cosine)


class AttitudeSensor(Sampled):
    """Attitude sensor; ideal by default."""

    failures: tuple[DirectionFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""

    error_deg: Vector = (0.0, 0.0, 0.0)
    """Fixed rotation about the body axes between true and measured attitude, a mounting error."""
    noise_deg: float = Field(default=0.0, ge=0.0)
    """Standard deviation of a random rotation about each axis, drawn at every reading."""

    def pack(self) -> AttitudeSensorSet:
        """Constants for kernels."""
        error = scale(math.radians(1.0), as_vector(self.error_deg))
        return AttitudeSensorSet(from_rotation_vector(error), math.radians(self.noise_deg))
