"""Adaptive steps of members side by side: each keeps its own step, error and time.

A member at the end of its stretch waits for the others: their steps do not change its numbers. So
each has the bits of its own flight. What acts at the stages of a member's step stands in its lane.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import called, inlined, kernel
from torquer.environment.light import next_edge
from torquer.environment.local import LocalEnvironment
from torquer.environment.table import polynomials6, position_in, segment_at
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.vec3 import scale
from torquer.maths.integrate.dop853_stages import C
from torquer.simulation.loop.members import count, each, first_member
from torquer.simulation.loop.state import put_motion, read_motion
from torquer.simulation.propagate.adaptive import (
    MORE,
    MOST_STEPS,
    Auto,
    count_step,
    learn_from,
    next_slow_step,
    next_step,
    ratio_of,
)
from torquer.simulation.propagate.dormand_prince import (
    Smooth,
    left_at_5,
    stages_at_5,
    step_5,
    step_8,
    time_of_stage,
)
from torquer.simulation.propagate.forces import (
    environment_at,
    forces_now,
    with_light_between,
)
from torquer.spacecraft.actuators.coils import remaining

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
def _put_environment(row, local):
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
def _environment_in(row, like):
    """The environment that stands in a row; `like`: one with the same parts."""
    return LocalEnvironment(
        _vector_in(row, 0, like.b_t),
        _vector_in(row, 3, like.gravity_gradient),
        _vector_in(row, 6, like.flow),
        _vector_in(row, 9, like.light),
        _number_in(row, 12, like.orbit_angle),
    )


@inlined
def _choose(yes, one, other):
    """One of two numbers; both are there, so that members side by side are vectors."""
    return one if yes else other


@inlined
def _choose_vector(yes, one, other):
    if len(one) == 0:
        return ()
    return (
        _choose(yes, one[0], other[0]),
        _choose(yes, one[1], other[1]),
        _choose(yes, one[2], other[2]),
    )


@inlined
def _choose_number(yes, one, other):
    if len(one) == 0:
        return ()
    return (_choose(yes, one[0], other[0]),)


@inlined
def _choose_environment(yes, one, other):
    return LocalEnvironment(
        _choose_vector(yes, one.b_t, other.b_t),
        _choose_vector(yes, one.gravity_gradient, other.gravity_gradient),
        _choose_vector(yes, one.flow, other.flow),
        _choose_vector(yes, one.light, other.light),
        _choose_number(yes, one.orbit_angle, other.orbit_angle),
    )


@inlined
def _move(cells, moves, y, x):
    """Write the motion y into the state, or x where the member does not move."""
    (a, b, c, d), (e, f, g, h) = y.q, x.q
    q = (_choose(moves, a, e), _choose(moves, b, f), _choose(moves, c, g), _choose(moves, d, h))
    put_motion(cells, Motion(q, _choose_vector(moves, y.omega, x.omega)))


@inlined
def _smooth_of(member):
    rigid, _, path, held, _ = forces_now(member, ())
    return Smooth(rigid, (), path, held, (), 0.0, 0.0)


@inlined
def begin_phase(member, local, left, length_s):
    """Stand at the start of a stretch; at its end if the motion has ended before."""
    work = member.state.steps[0]
    work.t_s = _choose(member.state.cells[0].next_step_s == 0.0, length_s, 0.0)
    work.h_s = 0.0
    work.left[0] = left
    _put_environment(work.around[0], local)


@inlined
def tries_order_5(member, length_s):
    """1 if a member's motion is slow enough to try order 5 on the stretch, else 0."""
    return 1 if member.state.cells[0].slow_step_s >= length_s else 0


@inlined
def _environments_at_5(tables, local, start_s, length_s):
    """The environment at the stages of a step of order 5, which all members share."""
    _, t1, t2, t3, t4, end = stages_at_5(tables, local, start_s, length_s)
    early = (local, environment_at(tables, t1), environment_at(tables, t2))
    return (*early, environment_at(tables, t3), environment_at(tables, t4), end)


@inlined
def slower_phase(member):
    """Order 5 is tried on a longer stretch later."""
    member.state.cells[0].slow_step_s *= MORE


@inlined
def order_5_phase(member, integrator, around, left, length_s):
    """A step of order 5 over the whole stretch, taken by members that try it and pass."""
    cells, work = member.state.cells, member.state.steps[0]
    c, x = cells[0], read_motion(cells)
    y, error = step_5(_smooth_of(member), around, left, x, length_s)
    ratio, slow_s = ratio_of(integrator, x, length_s, error), c.slow_step_s
    tried = slow_s >= length_s
    taken = tried & (ratio <= 1.0) & (work.t_s == 0.0)
    c.slow_step_s = _choose(tried, next_slow_step(slow_s, length_s, ratio), slow_s * MORE)
    _move(cells, taken, y, x)
    count_step(c, length_s, error, taken)
    work.t_s = _choose(taken, length_s, work.t_s)


@inlined
def plan_phase(member, integrator, length_s):
    """Choose a member's next step after what its last one taught; 1 if there is one, else 0."""
    c, work = member.state.cells[0], member.state.steps[0]
    if work.h_s > 0.0 and not learn_from(c, work.h_s, work.ratio):
        c.next_step_s, c.omega_x, work.t_s = 0.0, math.nan, length_s
    if work.t_s == length_s:
        work.h_s = 0.0
        return 0
    work.h_s, work.then_s = next_step(integrator, c, work.t_s, length_s)
    return 1


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
    _put_environment(work.around[stage], local)


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
            _put_environment(work.around[stage], environment_at(tables, t))


