"""Reading the sensors, and what the on-board computer knows at a control step."""

from torquer.engine import inner, internal
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
def count_reading(sensor):
    """Number of a sensor's reading, from 0: it is the key of the reading's noise."""
    number = int(sensor.count)
    sensor.count += 1.0
    return number


@inner
def deliver(sensors, known, actions):
    """Let the late readings that are due reach the computer."""
    if actions & (DELIVER << MAGNETOMETER):
        r = sensors[MAGNETOMETER]
        known.b_s, known.b_x, known.b_y, known.b_z = r.t_s, r.x, r.y, r.z
    if actions & (DELIVER << GYRO):
        r = sensors[GYRO]
        known.omega_s, known.omega_x, known.omega_y, known.omega_z = r.t_s, r.x, r.y, r.z
    if actions & (DELIVER << SUN_SENSORS):
        r = sensors[SUN_SENSORS]
        known.sun_s, known.sun_x, known.sun_y, known.sun_z = r.t_s, r.x, r.y, r.z
    if actions & (DELIVER << ATTITUDE_SENSOR):
        r = sensors[ATTITUDE_SENSOR]
        known.q_s, known.q_x, known.q_y, known.q_z, known.q_w = r.t_s, r.x, r.y, r.z, r.w


@internal
def put_late(reading, t, x, y, z, w):
    """Send a reading on its way to the computer."""
    reading.t_s, reading.x, reading.y, reading.z, reading.w = t, x, y, z, w


@inner
def sun_and_light(shadow, orbit, sun, t):
    """Unit vector from the satellite to the Sun (inertial), visible part of its disc."""
    r, sun_m = lookup3(orbit, t), lookup3(sun, t)
    return unit(sub(sun_m, r)), lit_fraction_at(shadow, r, sun_m)


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
    plant, known, t = plan.plant, state.board.known[0], step * plan.step_s
    sensors, delayed = state.sensors, plan.timetable.late
    q, omega = x
    if actions & ANY_DELIVERY:
        deliver(sensors, known, actions)
    b_body = rotate_inverse(q, here.b_t)
    if actions & (READ << MAGNETOMETER):
        number = count_reading(sensors[MAGNETOMETER])
        bx, by, bz = read_magnetometer(plant, state.coils, b_body, seed, number)
        if delayed & (READ << MAGNETOMETER):
            put_late(sensors[MAGNETOMETER], t, bx, by, bz, 0.0)
        else:
            known.b_s, known.b_x, known.b_y, known.b_z = t, bx, by, bz
    if actions & (READ << SEARCH_COIL):
        turning = rotate_inverse(q, rate_from(tables.orbit, t, 3))
        known.b_rate_x, known.b_rate_y, known.b_rate_z = sub(turning, cross(omega, b_body))
        known.b_rate_s = t
    if actions & (READ << GYRO):
        number = count_reading(sensors[GYRO])
        wx, wy, wz = read_gyro(plant, state.cells, omega, t, seed, number)
        if delayed & (READ << GYRO):
            put_late(sensors[GYRO], t, wx, wy, wz, 0.0)
        else:
            known.omega_s, known.omega_x, known.omega_y, known.omega_z = t, wx, wy, wz
    if actions & (READ << SUN_SENSORS):
        direction, lit = sun_and_light(plant.shadow, tables.orbit, tables.sun, t)
        sun_body = rotate_inverse(q, direction)
        number = count_reading(sensors[SUN_SENSORS])
        sx, sy, sz = read_sun(plant.sun_sensors, sun_body, lit, seed, number)
        if delayed & (READ << SUN_SENSORS):
            put_late(sensors[SUN_SENSORS], t, sx, sy, sz, 0.0)
        else:
            known.sun_s, known.sun_x, known.sun_y, known.sun_z = t, sx, sy, sz
    if actions & (READ << ATTITUDE_SENSOR):
        number = count_reading(sensors[ATTITUDE_SENSOR])
        qx, qy, qz, qw = read_attitude(plant.attitude_sensor, q, seed, number)
        if delayed & (READ << ATTITUDE_SENSOR):
            put_late(sensors[ATTITUDE_SENSOR], t, qx, qy, qz, qw)
        else:
            known.q_s, known.q_x, known.q_y, known.q_z, known.q_w = t, qx, qy, qz, qw
    if actions & (READ << TACHOMETERS):
        noise_rad_s = plant.tachometer_noise_rad_s
        number = count_reading(sensors[TACHOMETERS])
        momentum = read_wheels(plant.rotors, noise_rad_s, state, omega, seed, number)
        known.wheels_x, known.wheels_y, known.wheels_z = momentum
        known.wheels_s = t


@inner
def ephemeris_at(plant, tables, t):
    """Where the computer believes to be: on the orbit, with the field model of the simulation."""
    b, _ = lookup6(tables.orbit, t, 3)
    direction, lit = sun_and_light(plant.shadow, tables.orbit, tables.sun, t)
    v, b_rate = rate_from(tables.orbit, t, 0), rate_from(tables.orbit, t, 3)
    return Ephemeris(lookup3(tables.orbit, t), v, b, b_rate, direction, lit)


@internal
def begin_control_step(plan, tables, state, step):
    """Tell the computer the time and, where it needs it, its ephemeris."""
    known, t = state.board.known[0], step * plan.step_s
    known.t_s = t
    if plan.needs_ephemeris:
        put_ephemeris(known, ephemeris_at(plan.plant, tables, t))
