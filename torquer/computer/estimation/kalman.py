"""What the Kalman filters share: one step, and its gate.

The filters are multiplicative: a quaternion is estimated, and a small rotation from it, which is
put back into the quaternion after every measurement. E. Lefferts, F. Markley, M. Shuster, 'Kalman
filtering for spacecraft attitude estimation' (1982).
"""

import math

from torquer.compile.engine import inlined, plugged
from torquer.computer.estimation.channels import (
    count_channels,
    isolate,
    isolate_units,
    keep_innovation,
    measure,
)
from torquer.computer.estimation.covariance import (
    ATTITUDE,
    RATE_ERROR,
    mean_variance,
    turn_attitude,
    update,
)
from torquer.computer.estimation.isolation import is_broken, isolate_what_is_no_number, judge, widen
from torquer.computer.estimation.isolation_states import USED
from torquer.computer.estimation.measurements.measurement import NO_MEASUREMENT, estimated_rows
from torquer.computer.estimation.measurements.star_tracker import keep_rotation
from torquer.computer.estimation.measurements.table import FIRST_CELL, UNITS_AT
from torquer.computer.estimation.starts import has_attitude
from torquer.computer.estimation.watch import follow
from torquer.computer.interface import UNKNOWN_ESTIMATE, Estimate
from torquer.maths.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    normalise,
    put_quaternion,
    read_quaternion,
)
from torquer.maths.geometry.vec3 import is_finite, put_vector

NOTHING = (math.nan, math.nan, math.nan)


@plugged
def step(inputs, parameters, memory, begin, propagate, rate_of):
    """Estimate of a filter: propagated to now, then updated by new readings of the sensors.

    What differs between filters: `propagate(inputs, parameters, memory, dt)`; `rate_of`, of the
    same arguments: (rate, bias of the gyro, mean variance of the rate's error that lasts, that of
    its noise over dt); `begin`: see
    `torquer.computer.estimation.starts.find_attitude`.
    """
    isolate_what_is_no_number(inputs, parameters.sensing, memory)
    if not has_attitude(inputs, parameters, memory, begin, rate_of):
        return nothing_estimated(inputs, parameters, memory)
    dt = inputs.t_s - memory.t_s
    advance(inputs, parameters, memory, dt, propagate, rate_of)
    return state_estimate(inputs, parameters, memory, dt, rate_of)


@plugged
def advance(inputs, parameters, memory, dt, propagate, rate_of):
    """Propagate a filter to now, dt seconds, and take the readings."""
    before = read_quaternion(memory.q)
    propagate(inputs, parameters, memory, dt)
    follow(memory.rotation, before, read_quaternion(memory.q))
    memory.t_s = inputs.t_s
    if parameters.sensing.star_tracker.r > 0.0:
        keep_rotation(memory)
    widen(memory, dt)
    omega, _, lasting, noise = rate_of(inputs, parameters, memory, dt)
    take_readings(inputs, parameters, memory, omega, (lasting, noise * dt), True)


@plugged
def state_estimate(inputs, parameters, memory, dt, rate_of):
    """What the filter states dt seconds after its last step."""
    omega, bias, lasting, noise = rate_of(inputs, parameters, memory, dt)
    sigma = math.sqrt(mean_variance(memory.covariance, ATTITUDE))
    q, sigma_rate = read_quaternion(memory.q), math.sqrt(lasting + noise)
    wrong, units = isolate(inputs, parameters, memory), isolate_units(memory)
    return Estimate(memory.t_s, q, omega, bias, sigma, sigma_rate, wrong, units)


@inlined
def nothing_estimated(inputs, parameters, memory):
    """The estimate of a filter without an attitude: which sensors it judges to be wrong."""
    e = UNKNOWN_ESTIMATE
    nothing, bias = e.omega_body_rad_s, e.gyro_bias_rad_s
    wrong, units = isolate(inputs, parameters, memory), isolate_units(memory)
    q = e.q_body_to_inertial
    return Estimate(e.t_s, q, nothing, bias, e.sigma_rad, e.sigma_rad_s, wrong, units)


@inlined
def latest(inputs, parameters, memory, sensor, omega, walk):
    """(z, H, R) of a sensor's latest reading and its time, as `measure`; none without a model."""
    m, read_s = measure(inputs, parameters, memory, sensor, omega, walk)
    if not is_finite(m.reference):
        m = NO_MEASUREMENT
    return m, read_s


@inlined
def take_readings(inputs, parameters, memory, omega, rate_variances, judged):
    """Update by each sensor that has been read since; the body turns with omega.

    `rate_variances`: of the rate's error that lasts [rad^2/s^2], and growth of that of the
    propagated rotation by white noise [rad^2/s]; `judged`: whether the sensors and the motion are
    tested, too.
    """
    for sensor in range(count_channels(parameters.sensing, memory)):
        m, read_s = latest(inputs, parameters, memory, sensor, omega, rate_variances[1])
        put_vector(memory.innovation_cell, NOTHING)
        if m.count > 0:
            memory.read_s[sensor] = read_s
            if judged:
                judge(inputs, parameters, memory, m, sensor, rate_variances)
            take(parameters.sensing, memory, m, sensor)
        keep_innovation(memory, sensor)


@inlined
def take(sensing, memory, m, sensor):
    """Update by a sensor's measurement, and correct the states, unless it is rejected.

    A sensor that is isolated because it contradicts the others is still compared with the filter,
    and used again once it agrees.
    """
    row = memory.rejected_in_a_row
    if is_broken(memory, sensor):
        memory.rejected += 1.0
        row[sensor] += 1.0
        return
    gate = sensing.gate_3 if m.count == 3 else sensing.gate_2
    if FIRST_CELL <= sensor < UNITS_AT:
        gate = sensing.gate_1
    used = gate if memory.isolated[sensor] == USED else -1.0
    p, gain, correction = memory.covariance, memory.gain, memory.correction
    nis, accepted, e = update(p, gain, correction, m, used, estimated_rows(sensing, p))
    put_vector(memory.innovation_cell, (e[0], e[1], e[2] if m.count == 3 else math.nan))
    if accepted:
        row[sensor] = 0.0
        put_back(memory)
        return
    memory.rejected += 1.0
    row[sensor] = min(row[sensor], 0.0) - 1.0 if nis <= gate else max(row[sensor], 0.0) + 1.0
    if row[sensor] <= -sensing.most_rejected:
        memory.isolated[sensor] = USED
        row[sensor] = 0.0


@inlined
def put_back(memory):
    """Move the change of the states into quaternion and states; refer the error to the new axes."""
    c = memory.correction
    turn = from_rotation_vector((c[0], c[1], c[2]))
    turn_attitude(memory.covariance, turn)
    put_quaternion(memory.q, normalise(multiply(read_quaternion(memory.q), turn)))
    for i in range(3, c.shape[0]):
        memory.states[i - 3] += c[i]
    for i in range(RATE_ERROR, RATE_ERROR + 3):
        memory.rate_corrected += c[i] * c[i]
