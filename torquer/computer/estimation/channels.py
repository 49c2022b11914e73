"""What a filter does with each of its channels: one for each device that it measures with.

Made of the table of devices by `docs/made_code.py`: do not edit.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.estimation.isolation_states import USED
from torquer.computer.estimation.measurements import (
    fine_sun_sensor,
    horizon_sensor,
    magnetometer,
    star_tracker,
    sun_cells,
    sun_sensors,
)
from torquer.computer.estimation.measurements.measured import Place
from torquer.computer.estimation.measurements.measurement import NO_DIRECTION, NO_MEASUREMENT
from torquer.maths.geometry.vec3 import is_finite, put_vector, read_vector


class Sensing(NamedTuple):
    """Noise of the sensors as filters assume it, and limits beyond which filters reject or restart.

    For each device its constants (`r`: variance of a component, 0 for one that is not used).
    `after_last`: number after that of the last channel used; `gate_1` to `gate_3`: greatest
    normalised innovations squared of 1 to 3 components; `lost`: greatest sum of the attitude's
    variances [rad^2]; `most_rejected`: number of readings rejected one after another, `gap`: time
    without a step [s], after which the filter starts again; `has_gyro`: 1 for a filter whose motion
    is that of a gyro, else 0; `considered`: first row of the covariance that is not estimated, only
    considered, 0 for none.
    """

    magnetometer: magnetometer.FieldNoise
    sun: sun_sensors.SunNoise
    star_tracker: star_tracker.StarNoise
    horizon: horizon_sensor.HorizonNoise
    fine_sun: fine_sun_sensor.FineSunNoise
    sun_cells: sun_cells.CellNoise
    after_last: float
    gate_1: float
    gate_2: float
    gate_3: float
    lost: float
    most_rejected: float
    gap: float
    has_gyro: float
    considered: float


@inlined
def is_unit(memory, channel):
    """Whether a channel is that of one of several devices.

    Where there are none, which is known when the filter is compiled, nothing is left of what is
    for them: 84 readings would be loaded in each step, and kept for where one might be asked for.
    """
    return memory.unit_constants.shape[0] > 1 and channel >= 11


@inlined
def kind_of(memory, channel):
    """The channel whose kernels serve a channel: its own, or that of its kind; -1 for none."""
    return int(memory.unit_constants[channel - 11, 0]) if is_unit(memory, channel) else channel


@inlined
def count_channels(sensing, memory):
    """Number after that of the last channel used, of those that there are."""
    return min(int(sensing.after_last), memory.isolated.shape[0])


@inlined
def magnetometer_constants(sensing, memory, channel):
    """Constants of a device, or of one of several."""
    if not is_unit(memory, channel):
        return sensing.magnetometer
    u = memory.unit_constants[channel - 11]
    return magnetometer.FieldNoise(u[1])


@inlined
def sun_constants(sensing, memory, channel):
    """Constants of a device, or of one of several."""
    if not is_unit(memory, channel):
        return sensing.sun
    u = memory.unit_constants[channel - 11]
    return sun_sensors.SunNoise(u[1])


@inlined
def star_tracker_constants(sensing, memory, channel):
    """Constants of a device, or of one of several."""
    if not is_unit(memory, channel):
        return sensing.star_tracker
    u = memory.unit_constants[channel - 11]
    return star_tracker.StarNoise(u[1], u[2], (u[3], u[4], u[5]))


@inlined
def horizon_constants(sensing, memory, channel):
    """Constants of a device, or of one of several."""
    if not is_unit(memory, channel):
        return sensing.horizon
    u = memory.unit_constants[channel - 11]
    return horizon_sensor.HorizonNoise(u[1])


@inlined
def fine_sun_constants(sensing, memory, channel):
    """Constants of a device, or of one of several."""
    if not is_unit(memory, channel):
        return sensing.fine_sun
    u = memory.unit_constants[channel - 11]
    return fine_sun_sensor.FineSunNoise(
        u[1], ((u[2], u[3], u[4]), (u[5], u[6], u[7]), (u[8], u[9], u[10]))
    )


@inlined
def reading_of(inputs, memory, channel, read_s, v):
    """(Time, six numbers) of the latest reading of a device, or of one of several."""
    found_s, found = read_s, v
    if is_unit(memory, channel):
        u = inputs.units[channel - 11]
        found_s, found = u[0], (u[1], u[2], u[3], u[4], u[5], u[6])
    return found_s, found


@inlined
def measure(inputs, parameters, memory, channel, omega, walk):
    """((z, H, R) of the latest reading if it is new, when it was taken)."""
    sensing, at, kind = parameters.sensing, inputs.read_at, kind_of(memory, channel)
    m, taken_s = NO_MEASUREMENT, 0.0
    if kind == 0:
        taken_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.magnetometer_s,
            (inputs.b_body_t[0], inputs.b_body_t[1], inputs.b_body_t[2], 0.0, 0.0, 0.0),
        )
        if channel >= 11 or memory.by_units[0] == 0.0:
            m = magnetometer.measure(
                inputs,
                parameters,
                memory,
                (v[0], v[1], v[2]),
                taken_s,
                magnetometer_constants(sensing, memory, channel),
                Place(channel, 0),
                omega,
                walk,
            )
    elif kind == 1:
        taken_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.sun_sensors_s,
            (inputs.sun_body[0], inputs.sun_body[1], inputs.sun_body[2], 0.0, 0.0, 0.0),
        )
        if channel >= 11 or memory.by_units[1] == 0.0:
            m = sun_sensors.measure(
                inputs,
                parameters,
                memory,
                (v[0], v[1], v[2]),
                taken_s,
                sun_constants(sensing, memory, channel),
                Place(channel, 0),
                omega,
                walk,
            )
    elif kind == 2:
        taken_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.attitude_sensor_s,
            (
                inputs.q_body_to_inertial[0],
                inputs.q_body_to_inertial[1],
                inputs.q_body_to_inertial[2],
                inputs.q_body_to_inertial[3],
                0.0,
                0.0,
            ),
        )
        if channel >= 11 or memory.by_units[2] == 0.0:
            m = star_tracker.measure(
                inputs,
                parameters,
                memory,
                (v[0], v[1], v[2], v[3]),
                taken_s,
                star_tracker_constants(sensing, memory, channel),
                Place(channel, 0),
                omega,
                walk,
            )
    elif kind == 3:
        taken_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.horizon_sensor_s,
            (inputs.nadir_body[0], inputs.nadir_body[1], inputs.nadir_body[2], 0.0, 0.0, 0.0),
        )
        if channel >= 11 or memory.by_units[3] == 0.0:
            m = horizon_sensor.measure(
                inputs,
                parameters,
                memory,
                (v[0], v[1], v[2]),
                taken_s,
                horizon_constants(sensing, memory, channel),
                Place(channel, 0),
                omega,
                walk,
            )
    elif kind == 4:
        taken_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.fine_sun_sensor_s,
            (inputs.sun_tangents[0], inputs.sun_tangents[1], inputs.sun_tangents[2], 0.0, 0.0, 0.0),
        )
        if channel >= 11 or memory.by_units[4] == 0.0:
            m = fine_sun_sensor.measure(
                inputs,
                parameters,
                memory,
                (v[0], v[1], v[2]),
                taken_s,
                fine_sun_constants(sensing, memory, channel),
                Place(channel, 0),
                omega,
                walk,
            )
    elif 5 <= kind < 11:
        taken_s = at.sun_cells_s
        m = sun_cells.measure(
            inputs,
            parameters,
            memory,
            inputs.sun_cells,
            taken_s,
            sensing.sun_cells,
            Place(channel, channel - 5),
            omega,
            walk,
        )
    return m, taken_s


@inlined
def reads_number(inputs, sensing, memory, channel):
    """Whether a channel that is used reads a number; one that is blinded is sound."""
    is_number, kind = True, kind_of(memory, channel)
    if kind == 0:
        _, v = reading_of(
            inputs,
            memory,
            channel,
            0.0,
            (inputs.b_body_t[0], inputs.b_body_t[1], inputs.b_body_t[2], 0.0, 0.0, 0.0),
        )
        is_number = (channel == 0 and not sensing.magnetometer.r > 0.0) or math.isfinite(
            v[0] + v[1] + v[2]
        )
    elif kind == 1:
        _, v = reading_of(
            inputs,
            memory,
            channel,
            0.0,
            (inputs.sun_body[0], inputs.sun_body[1], inputs.sun_body[2], 0.0, 0.0, 0.0),
        )
        is_number = (channel == 1 and not sensing.sun.r > 0.0) or math.isfinite(v[0] + v[1] + v[2])
    elif kind == 2:
        _, v = reading_of(
            inputs,
            memory,
            channel,
            0.0,
            (
                inputs.q_body_to_inertial[0],
                inputs.q_body_to_inertial[1],
                inputs.q_body_to_inertial[2],
                inputs.q_body_to_inertial[3],
                0.0,
                0.0,
            ),
        )
        is_number = (
            (channel == 2 and not sensing.star_tracker.r > 0.0)
            or math.isnan(v[0])
            or math.isfinite(v[0] + v[1] + v[2] + v[3])
        )
    elif kind == 3:
        _, v = reading_of(
            inputs,
            memory,
            channel,
            0.0,
            (inputs.nadir_body[0], inputs.nadir_body[1], inputs.nadir_body[2], 0.0, 0.0, 0.0),
        )
        is_number = (channel == 3 and not sensing.horizon.r > 0.0) or math.isfinite(
            v[0] + v[1] + v[2]
        )
    elif kind == 4:
        _, v = reading_of(
            inputs,
            memory,
            channel,
            0.0,
            (inputs.sun_tangents[0], inputs.sun_tangents[1], inputs.sun_tangents[2], 0.0, 0.0, 0.0),
        )
        is_number = (channel == 4 and not sensing.fine_sun.r > 0.0) or math.isfinite(
            v[0] + v[1] + v[2]
        )
    elif 5 <= kind < 11:
        cell = channel - 5
        is_used = sensing.sun_cells.r > 0.0 and sensing.sun_cells.cells[cell][3] < 1.0
        is_number = not is_used or math.isfinite(inputs.sun_cells[cell])
    return is_number


@inlined
def keep_innovation(memory, channel):
    """Keep the latest innovation where those of its device are."""
    innovation = read_vector(memory.innovation_cell)
    if channel >= 11:
        put_vector(memory.innovation_units[channel - 11], innovation)
    elif channel >= 5:
        memory.innovation_sun_cells[channel - 5] = innovation[0]
    elif channel >= 4:
        put_vector(memory.innovation_fine_sun, innovation)
    elif channel >= 3:
        put_vector(memory.innovation_horizon, innovation)
    elif channel >= 2:
        put_vector(memory.innovation_star_tracker, innovation)
    elif channel >= 1:
        put_vector(memory.innovation_sun, innovation)
    elif channel >= 0:
        put_vector(memory.innovation_magnetometer, innovation)


@inlined
def read_direction(inputs, parameters, memory, channel):
    """The latest reading of a sensor of directions; of any other it is not used."""
    sensing, at, kind = parameters.sensing, inputs.read_at, kind_of(memory, channel)
    found = NO_DIRECTION
    if kind == 0:
        read_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.magnetometer_s,
            (inputs.b_body_t[0], inputs.b_body_t[1], inputs.b_body_t[2], 0.0, 0.0, 0.0),
        )
        found = magnetometer.direction(
            inputs,
            parameters,
            (v[0], v[1], v[2]),
            read_s,
            magnetometer_constants(sensing, memory, channel),
        )
    elif kind == 1:
        read_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.sun_sensors_s,
            (inputs.sun_body[0], inputs.sun_body[1], inputs.sun_body[2], 0.0, 0.0, 0.0),
        )
        found = sun_sensors.direction(
            inputs, parameters, (v[0], v[1], v[2]), read_s, sun_constants(sensing, memory, channel)
        )
    elif kind == 3:
        read_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.horizon_sensor_s,
            (inputs.nadir_body[0], inputs.nadir_body[1], inputs.nadir_body[2], 0.0, 0.0, 0.0),
        )
        found = horizon_sensor.direction(
            inputs,
            parameters,
            (v[0], v[1], v[2]),
            read_s,
            horizon_constants(sensing, memory, channel),
        )
    elif kind == 4:
        read_s, v = reading_of(
            inputs,
            memory,
            channel,
            at.fine_sun_sensor_s,
            (inputs.sun_tangents[0], inputs.sun_tangents[1], inputs.sun_tangents[2], 0.0, 0.0, 0.0),
        )
        found = fine_sun_sensor.direction(
            inputs,
            parameters,
            (v[0], v[1], v[2]),
            read_s,
            fine_sun_constants(sensing, memory, channel),
        )
    elif kind == 5:
        found = sun_cells.direction(
            inputs, parameters, inputs.sun_cells, at.sun_cells_s, sensing.sun_cells
        )
    return found


@inlined
def is_odd(inputs, parameters, memory, m, channel):
    """Whether a measurement cannot be, whatever the attitude."""
    odd, kind = False, kind_of(memory, channel)
    if kind == 0:
        odd = magnetometer.odd(inputs, parameters, m)
    elif kind == 1:
        odd = sun_sensors.odd(inputs, parameters, m)
    elif kind == 4:
        odd = fine_sun_sensor.odd(inputs, parameters, m)
    return odd


@inlined
def is_field_alone(sensing):
    """Whether a filter uses the magnetometer alone."""
    others = (
        sensing.sun.r
        + sensing.star_tracker.r
        + sensing.horizon.r
        + sensing.fine_sun.r
        + sensing.sun_cells.r
    )
    return others == 0.0 and sensing.magnetometer.r > 0.0


@inlined
def noise_of_directions(sensing, b):
    """Sum of the variances [rad^2] of all directions; `b`: square of the field [T^2]."""
    return (
        sensing.sun.r
        + sensing.horizon.r
        + sensing.fine_sun.r
        + sensing.sun_cells.r
        + sensing.magnetometer.r / b
    )


@inlined
def is_isolated(memory, channel, after):
    """1 if a device is judged to be wrong: one of its channels, or each of several; else 0."""
    wrong = 0.0
    for k in range(channel, after):
        wrong = 1.0 if memory.isolated[k] != USED else wrong
    several = sound = 0
    for u in range(memory.unit_constants.shape[0]):
        if memory.unit_constants[u, 0] == channel:
            several += 1
            sound += 1 if memory.isolated[11 + u] == USED else 0
    return wrong if several == 0 else (1.0 if sound == 0 else 0.0)


@inlined
def isolate(inputs, parameters, memory):
    """Which sensors the filter judges to be wrong, as `Estimate` has them."""
    doubtful = memory.rate_error > 0.0 or memory.unrest > 0.0
    doubtful = doubtful or not is_finite(inputs.omega_body_rad_s)
    gyro = parameters.sensing.has_gyro if doubtful else 0.0
    return (
        is_isolated(memory, 0, 1),
        0.0,
        gyro,
        is_isolated(memory, 1, 2),
        is_isolated(memory, 2, 3),
        0.0,
        is_isolated(memory, 3, 4),
        is_isolated(memory, 5, 11),
        0.0,
        is_isolated(memory, 4, 5),
        0.0,
    )


@inlined
def isolate_units(memory):
    """Which of several devices of a kind the filter judges to be wrong."""
    return (
        1.0 if memory.isolated[11] != USED else 0.0,
        1.0 if memory.isolated[12] != USED else 0.0,
        1.0 if memory.isolated[13] != USED else 0.0,
        1.0 if memory.isolated[14] != USED else 0.0,
        1.0 if memory.isolated[15] != USED else 0.0,
        1.0 if memory.isolated[16] != USED else 0.0,
        1.0 if memory.isolated[17] != USED else 0.0,
        1.0 if memory.isolated[18] != USED else 0.0,
        1.0 if memory.isolated[19] != USED else 0.0,
        1.0 if memory.isolated[20] != USED else 0.0,
        1.0 if memory.isolated[21] != USED else 0.0,
        1.0 if memory.isolated[22] != USED else 0.0,
    )


@inlined
def expect(parameters, along, k, channel, assumed):
    """(z, H, R) of what would be read at a place of a nominal motion.

    `assumed` (3,): the vector that the filter assumes of the surroundings.
    """
    sensing, m = parameters.sensing, NO_MEASUREMENT
    if channel == 0 and sensing.magnetometer.r > 0.0 and along.visible[0, k]:
        m = magnetometer.expected(parameters, along, k, sensing.magnetometer, assumed, channel - 0)
    if channel == 1 and sensing.sun.r > 0.0 and along.visible[1, k]:
        m = sun_sensors.expected(parameters, along, k, sensing.sun, assumed, channel - 1)
    if channel == 2 and sensing.star_tracker.r > 0.0 and along.visible[2, k]:
        m = star_tracker.expected(parameters, along, k, sensing.star_tracker, assumed, channel - 2)
    if channel == 3 and sensing.horizon.r > 0.0 and along.visible[3, k]:
        m = horizon_sensor.expected(parameters, along, k, sensing.horizon, assumed, channel - 3)
    if channel == 4 and sensing.fine_sun.r > 0.0 and along.visible[4, k]:
        m = fine_sun_sensor.expected(parameters, along, k, sensing.fine_sun, assumed, channel - 4)
    if channel >= 5 and sensing.sun_cells.r > 0.0 and along.visible[5, k]:
        m = sun_cells.expected(parameters, along, k, sensing.sun_cells, assumed, channel - 5)
    return m
