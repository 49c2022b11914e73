"""Reading the devices that are due, one after another.

Made of the table of devices by `docs/made_code.py`: do not edit.
"""

from torquer.compile.arguments import Entry, entry_caller, record_at
from torquer.compile.engine import inlined
from torquer.simulation.loop.members import draw, drawn_for, each
from torquer.simulation.loop.readings import begin_reading, send3, send4, send6
from torquer.simulation.loop.state import local_in
from torquer.simulation.loop.timetable import ANY_UNIT, READ
from torquer.spacecraft.sensors import (
    attitude_sensor,
    fine_sun_sensor,
    gyro,
    horizon_sensor,
    integrating_gyro,
    magnetometer,
    own_sensor,
    search_coil,
    sun_cells,
    sun_sensor,
)
from torquer.spacecraft.sensors.device import Around


@inlined
def magnetometer_step(member, late, sky, t):
    """A reading of the magnetometer."""
    constants = member.constants.sensors.magnetometer
    here = begin_reading(member, 0, t)
    drawn_1 = drawn_for(member, 1)
    reading = magnetometer.read(constants, here, sky, drawn_1)
    send3(member, 0, late, t, reading)


@inlined
def read_magnetometer(members, plant, around, late):
    """Read the magnetometer of each member."""
    constants = plant.sensors.magnetometer
    draw(members, constants.noise_t, 0, 1)
    sky = magnetometer.field_around(constants, around)
    each(members, magnetometer_step, late, sky, around.t_s)


@inlined
def search_coil_step(member, late, sky, t):
    """A reading of the search coil."""
    constants = member.constants.sensors.search_coil
    here = begin_reading(member, 1, t)
    drawn_52 = drawn_for(member, 52)
    reading = search_coil.read(constants, here, sky, drawn_52)
    send3(member, 1, late, t, reading)


@inlined
def read_search_coil(members, plant, around, late):
    """Read the search coil of each member."""
    constants = plant.sensors.search_coil
    draw(members, constants.noise_t_s, 1, 52)
    sky = search_coil.field_and_rate(constants, around)
    each(members, search_coil_step, late, sky, around.t_s)


@inlined
def gyro_step(member, late, sky, t):
    """A reading of the gyro."""
    constants = member.constants.sensors.gyro
    here = begin_reading(member, 2, t)
    drawn_2 = drawn_for(member, 2)
    drawn_3 = drawn_for(member, 3)
    reading = gyro.read(constants, here, sky, drawn_2, drawn_3)
    send3(member, 2, late, t, reading)


@inlined
def read_gyro(members, plant, around, late):
    """Read the gyro of each member."""
    constants = plant.sensors.gyro
    draw(members, constants.noise_rad_s, 2, 2)
    draw(members, constants.drift_rad_s_sqrt_s, 2, 3)
    sky = gyro.nothing_around(constants, around)
    each(members, gyro_step, late, sky, around.t_s)


@inlined
def sun_sensors_step(member, late, sky, t):
    """A reading of the Sun sensors."""
    constants = member.constants.sensors.sun_sensors
    here = begin_reading(member, 3, t)
    drawn_4 = drawn_for(member, 4)
    reading = sun_sensor.read(constants, here, sky, drawn_4)
    send3(member, 3, late, t, reading)


@inlined
def read_sun_sensors(members, plant, around, late):
    """Read the Sun sensors of each member."""
    constants = plant.sensors.sun_sensors
    draw(members, constants.noise_rad, 3, 4)
    sky = sun_sensor.sunlight_around(constants, around)
    each(members, sun_sensors_step, late, sky, around.t_s)


@inlined
def attitude_sensor_step(member, late, sky, t):
    """A reading of the attitude sensor."""
    constants = member.constants.sensors.attitude_sensor
    here = begin_reading(member, 4, t)
    drawn_5 = drawn_for(member, 5)
    reading = attitude_sensor.read(constants, here, sky, drawn_5)
    send4(member, 4, late, t, reading)


