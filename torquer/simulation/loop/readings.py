"""How readings reach the computer: at once, late, or not as they were, where a sensor fails.

What ends in `_step` is a phase of the loop, for one member: see `torquer.simulation.loop.members`.
"""

from torquer.base.noise import normal3
from torquer.compile.engine import inlined, kernel
from torquer.computer.interface import (
    ATTITUDE_SENSOR,
    GYRO,
    HORIZON_SENSOR,
    MAGNETOMETER,
    SUN_CELLS,
    SUN_SENSORS,
)
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, rotate
from torquer.maths.geometry.vec3 import add, norm
from torquer.simulation.loop.members import each
from torquer.simulation.loop.timetable import DELIVER, READ
from torquer.spacecraft.failures import (
    CHANGED,
    FIRST_STREAM,
    REPLACED,
    STUCK,
    changed_vector,
    failure_error,
)


@inlined
def put_reading(known, sensor, t_s, x, y, z, w, u, v):
    """Give a reading to the computer; u and v: of the last two Sun cells."""
    if sensor == MAGNETOMETER:
        known.b_s, known.b_x, known.b_y, known.b_z = t_s, x, y, z
    elif sensor == GYRO:
        known.omega_s, known.omega_x, known.omega_y, known.omega_z = t_s, x, y, z
    elif sensor == SUN_SENSORS:
        known.sun_s, known.sun_x, known.sun_y, known.sun_z = t_s, x, y, z
    elif sensor == ATTITUDE_SENSOR:
        known.q_s, known.q_x, known.q_y, known.q_z, known.q_w = t_s, x, y, z, w
    elif sensor == HORIZON_SENSOR:
        known.nadir_s, known.nadir_x, known.nadir_y, known.nadir_z = t_s, x, y, z
    elif sensor == SUN_CELLS:
        known.cells_s, known.cells_0, known.cells_1, known.cells_2 = t_s, x, y, z
        known.cells_3, known.cells_4, known.cells_5 = w, u, v


@kernel
def deliver_step(member, actions):
    """Let the late readings that are due reach the computer."""
    for sensor in (MAGNETOMETER, GYRO, SUN_SENSORS, ATTITUDE_SENSOR, HORIZON_SENSOR, SUN_CELLS):
        if actions & (DELIVER << sensor):
            r = member.state.sensors[sensor]
            put_reading(member.state.board.known[0], sensor, r.t_s, r.x, r.y, r.z, r.w, r.u, r.v)


@inlined
def choose(condition, a, b):
    """a where the condition holds, else b."""
    return a if condition else b


@inlined
def put_late(is_late, reading, t, x, y, z, w):
    """Send a reading on its way to the computer if it is late.

    Written in any case: stores under a condition keep a loop over members from being vectorised.
    """
    r = reading
    r.t_s, r.w = choose(is_late, t, r.t_s), choose(is_late, w, r.w)
    r.x, r.y, r.z = choose(is_late, x, r.x), choose(is_late, y, r.y), choose(is_late, z, r.z)


@inlined
def acts(failure, actions, t):
    """Whether a failure acts on a reading of now."""
    return actions & (READ << failure.sensor) != 0 and failure.from_s <= t < failure.until_s


@kernel
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
    elif sensor == HORIZON_SENSOR:
        known.nadir_s = t
    elif sensor == SUN_CELLS:
        known.cells_s = t


@kernel
def replace_step(member, sensor, value, late, t):
    """Put a value in place of each component of the reading of now."""
    if late & (READ << sensor):
        r = member.state.sensors[sensor]
        r.x, r.y, r.z, r.w, r.u, r.v = value, value, value, value, value, value
    else:
        known = member.state.board.known[0]
        put_reading(known, sensor, t, value, value, value, value, value, value)


@inlined
def read_sensor(known, sensor):
    """A reading (six numbers) that the computer has; ones where the sensor has fewer."""
    x, y, z, w, u, v = known.b_x, known.b_y, known.b_z, 1.0, 1.0, 1.0
    if sensor == GYRO:
        x, y, z = known.omega_x, known.omega_y, known.omega_z
    elif sensor == SUN_SENSORS:
        x, y, z = known.sun_x, known.sun_y, known.sun_z
    elif sensor == ATTITUDE_SENSOR:
        x, y, z, w = known.q_x, known.q_y, known.q_z, known.q_w
    elif sensor == HORIZON_SENSOR:
        x, y, z = known.nadir_x, known.nadir_y, known.nadir_z
    elif sensor == SUN_CELLS:
        x, y, z, w = known.cells_0, known.cells_1, known.cells_2, known.cells_3
        u, v = known.cells_4, known.cells_5
    return x, y, z, w, u, v


@inlined
def with_error(sensor, v, w, error):
    """A reading with an error: of directions and attitudes a rotation vector in body axes."""
    if norm(error) == 0.0:  # a product with nothing would make what is infinite unknown
        return v, w
    if sensor == ATTITUDE_SENSOR:
        x, y, z, w = multiply((v[0], v[1], v[2], w), from_rotation_vector(error))
        return (x, y, z), w
    if sensor in (SUN_SENSORS, HORIZON_SENSOR):
        return rotate(from_rotation_vector(error), v), w
    return add(v, error), w


@kernel
def change_step(member, failure, stream, late, t):
    """Change the reading of now as a failure says."""
    sensor = failure.sensor
    r, known = member.state.sensors[sensor], member.state.board.known[0]
    is_late = late & (READ << sensor) != 0
    x, y, z, w, u, v = read_sensor(known, sensor)
    if is_late:
        x, y, z, w = r.x, r.y, r.z, r.w
    error = failure_error(failure, normal3(member.seed, stream, int(r.count)))
    (x, y, z), w = with_error(sensor, changed_vector(failure, (x, y, z)), w, error)
    if is_late:
        r.x, r.y, r.z, r.w = x, y, z, w
    else:
        put_reading(known, sensor, t, x, y, z, w, u, v)


@inlined
def sensors_at_work(members, failures, late, actions, t):
    """The actions without the readings that a failure prevents."""
    left = actions
    for i in range(failures.shape[0]):
        if failures[i].kind < REPLACED and acts(failures[i], left, t):
            left &= ~(READ << failures[i].sensor)
            if failures[i].kind == STUCK:
                each(members, stuck_step, failures[i].sensor, late, t)
    return left


@inlined
def change_readings(members, failures, late, actions, t):
    """Replace or change what has been read, where a failure says so; in the order of failures."""
    for i in range(failures.shape[0]):
        if failures[i].kind == REPLACED and acts(failures[i], actions, t):
            each(members, replace_step, failures[i].sensor, failures[i].value, late, t)
        elif failures[i].kind == CHANGED and acts(failures[i], actions, t):
            each(members, change_step, failures[i], FIRST_STREAM + i, late, t)
