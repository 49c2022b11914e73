"""Attitude sensor: a star tracker, or what stands for a filter whose accuracy is known."""

import math
from typing import NamedTuple

from pydantic import Field

from torquer.engine import inlined
from torquer.geometry.quaternion import from_rotation_vector, multiply
from torquer.geometry.vec3 import as_vector, scale
from torquer.spacecraft.sampling import Sampled
from torquer.spec import Vector

STREAM = 5


class AttitudeSensorSet(NamedTuple):
    """Constants of the attitude sensor for kernels."""

    ideal: bool
    q_error: tuple
    noise_rad: float


@inlined
def read_attitude(sensor, q_body_to_inertial, drawn):
    """Measured attitude: the true one after the fixed and the random turn, in body axes.

    `drawn`: three standard normal numbers.
    """
    if sensor.ideal:
        return q_body_to_inertial
    turn = from_rotation_vector(scale(sensor.noise_rad, drawn))
    return multiply(multiply(q_body_to_inertial, sensor.q_error), turn)


class AttitudeSensor(Sampled):
    """Attitude sensor; the default is an ideal one.

    `error_deg`: fixed turn about the body axes between true and measured attitude (a mounting
    error); `noise_deg`: standard deviation of a random turn about each axis, anew at every reading.
    """

    error_deg: Vector = (0.0, 0.0, 0.0)
    noise_deg: float = Field(default=0.0, ge=0.0)

    def pack(self) -> AttitudeSensorSet:
        """Constants for kernels."""
        error = scale(math.radians(1.0), as_vector(self.error_deg))
        ideal = self.noise_deg == 0.0 and error == (0.0, 0.0, 0.0)
        return AttitudeSensorSet(ideal, from_rotation_vector(error), math.radians(self.noise_deg))
