"""Reading the sensors, and what the on-board computer knows at a control step.

What ends in `_step` is a phase of the loop, for one member: see `torquer.simulation.members`.
"""

from torquer.compile.engine import inner, internal
from torquer.environment.albedo import earthlight
from torquer.environment.sun import sunlit_fraction_at
from torquer.environment.table import lookup3, lookup6, rate_from
from torquer.geometry.quaternion import from_rotation_vector, multiply, rotate, rotate_inverse
from torquer.geometry.vec3 import add, cross, norm, sub, unit
from torquer.interface import Ephemeris, put_ephemeris
from torquer.noise import normal3
from torquer.simulation.members import draw, drawn_for, each, each_alone
from torquer.simulation.state import motion_of
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
from torquer.spacecraft import attitude_sensor, gyro, magnetometer, sun_sensor
from torquer.spacecraft.attitude_sensor import read_attitude
from torquer.spacecraft.coils import present_dipole
from torquer.spacecraft.failures import (
    CHANGED,
    FIRST_STREAM,
    REPLACED,
    STUCK,
    changed_vector,
    error_of,
)
from torquer.spacecraft.gyro import read_rate, walked_bias
from torquer.spacecraft.magnetometer import read_field
from torquer.spacecraft.sun_sensor import read_sun
from torquer.spacecraft.wheels import read_tachometers


@internal
def put_reading(known, sensor, t_s, x, y, z, w):
    """Give a reading to the computer."""
    if sensor == MAGNETOMETER:
        known.b_s, known.b_x, known.b_y, known.b_z = t_s, x, y, z
    elif sensor == GYRO:
        known.omega_s, known.omega_x, known.omega_y, known.omega_z = t_s, x, y, z
    elif sensor == SUN_SENSORS:
        known.sun_s, known.sun_x, known.sun_y, known.sun_z = t_s, x, y, z
    elif sensor == ATTITUDE_SENSOR:
        known.q_s, known.q_x, known.q_y, known.q_z, known.q_w = t_s, x, y, z, w


@inner
def deliver_step(member, actions):
    """Let the late readings that are due reach the computer."""
    for sensor in (MAGNETOMETER, GYRO, SUN_SENSORS, ATTITUDE_SENSOR):
        if actions & (DELIVER << sensor):
            r = member.state.sensors[sensor]
            put_reading(member.state.board.known[0], sensor, r.t_s, r.x, r.y, r.z, r.w)


@internal
def chosen(condition, a, b):
    """a where the condition holds, else b."""
    return a if condition else b


@internal
def put_late(is_late, reading, t, x, y, z, w):
    """Send a reading on its way to the computer if it is late.

    Written in any case: stores under a condition keep a loop over members from being vectorised.
    """
    r = reading
    r.t_s, r.w = chosen(is_late, t, r.t_s), chosen(is_late, w, r.w)
    r.x, r.y, r.z = chosen(is_late, x, r.x), chosen(is_late, y, r.y), chosen(is_late, z, r.z)


@inner
def sun_and_light(shadow, orbit, sun, t):
    """Unit vector from the satellite to the Sun (inertial), visible part of its disc."""
    r, sun_m = lookup3(orbit, t), lookup3(sun, t)
    return unit(sub(sun_m, r)), sunlit_fraction_at(shadow, r, sun_m)


@inner
def sunlight_at(plant, tables, t):
    """What Sun sensors receive: direction to the Sun, visible part of it, light of the Earth."""
    direction, sunlit_fraction = sun_and_light(plant.shadow, tables.orbit, tables.sun, t)
    of_earth, albedo = (0.0, 0.0, 0.0), plant.sun_sensors.albedo
    if albedo > 0.0:
        of_earth = earthlight(albedo, lookup3(tables.orbit, t), direction)
    return direction, sunlit_fraction, of_earth


@internal
def read_gyro(plant, cells, omega, t, drawn, drawn_walk):
    """What the gyro reads; its drift goes on from its last reading."""
    c = cells[0]
    drift = (c.drift_x, c.drift_y, c.drift_z)
    drift = walked_bias(plant.gyro, drift, t - c.drift_s, drawn_walk)
    c.drift_x, c.drift_y, c.drift_z = drift
    c.drift_s = t
    return read_rate(plant.gyro, omega, drift, drawn)


