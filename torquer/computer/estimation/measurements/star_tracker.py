"""Star tracker: the whole attitude, with other noise about its boresight than across it."""

import math

from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import RATE_ERROR, mat_scale
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    STAR_CHANNEL,
    Measurement,
    frame_across,
)
from torquer.computer.estimation.triad import rate_between, read_quaternion
from torquer.maths.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    normalise,
    rotate_inverse,
)
from torquer.maths.geometry.vec3 import dot, scale

#: A direction (inertial) that stands for the stars where readings are watched: about it no
#: satellite spins for long.
_STAR = (0.48, 0.6, 0.64)
#: Number of steps whose rotation is kept, to take late readings as of their time.
PAST = 16


@inlined
def is_attitude(variance, q, t_s, since_s):
    """Whether a star tracker is used, its reading an attitude and taken after `since_s`."""
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    return variance > 0.0 and t_s > since_s and 0.0 < square < math.inf


@inlined
def keep_rotation(memory):
    """Keep the rotation propagated until now, in place of the oldest that is kept."""
    k = int(memory.past_next)
    row = memory.past[k]
    row[0] = memory.t_s
    row[1], row[2], row[3], row[4] = read_quaternion(memory.rotation)
    memory.past_next = float(k + 1) if k + 1 < PAST else 0.0


@inlined
def turn_since(memory, since_s, omega):
    """Rotation (a quaternion) propagated since an earlier time.

    Between two steps the rate is steady; before the first one kept it is omega.
    """
    past, next_s, later = memory.past, memory.t_s, read_quaternion(memory.rotation)
    k, turn, left = int(memory.past_next), (0.0, 0.0, 0.0, 1.0), True
    for _ in range(PAST):
        k = k - 1 if k > 0 else PAST - 1
        row = past[k]
        if left and -math.inf < row[0] < next_s:
            earlier = (row[1], row[2], row[3], row[4])
            share = min((next_s - since_s) / (next_s - row[0]), 1.0)
            turned = scale(share, rate_between(earlier, later, 1.0))
            turn = multiply(from_rotation_vector(turned), turn)
            next_s, later, left = row[0], earlier, row[0] > since_s
    if left and next_s > since_s:
        turn = multiply(from_rotation_vector(scale(next_s - since_s, omega)), turn)
    return turn


@inlined
def measure_attitude(q, read, sensing, lever, since):
    """(z, H, R) of an attitude read: the rotation to it from the filter's, across and about.

    The three components are scaled to one variance, the greater one. `lever` [s]: what the error of
    the rate is multiplied by in a late reading, which has no part of it since; `since`: see
    `Measurement`.
    """
    turn, b = rate_between(q, read, 1.0), sensing.star_boresight
    r = max(sensing.r_star, sensing.r_star_about)
    t, u = frame_across(b)
    factor = math.sqrt(r / sensing.r_star)
    rows = (scale(factor, t), scale(factor, u), scale(math.sqrt(r / sensing.r_star_about), b))
    z = (dot(rows[0], turn), dot(rows[1], turn), dot(rows[2], turn))
    seen = rotate_inverse(read, _STAR)
    at = (RATE_ERROR if lever != 0.0 else 0, 0, 0)
    others = (mat_scale(lever, rows), rows, rows)
    return Measurement(z, rows, others, at, r, 3, seen, _STAR, since)


@inlined
def star_tracker(inputs, parameters, memory, omega, walk):
    """(z, H, R) of the latest reading, if it is new, as of now.

    A tracker is so accurate that a rate times its reading's age would not do: the reading is turned
    as the filter has propagated its attitude since, with omega before the first step kept. `walk`:
    growth of the variance of the propagated rotation by white noise [rad^2/s].
    """
    read, at_s, sensing = (
        inputs.q_body_to_inertial,
        inputs.read_at.attitude_sensor_s,
        parameters.sensing,
    )
    if not is_attitude(sensing.r_star, read, at_s, memory.read_s[STAR_CHANNEL]):
        return NO_MEASUREMENT
    age = max(inputs.t_s - at_s, 0.0)
    turn = turn_since(memory, at_s, omega) if age > 0.0 else (0.0, 0.0, 0.0, 1.0)
    now = normalise(multiply(read, turn))
    # an error of the gyro turns the filter the other way
    lever = -age if parameters.prior.rate > 0.0 else age
    return measure_attitude(read_quaternion(memory.q), now, sensing, lever, age * walk)
