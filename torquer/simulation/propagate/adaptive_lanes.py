"""Adaptive steps of members side by side: each keeps its own step, error and time.

A member at the end of its stretch waits for the others: their steps do not change its numbers. So
each has the bits of its own flight. What acts at the stages of a member's step stands in its lane.
"""

import math

from torquer.compile.engine import called, inlined, kernel
from torquer.environment.light import next_edge
from torquer.maths.geometry.motion import Motion
from torquer.simulation.loop.members import count, each, first_member
from torquer.simulation.loop.state import put_motion, read_motion
from torquer.simulation.propagate.adaptive import (
    MORE,
    MOST_STEPS,
    Auto,
    by_auto,
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
)
from torquer.simulation.propagate.forces import (
    environment_at,
    forces_now,
    look_up,
    with_light_between,
)
from torquer.simulation.propagate.lane_stages import (
    Stretch,
    choose,
    choose_environment,
    choose_vector,
    environment_in,
    look_around,
    put_environment,
)
from torquer.spacecraft.actuators.coils import remaining
from torquer.spacecraft.actuators.turning import forget_driven


@inlined
def _move(cells, moves, y, x):
    """Write the motion y into the state, or x where the member does not move."""
    (a, b, c, d), (e, f, g, h) = y.q, x.q
    q = (choose(moves, a, e), choose(moves, b, f), choose(moves, c, g), choose(moves, d, h))
    put_motion(cells, Motion(q, choose_vector(moves, y.omega, x.omega)))


@inlined
def _smooth_of(member):
    rigid, _, path, held, _ = forces_now(member, ())
    return Smooth(rigid, (), path, held, (), 0.0, 0.0)


@inlined
def begin_phase(member, local, left, length_s):
    """Stand at the start of a stretch; at its end if the motion has ended before."""
    work = member.state.steps[0]
    work.t_s = choose(member.state.cells[0].next_step_s == 0.0, length_s, 0.0)
    work.h_s = 0.0
    work.left[0] = left
    put_environment(work.around[0], local)


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
    c.slow_step_s = choose(tried, next_slow_step(slow_s, length_s, ratio), slow_s * MORE)
    _move(cells, taken, y, x)
    count_step(c, length_s, error, taken)
    work.t_s = choose(taken, length_s, work.t_s)


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
def order_8_phase(member, integrator, like, length_s):
    """A step of order 8, taken by members that have one to try and pass."""
    cells, work = member.state.cells, member.state.steps[0]
    x, h, left, rows = read_motion(cells), work.h_s, work.left, work.around
    around = (
        environment_in(rows[0], like), environment_in(rows[1], like),
        environment_in(rows[2], like), environment_in(rows[3], like),
        environment_in(rows[4], like), environment_in(rows[5], like),
        environment_in(rows[6], like), environment_in(rows[7], like),
        environment_in(rows[8], like), environment_in(rows[9], like),
        environment_in(rows[10], like), environment_in(rows[11], like),
    )  # fmt: skip
    y, error = step_8(_smooth_of(member), around, left, x, h)
    ratio = ratio_of(integrator, x, h, error)
    taken = (h > 0.0) & (ratio <= 1.0)
    _move(cells, taken, y, x)
    count_step(cells[0], h, error, taken)
    work.ratio = ratio
    work.t_s = choose(taken, work.then_s, work.t_s)
    put_environment(rows[0], choose_environment(taken, around[11], around[0]))


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
    c.omega_x = choose(finished, c.omega_x, math.nan)


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


@called
def alone_phase(member, integrator, tables, local, step, until, h):
    """Advance a member with wheels as in its own flight: its steps end where its rotors change."""
    cells = member.state.cells
    if cells[0].next_step_s == 0.0:  # its motion has ended
        return
    forget_driven(integrator.work)
    forces, x = forces_now(member, tables), read_motion(cells)
    put_motion(cells, by_auto(integrator, forces, cells[0], x, local, step, until, h))


@inlined
def steps_of_members(members, rotors, problem, local, step, until):
    """Advance members over steps step..until-1 of the time grid; `rotors`: () without wheels."""
    tables, h = problem.tables, problem.step_s
    if len(rotors) > 0:
        each(members, alone_phase, problem.integrator, tables, local, step, until, h)
        return
    attitude_rad_s, rate_rad_s2, longest_s, _, _ = problem.integrator
    integrator = Auto(attitude_rad_s, rate_rad_s2, longest_s, (), ())
    over_stretches(members, integrator, tables, tables.light, local, step * h, (until - step) * h)


@inlined
def auto_in_lanes(members, problem, local, step, until):
    """Advance members over steps step..until-1 of the time grid, each by its own steps.

    What `look_up` finds then.
    """
    rotors, tables = first_member(members).constants.rotors, problem.tables
    steps_of_members(members, rotors, problem, local, step, until)
    return look_up(tables, until * problem.step_s)
