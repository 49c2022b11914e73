"""First stage of the magneto-gyroscopic system: from any attitude, by the field and its derivative.

W is the field that the magnetometer reads, in body axes; B the one that the computer calculates, in
t, w, s. Both pass the same filters, whose rate is an approximate derivative: so their lags cancel.
"""

import math

from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add, cross, scale, sub


@inlined
def filtered_component(low, rate, value, frequency, damping, interval_s):
    """(x, x') of x'' = w^2 (value - x) - 2 z w x' after an interval, the value constant in it.

    x' is the value behind w^2 p/(p^2 + 2 z w p + w^2), z < 1.
    """
    decay, ringing = damping * frequency, frequency * math.sqrt(1.0 - damping * damping)
    left, angle = math.exp(-decay * interval_s), ringing * interval_s
    off = low - value
    sine = math.sin(angle) / ringing
    after = left * (off * math.cos(angle) + (rate + decay * off) * sine)
    slope = left * (rate * math.cos(angle) - (frequency * frequency * off + decay * rate) * sine)
    return value + after, slope


@inlined
def filter_vector(low, rate, value, frequency, damping, interval_s):
    """Advance the filters of a vector, whose states are the cells `low` and `rate`."""
    for i in range(3):
        low[i], rate[i] = filtered_component(
            low[i], rate[i], value[i], frequency, damping, interval_s
        )


@inlined
def angle_function(reading, model, square):
    """U = (W x B)/B^2: the part normal to the field of the turn from t, w, s to the body."""
    return scale(1.0 / square, cross(reading, model))


@inlined
def rate_function(reading, reading_rate, model, model_rate, square):
    """V = (B x q_B - W x q_W)/B^2: the part normal to the field of the relative rate.

    q: approximate derivatives of the components of B in t, w, s and of W in the body.
    """
    return scale(1.0 / square, sub(cross(model, model_rate), cross(reading, reading_rate)))


@inlined
def capture_dipole(reading, u, v, square, angle_gain, rate_gain):
    """P = -(K W x U + N W x V)/B^2, whose torque is -K U - N V less its part along the field.

    K [N m], N [N m s], U [rad], V [rad/s] give A m^2 for fields in T; B^2 is that of the model.
    """
    wanted = add(scale(angle_gain, u), scale(rate_gain, v))
    return scale(-1.0 / square, cross(reading, wanted))