@internal
def read_magnetometer(plant, coils, b_body, drawn):
    """What the magnetometer reads, with the field of coils that are on."""
    dipole = (0.0, 0.0, 0.0)
    if plant.magnetometer.coupling_t_per_a_m2 != 0.0:
        dipole = present_dipole(plant.coils, coils)
    return read_field(plant.magnetometer, b_body, dipole, drawn)


@internal
def magnetometer_step(member, late, b_inertial, t):
    """A reading of the magnetometer, which reaches the computer now or is on its way."""
    state, drawn = member.state, drawn_for(member, magnetometer.STREAM)
    state.sensors[MAGNETOMETER].count += 1.0
    b_body = rotate_inverse(motion_of(state.cells).q, b_inertial)
    bx, by, bz = read_magnetometer(member.constants, state.coils, b_body, drawn)
    is_late, known = late & (READ << MAGNETOMETER) != 0, state.board.known[0]
    put_late(is_late, state.sensors[MAGNETOMETER], t, bx, by, bz, 0.0)
    known.b_s = chosen(is_late, known.b_s, t)
    known.b_x = chosen(is_late, known.b_x, bx)
    known.b_y = chosen(is_late, known.b_y, by)
    known.b_z = chosen(is_late, known.b_z, bz)


@internal
def search_coil_step(member, b_inertial, b_rate_inertial, t):
    """A reading of the search coil: the field's rate of change as the body sees it."""
    known, x = member.state.board.known[0], motion_of(member.state.cells)
    turning = rotate_inverse(x.q, b_rate_inertial)
    seen = sub(turning, cross(x.omega, rotate_inverse(x.q, b_inertial)))
    known.b_rate_x, known.b_rate_y, known.b_rate_z = seen
    known.b_rate_s = t


@internal
def gyro_step(member, late, t):
    """A reading of the gyro."""
    state, drawn = member.state, drawn_for(member, gyro.NOISE_STREAM)
    state.sensors[GYRO].count += 1.0
    drawn_walk = drawn_for(member, gyro.DRIFT_STREAM)
    omega = motion_of(state.cells).omega
    wx, wy, wz = read_gyro(member.constants, state.cells, omega, t, drawn, drawn_walk)
    is_late, known = late & (READ << GYRO) != 0, state.board.known[0]
    put_late(is_late, state.sensors[GYRO], t, wx, wy, wz, 0.0)
    known.omega_s = chosen(is_late, known.omega_s, t)
    known.omega_x = chosen(is_late, known.omega_x, wx)
    known.omega_y = chosen(is_late, known.omega_y, wy)
    known.omega_z = chosen(is_late, known.omega_z, wz)


@internal
def sun_sensors_step(member, late, sunlight, t):
    """A reading of the Sun sensors; `sunlight`: direction to the Sun, visible part of it, light of
    the Earth (inertial)."""
    state, q = member.state, motion_of(member.state.cells).q
    state.sensors[SUN_SENSORS].count += 1.0
    direction, sunlit_fraction, of_earth = sunlight
    sun_body, earth_body = rotate_inverse(q, direction), rotate_inverse(q, of_earth)
    drawn = drawn_for(member, sun_sensor.STREAM)
    sx, sy, sz = read_sun(
        member.constants.sun_sensors, sun_body, sunlit_fraction, earth_body, drawn
    )
    is_late, known = late & (READ << SUN_SENSORS) != 0, state.board.known[0]
    put_late(is_late, state.sensors[SUN_SENSORS], t, sx, sy, sz, 0.0)
    known.sun_s = chosen(is_late, known.sun_s, t)
    known.sun_x = chosen(is_late, known.sun_x, sx)
    known.sun_y = chosen(is_late, known.sun_y, sy)
    known.sun_z = chosen(is_late, known.sun_z, sz)


