"""Reading the sensors, and what the on-board computer knows at a control step."""

from torquer.engine import internal, kernel
from torquer.environment.sun import lit_fraction_at
from torquer.environment.table import lookup3, lookup6, rate_from
from torquer.geometry.quaternion import rotate_inverse
from torquer.geometry.vec3 import cross, sub, unit
from torquer.interface import Ephemeris, put_ephemeris
from torquer.simulation.timetable import (
    ANY_DELIVERY,
    ATTITUDE_SENSOR,
    DELIVER,
    GYRO,
    MAGNETOMETER,
    READ,
    SEARCH_COIL,
    SUN_SENSORS,
    TACHOMETERS,
)
from torquer.spacecraft.attitude_sensor import read_attitude
from torquer.spacecraft.coils import present_dipole
from torquer.spacecraft.gyro import read_rate, walked_bias
from torquer.spacecraft.magnetometer import read_field
from torquer.spacecraft.sun_sensor import read_sun
from torquer.spacecraft.wheels import read_tachometers


@internal
def put_reading(known, sensor, t, v, w):
    """Let a reading reach the computer."""
    x, y, z = v
    if sensor == MAGNETOMETER:
        known.b_s, known.b_x, known.b_y, known.b_z = t, x, y, z
    elif sensor == SEARCH_COIL:
        known.b_rate_s, known.b_rate_x, known.b_rate_y, known.b_rate_z = t, x, y, z
    elif sensor == GYRO:
        known.omega_s, known.omega_x, known.omega_y, known.omega_z = t, x, y, z
    elif sensor == SUN_SENSORS:
        known.sun_s, known.sun_x, known.sun_y, known.sun_z = t, x, y, z
    elif sensor == ATTITUDE_SENSOR:
        known.q_s, known.q_x, known.q_y, known.q_z, known.q_w = t, x, y, z, w
    else:
        known.wheels_s, known.wheels_x, known.wheels_y, known.wheels_z = t, x, y, z


@kernel
def deliver(late, known, actions):
    """Let the late readings that are due reach the computer."""
    for sensor in range(late.shape[0]):
        if actions & (DELIVER << sensor):
            reading = late[sensor]
            v = (reading.x, reading.y, reading.z)
            put_reading(known, sensor, reading.t_s, v, reading.w)


@internal
def send(plan, state, sensor, t, v, w):
    """Hand a reading to the computer, or send it on its way if it arrives late."""
    if plan.timetable.late & (READ << sensor):
        reading = state.late[sensor]
        reading.t_s, reading.w = t, w
        reading.x, reading.y, reading.z = v
    else:
        put_reading(state.board.known[0], sensor, t, v, w)


@kernel
def sun_and_light(plant, tables, t):
    """Unit vector from the satellite to the Sun (inertial), visible part of its disc."""
    r, sun = lookup3(tables.orbit, t), lookup3(tables.sun, t)
    return unit(sub(sun, r)), lit_fraction_at(plant.shadow, r, sun)


@kernel
def read_sun_sensors(plant, tables, q, t, seed, sample):
    """What the Sun sensors read at time t."""
    direction, lit = sun_and_light(plant, tables, t)
    return read_sun(plant.sun_sensors, rotate_inverse(q, direction), lit, seed, sample)


@internal
def read_gyro(plant, cells, omega, t, seed, sample):
    """What the gyro reads; its drift goes on from its last reading."""
    c = cells[0]
    drift = (c.drift_x, c.drift_y, c.drift_z)
    drift = walked_bias(plant.gyro, drift, t - c.drift_s, seed, sample)
    c.drift_x, c.drift_y, c.drift_z = drift
    c.drift_s = t
    return read_rate(plant.gyro, omega, drift, seed, sample)


@internal
def read_magnetometer(plant, coils, b_body, seed, sample):
    """What the magnetometer reads, with the field of coils that are on."""
    dipole = (0.0, 0.0, 0.0)
    if plant.magnetometer.coupling_t_per_a_m2 != 0.0:
        dipole = present_dipole(plant.coils, coils)
    return read_field(plant.magnetometer, b_body, dipole, seed, sample)


@internal
def read_wheels(rotors, noise_rad_s, state, omega, seed, sample):
    """What the tachometers tell: the wheels' momenta, for the allocation; their vector sum."""
    if len(rotors) == 0:
        return (0.0, 0.0, 0.0)
    momenta = state.allocation.momentum
    return read_tachometers(rotors, noise_rad_s, state.rotors, omega, seed, sample, momenta)


@internal
def read_sensors(plan, tables, state, x, here, actions, step, seed):
    """Read the sensors that are due: a pure function of the state and the step."""
    plant, t = plan.plant, step * plan.step_s
    q, omega = x
    if actions & ANY_DELIVERY:
        deliver(state.late, state.board.known[0], actions)
    b_body = rotate_inverse(q, here.b_t)
    if actions & (READ << MAGNETOMETER):
        b = read_magnetometer(plant, state.coils, b_body, seed, step)
        send(plan, state, MAGNETOMETER, t, b, 0.0)
    if actions & (READ << SEARCH_COIL):
        turning = rotate_inverse(q, rate_from(tables.orbit, t, 3))
        send(plan, state, SEARCH_COIL, t, sub(turning, cross(omega, b_body)), 0.0)
    if actions & (READ << GYRO):
        send(plan, state, GYRO, t, read_gyro(plant, state.cells, omega, t, seed, step), 0.0)
    if actions & (READ << SUN_SENSORS):
        sun = read_sun_sensors(plant, tables, q, t, seed, step)
        send(plan, state, SUN_SENSORS, t, sun, 0.0)
    if actions & (READ << ATTITUDE_SENSOR):
        x, y, z, w = read_attitude(plant.attitude_sensor, q, seed, step)
        send(plan, state, ATTITUDE_SENSOR, t, (x, y, z), w)
    if actions & (READ << TACHOMETERS):
        noise_rad_s = plant.tachometer_noise_rad_s
        momentum = read_wheels(plant.rotors, noise_rad_s, state, omega, seed, step)
        send(plan, state, TACHOMETERS, t, momentum, 0.0)


@kernel
def ephemeris_at(plant, tables, t):
    """Where the computer believes to be: on the orbit, with the field model of the simulation."""
    b, _ = lookup6(tables.orbit, t, 3)
    direction, lit = sun_and_light(plant, tables, t)
    v, b_rate = rate_from(tables.orbit, t, 0), rate_from(tables.orbit, t, 3)
    return Ephemeris(lookup3(tables.orbit, t), v, b, b_rate, direction, lit)


@internal
def begin_control_step(plan, tables, state, step):
    """Tell the computer the time and, where it needs it, its ephemeris."""
    known, t = state.board.known[0], step * plan.step_s
    known.t_s = t
    if plan.needs_ephemeris:
        put_ephemeris(known, ephemeris_at(plan.plant, tables, t))
