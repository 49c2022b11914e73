"""Reading the sensors, and what the on-board computer knows at a control step.

What ends in `_step` is a phase of the loop, for one member: see `torquer.simulation.loop.members`.
"""

import math

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.compile.engine import inlined, kernel
from torquer.computer.interface import (
    ATTITUDE_SENSOR,
    GYRO,
    HORIZON_SENSOR,
    MAGNETOMETER,
    SEARCH_COIL,
    SUN_CELLS,
    SUN_SENSORS,
    TACHOMETERS,
    Ephemeris,
    put_ephemeris,
)
from torquer.environment.albedo import earthlight
from torquer.environment.sun import sunlit_fraction_at
from torquer.environment.table import lookup3, lookup6, rate_from
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import cross, norm, scale, sub, unit
from torquer.simulation.loop.members import draw, drawn_for, each, each_alone
from torquer.simulation.loop.readings import (
    change_readings,
    choose,
    deliver_step,
    put_late,
    sensors_at_work,
)
from torquer.simulation.loop.state import read_motion
from torquer.simulation.loop.timetable import ANY_DELIVERY, READ
from torquer.spacecraft.actuators.coils import present_dipole
from torquer.spacecraft.actuators.reaction_wheels import read_tachometers
from torquer.spacecraft.sensors import (
    attitude_sensor,
    gyro,
    horizon_sensor,
    magnetometer,
    sun_cells,
    sun_sensor,
)
from torquer.spacecraft.sensors.attitude_sensor import (
    Sky,
    earth_cosine,
    excludes_sun,
    is_blind,
    read_attitude,
)
from torquer.spacecraft.sensors.gyro import read_rate, walked_bias
from torquer.spacecraft.sensors.horizon_sensor import disc_centre, read_horizon
from torquer.spacecraft.sensors.magnetometer import read_field
from torquer.spacecraft.sensors.sun_cells import read_cell
from torquer.spacecraft.sensors.sun_sensor import read_sun


@kernel
def sun_and_light(shadow, orbit, sun, t):
    """Unit vector from the satellite to the Sun (inertial), visible part of its disc."""
    r, sun_m = lookup3(orbit, t), lookup3(sun, t)
    return unit(sub(sun_m, r)), sunlit_fraction_at(shadow, r, sun_m)


@kernel
def sunlight_at(plant, albedo, tables, t):
    """What Sun sensors receive: direction to the Sun, visible part of it, light of the Earth."""
    direction, sunlit_fraction = sun_and_light(plant.shadow, tables.orbit, tables.sun, t)
    of_earth = (0.0, 0.0, 0.0)
    if albedo > 0.0:
        of_earth = earthlight(albedo, lookup3(tables.orbit, t), direction)
    return direction, sunlit_fraction, of_earth


@inlined
def read_gyro(plant, cells, omega, t, drawn, drawn_walk):
    """What the gyro reads; its drift goes on from its last reading."""
    c = cells[0]
    drift = (c.drift_x, c.drift_y, c.drift_z)
    drift = walked_bias(plant.gyro, drift, t - c.drift_s, drawn_walk)
    c.drift_x, c.drift_y, c.drift_z = drift
    c.drift_s = t
    return read_rate(plant.gyro, omega, drift, drawn)


@inlined
def read_magnetometer(plant, coils, b_body, drawn):
    """What the magnetometer reads, with the field of coils that are on."""
    dipole = (0.0, 0.0, 0.0)
    if plant.magnetometer.coupling_t_per_a_m2 != 0.0:
        dipole = present_dipole(plant.coils, coils)
    return read_field(plant.magnetometer, b_body, dipole, drawn)


@inlined
def magnetometer_step(member, late, b_inertial, t):
    """A reading of the magnetometer, which reaches the computer now or is on its way."""
    state, drawn = member.state, drawn_for(member, magnetometer.STREAM)
    state.sensors[MAGNETOMETER].count += 1.0
    b_body = rotate_inverse(read_motion(state.cells).q, b_inertial)
    bx, by, bz = read_magnetometer(member.constants, state.coils, b_body, drawn)
    is_late, known = late & (READ << MAGNETOMETER) != 0, state.board.known[0]
    put_late(is_late, state.sensors[MAGNETOMETER], t, bx, by, bz, 0.0)
    known.b_s = choose(is_late, known.b_s, t)
    known.b_x = choose(is_late, known.b_x, bx)
    known.b_y = choose(is_late, known.b_y, by)
    known.b_z = choose(is_late, known.b_z, bz)


@inlined
def search_coil_step(member, b_inertial, b_rate_inertial, t):
    """A reading of the search coil: the field's rate of change as the body sees it."""
    known, x = member.state.board.known[0], read_motion(member.state.cells)
    turning = rotate_inverse(x.q, b_rate_inertial)
    seen = sub(turning, cross(x.omega, rotate_inverse(x.q, b_inertial)))
    known.b_rate_x, known.b_rate_y, known.b_rate_z = seen
    known.b_rate_s = t