@inlined
def read_attitude_sensor(members, plant, around, late):
    """Read the attitude sensor of each member."""
    constants = plant.sensors.attitude_sensor
    draw(members, max(constants.noise_rad, constants.boresight_noise_rad), 4, 5)
    sky = attitude_sensor.sky_around(constants, around)
    each(members, attitude_sensor_step, late, sky, around.t_s)


@inlined
def horizon_sensor_step(member, late, sky, t):
    """A reading of the horizon sensor."""
    constants = member.constants.sensors.horizon_sensor
    here = begin_reading(member, 6, t)
    drawn_9 = drawn_for(member, 9)
    reading = horizon_sensor.read(constants, here, sky, drawn_9)
    send3(member, 6, late, t, reading)


@inlined
def read_horizon_sensor(members, plant, around, late):
    """Read the horizon sensor of each member."""
    constants = plant.sensors.horizon_sensor
    draw(members, constants.noise_rad, 6, 9)
    sky = horizon_sensor.disc_around(constants, around)
    each(members, horizon_sensor_step, late, sky, around.t_s)


@inlined
def sun_cells_step(member, late, sky, t):
    """A reading of the Sun cells."""
    constants = member.constants.sensors.sun_cells
    here = begin_reading(member, 7, t)
    drawn_10 = drawn_for(member, 10)
    drawn_11 = drawn_for(member, 11)
    reading = sun_cells.read(constants, here, sky, drawn_10, drawn_11)
    send6(member, 7, late, t, reading)


@inlined
def read_sun_cells(members, plant, around, late):
    """Read the Sun cells of each member."""
    constants = plant.sensors.sun_cells
    draw(members, constants.noise, 7, 10)
    draw(members, constants.noise, 7, 11)
    sky = sun_cells.sunlight_around(constants, around)
    each(members, sun_cells_step, late, sky, around.t_s)


@inlined
def integrating_gyro_step(member, late, sky, t):
    """A reading of the integrating gyro."""
    constants = member.constants.sensors.integrating_gyro
    here = begin_reading(member, 8, t)
    drawn_12 = drawn_for(member, 12)
    drawn_13 = drawn_for(member, 13)
    drawn_14 = drawn_for(member, 14)
    reading = integrating_gyro.read(constants, here, sky, drawn_12, drawn_13, drawn_14)
    send3(member, 8, late, t, reading)


@inlined
def read_integrating_gyro(members, plant, around, late):
    """Read the integrating gyro of each member."""
    constants = plant.sensors.integrating_gyro
    draw(
        members,
        max(constants.angle_rad_sqrt_s, constants.markov_rad_s, constants.walk_rad_s_sqrt_s),
        8,
        12,
    )
    draw(
        members,
        max(constants.angle_rad_sqrt_s, constants.markov_rad_s, constants.walk_rad_s_sqrt_s),
        8,
        13,
    )
    draw(
        members,
        max(constants.angle_rad_sqrt_s, constants.markov_rad_s, constants.walk_rad_s_sqrt_s),
        8,
        14,
    )
    sky = integrating_gyro.nothing_around(constants, around)
    each(members, integrating_gyro_step, late, sky, around.t_s)


@inlined
def fine_sun_sensor_step(member, late, sky, t):
    """A reading of the fine Sun sensor."""
    constants = member.constants.sensors.fine_sun_sensor
    here = begin_reading(member, 9, t)
    drawn_15 = drawn_for(member, 15)
    reading = fine_sun_sensor.read(constants, here, sky, drawn_15)
    send3(member, 9, late, t, reading)


@inlined
def read_fine_sun_sensor(members, plant, around, late):
    """Read the fine Sun sensor of each member."""
    constants = plant.sensors.fine_sun_sensor
    draw(members, constants.noise, 9, 15)
    sky = fine_sun_sensor.sun_around(constants, around)
    each(members, fine_sun_sensor_step, late, sky, around.t_s)


@inlined
def own_sensor_step(member, late, sky, t):
    """A reading of the own sensor."""
    constants = member.constants.sensors.own_sensor
    here = begin_reading(member, 10, t)
    drawn_0 = drawn_for(member, 0)
    reading = own_sensor.read(constants, here, sky, drawn_0)
    send3(member, 10, late, t, reading)


