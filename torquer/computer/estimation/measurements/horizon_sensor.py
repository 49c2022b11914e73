"""Horizon sensor: the direction to the Earth's centre in body axes, while it sees the Earth."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec
from torquer.compile.engine import inlined, kernel
from torquer.computer.estimation.measurements.measured import Measured
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    Direction,
    direction_measurement,
    is_new,
    is_usable,
    turn_to_now,
)
from torquer.maths.geometry.quaternion import read_quaternion, rotate_inverse
from torquer.maths.geometry.vec3 import add_scaled, read_vector, scale, unit
from torquer.spacecraft.sensors.horizon_sensor import HorizonSensor, disc_centre, sees_horizon


class HorizonNoise(NamedTuple):
    """Variance of each component [rad^2]."""

    r: float


@inlined
def nadir_at(inputs, t_s):
    """Direction to the Earth's centre (inertial) by the computer's orbit, a little before now."""
    place = inputs.ephemeris
    r = add_scaled(place.r_inertial_m, t_s - inputs.t_s, place.v_inertial_m_s)
    return scale(-1.0, unit(r))


@inlined
def measure(inputs, parameters, memory, nadir, at_s, own, place, omega, walk):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    if not is_new(own.r, nadir, at_s, memory.read_s[place.channel]):
        return NO_MEASUREMENT
    read = turn_to_now(omega, inputs.t_s - at_s, nadir)
    return direction_measurement(read_quaternion(memory.q), nadir_at(inputs, at_s), read, own.r)


@inlined
def direction(inputs, parameters, nadir, at_s, own):
    """The latest reading."""
    usable = is_usable(own.r, nadir, inputs.t_s - at_s, parameters.sensing.gap)
    return Direction(own.r > 0.0, usable, at_s, nadir, nadir_at(inputs, at_s), own.r)


@inlined
def expected(parameters, along, k, own, assumed, cell):
    """(z, H, R) of the direction to the Earth's centre where the filter assumes another."""
    q, nadir = read_quaternion(along.q[k]), scale(-1.0, unit(read_vector(along.gravity[k])))
    return direction_measurement(q, nadir, rotate_inverse(q, assumed), own.r)


@kernel
def put_earth(sensor, q, omega, r, earth):
    """Whether a horizon sensor sees the Earth, into `earth` (k,).

    At attitudes (k, 4), rates (k, 3), positions (k, 3) [m, inertial].
    """
    for k in range(earth.shape[0]):
        centre = rotate_inverse(read_quaternion(q[k]), disc_centre(sensor, read_vector(r[k])))
        earth[k] = sees_horizon(sensor, read_vector(omega[k]), centre)


def visible(craft, seen):
    """Whether one of the sensors sees the Earth along a motion (k,)."""
    earth = np.zeros(len(seen.q), bool)
    for sensor in craft.each_of("horizon_sensor") or [HorizonSensor()]:
        own = np.zeros(len(seen.q), bool)
        put_earth(sensor.pack(), seen.q, seen.omega, seen.r, own)
        earth |= own
    return earth


class HorizonKeys(Spec):
    """A filter's key of the horizon sensor."""

    horizon_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each component of a reading of the horizon sensor, that of the horizon
    included; given if the filter uses it.
    """


def constants(keys) -> HorizonNoise:
    """Constants for kernels."""
    return HorizonNoise(math.radians(keys.horizon_noise_deg or 0.0) ** 2)


MEASURED = Measured(
    "horizon",
    said="horizon sensor",
    keys=HorizonKeys,
    noise="horizon_noise_deg",
    constants=constants,
    measure=measure,
    expected=expected,
    visible=visible,
    missing="no usable reading of the horizon sensor",
    direction=direction,
    reference="nadir",
    colour="RED",
)