@inlined
def own_left_phase(member, lag_s, since_s):
    """Put what is left of the dipole's way at all stages of a member's own step."""
    work = member.state.steps[0]
    if work.h_s > 0.0:
        for stage in range(_STAGES):
            work.left[stage] = remaining(lag_s, since_s + work.t_s + C[stage] * work.h_s)


@inlined
def order_8_phase(member, integrator, like, length_s):
    """A step of order 8, taken by members that have one to try and pass."""
    cells, work = member.state.cells, member.state.steps[0]
    x, h, left, rows = read_motion(cells), work.h_s, work.left, work.around
    around = (
        _environment_in(rows[0], like), _environment_in(rows[1], like),
        _environment_in(rows[2], like), _environment_in(rows[3], like),
        _environment_in(rows[4], like), _environment_in(rows[5], like),
        _environment_in(rows[6], like), _environment_in(rows[7], like),
        _environment_in(rows[8], like), _environment_in(rows[9], like),
        _environment_in(rows[10], like), _environment_in(rows[11], like),
    )  # fmt: skip
    y, error = step_8(_smooth_of(member), around, left, x, h)
    ratio = ratio_of(integrator, x, h, error)
    taken = (h > 0.0) & (ratio <= 1.0)
    _move(cells, taken, y, x)
    count_step(cells[0], h, error, taken)
    work.ratio = ratio
    work.t_s = _choose(taken, work.then_s, work.t_s)
    _put_environment(rows[0], _choose_environment(taken, around[11], around[0]))


@called
def due_order_5_phase(member, integrator, around, left, length_s):
    """The same as `order_5_phase`, computed for a member that tries it alone."""
    if tries_order_5(member, length_s) == 1:
        order_5_phase(member, integrator, around, left, length_s)
    else:
        slower_phase(member)


@called
def due_order_8_phase(member, integrator, like, length_s):
    """The same as `order_8_phase`, computed for a member that has a step to try alone."""
    if member.state.steps[0].h_s > 0.0:
        order_8_phase(member, integrator, like, length_s)


@inlined
def try_order_5(members, surface, acting, integrator, around, left, length_s):
    """Let members try order 5; where air or other torques act no good vectors are made of it."""
    if len(acting) > 0 or len(surface) > 0:
        each(members, due_order_5_phase, integrator, around, left, length_s)
    else:
        each(members, order_5_phase, integrator, around, left, length_s)


@inlined
def try_order_8(members, surface, acting, integrator, like, length_s):
    """Let members try their steps of order 8 in the same way."""
    if len(acting) > 0 or len(surface) > 0:
        each(members, due_order_8_phase, integrator, like, length_s)
    else:
        each(members, order_8_phase, integrator, like, length_s)


@inlined
def unfinished_phase(member, length_s):
    """Let the motion of a member that took too many steps end."""
    c, finished = member.state.cells[0], member.state.steps[0].t_s == length_s
    c.omega_x = _choose(finished, c.omega_x, math.nan)


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


@kernel
def over_stretch(members, integrator, tables, local, stretch):
    """Advance members over a stretch; `local`: the environment at its start."""
    start_s, since_s, length_s = stretch
    constants = first_member(members).constants
    lag_s, (_, _, _, surface, acting) = constants.coils.lag_s, constants.rigid
    each(members, begin_phase, local, remaining(lag_s, since_s), length_s)
    if length_s <= integrator.longest_s:
        if count(members, tries_order_5, length_s) > 0:
            around = _environments_at_5(tables, local, start_s, length_s)
            left = left_at_5(lag_s, since_s, length_s)
            try_order_5(members, surface, acting, integrator, around, left, length_s)
        else:
            each(members, slower_phase)
    for _ in range(MOST_STEPS):
        if count(members, plan_phase, integrator, length_s) == 0:
            break
        look_around(members, tables, stretch, lag_s)
        try_order_8(members, surface, acting, integrator, local, length_s)
    each(members, unfinished_phase, length_s)


@inlined
def over_stretches(members, integrator, tables, light, local, start_s, length_s):
    """Advance members over an interval, in stretches that end where the sunlight jumps or bends."""
    if len(light) == 0:
        over_stretch(members, integrator, tables, local, Stretch(start_s, 0.0, length_s))
        return
    t, edge_s = 0.0, next_edge(light, start_s)
    while t < length_s:
        end = min(edge_s - start_s, length_s)
        edge_s = next_edge(light, edge_s)
        if end == t:  # by rounding
            continue
        lit = with_light_between(tables, start_s + t, start_s + end)
        local = environment_at(lit, start_s + t)
        over_stretch(members, integrator, lit, local, Stretch(start_s + t, t, end - t))
        t = end


@inlined
def auto_in_lanes(members, problem, local, step, until):
    """Advance members over steps step..until-1 of the time grid, each by its own steps."""
    attitude_rad_s, rate_rad_s2, longest_s, _, _ = problem.integrator
    integrator = Auto(attitude_rad_s, rate_rad_s2, longest_s, (), ())
    tables, h = problem.tables, problem.step_s
    over_stretches(members, integrator, tables, tables.light, local, step * h, (until - step) * h)