@inlined
def read_own_sensor(members, plant, around, late):
    """Read the own sensor of each member."""
    constants = plant.sensors.own_sensor
    draw(members, constants.noise, 10, 0)
    sky = own_sensor.own_around(constants, around)
    each(members, own_sensor_step, late, sky, around.t_s)


@inlined
def read_usual(members, plant, around, late, actions):
    """Read what every satellite has and what is due of it, in the order of the numbers."""
    if actions & (READ << 0):
        read_magnetometer(members, plant, around, late)
    if actions & (READ << 2):
        read_gyro(members, plant, around, late)
    if actions & (READ << 4):
        read_attitude_sensor(members, plant, around, late)


@inlined
def magnetometers_of(rows, unit):
    """Constants of one of several: those in a row."""
    return magnetometer.MagnetometerSet(
        (
            (rows[unit, 0], rows[unit, 1], rows[unit, 2]),
            (rows[unit, 3], rows[unit, 4], rows[unit, 5]),
            (rows[unit, 6], rows[unit, 7], rows[unit, 8]),
        ),
        (rows[unit, 9], rows[unit, 10], rows[unit, 11]),
        rows[unit, 12],
        rows[unit, 13],
        rows[unit, 14],
        rows[unit, 15],
        rows[unit, 16],
        (
            (rows[unit, 17], rows[unit, 18], rows[unit, 19]),
            (rows[unit, 20], rows[unit, 21], rows[unit, 22]),
            (rows[unit, 23], rows[unit, 24], rows[unit, 25]),
        ),
        (
            (rows[unit, 26], rows[unit, 27], rows[unit, 28]),
            (rows[unit, 29], rows[unit, 30], rows[unit, 31]),
            (rows[unit, 32], rows[unit, 33], rows[unit, 34]),
            (rows[unit, 35], rows[unit, 36], rows[unit, 37]),
            (rows[unit, 38], rows[unit, 39], rows[unit, 40]),
            (rows[unit, 41], rows[unit, 42], rows[unit, 43]),
        ),
        (rows[unit, 44], rows[unit, 45], rows[unit, 46]),
    )


@inlined
def magnetometers_step(member, unit, row, late, sky, t):
    """A reading of one of several: magnetometer."""
    constants = magnetometers_of(member.constants.units.magnetometers, unit)
    here = begin_reading(member, row, t)
    drawn_0 = drawn_for(member, 16 + 3 * (row - 11) + 0)
    reading = magnetometer.read(constants, here, sky, drawn_0)
    send3(member, row, late, t, reading)


@inlined
def read_magnetometers(members, plant, around, late, actions, first):
    """Read those of several that are due, from number `first` on."""
    for unit in range(plant.unit_counts.magnetometers):
        row = first + unit
        if actions & (READ << row):
            constants = magnetometers_of(plant.units.magnetometers, unit)
            stream = 16 + 3 * (row - 11)
            draw(members, constants.noise_t, row, stream + 0)
            sky = magnetometer.field_around(constants, around)
            each(members, magnetometers_step, unit, row, late, sky, around.t_s)


@inlined
def gyros_of(rows, unit):
    """Constants of one of several: those in a row."""
    return gyro.GyroSet(
        (
            (rows[unit, 0], rows[unit, 1], rows[unit, 2]),
            (rows[unit, 3], rows[unit, 4], rows[unit, 5]),
            (rows[unit, 6], rows[unit, 7], rows[unit, 8]),
        ),
        (rows[unit, 9], rows[unit, 10], rows[unit, 11]),
        rows[unit, 12],
        rows[unit, 13],
        rows[unit, 14],
        rows[unit, 15],
    )


@inlined
def gyros_step(member, unit, row, late, sky, t):
    """A reading of one of several: gyro."""
    constants = gyros_of(member.constants.units.gyros, unit)
    here = begin_reading(member, row, t)
    drawn_0 = drawn_for(member, 16 + 3 * (row - 11) + 0)
    drawn_1 = drawn_for(member, 16 + 3 * (row - 11) + 1)
    reading = gyro.read(constants, here, sky, drawn_0, drawn_1)
    send3(member, row, late, t, reading)


