"""Sun sensors: the direction to the Sun in body axes, while one of them sees it."""

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
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.quaternion import read_quaternion, rotate_inverse
from torquer.maths.geometry.vec3 import read_vector
from torquer.spacecraft.sensors.sun_sensor import sensor_that_sees


class SunNoise(NamedTuple):
    """Variance of each component [rad^2]."""

    r: float


@inlined
def measure(inputs, parameters, memory, sun, at_s, own, place, omega, walk):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    if not is_new(own.r, sun, at_s, memory.read_s[place.channel]):
        return NO_MEASUREMENT
    read = turn_to_now(omega, inputs.t_s - at_s, sun)
    q, reference = read_quaternion(memory.q), inputs.ephemeris.sun_inertial
    return direction_measurement(q, reference, read, own.r)


@inlined
def direction(inputs, parameters, sun, at_s, own):
    """The latest reading."""
    usable = is_usable(own.r, sun, inputs.t_s - at_s, parameters.sensing.gap)
    return Direction(own.r > 0.0, usable, at_s, sun, inputs.ephemeris.sun_inertial, own.r)


@inlined
def odd(inputs, parameters, m):
    """Whether the Sun is seen in the umbra."""
    return inputs.ephemeris.sunlit_fraction == 0.0


@inlined
def expected(parameters, along, k, own, assumed, cell):
    """(z, H, R) of the direction to the Sun where the filter assumes another."""
    q, sun = read_quaternion(along.q[k]), read_vector(along.sun[k])
    return direction_measurement(q, sun, rotate_inverse(q, assumed), own.r)


@kernel
def keep_seen(sensors, sun_body, seen):
    """Clear `seen` (k,) where no sensor sees the Sun, in direction `sun_body` (k, 3)."""
    for k in range(seen.shape[0]):
        seen[k] = seen[k] and sensor_that_sees(sensors, read_vector(sun_body[k])) >= 0


def visible(craft, seen):
    """Whether a sensor sees the Sun along a motion (k,)."""
    lit, sensors = seen.sunlit >= 0.5, craft.each_of("sun_sensors")
    found = np.zeros(len(lit), bool) if sensors else lit
    for each in sensors:
        own = lit.copy()
        keep_seen(each.pack(), to_body(seen.q, seen.sun), own)
        found |= own
    return found


class SunKeys(Spec):
    """A filter's key of the Sun sensors."""

    sun_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each component of a Sun reading; given if the filter uses Sun sensors.
    """


def constants(keys) -> SunNoise:
    """Constants for kernels."""
    return SunNoise(math.radians(keys.sun_noise_deg or 0.0) ** 2)


MEASURED = Measured(
    "sun",
    said="Sun sensors",
    keys=SunKeys,
    noise="sun_noise_deg",
    constants=constants,
    measure=measure,
    expected=expected,
    visible=visible,
    missing="no usable reading of the Sun sensors",
    direction=direction,
    reference="sun",
    odd=odd,
    colour="ORANGE",
)
