"""Whether sensors and motion are to be believed: what is isolated, what becomes uncertain.

See `torquer.computer.estimation.watch` for the tests; design/0010 for what was tried.
"""

import math

from torquer.compile.engine import inlined
from torquer.computer.estimation.channels import (
    count_channels,
    is_field_alone,
    is_odd,
    noise_of_directions,
    reads_number,
)
from torquer.computer.estimation.covariance import ATTITUDE, RATE_ERROR, mean_variance
from torquer.computer.estimation.isolation_states import NO_NUMBER, ODD, STUCK, USED
from torquer.computer.estimation.measurements.table import (
    DIRECTIONS,
    FIRST_CELL,
    UNITS_AT,
    VECTORS,
)
from torquer.computer.estimation.triad import CONTRADICTION_RAD
from torquer.computer.estimation.watch import GROWN_S, watch
from torquer.maths.geometry.quaternion import read_quaternion
from torquer.maths.geometry.vec3 import dot

#: Number of rejected readings in a row from which on something is wrong; by chance it is not.
_FEW = 3.0
#: Doubts of the motion less than this time [s] apart are one.
_APART_S = 10.0
#: The unrest of the rate (spectral density of its random walk, rad^2/s^3) is measured in this time
#: [s], and over below this value.
_CALM_S, _AT_REST = 150.0, 1e-11
#: Variance [rad^2] of an attitude that may be wrong altogether, as from the field alone.
_ANY_ATTITUDE = 1.0


@inlined
def isolate_what_is_no_number(inputs, sensing, memory):
    """Isolate the sensors whose latest reading is no number until they read one."""
    for channel in range(count_channels(sensing, memory)):
        is_number, status = reads_number(inputs, sensing, memory, channel), memory.isolated[channel]
        if status == USED and not is_number:
            memory.isolated[channel] = NO_NUMBER
        elif status == NO_NUMBER and is_number:
            memory.isolated[channel] = USED


@inlined
def judge(inputs, parameters, memory, m, sensor, rate_variances):
    """Whether the sensor seems to be sound, and the motion; tests that need no attitude.

    `rate_variances`: see `kalman.take_readings`. Signals of single cells are not
    tested.

    The motion is in doubt where a sensor that is not stuck turns in another way while its readings
    are being rejected; not if it turns by so much that others' readings would be rejected, too.
    """
    if FIRST_CELL <= sensor < UNITS_AT:
        return
    watched = memory.watched[sensor if sensor < UNITS_AT else sensor - UNITS_AT + VECTORS]
    q, rotation = read_quaternion(memory.q), read_quaternion(memory.rotation)
    now, attitude = memory.t_s, mean_variance(memory.covariance, ATTITUDE)
    doubted = _ANY_ATTITUDE if is_field_alone(parameters.sensing) else attitude
    variances = (attitude, rate_variances[0], rate_variances[1], doubted)
    turned = watch(watched, now, m, q, rotation, variances)
    odd, most = is_odd(inputs, parameters, memory, m, sensor), parameters.sensing.most_rejected
    status = sensor_status(
        memory.isolated[sensor], turned, odd, memory.rejected_in_a_row[sensor], most
    )
    if turned.moves:
        memory.missed[sensor] = turned.rate_error
    if status == USED and turned.moves:
        if turned.rate_error == 0.0:
            memory.rate_error = 0.0
        elif is_to_blame(inputs, parameters.sensing, memory, sensor, turned.rate_error):
            doubt_motion(memory, turned.rate_error)
    if status != memory.isolated[sensor]:
        memory.isolated[sensor] = status
        memory.rejected_in_a_row[sensor] = 0.0


@inlined
def sensor_status(status, turned, odd, in_a_row, most):
    """What a sensor is to the filter after a reading that is odd or not.

    A sensor is stuck until its readings move; so is one that has been odd for `most` readings.
    """
    if status == STUCK or turned.stuck:
        return USED if turned.moves and not odd else STUCK
    if odd:
        return ODD
    if status == ODD:
        return STUCK if in_a_row >= most and not turned.moves else USED
    return status


