"""How readings reach the computer: at once, late, or not as they were, where a sensor fails.

What ends in `_step` is a phase of the loop, for one member: see `torquer.simulation.loop.members`.
"""

from torquer.base.noise import normal3
from torquer.compile.engine import inlined, kernel
from torquer.computer.interface import ROWS
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, rotate
from torquer.maths.geometry.vec3 import add, norm
from torquer.simulation.loop.members import each
from torquer.simulation.loop.state import read_motion
from torquer.simulation.loop.timetable import DELIVER, READ
from torquer.spacecraft.failures import (
    CHANGED,
    FIRST_STREAM,
    REPLACED,
    STUCK,
    TURNS_ATTITUDE,
    TURNS_DIRECTION,
    changed_vector,
    failure_error,
)
from torquer.spacecraft.sensors.device import MOST_PARTS, Here


@inlined
def begin_reading(member, sensor, t):
    """Count a reading that is being taken; what the device is exposed to."""
    state, r = member.state, member.state.sensors[sensor]
    r.count += 1.0
    return Here(read_motion(state.cells), member.constants.coils, state.coils, r.own, t)


@inlined
def choose(condition, a, b):
    """a where the condition holds, else b."""
    return a if condition else b


@inlined
def _send(under_way, readings, sensor, is_late, k, value):
    """Number k of a reading, sent on its way or given to the computer.

    Both are written in any case: stores under a condition keep a loop over members from being
    vectorised.
    """
    under_way[k] = choose(is_late, value, under_way[k])
    readings[sensor, k] = choose(is_late, readings[sensor, k], value)


@inlined
def send3(member, sensor, late, t, v):
    """Send a reading of three numbers to the computer, now or late."""
    is_late = late & (READ << sensor) != 0
    r, known = member.state.sensors[sensor], member.state.board.known[0]
    r.t_s = choose(is_late, t, r.t_s)
    known.read_s[sensor] = choose(is_late, known.read_s[sensor], t)
    _send(r.reading, known.readings, sensor, is_late, 0, v[0])
    _send(r.reading, known.readings, sensor, is_late, 1, v[1])
    _send(r.reading, known.readings, sensor, is_late, 2, v[2])


@inlined
def send4(member, sensor, late, t, v):
    """Send a reading of four numbers to the computer, now or late."""
    send3(member, sensor, late, t, v)
    is_late = late & (READ << sensor) != 0
    r, known = member.state.sensors[sensor], member.state.board.known[0]
    _send(r.reading, known.readings, sensor, is_late, 3, v[3])


@inlined
def send6(member, sensor, late, t, v):
    """Send a reading of six numbers to the computer, now or late."""
    send4(member, sensor, late, t, v)
    is_late = late & (READ << sensor) != 0
    r, known = member.state.sensors[sensor], member.state.board.known[0]
    _send(r.reading, known.readings, sensor, is_late, 4, v[4])
    _send(r.reading, known.readings, sensor, is_late, 5, v[5])


@kernel
def deliver_step(member, actions):
    """Let the late readings that are due reach the computer."""
    known = member.state.board.known[0]
    for sensor in range(ROWS):
        if actions & (DELIVER << sensor):
            r = member.state.sensors[sensor]
            known.read_s[sensor] = r.t_s
            for k in range(MOST_PARTS):
                known.readings[sensor, k] = r.reading[k]


@inlined
def acts(failure, actions, t):
    """Whether a failure acts on a reading of now."""
    return actions & (READ << failure.sensor) != 0 and failure.from_s <= t < failure.until_s


@kernel
def stuck_step(member, sensor, late, t):
    """Send the last reading again, as one of now."""
    if late & (READ << sensor):
        member.state.sensors[sensor].t_s = t
    else:
        member.state.board.known[0].read_s[sensor] = t


@inlined
def under_way(member, sensor, late, k):
    """Number k of the reading of now, which is on its way or with the computer."""
    if late & (READ << sensor):
        return member.state.sensors[sensor].reading[k]
    return member.state.board.known[0].readings[sensor, k]


@inlined
def put_under_way(member, sensor, late, k, value):
    """Change number k of the reading of now."""
    if late & (READ << sensor):
        member.state.sensors[sensor].reading[k] = value
    else:
        member.state.board.known[0].readings[sensor, k] = value


@kernel
def replace_step(member, failure, late):
    """Put a value in place of each number of the reading of now."""
    for k in range(failure.parts):
        put_under_way(member, failure.sensor, late, k, failure.value)


@inlined
def with_error(turns, v, w, error):
    """A reading with an error: of directions and attitudes a rotation vector in body axes."""
    if norm(error) == 0.0:  # a product with nothing would make what is infinite unknown
        return v, w
    if turns == TURNS_ATTITUDE:
        x, y, z, w = multiply((v[0], v[1], v[2], w), from_rotation_vector(error))
        return (x, y, z), w
    if turns == TURNS_DIRECTION:
        return rotate(from_rotation_vector(error), v), w
    return add(v, error), w


@kernel
def change_step(member, failure, stream, late, t):
    """Change the reading of now as a failure says."""
    sensor = failure.sensor
    v = (
        under_way(member, sensor, late, 0),
        under_way(member, sensor, late, 1),
        under_way(member, sensor, late, 2),
    )
    w, count = under_way(member, sensor, late, 3), int(member.state.sensors[sensor].count)
    error = failure_error(failure, normal3(member.seed, stream, count))
    v, w = with_error(failure.turns, changed_vector(failure, v), w, error)
    for k in range(3):
        put_under_way(member, sensor, late, k, v[k])
    put_under_way(member, sensor, late, 3, w)


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
            each(members, replace_step, failures[i], late)
        elif failures[i].kind == CHANGED and acts(failures[i], actions, t):
            each(members, change_step, failures[i], FIRST_STREAM + i, late, t)
