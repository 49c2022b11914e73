"""Magnetometer: the field [T] in body axes; its bias may be among the states."""

from torquer.compile.engine import inlined
from torquer.estimation.covariance import slices_of, state_of
from torquer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    as_of_now,
    biased_measurement,
    direction_measurement,
    is_new,
)
from torquer.estimation.triad import field_at, quaternion_of
from torquer.geometry.quaternion import rotate_inverse
from torquer.geometry.vec3 import add, sub

#: Number of the sensor in a filter's memory.
MAGNETOMETER = 0


@inlined
def of_field(q, b_inertial, read, bias, at, variance):
    """(z, H, R) of a reading [T, body] of a field [T, inertial].

    All three components if the bias is a state, from column `at` on; else (0) the direction.
    """
    predicted = rotate_inverse(q, b_inertial)
    if at > 0:
        return biased_measurement(predicted, read, bias, at, variance)
    return direction_measurement(predicted, read, variance)


@inlined
def magnetometer(inputs, parameters, memory, omega):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    b, at_s, r = inputs.b_body_t, inputs.read_at.magnetometer_s, parameters.sensing.r_field
    if not is_new(r, b, at_s, memory.read_s[MAGNETOMETER]):
        return NO_MEASUREMENT
    at = slices_of(parameters.prior).magnetometer_bias
    bias = state_of(memory.states, at)
    read = add(as_of_now(omega, inputs.t_s - at_s, sub(b, bias)), bias)
    return of_field(quaternion_of(memory.q), field_at(inputs, at_s), read, bias, at, r)