@internal
def attitude_sensor_step(member, late, t):
    """A reading of the attitude sensor."""
    state, drawn = member.state, drawn_for(member, attitude_sensor.STREAM)
    state.sensors[ATTITUDE_SENSOR].count += 1.0
    q = motion_of(state.cells).q
    qx, qy, qz, qw = read_attitude(member.constants.attitude_sensor, q, drawn)
    is_late, known = late & (READ << ATTITUDE_SENSOR) != 0, state.board.known[0]
    put_late(is_late, state.sensors[ATTITUDE_SENSOR], t, qx, qy, qz, qw)
    known.q_s = chosen(is_late, known.q_s, t)
    known.q_x = chosen(is_late, known.q_x, qx)
    known.q_y = chosen(is_late, known.q_y, qy)
    known.q_z = chosen(is_late, known.q_z, qz)
    known.q_w = chosen(is_late, known.q_w, qw)


@inner
def tachometers_step(member, t):
    """A reading of the tachometers: momenta for the allocation, their vector sum for laws."""
    state, plant = member.state, member.constants
    known, sensor = state.board.known[0], state.sensors[TACHOMETERS]
    number, noise_rad_s = int(sensor.count), plant.tachometer_noise_rad_s
    sensor.count += 1.0
    momentum = read_tachometers(
        plant.rotors, noise_rad_s, state.rotors, motion_of(state.cells).omega, member.seed, number,
        state.allocation.momentum,
    )  # fmt: skip
    known.wheels_x, known.wheels_y, known.wheels_z = momentum
    known.wheels_s = t


@internal
def acts(failure, actions, t):
    """Whether a failure acts on a reading of now."""
    return actions & (READ << failure.sensor) != 0 and failure.from_s <= t < failure.until_s


@inner
def stuck_step(member, sensor, late, t):
    """Send the last reading again, as one of now."""
    known = member.state.board.known[0]
    if late & (READ << sensor):
        member.state.sensors[sensor].t_s = t
    elif sensor == MAGNETOMETER:
        known.b_s = t
    elif sensor == GYRO:
        known.omega_s = t
    elif sensor == SUN_SENSORS:
        known.sun_s = t
    elif sensor == ATTITUDE_SENSOR:
        known.q_s = t


@inner
def replace_step(member, sensor, value, late, t):
    """Put a value in place of each component of the reading of now."""
    if late & (READ << sensor):
        r = member.state.sensors[sensor]
        r.x, r.y, r.z, r.w = value, value, value, value
    else:
        put_reading(member.state.board.known[0], sensor, t, value, value, value, value)


@internal
def reading_of(known, sensor):
    """A reading (x, y, z, w) that the computer has; w: 1 unless it is a quaternion's."""
    x, y, z, w = known.b_x, known.b_y, known.b_z, 1.0
    if sensor == GYRO:
        x, y, z = known.omega_x, known.omega_y, known.omega_z
    elif sensor == SUN_SENSORS:
        x, y, z = known.sun_x, known.sun_y, known.sun_z
    elif sensor == ATTITUDE_SENSOR:
        x, y, z, w = known.q_x, known.q_y, known.q_z, known.q_w
    return x, y, z, w


@internal
def with_error(sensor, v, w, error):
    """A reading with an error: of directions and attitudes a rotation vector in body axes."""
    if norm(error) == 0.0:  # a product with nothing would make what is infinite unknown
        return v, w
    if sensor == ATTITUDE_SENSOR:
        x, y, z, w = multiply((v[0], v[1], v[2], w), from_rotation_vector(error))
        return (x, y, z), w
    if sensor == SUN_SENSORS:
        return rotate(from_rotation_vector(error), v), w
    return add(v, error), w


@inner
def change_step(member, failure, stream, late, t):
    """Change the reading of now as a failure says."""
    sensor = failure.sensor
    r, known = member.state.sensors[sensor], member.state.board.known[0]
    is_late = late & (READ << sensor) != 0
    x, y, z, w = reading_of(known, sensor)
    if is_late:
        x, y, z, w = r.x, r.y, r.z, r.w
    error = error_of(failure, normal3(member.seed, stream, int(r.count)))
    (x, y, z), w = with_error(sensor, changed_vector(failure, (x, y, z)), w, error)
    if is_late:
        r.x, r.y, r.z, r.w = x, y, z, w
    else:
        put_reading(known, sensor, t, x, y, z, w)