@inlined
def read_gyros(members, plant, around, late, actions, first):
    """Read those of several that are due, from number `first` on."""
    for unit in range(plant.unit_counts.gyros):
        row = first + unit
        if actions & (READ << row):
            constants = gyros_of(plant.units.gyros, unit)
            stream = 16 + 3 * (row - 11)
            draw(members, constants.noise_rad_s, row, stream + 0)
            draw(members, constants.drift_rad_s_sqrt_s, row, stream + 1)
            sky = gyro.nothing_around(constants, around)
            each(members, gyros_step, unit, row, late, sky, around.t_s)


@inlined
def sun_heads_of(rows, unit):
    """Constants of one of several: those in a row."""
    return sun_sensor.SunHeadSet(
        (rows[unit, 0], rows[unit, 1], rows[unit, 2]),
        rows[unit, 3],
        (rows[unit, 4], rows[unit, 5], rows[unit, 6], rows[unit, 7]),
        rows[unit, 8],
        rows[unit, 9],
    )


@inlined
def sun_heads_step(member, unit, row, late, sky, t):
    """A reading of one of several: Sun sensors."""
    constants = sun_heads_of(member.constants.units.sun_heads, unit)
    here = begin_reading(member, row, t)
    drawn_0 = drawn_for(member, 16 + 3 * (row - 11) + 0)
    reading = sun_sensor.read_head(constants, here, sky, drawn_0)
    send3(member, row, late, t, reading)


@inlined
def read_sun_heads(members, plant, around, late, actions, first):
    """Read those of several that are due, from number `first` on."""
    for unit in range(plant.unit_counts.sun_heads):
        row = first + unit
        if actions & (READ << row):
            constants = sun_heads_of(plant.units.sun_heads, unit)
            stream = 16 + 3 * (row - 11)
            draw(members, constants.noise_rad, row, stream + 0)
            sky = sun_sensor.sunlight_around(constants, around)
            each(members, sun_heads_step, unit, row, late, sky, around.t_s)


@inlined
def star_trackers_of(rows, unit):
    """Constants of one of several: those in a row."""
    return attitude_sensor.AttitudeSensorSet(
        (rows[unit, 0], rows[unit, 1], rows[unit, 2], rows[unit, 3]),
        (rows[unit, 4], rows[unit, 5], rows[unit, 6]),
        rows[unit, 7],
        rows[unit, 8],
        rows[unit, 9],
        rows[unit, 10],
        rows[unit, 11],
        rows[unit, 12],
    )


@inlined
def star_trackers_step(member, unit, row, late, sky, t):
    """A reading of one of several: attitude sensor."""
    constants = star_trackers_of(member.constants.units.star_trackers, unit)
    here = begin_reading(member, row, t)
    drawn_0 = drawn_for(member, 16 + 3 * (row - 11) + 0)
    reading = attitude_sensor.read(constants, here, sky, drawn_0)
    send4(member, row, late, t, reading)


@inlined
def read_star_trackers(members, plant, around, late, actions, first):
    """Read those of several that are due, from number `first` on."""
    for unit in range(plant.unit_counts.star_trackers):
        row = first + unit
        if actions & (READ << row):
            constants = star_trackers_of(plant.units.star_trackers, unit)
            stream = 16 + 3 * (row - 11)
            draw(members, max(constants.noise_rad, constants.boresight_noise_rad), row, stream + 0)
            sky = attitude_sensor.sky_around(constants, around)
            each(members, star_trackers_step, unit, row, late, sky, around.t_s)


@inlined
def horizon_sensors_of(rows, unit):
    """Constants of one of several: those in a row."""
    return horizon_sensor.HorizonSensorSet(
        (rows[unit, 0], rows[unit, 1], rows[unit, 2]),
        (rows[unit, 3], rows[unit, 4], rows[unit, 5], rows[unit, 6]),
        rows[unit, 7],
        rows[unit, 8],
        rows[unit, 9],
        rows[unit, 10],
    )