@inlined
def gyro_step(member, late, t):
    """A reading of the gyro."""
    state, drawn = member.state, drawn_for(member, gyro.NOISE_STREAM)
    state.sensors[GYRO].count += 1.0
    drawn_walk = drawn_for(member, gyro.DRIFT_STREAM)
    omega = read_motion(state.cells).omega
    wx, wy, wz = read_gyro(member.constants, state.cells, omega, t, drawn, drawn_walk)
    is_late, known = late & (READ << GYRO) != 0, state.board.known[0]
    put_late(is_late, state.sensors[GYRO], t, wx, wy, wz, 0.0)
    known.omega_s = choose(is_late, known.omega_s, t)
    known.omega_x = choose(is_late, known.omega_x, wx)
    known.omega_y = choose(is_late, known.omega_y, wy)
    known.omega_z = choose(is_late, known.omega_z, wz)


@inlined
def sun_sensors_step(member, late, sunlight, t):
    """A reading of the Sun sensors; `sunlight`: direction to the Sun, visible part of it, light of
    the Earth (inertial)."""
    state, q = member.state, read_motion(member.state.cells).q
    state.sensors[SUN_SENSORS].count += 1.0
    direction, sunlit_fraction, of_earth = sunlight
    sun_body, earth_body = rotate_inverse(q, direction), rotate_inverse(q, of_earth)
    drawn = drawn_for(member, sun_sensor.STREAM)
    sx, sy, sz = read_sun(
        member.constants.sun_sensors, sun_body, sunlit_fraction, earth_body, drawn
    )
    is_late, known = late & (READ << SUN_SENSORS) != 0, state.board.known[0]
    put_late(is_late, state.sensors[SUN_SENSORS], t, sx, sy, sz, 0.0)
    known.sun_s = choose(is_late, known.sun_s, t)
    known.sun_x = choose(is_late, known.sun_x, sx)
    known.sun_y = choose(is_late, known.sun_y, sy)
    known.sun_z = choose(is_late, known.sun_z, sz)


@kernel
def sky_at(plant, tables, t):
    """What may blind the attitude sensor."""
    sensor, nothing = plant.attitude_sensor, (0.0, 0.0, 0.0)
    sun, nadir, cosine = nothing, nothing, earth_cosine(sensor, EARTH_RADIUS_M)
    if excludes_sun(sensor):
        sun, _ = sun_and_light(plant.shadow, tables.orbit, tables.sun, t)
    if sensor.earth_rad >= 0.0:
        r = lookup3(tables.orbit, t)
        nadir, cosine = scale(-1.0, unit(r)), earth_cosine(sensor, norm(r))
    return Sky(sun, nadir, cosine)


@inlined
def attitude_sensor_step(member, late, sky, t):
    """A reading of the attitude sensor; NaN where it is blinded."""
    state, drawn = member.state, drawn_for(member, attitude_sensor.STREAM)
    state.sensors[ATTITUDE_SENSOR].count += 1.0
    sensor, x = member.constants.attitude_sensor, read_motion(state.cells)
    sun_body, nadir_body = rotate_inverse(x.q, sky.sun), rotate_inverse(x.q, sky.nadir)
    blind = is_blind(sensor, x.omega, sun_body, nadir_body, sky.earth_cosine)
    qx, qy, qz, qw = read_attitude(sensor, x.q, drawn)
    qx, qy = choose(blind, math.nan, qx), choose(blind, math.nan, qy)
    qz, qw = choose(blind, math.nan, qz), choose(blind, math.nan, qw)
    is_late, known = late & (READ << ATTITUDE_SENSOR) != 0, state.board.known[0]
    put_late(is_late, state.sensors[ATTITUDE_SENSOR], t, qx, qy, qz, qw)
    known.q_s = choose(is_late, known.q_s, t)
    known.q_x = choose(is_late, known.q_x, qx)
    known.q_y = choose(is_late, known.q_y, qy)
    known.q_z = choose(is_late, known.q_z, qz)
    known.q_w = choose(is_late, known.q_w, qw)


@inlined
def horizon_sensor_step(member, late, centre, t):
    """A reading of the horizon sensor; `centre`: of the Earth's infrared disc (inertial)."""
    state, drawn = member.state, drawn_for(member, horizon_sensor.STREAM)
    state.sensors[HORIZON_SENSOR].count += 1.0
    x = read_motion(state.cells)
    seen = rotate_inverse(x.q, centre)
    nx, ny, nz = read_horizon(member.constants.horizon_sensor, x.omega, seen, drawn)
    is_late, known = late & (READ << HORIZON_SENSOR) != 0, state.board.known[0]
    put_late(is_late, state.sensors[HORIZON_SENSOR], t, nx, ny, nz, 0.0)
    known.nadir_s = choose(is_late, known.nadir_s, t)
    known.nadir_x = choose(is_late, known.nadir_x, nx)
    known.nadir_y = choose(is_late, known.nadir_y, ny)
    known.nadir_z = choose(is_late, known.nadir_z, nz)