@internal
def sensors_at_work(members, failures, late, actions, t):
    """The actions without the readings that a failure prevents."""
    left = actions
    for i in range(failures.shape[0]):
        if failures[i].kind < REPLACED and acts(failures[i], left, t):
            left &= ~(READ << failures[i].sensor)
            if failures[i].kind == STUCK:
                each(members, stuck_step, failures[i].sensor, late, t)
    return left


@internal
def change_readings(members, failures, late, actions, t):
    """Replace or change what has been read, where a failure says so; in the order of failures."""
    for i in range(failures.shape[0]):
        if failures[i].kind == REPLACED and acts(failures[i], actions, t):
            each(members, replace_step, failures[i].sensor, failures[i].value, late, t)
        elif failures[i].kind == CHANGED and acts(failures[i], actions, t):
            each(members, change_step, failures[i], FIRST_STREAM + i, late, t)


@internal
def read_sensors(members, plan, tables, b_inertial, actions, step):
    """Read the sensors that are due, in this order; what their noise is, state and step decide."""
    t, late, plant = step * plan.step_s, plan.timetable.late, plan.plant
    if actions & ANY_DELIVERY:
        each(members, deliver_step, actions)
    failures = plant.failures.sensors
    actions = sensors_at_work(members, failures, late, actions, t)
    if actions & (READ << MAGNETOMETER):
        draw(members, plant.magnetometer.noise_t, MAGNETOMETER, magnetometer.STREAM)
        each(members, magnetometer_step, late, b_inertial, t)
    if actions & (READ << SEARCH_COIL):
        each(members, search_coil_step, b_inertial, rate_from(tables.orbit, t, 3), t)
    if actions & (READ << GYRO):
        draw(members, plant.gyro.noise_rad_s, GYRO, gyro.NOISE_STREAM)
        draw(members, plant.gyro.drift_rad_s_sqrt_s, GYRO, gyro.DRIFT_STREAM)
        each(members, gyro_step, late, t)
    if actions & (READ << SUN_SENSORS):
        draw(members, plant.sun_sensors.noise_rad, SUN_SENSORS, sun_sensor.STREAM)
        each(members, sun_sensors_step, late, sunlight_at(plant, tables, t), t)
    if actions & (READ << ATTITUDE_SENSOR):
        draw(members, plant.attitude_sensor.noise_rad, ATTITUDE_SENSOR, attitude_sensor.STREAM)
        each(members, attitude_sensor_step, late, t)
    if actions & (READ << TACHOMETERS):
        each_alone(members, tachometers_step, t)
    change_readings(members, failures, late, actions, t)


@inner
def ephemeris_at(plant, tables, t):
    """Where the computer believes the satellite to be, and what its models give there."""
    orbit, sun = tables.believed_orbit, tables.believed_sun
    b, _ = lookup6(orbit, t, 3)
    direction, sunlit_fraction = sun_and_light(plant.shadow, orbit, sun, t)
    v, b_rate = rate_from(orbit, t, 0), rate_from(orbit, t, 3)
    return Ephemeris(lookup3(orbit, t), v, b, b_rate, direction, sunlit_fraction)


@internal
def update_step(member, left, mean, t):
    """Give the computer the time and what its coils have done since the control step before.

    `left`, `mean`: see `remaining_and_mean`.
    """
    k, c = member.state.board.known[0], member.state.cells[0]
    x, y, z = c.reached_x - c.set_x, c.reached_y - c.set_y, c.reached_z - c.set_z
    k.coils_x, k.coils_y, k.coils_z = c.set_x + mean * x, c.set_y + mean * y, c.set_z + mean * z
    c.reached_x, c.reached_y, c.reached_z = (
        c.set_x + left * x,
        c.set_y + left * y,
        c.set_z + left * z,
    )
    k.t_s = t


@internal
def ephemeris_step(member, ephemeris):
    """Give the computer its ephemeris."""
    put_ephemeris(member.state.board.known[0], ephemeris)