@inlined
def horizon_sensors_step(member, unit, row, late, sky, t):
    """A reading of one of several: horizon sensor."""
    constants = horizon_sensors_of(member.constants.units.horizon_sensors, unit)
    here = begin_reading(member, row, t)
    drawn_0 = drawn_for(member, 16 + 3 * (row - 11) + 0)
    reading = horizon_sensor.read(constants, here, sky, drawn_0)
    send3(member, row, late, t, reading)


@inlined
def read_horizon_sensors(members, plant, around, late, actions, first):
    """Read those of several that are due, from number `first` on."""
    for unit in range(plant.unit_counts.horizon_sensors):
        row = first + unit
        if actions & (READ << row):
            constants = horizon_sensors_of(plant.units.horizon_sensors, unit)
            stream = 16 + 3 * (row - 11)
            draw(members, constants.noise_rad, row, stream + 0)
            sky = horizon_sensor.disc_around(constants, around)
            each(members, horizon_sensors_step, unit, row, late, sky, around.t_s)


@inlined
def integrating_gyros_of(rows, unit):
    """Constants of one of several: those in a row."""
    return integrating_gyro.IntegratingGyroSet(
        (
            (rows[unit, 0], rows[unit, 1], rows[unit, 2]),
            (rows[unit, 3], rows[unit, 4], rows[unit, 5]),
            (rows[unit, 6], rows[unit, 7], rows[unit, 8]),
        ),
        (rows[unit, 9], rows[unit, 10], rows[unit, 11]),
        rows[unit, 12],
        rows[unit, 13],
        rows[unit, 14],
        rows[unit, 15],
        rows[unit, 16],
        rows[unit, 17],
    )


@inlined
def integrating_gyros_step(member, unit, row, late, sky, t):
    """A reading of one of several: integrating gyro."""
    constants = integrating_gyros_of(member.constants.units.integrating_gyros, unit)
    here = begin_reading(member, row, t)
    drawn_0 = drawn_for(member, 16 + 3 * (row - 11) + 0)
    drawn_1 = drawn_for(member, 16 + 3 * (row - 11) + 1)
    drawn_2 = drawn_for(member, 16 + 3 * (row - 11) + 2)
    reading = integrating_gyro.read(constants, here, sky, drawn_0, drawn_1, drawn_2)
    send3(member, row, late, t, reading)


@inlined
def read_integrating_gyros(members, plant, around, late, actions, first):
    """Read those of several that are due, from number `first` on."""
    for unit in range(plant.unit_counts.integrating_gyros):
        row = first + unit
        if actions & (READ << row):
            constants = integrating_gyros_of(plant.units.integrating_gyros, unit)
            stream = 16 + 3 * (row - 11)
            draw(
                members,
                max(
                    constants.angle_rad_sqrt_s, constants.markov_rad_s, constants.walk_rad_s_sqrt_s
                ),
                row,
                stream + 0,
            )
            draw(
                members,
                max(
                    constants.angle_rad_sqrt_s, constants.markov_rad_s, constants.walk_rad_s_sqrt_s
                ),
                row,
                stream + 1,
            )
            draw(
                members,
                max(
                    constants.angle_rad_sqrt_s, constants.markov_rad_s, constants.walk_rad_s_sqrt_s
                ),
                row,
                stream + 2,
            )
            sky = integrating_gyro.nothing_around(constants, around)
            each(members, integrating_gyros_step, unit, row, late, sky, around.t_s)


@inlined
def fine_sun_sensors_of(rows, unit):
    """Constants of one of several: those in a row."""
    return fine_sun_sensor.FineSunSensorSet(
        (
            (rows[unit, 0], rows[unit, 1], rows[unit, 2]),
            (rows[unit, 3], rows[unit, 4], rows[unit, 5]),
            (rows[unit, 6], rows[unit, 7], rows[unit, 8]),
        ),
        rows[unit, 9],
        rows[unit, 10],
        rows[unit, 11],
    )


