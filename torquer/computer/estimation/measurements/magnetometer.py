"""Magnetometer: the field [T] in body axes; its errors may be among the states."""

import math

from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import read_state, state_slices
from torquer.computer.estimation.measurements.measurement import (
    FIELD_CHANNEL,
    NO_MEASUREMENT,
    direction_measurement,
    is_new,
    turn_to_now,
    vector_measurement,
)
from torquer.computer.estimation.mounting import without_mounting
from torquer.computer.estimation.triad import field_at, read_quaternion
from torquer.maths.geometry.vec3 import norm, sub

#: Part of the field by which a reading may be off in magnitude, besides its noise: scale factors
#: and models that users leave out of the noise are far smaller, broken sensors are not.
_ODD = 0.1


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
def has_field_magnitude(parameters, read, b_inertial):
    """Whether a reading is about as large as the field: a test that needs no attitude."""
    sigma = math.sqrt(parameters.sensing.r_field + parameters.prior.magnetometer_bias)
    return has_magnitude(read, b_inertial, sigma)


@inlined
def magnetometer(inputs, parameters, memory, omega):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    b, at_s, r = inputs.b_body_t, inputs.read_at.magnetometer_s, parameters.sensing.r_field
    if not is_new(r, b, at_s, memory.read_s[FIELD_CHANNEL]):
        return NO_MEASUREMENT
    at = errors_at(parameters)
    read = turn_to_now(omega, inputs.t_s - at_s, calibrate_reading(memory.states, at, b))
    return measure_field(read_quaternion(memory.q), field_at(inputs, at_s), read, at, r)
