"""What acts at the stages of each member's step, in its lane: environment, dipole's way, wheels."""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined
from torquer.environment.local import LocalEnvironment
from torquer.environment.table import polynomials6, position_in, segment_at
from torquer.maths.geometry.vec3 import scale
from torquer.maths.integrate.dop853_stages import C
from torquer.simulation.loop.members import count, each
from torquer.simulation.propagate.dormand_prince import time_of_stage
from torquer.simulation.propagate.forces import environment_at
from torquer.spacecraft.actuators.coils import remaining
from torquer.spacecraft.actuators.rotors import Spin

_STAGES = len(C)
#: A member's step: time within the stretch, length (0: none is to try), time after it, error as a
#: multiple of what it may be; at its stages what is left of the dipole's way, and the environment.
STEP = np.dtype(
    [
        *((name, np.float64) for name in ("t_s", "h_s", "then_s", "ratio")),
        ("left", np.float64, (_STAGES,)),
        ("around", np.float64, (_STAGES, 13)),
    ]
)

#: What the rotors of a member's wheels do in a step of RK4: a `Spin` without its tensor.
SPUN = np.dtype([(name, np.float64, (3,)) for name in ("momentum", "torque")])


class Stretch(NamedTuple):
    """Where the motion is smooth: start, age of the dipole's path there, length [s]."""

    start_s: float
    since_s: float
    length_s: float


@inlined
def _put_vector(row, place, vector):
    if len(vector) > 0:
        row[place], row[place + 1], row[place + 2] = vector


@inlined
def _put_number(row, place, number):
    if len(number) > 0:
        row[place] = number[0]


@inlined
def put_environment(row, local):
    """Write an environment into a row."""
    _put_vector(row, 0, local.b_t)
    _put_vector(row, 3, local.gravity_gradient)
    _put_vector(row, 6, local.flow)
    _put_vector(row, 9, local.light)
    _put_number(row, 12, local.orbit_angle)


@inlined
def _vector_in(row, place, like):
    if len(like) == 0:
        return ()
    return (row[place], row[place + 1], row[place + 2])


@inlined
def _number_in(row, place, like):
    if len(like) == 0:
        return ()
    return (row[place],)


@inlined
def environment_in(row, like):
    """The environment that stands in a row; `like`: one with the same parts."""
    return LocalEnvironment(
        _vector_in(row, 0, like.b_t),
        _vector_in(row, 3, like.gravity_gradient),
        _vector_in(row, 6, like.flow),
        _vector_in(row, 9, like.light),
        _number_in(row, 12, like.orbit_angle),
    )


@inlined
def put_spin(row, spin):
    """Write what the rotors do in a step."""
    _put_vector(row.momentum, 0, spin.momentum)
    _put_vector(row.torque, 0, spin.torque)


@inlined
def spin_in(row, rotors):
    """What the rotors do in a step, as it was written; () for a satellite without wheels."""
    if len(rotors) == 0:
        return ()
    m, t = row.momentum, row.torque
    return Spin((m[0], m[1], m[2]), (t[0], t[1], t[2]), rotors.tensor)


@inlined
def choose(yes, one, other):
    """One of two numbers; both are there, so that members side by side are vectors."""
    return one if yes else other


@inlined
def choose_vector(yes, one, other):
    """One of two vectors, () for none."""
    if len(one) == 0:
        return ()
    return (
        choose(yes, one[0], other[0]),
        choose(yes, one[1], other[1]),
        choose(yes, one[2], other[2]),
    )


@inlined
def _choose_number(yes, one, other):
    if len(one) == 0:
        return ()
    return (choose(yes, one[0], other[0]),)


@inlined
def choose_environment(yes, one, other):
    """One of two environments with the same parts."""
    return LocalEnvironment(
        choose_vector(yes, one.b_t, other.b_t),
        choose_vector(yes, one.gravity_gradient, other.gravity_gradient),
        choose_vector(yes, one.flow, other.flow),
        choose_vector(yes, one.light, other.light),
        _choose_number(yes, one.orbit_angle, other.orbit_angle),
    )


@inlined
def steps_within(member, length_s):
    """1 if a member's next step is a part of the stretch, 0 if it is the whole or none."""
    h = member.state.steps[0].h_s
    return 1 if (h > 0.0) & (h != length_s) else 0


@inlined
def same_stage_phase(member, stage, local, left):
    """Put what acts at a stage that all members share."""
    work = member.state.steps[0]
    work.left[stage] = left
    put_environment(work.around[stage], local)


@inlined
def own_stage_phase(member, stage, part, table, segment, gravity, start_s):
    """Put what acts at a member's own stage: in a segment of the table, field and gravity."""
    work = member.state.steps[0]
    t = time_of_stage(start_s, work.t_s, work.h_s, part)
    b, g = polynomials6(table.coefficients, segment, position_in(table, segment, t), 3)
    row = work.around[stage]
    row[0], row[1], row[2] = b
    row[3], row[4], row[5] = scale(gravity, g)


@inlined
def own_stages_phase(member, tables, start_s):
    """Put what acts at all stages of a member's own step."""
    work = member.state.steps[0]
    if work.h_s > 0.0:
        for stage in range(1, _STAGES):
            t = time_of_stage(start_s, work.t_s, work.h_s, C[stage])
            put_environment(work.around[stage], environment_at(tables, t))


@inlined
def own_left_phase(member, lag_s, since_s):
    """Put what is left of the dipole's way at all stages of a member's own step."""
    work = member.state.steps[0]
    if work.h_s > 0.0:
        for stage in range(_STAGES):
            work.left[stage] = remaining(lag_s, since_s + work.t_s + C[stage] * work.h_s)


@inlined
def _are_alone(air, light, orbit_angle):
    """Whether field and gravity are all of the environment."""
    return len(air) + len(light) + len(orbit_angle) == 0


@inlined
def look_around(members, tables, stretch, lag_s):
    """Put what acts at the stages of all members' next steps; looked up once where it is shared."""
    start_s, since_s, length_s = stretch
    if count(members, steps_within, length_s) == 0:
        for stage in range(1, _STAGES):
            local = environment_at(tables, time_of_stage(start_s, 0.0, length_s, C[stage]))
            left = remaining(lag_s, since_s + C[stage] * length_s)
            each(members, same_stage_phase, stage, local, left)
        return
    if lag_s > 0.0:
        each(members, own_left_phase, lag_s, since_s)
    table = tables.orbit
    segment = segment_at(table, start_s)
    beyond_s = (start_s + length_s) * (1.0 + 1e-15)  # no rounding leads beyond it
    alone = _are_alone(tables.air, tables.light, tables.orbit_angle)
    if alone and segment == segment_at(table, beyond_s):
        for stage in range(1, _STAGES):
            each(
                members, own_stage_phase,
                stage, C[stage], table, segment, tables.gravity, start_s,
            )  # fmt: skip
    else:
        each(members, own_stages_phase, tables, start_s)