@inlined
def fine_sun_sensors_step(member, unit, row, late, sky, t):
    """A reading of one of several: fine Sun sensor."""
    constants = fine_sun_sensors_of(member.constants.units.fine_sun_sensors, unit)
    here = begin_reading(member, row, t)
    drawn_0 = drawn_for(member, 16 + 3 * (row - 11) + 0)
    reading = fine_sun_sensor.read(constants, here, sky, drawn_0)
    send3(member, row, late, t, reading)


@inlined
def read_fine_sun_sensors(members, plant, around, late, actions, first):
    """Read those of several that are due, from number `first` on."""
    for unit in range(plant.unit_counts.fine_sun_sensors):
        row = first + unit
        if actions & (READ << row):
            constants = fine_sun_sensors_of(plant.units.fine_sun_sensors, unit)
            stream = 16 + 3 * (row - 11)
            draw(members, constants.noise, row, stream + 0)
            sky = fine_sun_sensor.sun_around(constants, around)
            each(members, fine_sun_sensors_step, unit, row, late, sky, around.t_s)


@inlined
def around_at(loop, step):
    """What there is to sense at a step, which the loop has reached."""
    tables, plan, b_inertial = loop.tables, loop.plan, local_in(loop.local)[0]
    sky = plan.plant.shadow, tables.orbit, tables.sun, tables.moon
    return Around(*sky, b_inertial, step * plan.step_s)


def _read_search_coil(address, actions, step):
    """Read the search coil, if it is due at this step."""
    loop = record_at(address)
    plant, late = loop.plan.plant, loop.plan.timetable.late
    if actions & (READ << 1):
        read_search_coil(loop.members, plant, around_at(loop, step), late)
    return 0


def _read_sun_sensors(address, actions, step):
    """Read the Sun sensors, if it is due at this step."""
    loop = record_at(address)
    plant, late = loop.plan.plant, loop.plan.timetable.late
    if actions & (READ << 3):
        read_sun_sensors(loop.members, plant, around_at(loop, step), late)
    return 0


def _read_horizon_sensor(address, actions, step):
    """Read the horizon sensor, if it is due at this step."""
    loop = record_at(address)
    plant, late = loop.plan.plant, loop.plan.timetable.late
    if actions & (READ << 6):
        read_horizon_sensor(loop.members, plant, around_at(loop, step), late)
    return 0


def _read_sun_cells(address, actions, step):
    """Read the Sun cells, if it is due at this step."""
    loop = record_at(address)
    plant, late = loop.plan.plant, loop.plan.timetable.late
    if actions & (READ << 7):
        read_sun_cells(loop.members, plant, around_at(loop, step), late)
    return 0


def _read_integrating_gyro(address, actions, step):
    """Read the integrating gyro, if it is due at this step."""
    loop = record_at(address)
    plant, late = loop.plan.plant, loop.plan.timetable.late
    if actions & (READ << 8):
        read_integrating_gyro(loop.members, plant, around_at(loop, step), late)
    return 0


def _read_fine_sun_sensor(address, actions, step):
    """Read the fine Sun sensor, if it is due at this step."""
    loop = record_at(address)
    plant, late = loop.plan.plant, loop.plan.timetable.late
    if actions & (READ << 9):
        read_fine_sun_sensor(loop.members, plant, around_at(loop, step), late)
    return 0


def _read_own_sensor(address, actions, step):
    """Read the own sensor, if it is due at this step."""
    loop = record_at(address)
    plant, late = loop.plan.plant, loop.plan.timetable.late
    if actions & (READ << 10):
        read_own_sensor(loop.members, plant, around_at(loop, step), late)
    return 0


def _read_magnetometers(address, actions, step):
    """Read those of several that are due at this step: magnetometer."""
    loop = record_at(address)
    plant, late, first = loop.plan.plant, loop.plan.timetable.late, 11
    around = around_at(loop, step)
    read_magnetometers(loop.members, plant, around, late, actions, first)
    return 0


def _read_gyros(address, actions, step):
    """Read those of several that are due at this step: gyro."""
    loop = record_at(address)
    plant, late, first = loop.plan.plant, loop.plan.timetable.late, 11
    first += plant.unit_counts.magnetometers
    around = around_at(loop, step)
    read_gyros(loop.members, plant, around, late, actions, first)
    return 0