@inlined
def sun_cells_step(member, late, sunlight, t):
    """Signals of the Sun cells; `sunlight`: as for the Sun sensors."""
    state, q = member.state, read_motion(member.state.cells).q
    state.sensors[SUN_CELLS].count += 1.0
    cells, (direction, sunlit, of_earth) = member.constants.sun_cells, sunlight
    sun, earth = rotate_inverse(q, direction), rotate_inverse(q, of_earth)
    a, b, c = drawn_for(member, sun_cells.STREAM)
    d, e, f = drawn_for(member, sun_cells.MORE_STREAM)
    a, b = read_cell(cells, 0, sun, sunlit, earth, a), read_cell(cells, 1, sun, sunlit, earth, b)
    c, d = read_cell(cells, 2, sun, sunlit, earth, c), read_cell(cells, 3, sun, sunlit, earth, d)
    e, f = read_cell(cells, 4, sun, sunlit, earth, e), read_cell(cells, 5, sun, sunlit, earth, f)
    is_late, known, r = late & (READ << SUN_CELLS) != 0, state.board.known[0], state.sensors
    put_late(is_late, r[SUN_CELLS], t, a, b, c, d)
    r[SUN_CELLS].u = choose(is_late, e, r[SUN_CELLS].u)
    r[SUN_CELLS].v = choose(is_late, f, r[SUN_CELLS].v)
    known.cells_s = choose(is_late, known.cells_s, t)
    known.cells_0, known.cells_1 = (
        choose(is_late, known.cells_0, a),
        choose(is_late, known.cells_1, b),
    )
    known.cells_2, known.cells_3 = (
        choose(is_late, known.cells_2, c),
        choose(is_late, known.cells_3, d),
    )
    known.cells_4, known.cells_5 = (
        choose(is_late, known.cells_4, e),
        choose(is_late, known.cells_5, f),
    )


@kernel
def tachometers_step(member, t):
    """A reading of the tachometers: momenta for the allocation, their vector sum for laws."""
    state, plant = member.state, member.constants
    known, sensor = state.board.known[0], state.sensors[TACHOMETERS]
    number, noise_rad_s = int(sensor.count), plant.tachometer_noise_rad_s
    sensor.count += 1.0
    momentum = read_tachometers(
        plant.rotors, noise_rad_s, state.rotors, read_motion(state.cells).omega, member.seed,
        number, state.allocation.momentum,
    )  # fmt: skip
    known.wheels_x, known.wheels_y, known.wheels_z = momentum
    known.wheels_s = t


@inlined
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
        albedo = plant.sun_sensors.albedo
        each(members, sun_sensors_step, late, sunlight_at(plant, albedo, tables, t), t)
    if actions & (READ << ATTITUDE_SENSOR):
        noise_rad = max(plant.attitude_sensor.noise_rad, plant.attitude_sensor.boresight_noise_rad)
        draw(members, noise_rad, ATTITUDE_SENSOR, attitude_sensor.STREAM)
        each(members, attitude_sensor_step, late, sky_at(plant, tables, t), t)
    if actions & (READ << HORIZON_SENSOR):
        draw(members, plant.horizon_sensor.noise_rad, HORIZON_SENSOR, horizon_sensor.STREAM)
        centre = disc_centre(plant.horizon_sensor, lookup3(tables.orbit, t))
        each(members, horizon_sensor_step, late, centre, t)
    if actions & (READ << SUN_CELLS):
        draw(members, plant.sun_cells.noise, SUN_CELLS, sun_cells.STREAM)
        draw(members, plant.sun_cells.noise, SUN_CELLS, sun_cells.MORE_STREAM)
        albedo = plant.sun_cells.albedo
        each(members, sun_cells_step, late, sunlight_at(plant, albedo, tables, t), t)
    if actions & (READ << TACHOMETERS):
        each_alone(members, tachometers_step, t)
    change_readings(members, failures, late, actions, t)


@kernel
def ephemeris_at(plant, tables, t):
    """Where the computer believes the satellite to be, and what its models give there."""
    orbit, sun = tables.believed_orbit, tables.believed_sun
    b, _ = lookup6(orbit, t, 3)
    direction, sunlit_fraction = sun_and_light(plant.shadow, orbit, sun, t)
    v, b_rate = rate_from(orbit, t, 0), rate_from(orbit, t, 3)
    return Ephemeris(lookup3(orbit, t), v, b, b_rate, direction, sunlit_fraction)


@inlined
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


@inlined
def ephemeris_step(member, ephemeris):
    """Give the computer its ephemeris."""
    put_ephemeris(member.state.board.known[0], ephemeris)
