"""The loop for `LANES` members of one orbit at once, with the kernels and the bits of a single run.

What the orbit brings is looked up once for all; each phase of the loop (readings, laws, coils, a
step) runs over the members, in vectors. RK4 only: steps are shared.
"""

import math

from torquer.engine import internal, released, without_reference_counts
from torquer.geometry.vec3 import dot, sub
from torquer.lanes import LANES, lane_plant, lane_state
from torquer.simulation.advance import left_in_step, resolves, rk4_step
from torquer.simulation.draws import draw_torques, next_draw
from torquer.simulation.forces import (
    DipolePath,
    Forces,
    environment_at,
    environment_tables,
    with_drawn,
)
from torquer.simulation.lane_control import control_in_lanes, end
from torquer.simulation.lane_sensors import read_in_lanes
from torquer.simulation.state import goal_dipole, motion_of, put_goal, put_motion
from torquer.simulation.step import (
    BAD_STATE,
    COARSE_STEP,
    advance_actuators,
    drive_coils,
    leave_coils_off,
)
from torquer.simulation.timetable import COILS_OFF, COILS_ON, COILS_STAY, CONTROL, row_from
from torquer.spacecraft.coils import present_dipole, switch_off_coils
from torquer.spacecraft.disturbance.held import present_torque


@internal
def coils_off(layout, shared, cells, count):
    """Let the coils go to zero; `count` as above."""
    for lane in range(count):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        put_goal(state.cells, switch_off_coils(plant.coils, state.coils))


@internal
def coils_in_lanes(layout, shared, cells, count):
    """Hand the commands to the coils; `count` as above."""
    for lane in range(count):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        drive_coils(plant.coils, state)


@internal
def leave_coils_off_in_lanes(layout, cells, count):
    """Remember that the coils stay off until the next control step; `count` as above."""
    for lane in range(count):
        leave_coils_off(lane_state(layout, cells, lane))


@internal
def draw_torques_in_lanes(layout, shared, cells, seeds, step):
    """Draw the torques that jump at a step."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        draw_torques(plant, state, seeds[lane], step)


@internal
def step_in_lanes(layout, shared, cells, here, middle, end, left, step, h):
    """A step of RK4; `left`: parts of the dipoles' ways that are still to go."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        target, way = goal_dipole(state.cells), (0.0, 0.0, 0.0)
        if shared.coils.lag_s > 0.0:
            way = sub(present_dipole(plant.coils, state.coils), target)
        path = DipolePath(target, way, shared.coils.lag_s)
        rigid = with_drawn(plant.rigid, plant.rigid.acting, state.coefficients)
        held = present_torque(plant.held, state.held)
        forces = Forces(rigid, (), path, held, ())  # type: ignore[arg-type]
        x = motion_of(state.cells)
        put_motion(state.cells, rk4_step(forces, x, here, middle, end, left, step, h))


@internal
def has_motion(layout, cells, lane):
    """Whether a member's motion is finite."""
    x = motion_of(lane_state(layout, cells, lane).cells)
    return math.isfinite(dot(x.omega, x.omega) + x.q[0] + x.q[1] + x.q[2] + x.q[3])


@internal
def finish_event(layout, shared, cells, count, ends, step, t_s):
    """Let the coils go on for t_s; end the members whose state is not finite."""
    bad = 0
    for lane in range(count):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        advance_actuators(plant.coils, state, t_s)
        bad += not has_motion(layout, cells, lane)
    if bad > 0:
        for lane in range(count):
            if not has_motion(layout, cells, lane):
                end(ends, lane, BAD_STATE, step)


@internal
def record_in_lanes(layout, cells, kept):
    """Keep attitudes and rates."""
    for lane in range(LANES):
        x = motion_of(lane_state(layout, cells, lane).cells)
        for k in range(4):
            kept[k, lane] = x.q[k]
        for k in range(3):
            kept[4 + k, lane] = x.omega[k]


@internal
def check_in_lanes(layout, integrator, plan, cells, here, ends, step, steps):
    """End the members whose motion the step does not resolve in the next `steps`."""
    shared = plan.plant
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        if not resolves(integrator, plant, plan.step_s, steps, state, motion_of(state.cells), here):
            end(ends, lane, COARSE_STEP, step)


@released
def run_lanes(
    layout, integrator, plan, tables, boards, cells, seeds, drawn, ends, kept, first, last
):
    """Run all lanes from step `first` to `last`; `kept` (rows, 7, LANES): attitude and rate.

    `plan`: of one of the members; `boards`: `Boards`, or (); `ends`: `END` of each.
    """
    plan, tables = without_reference_counts(plan), without_reference_counts(tables)
    cells, kept = without_reference_counts(cells), without_reference_counts(kept)
    boards = without_reference_counts(boards)
    around, timetable, h = environment_tables(plan, tables), plan.timetable, plan.step_s
    shared = plan.plant
    step = first
    here = environment_at(around, step * h)
    number, cycle = row_from(timetable, step)
    due = cycle + timetable.rows[number].step
    to_record, place = step + -step % plan.record_steps, 0
    while step < last:
        if step == due:
            actions = timetable.rows[number].actions
            if actions & COILS_OFF:
                coils_off(layout, shared, cells, len(seeds))
            read_in_lanes(layout, plan, tables, cells, seeds, drawn, here, actions, step)
            if actions & CONTROL:
                control_in_lanes(layout, plan, tables, boards, cells, len(seeds), ends, step)
            if actions & COILS_ON:
                coils_in_lanes(layout, shared, cells, len(seeds))
            elif actions & CONTROL and actions & COILS_STAY == 0:
                leave_coils_off_in_lanes(layout, cells, len(seeds))
            number += 1
            if number == timetable.rows.shape[0]:
                number, cycle = 0, cycle + timetable.cycle_steps
            due = cycle + timetable.rows[number].step
        if step == to_record:
            record_in_lanes(layout, cells, kept[place])
            place += 1
            to_record += plan.record_steps
            check_in_lanes(layout, integrator, plan, cells, here, ends, step, plan.record_steps)
        until = next_draw(shared, step, min(due, to_record, last))
        draw_torques_in_lanes(layout, shared, cells, seeds, step)
        for each in range(step, until):
            middle = environment_at(around, (each + 0.5) * h)
            after = environment_at(around, (each + 1) * h)
            left = left_in_step(shared.coils.lag_s, (each - step) * h, h)
            step_in_lanes(layout, shared, cells, here, middle, after, left, each, h)
            here = after
        finish_event(layout, shared, cells, len(seeds), ends, until, (until - step) * h)
        step = until


@released
def finish_lanes(layout, integrator, plan, tables, cells, ends, kept, last):
    """Record the end of all lanes in a row (7, LANES), and whether the step follows them there."""
    here = environment_at(environment_tables(plan, tables), last * plan.step_s)
    record_in_lanes(layout, cells, kept)
    check_in_lanes(layout, integrator, plan, cells, here, ends, last, 0)