def _read_sun_heads(address, actions, step):
    """Read those of several that are due at this step: Sun sensors."""
    loop = record_at(address)
    plant, late, first = loop.plan.plant, loop.plan.timetable.late, 11
    first += plant.unit_counts.magnetometers
    first += plant.unit_counts.gyros
    around = around_at(loop, step)
    read_sun_heads(loop.members, plant, around, late, actions, first)
    return 0


def _read_star_trackers(address, actions, step):
    """Read those of several that are due at this step: attitude sensor."""
    loop = record_at(address)
    plant, late, first = loop.plan.plant, loop.plan.timetable.late, 11
    first += plant.unit_counts.magnetometers
    first += plant.unit_counts.gyros
    first += plant.unit_counts.sun_heads
    around = around_at(loop, step)
    read_star_trackers(loop.members, plant, around, late, actions, first)
    return 0


def _read_horizon_sensors(address, actions, step):
    """Read those of several that are due at this step: horizon sensor."""
    loop = record_at(address)
    plant, late, first = loop.plan.plant, loop.plan.timetable.late, 11
    first += plant.unit_counts.magnetometers
    first += plant.unit_counts.gyros
    first += plant.unit_counts.sun_heads
    first += plant.unit_counts.star_trackers
    around = around_at(loop, step)
    read_horizon_sensors(loop.members, plant, around, late, actions, first)
    return 0


def _read_integrating_gyros(address, actions, step):
    """Read those of several that are due at this step: integrating gyro."""
    loop = record_at(address)
    plant, late, first = loop.plan.plant, loop.plan.timetable.late, 11
    first += plant.unit_counts.magnetometers
    first += plant.unit_counts.gyros
    first += plant.unit_counts.sun_heads
    first += plant.unit_counts.star_trackers
    first += plant.unit_counts.horizon_sensors
    around = around_at(loop, step)
    read_integrating_gyros(loop.members, plant, around, late, actions, first)
    return 0


def _read_fine_sun_sensors(address, actions, step):
    """Read those of several that are due at this step: fine Sun sensor."""
    loop = record_at(address)
    plant, late, first = loop.plan.plant, loop.plan.timetable.late, 11
    first += plant.unit_counts.magnetometers
    first += plant.unit_counts.gyros
    first += plant.unit_counts.sun_heads
    first += plant.unit_counts.star_trackers
    first += plant.unit_counts.horizon_sensors
    first += plant.unit_counts.integrating_gyros
    around = around_at(loop, step)
    read_fine_sun_sensors(loop.members, plant, around, late, actions, first)
    return 0


#: What reads devices that not every satellite has, `(address of a Loop, actions, step)`: called by
#: its address, so that those compile it that have the device. By the device's number, or by the
#: name of a kind of which there are several.
READERS: dict[int | str, Entry] = {
    1: Entry(_read_search_coil, 2),
    3: Entry(_read_sun_sensors, 2),
    6: Entry(_read_horizon_sensor, 2),
    7: Entry(_read_sun_cells, 2),
    8: Entry(_read_integrating_gyro, 2),
    9: Entry(_read_fine_sun_sensor, 2),
    10: Entry(_read_own_sensor, 2),
    "magnetometers": Entry(_read_magnetometers, 2),
    "gyros": Entry(_read_gyros, 2),
    "sun_heads": Entry(_read_sun_heads, 2),
    "star_trackers": Entry(_read_star_trackers, 2),
    "horizon_sensors": Entry(_read_horizon_sensors, 2),
    "integrating_gyros": Entry(_read_integrating_gyros, 2),
    "fine_sun_sensors": Entry(_read_fine_sun_sensors, 2),
}
call_reader = entry_caller(2)
#: Readings of these.
BY_READERS = (
    ANY_UNIT
    | (READ << 1)
    | (READ << 3)
    | (READ << 6)
    | (READ << 7)
    | (READ << 8)
    | (READ << 9)
    | (READ << 10)
)
