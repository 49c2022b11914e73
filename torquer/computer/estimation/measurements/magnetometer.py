"""Magnetometer: the field [T] in body axes; its errors may be among the states."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec
from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import read_state, state_slices
from torquer.computer.estimation.measurements.measured import Measured
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    Direction,
    direction_measurement,
    is_new,
    is_usable,
    turn_to_now,
    vector_measurement,
)
from torquer.computer.estimation.mounting import without_mounting
from torquer.computer.estimation.triad import field_at
from torquer.maths.geometry.quaternion import read_quaternion, rotate_inverse
from torquer.maths.geometry.vec3 import dot, norm, read_vector, sub

#: Square [T^2] below which a reading is no field.
_NO_FIELD = 1e-30
#: Part of the field by which a reading may be off in magnitude, besides its noise: scale factors
#: and models that users leave out of the noise are far smaller, broken sensors are not.
_ODD = 0.1


class FieldNoise(NamedTuple):
    """Variance of each component [T^2]."""

    r: float


@inlined
def measure_field(q, b_inertial, read, at, variance):
    """(z, H, R) of a reading [T, body], less its known errors, of a field [T, inertial].

    All three components if an error of the sensor is a state; else the direction. `at`: first rows
    of bias, scale factors and misalignment, 0 for none.
    """
    if max(at[0], at[1], at[2]) > 0:
        return vector_measurement(q, b_inertial, read, at, variance)
    return direction_measurement(q, b_inertial, read, variance)


@inlined
def errors_at(parameters):
    """First rows of bias, scale factors and misalignment in the covariance, 0 for none."""
    at = state_slices(parameters.prior)
    return (at.magnetometer_bias, at.magnetometer_scale, at.magnetometer_misalignment)


@inlined
def calibrate_reading(states, at, read):
    """A reading [T] without the errors of the sensor as they are known."""
    return without_mounting(states, at[1], at[2], sub(read, read_state(states, at[0])))


@inlined
def has_magnitude(read, b_inertial, sigma):
    """Whether a reading is about as large as the field; `sigma`: of a component [T]."""
    size = norm(b_inertial)
    return abs(norm(read) - size) <= _ODD * size + 6.0 * sigma


@inlined
def odd(inputs, parameters, m):
    """Whether a reading is not about as large as the field: a test that needs no attitude."""
    sigma = math.sqrt(m.r + parameters.prior.magnetometer_bias)
    return not has_magnitude(m.read, m.reference, sigma)


@inlined
def measure(inputs, parameters, memory, b, at_s, own, place, omega, walk):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    if not is_new(own.r, b, at_s, memory.read_s[place.channel]):
        return NO_MEASUREMENT
    at = errors_at(parameters)
    read = turn_to_now(omega, inputs.t_s - at_s, calibrate_reading(memory.states, at, b))
    return measure_field(read_quaternion(memory.q), field_at(inputs, at_s), read, at, own.r)


@inlined
def direction(inputs, parameters, b, at_s, own):
    """The latest reading as a direction, its errors as they are known at the start."""
    usable = is_usable(own.r, b, inputs.t_s - at_s, parameters.sensing.gap)
    prior, square = parameters.prior, max(dot(b, b), _NO_FIELD)
    mounting = prior.magnetometer_scale + prior.magnetometer_misalignment
    r = (own.r + prior.magnetometer_bias) / square + mounting
    return Direction(own.r > 0.0, usable, at_s, b, field_at(inputs, at_s), r)


@inlined
def expected(parameters, along, k, own, assumed, cell):
    """(z, H, R) of the field [T] where the filter assumes another."""
    q = read_quaternion(along.q[k])
    read = rotate_inverse(q, assumed)
    return measure_field(q, read_vector(along.b[k]), read, errors_at(parameters), own.r)


def visible(craft, seen):
    """The field is there all along a motion (k,)."""
    return np.ones(len(seen.q), bool)


class FieldKeys(Spec):
    """A filter's key of the magnetometer."""

    magnetometer_noise_nt: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation of each component of a magnetometer reading, errors of the field model
    included; given if the filter uses the magnetometer.
    """


def constants(keys) -> FieldNoise:
    """Constants for kernels."""
    return FieldNoise((1e-9 * (keys.magnetometer_noise_nt or 0.0)) ** 2)


MEASURED = Measured(
    "magnetometer",
    said="magnetometer",
    keys=FieldKeys,
    noise="magnetometer_noise_nt",
    constants=constants,
    measure=measure,
    expected=expected,
    visible=visible,
    missing="no usable reading of the magnetometer",
    direction=direction,
    reference="field",
    odd=odd,
    colour="BLUE",
)
