"""What the Kalman filters share: one step, and its gate.

The filters are multiplicative: a quaternion is estimated, and a small rotation from it, which is
put back into the quaternion after every measurement. E. Lefferts, F. Markley, M. Shuster, 'Kalman
filtering for spacecraft attitude estimation' (1982).
"""

import math

from torquer.compile.engine import inlined, plugged
from torquer.computer.estimation.covariance import (
    ATTITUDE,
    RATE_ERROR,
    mean_variance,
    turn_attitude,
    update,
)
from torquer.computer.estimation.isolation import USED, is_broken, judge, widen
from torquer.computer.estimation.measurements.horizon_sensor import horizon_sensor
from torquer.computer.estimation.measurements.magnetometer import magnetometer
from torquer.computer.estimation.measurements.measurement import (
    CHANNELS,
    FIELD_CHANNEL,
    FIRST_CELL,
    NADIR_CHANNEL,
    STAR_CHANNEL,
    SUN_CHANNEL,
    estimated_rows,
)
from torquer.computer.estimation.measurements.star_tracker import keep_rotation, star_tracker
from torquer.computer.estimation.measurements.sun_cells import put_earthlight, sun_cell
from torquer.computer.estimation.measurements.sun_sensors import sun_sensors
from torquer.computer.estimation.starts import has_attitude
from torquer.computer.estimation.triad import (
    put_quaternion,
    read_quaternion,
)
from torquer.computer.estimation.watch import follow
from torquer.computer.interface import UNKNOWN_ESTIMATE, Estimate
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, normalise
from torquer.maths.geometry.vec3 import put_vector

NOTHING = (math.nan, math.nan, math.nan)


@plugged
def step(inputs, parameters, memory, begin, propagate, rate_of):
    """Estimate of a filter: propagated to now, then updated by new readings of the sensors.

    What differs between filters: `propagate(inputs, parameters, memory, dt)`; `rate_of`, of the
    same arguments: (rate, bias of the gyro, mean variance of the rate's error that lasts, that of
    its noise over dt); `begin`: see
    `torquer.computer.estimation.starts.find_attitude`.
    """
    if not has_attitude(inputs, parameters, memory, begin, rate_of):
        return nothing_estimated(parameters, memory)
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
    if parameters.sensing.r_star > 0.0:
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
    return Estimate(memory.t_s, q, omega, bias, sigma, sigma_rate, isolate(parameters, memory))


@inlined
def isolate(parameters, memory):
    """Which sensors the filter judges to be wrong, as `Estimate` has them."""
    field = 1.0 if memory.isolated[FIELD_CHANNEL] != USED else 0.0
    sun = 1.0 if memory.isolated[SUN_CHANNEL] != USED else 0.0
    stars = 1.0 if memory.isolated[STAR_CHANNEL] != USED else 0.0
    horizon, cells = 1.0 if memory.isolated[NADIR_CHANNEL] != USED else 0.0, 0.0
    for k in range(FIRST_CELL, CHANNELS):
        cells = 1.0 if memory.isolated[k] != USED else cells
    doubtful = memory.rate_error > 0.0 or memory.unrest > 0.0
    gyro = parameters.sensing.has_gyro if doubtful else 0.0
    return (field, 0.0, gyro, sun, stars, 0.0, horizon, cells)


@inlined
def nothing_estimated(parameters, memory):
    """The estimate of a filter without an attitude: which sensors it judges to be wrong."""
    e = UNKNOWN_ESTIMATE
    nothing, bias = e.omega_body_rad_s, e.gyro_bias_rad_s
    wrong = isolate(parameters, memory)
    return Estimate(e.t_s, e.q_body_to_inertial, nothing, bias, e.sigma_rad, e.sigma_rad_s, wrong)


@inlined
def take_readings(inputs, parameters, memory, omega, rate_variances, judged):
    """Update by each sensor that has been read since; the body turns with omega.

    `rate_variances`: of the rate's error that lasts [rad^2/s^2], and growth of that of the
    propagated rotation by white noise [rad^2/s]; `judged`: whether the sensors and the motion are
    tested, too.
    """
    at = inputs.read_at
    for sensor in range(int(parameters.sensing.after_last)):
        if sensor == FIELD_CHANNEL:
            m = magnetometer(inputs, parameters, memory, omega)
            read_s, innovation = at.magnetometer_s, memory.innovation_magnetometer
        elif sensor == SUN_CHANNEL:
            m = sun_sensors(inputs, parameters, memory, omega)
            read_s, innovation = at.sun_sensors_s, memory.innovation_sun
        elif sensor == STAR_CHANNEL:
            m = star_tracker(inputs, parameters, memory, omega, rate_variances[1])
            read_s, innovation = at.attitude_sensor_s, memory.innovation_star_tracker
        elif sensor == NADIR_CHANNEL:
            m = horizon_sensor(inputs, parameters, memory, omega)
            read_s, innovation = at.horizon_sensor_s, memory.innovation_horizon
        else:
            if sensor == FIRST_CELL:
                put_earthlight(inputs, parameters.sensing, memory)
            m = sun_cell(inputs, parameters, memory, sensor - FIRST_CELL, omega)
            read_s, innovation = at.sun_cells_s, memory.innovation_cell
        put_vector(innovation, NOTHING)
        if m.count > 0:
            memory.read_s[sensor] = read_s
            if judged:
                judge(inputs, parameters, memory, m, sensor, rate_variances)
            take(parameters.sensing, memory, m, sensor, innovation)
        if sensor >= FIRST_CELL:
            memory.innovation_sun_cells[sensor - FIRST_CELL] = innovation[0]


@inlined
def take(sensing, memory, m, sensor, innovation):
    """Update by a sensor's measurement, and correct the states, unless it is rejected.

    `innovation`: cells for the whitened innovation. A sensor that is isolated because it
    contradicts the others is still compared with the filter, and used again once it agrees.
    """
    row = memory.rejected_in_a_row
    if is_broken(memory, sensor):
        memory.rejected += 1.0
        row[sensor] += 1.0
        return
    gate = sensing.gate_3 if m.count == 3 else sensing.gate_2
    if sensor >= FIRST_CELL:
        gate = sensing.gate_1
    used = gate if memory.isolated[sensor] == USED else -1.0
    p, gain, correction = memory.covariance, memory.gain, memory.correction
    nis, accepted, e = update(p, gain, correction, m, used, estimated_rows(sensing, p))
    put_vector(innovation, (e[0], e[1], e[2] if m.count == 3 else math.nan))
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
