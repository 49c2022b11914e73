"""Fine Sun sensor: the two tangents of the Sun's direction in the frame of its head.

The frame is that of `torquer.spacecraft.sensors.fine_sun_sensor`: rows x, y, z [body].
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec, unit_vector
from torquer.compile.engine import inlined
from torquer.computer.estimation.measurements.measured import Measured
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    NO_OTHER,
    NOWHERE,
    Direction,
    Measurement,
    direction_measurement,
    is_usable,
    turn_to_now,
)
from torquer.computer.estimation.measurements.sun_sensors import odd
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.quaternion import read_quaternion, rotate_inverse
from torquer.maths.geometry.vec3 import (
    add_scaled,
    cross,
    mat_t_vec,
    mat_vec,
    read_vector,
    scale,
    unit,
)
from torquer.spacecraft.sensors.fine_sun_sensor import head_frame

_ZERO = (0.0, 0.0, 0.0)
#: Part of a direction along the boresight below which its tangents (6 deg from the plane of the
#: detector) do not tell how far a filter is off.
_IN_FRONT = 0.1


class FineSunNoise(NamedTuple):
    """Variance of a tangent; axes of the head in the body, by rows."""

    r: float
    frame: tuple


@inlined
def has_tangents(reading):
    """Whether a reading (tangents, 1 if the Sun is seen) is one of the Sun."""
    size = reading[0] * reading[0] + reading[1] * reading[1]
    return reading[2] == 1.0 and size < math.inf


@inlined
def sun_by_tangents(frame, reading):
    """Unit vector to the Sun [body] by a reading of the tangents; zeros without one."""
    if not has_tangents(reading):
        return _ZERO
    return unit(mat_t_vec(frame, (reading[0], reading[1], 1.0)))


@inlined
def frame_then(frame, omega, age):
    """Axes of a head `age` seconds ago in body axes of now; the body turns with omega."""
    return (
        turn_to_now(omega, age, frame[0]),
        turn_to_now(omega, age, frame[1]),
        turn_to_now(omega, age, frame[2]),
    )


@inlined
def measure_tangents(q, sun_inertial, frame, reading, variance):
    """(z, H, R) of a reading of the tangents A = sx/sz, B = sy/sz; none without the Sun.

    `frame`: axes of the head, for a late reading by `frame_then`; `variance`: of a tangent.

    An attitude error e, q_true = q exp(e), makes s + s x e of the predicted direction s: it changes
    A by (x - A z) x s . e/sz. Where the prediction is not in front of the head, the reading counts
    as a direction: such a filter is wrong, and has to be told so.
    """
    if not has_tangents(reading):
        return NO_MEASUREMENT
    s, read = rotate_inverse(q, sun_inertial), sun_by_tangents(frame, reading)
    x, y, z = mat_vec(frame, s)
    if z < _IN_FRONT:
        return direction_measurement(q, sun_inertial, read, variance)
    a, b = x / z, y / z
    rows = (
        scale(1.0 / z, cross(add_scaled(frame[0], -a, frame[2]), s)),
        scale(1.0 / z, cross(add_scaled(frame[1], -b, frame[2]), s)),
        _ZERO,
    )
    e = (reading[0] - a, reading[1] - b, 0.0)
    return Measurement(e, rows, NO_OTHER, NOWHERE, variance, 2, read, sun_inertial, 0.0)


@inlined
def measure(inputs, parameters, memory, read, at_s, own, place, omega, walk):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    if not (own.r > 0.0 and at_s > memory.read_s[place.channel]):
        return NO_MEASUREMENT
    frame = frame_then(own.frame, omega, inputs.t_s - at_s)
    sun = inputs.ephemeris.sun_inertial
    return measure_tangents(read_quaternion(memory.q), sun, frame, read, own.r)


@inlined
def direction(inputs, parameters, read, at_s, own):
    """The latest reading as a direction, as uncertain as its tangents at the boresight."""
    sun = sun_by_tangents(own.frame, read)
    usable = is_usable(own.r, sun, inputs.t_s - at_s, parameters.sensing.gap)
    return Direction(own.r > 0.0, usable, at_s, sun, inputs.ephemeris.sun_inertial, own.r)


@inlined
def expected(parameters, along, k, own, assumed, cell):
    """(z, H, R) of the Sun's tangents where the filter assumes another direction."""
    q, sun = read_quaternion(along.q[k]), read_vector(along.sun[k])
    x, y, z = mat_vec(own.frame, rotate_inverse(q, assumed))
    return measure_tangents(q, sun, own.frame, (x / z, y / z, 1.0), own.r)


def visible(craft, seen):
    """Whether one of the sensors sees the Sun along a motion (k,)."""
    found = np.zeros(len(seen.q), bool)
    for sensor in craft.each_of("fine_sun_sensor"):
        constants = sensor.pack()
        x, y, z = np.array(constants.head) @ to_body(seen.q, seen.sun).T
        found |= (z > 0.0) & (np.maximum(abs(x), abs(y)) <= constants.limit * z)
    return found & (seen.sunlit >= 0.5)


class FineSunKeys(Spec):
    """A filter's keys of the fine Sun sensor."""

    fine_sun_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each angle of a reading of the fine Sun sensor at its boresight, its
    quantum included; given if the filter uses it.
    """
    fine_sun_boresight: unit_vector("boresight") | None = None
    """Axis of its head in the body; given if the filter uses it."""
    fine_sun_up: unit_vector("up") | None = None
    """Where the axis y of its head points, in the body; given if the filter uses it."""


def check(keys) -> None:
    """The head is given with the noise, and only then."""
    used = keys.fine_sun_noise_deg is not None
    for key in ("fine_sun_boresight", "fine_sun_up"):
        if (getattr(keys, key) is not None) != used:
            must = "given" if used else "left out"
            raise ValueError(
                f"{key}: must be {must} with fine_sun_noise_deg = {keys.fine_sun_noise_deg}; "
                f"received {getattr(keys, key)}"
            )
    if used:
        head_frame("fine_sun_up", keys.fine_sun_boresight, keys.fine_sun_up)


def constants(keys) -> FineSunNoise:
    """Constants for kernels."""
    if keys.fine_sun_noise_deg is None:
        return FineSunNoise(0.0, ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    frame = head_frame("fine_sun_up", keys.fine_sun_boresight, keys.fine_sun_up)
    return FineSunNoise(math.radians(keys.fine_sun_noise_deg) ** 2, frame)


def unit_constants(keys, spec) -> FineSunNoise:
    """Constants of one of several sensors: with its own head, as it is mounted."""
    return constants(keys)._replace(frame=spec.frame())


MEASURED = Measured(
    "fine_sun",
    said="fine Sun sensor",
    keys=FineSunKeys,
    noise="fine_sun_noise_deg",
    check=check,
    constants=constants,
    measure=measure,
    expected=expected,
    visible=visible,
    missing="no usable reading of the fine Sun sensor",
    direction=direction,
    says={"axes": "fine_sun_boresight"},
    reference="sun",
    odd=odd,
    unit_constants=unit_constants,
    colour="PINK",
)