@inlined
def is_to_blame(inputs, sensing, memory, sensor, rate_error):
    """Whether the motion is wrong by so much [rad/s], or the sensor that shows it.

    The readings are being rejected; an error that others would notice, too, they do notice.
    """
    if memory.rejected_in_a_row[sensor] < _FEW:
        return False
    b = inputs.ephemeris.b_inertial_t
    noticed = CONTRADICTION_RAD + 6.0 * math.sqrt(noise_of_directions(sensing, dot(b, b)))
    large = rate_error * GROWN_S > noticed
    return not (large and others_agree(inputs, sensing, memory, sensor))


@inlined
def is_broken(memory, sensor):
    """Whether a sensor's readings are those of a broken one, whatever the attitude."""
    return memory.isolated[sensor] in (STUCK, ODD)


@inlined
def others_agree(inputs, sensing, memory, sensor):
    """Whether the readings of another sensor have been accepted of late and turn as propagated."""
    return directions_in_agreement(inputs, sensing, memory, sensor) > 0


@inlined
def directions_in_agreement(inputs, sensing, memory, sensor):
    """Number of directions by other sensors that agree with the filter.

    Their readings have been accepted of late and turn as propagated. A star tracker gives two, all
    Sun cells together give one; so do several devices of a kind.
    """
    count = cells = 0
    for k in range(UNITS_AT):
        if k != sensor and agrees(inputs, sensing, memory, k):
            if k >= FIRST_CELL:
                cells = 1
            else:
                count += DIRECTIONS[k]
        elif k < FIRST_CELL and unit_agrees(inputs, sensing, memory, sensor, k):
            count += DIRECTIONS[k]
    return count + cells


@inlined
def agrees(inputs, sensing, memory, k):
    """Whether a channel's readings have been accepted of late and turn as propagated."""
    recent = inputs.t_s - memory.read_s[k] <= sensing.gap
    accepted = memory.isolated[k] == USED and memory.rejected_in_a_row[k] == 0.0
    return recent and accepted and memory.missed[k] == 0.0


@inlined
def unit_agrees(inputs, sensing, memory, sensor, kind):
    """Whether another one of several devices of a kind agrees."""
    found = False
    for u in range(memory.unit_constants.shape[0]):
        k = UNITS_AT + u
        if k != sensor and memory.unit_constants[u, 0] == kind:
            found = found or agrees(inputs, sensing, memory, k)
    return found


@inlined
def doubt_motion(memory, rate_error):
    """The propagated rate is wrong by so much [rad/s]: now, and again and again if so before.

    From the third time on the rate is a random walk of the size that explains them.
    """
    t_s, doubted_s = memory.t_s, memory.doubted_s
    memory.rate_error = rate_error
    if t_s - doubted_s[1] > _APART_S:
        memory.unrest = max(memory.unrest, rate_error * rate_error / (t_s - doubted_s[0]))
        doubted_s[0], doubted_s[1] = doubted_s[1], t_s


@inlined
def widen(memory, dt):
    """Allow for a motion that is not the body's: see `torquer.computer.estimation.watch`."""
    p, variance = memory.covariance, memory.rate_error * memory.rate_error
    if variance > 0.0:
        for i in range(3):
            p[i, i] += variance * GROWN_S * GROWN_S
            k = RATE_ERROR + i
            p[k, k] = max(p[k, k], variance)
    if memory.unrest > 0.0:
        for i in range(RATE_ERROR, RATE_ERROR + 3):
            p[i, i] += memory.unrest * dt
        # in a consistent filter the corrections are as large as what the random walk adds
        found = memory.rate_corrected / (3.0 * dt) if dt > 0.0 else memory.unrest
        memory.unrest += min(dt / _CALM_S, 1.0) * (found - memory.unrest)
        if memory.unrest < _AT_REST:
            memory.unrest = 0.0
    memory.rate_corrected = 0.0
