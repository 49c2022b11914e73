"""The one loop: sensors -> on-board computer -> actuators -> propagate -> record.

What is due when is in the timetable (`timetable`); a run can stop at any step and go on bit for
bit.
"""

import math

from torquer.control.allocation import allocate_torque, switch_off_motors
from torquer.control.computer import control_step
from torquer.engine import inner, internal, released, without_reference_counts
from torquer.geometry.vec3 import dot
from torquer.interface import estimate_of, put_estimate
from torquer.simulation.advance import forces_now, is_resolved, steps_by
from torquer.simulation.draws import draw_torques, next_draw
from torquer.simulation.forces import environment_at, environment_tables
from torquer.simulation.sensors import begin_control_step, read_sensors
from torquer.simulation.state import motion_of, put_goal, put_motion
from torquer.simulation.timetable import (
    COILS_OFF,
    COILS_ON,
    COILS_STAY,
    CONTROL,
    row_from,
)
from torquer.spacecraft.coils import (
    advance_coils,
    believed_dipole,
    command_coils,
    present_dipole,
    switch_off_coils,
)
from torquer.spacecraft.rotors import relative_momentum

#: Adaptive steps after which the loop returns at the next event, for a look at signals.
_STEPS_TO_LOOK = 100_000
#: How a piece of the run ended; WAITING: a host is to answer.
RUNNING, BAD_STATE, BAD_COMMAND, COARSE_STEP, WAITING = 0, 1, 2, 3, 4


@internal
def finite3(v):
    """Whether all three components are finite."""
    return math.isfinite(v[0]) and math.isfinite(v[1]) and math.isfinite(v[2])


@internal
def accept(state, command):
    """Keep a command; whether it is one of finite numbers."""
    c = state.cells[0]
    c.dipole_x, c.dipole_y, c.dipole_z = command.dipole_a_m2
    c.torque_x, c.torque_y, c.torque_z = command.torque_n_m
    return finite3(command.dipole_a_m2) and finite3(command.torque_n_m)


@internal
def drive_wheels(allocation, state, torque_body, hold_s, step):
    """Set the motors of the wheels until the next control step."""
    if len(allocation) == 0:
        return
    if state.board.chosen[0].wheels == 0.0:
        switch_off_motors(state.allocation, state.rotors)
        return
    allocate_torque(allocation, state.allocation, state.rotors, torque_body, hold_s, step)


@internal
def drive_coils(coils, state):
    """Hand the dipole that is kept to the coils."""
    c = state.cells[0]
    dipole = (c.dipole_x, c.dipole_y, c.dipole_z)
    put_goal(state.cells, command_coils(coils, dipole, state.coils))
    c.set_x, c.set_y, c.set_z = believed_dipole(coils, state.coils)


@internal
def leave_coils_off(state):
    """Remember that the coils stay off until the next control step."""
    c = state.cells[0]
    c.set_x, c.set_y, c.set_z = 0.0, 0.0, 0.0


@internal
def actuate(plan, state, row, step):
    """Hand the command that is kept to coils and wheels."""
    c = state.cells[0]
    if row.actions & COILS_ON:
        drive_coils(plan.plant.coils, state)
    elif row.actions & COILS_STAY == 0:
        leave_coils_off(state)
    torque, hold_s = (c.torque_x, c.torque_y, c.torque_z), row.hold_steps * plan.step_s
    drive_wheels(plan.allocation, state, torque, hold_s, step)


@inner
def record_wheels(rotors, state, omega, kept):
    """Write what is kept of the wheels: momentum and motor torque of each."""
    if len(rotors) == 0:
        return
    count = rotors.rows.shape[0]
    for k in range(count):
        kept[k] = relative_momentum(rotors.rows, state, omega, k)
        kept[count + k] = state[k].motor


@inner
def record_row(plan, state, coils, step, record, number):
    """Write what is kept of this instant into a row of the record; `coils`: their state."""
    cells, row, known = state.cells[0], record.rows[number], state.board.known[0]
    omega = (cells.omega_x, cells.omega_y, cells.omega_z)
    row.step = step
    row.q_x, row.q_y, row.q_z, row.q_w = cells.q_x, cells.q_y, cells.q_z, cells.q_w
    row.omega_x, row.omega_y, row.omega_z = omega
    row.dipole_x, row.dipole_y, row.dipole_z = present_dipole(plan.plant.coils, coils)
    row.b_measured_x, row.b_measured_y, row.b_measured_z = known.b_x, known.b_y, known.b_z
    row.omega_measured_x, row.omega_measured_y = known.omega_x, known.omega_y
    row.omega_measured_z = known.omega_z
    row.sun_measured_x, row.sun_measured_y, row.sun_measured_z = (
        known.sun_x,
        known.sun_y,
        known.sun_z,
    )
    row.command_x, row.command_y, row.command_z = cells.dipole_x, cells.dipole_y, cells.dipole_z
    row.torque_x, row.torque_y, row.torque_z = cells.torque_x, cells.torque_y, cells.torque_z
    record_wheels(plan.plant.rotors, state.rotors, omega, record.wheels[number])
    for k in range(plan.log_cells.shape[0]):
        record.log[number, k] = state.board.memory[plan.log_cells[k]]
    for region in range(record.modes.shape[1]):
        record.modes[number, region] = state.board.modes.regions[region].state
    if record.estimate.shape[0] > 0:
        put_estimate(record.estimate[number], estimate_of(known))


@internal
def advance_actuators(coils, state, t_s):
    """Let the coils go on to their targets, and add up what they take."""
    cells = state.cells[0]
    energy, greatest = cells.goal_power_w * t_s, cells.goal_greatest_a_m2
    if coils.lag_s > 0.0:
        energy, greatest = advance_coils(coils, state.coils, t_s)
    cells.coil_energy_j += energy
    cells.peak_dipole_a_m2 = max(cells.peak_dipole_a_m2, greatest)


@released
def run_steps(box, last):
    """Run on to step `last`; return how it ended. `box.state.at` tells how far it came.

    It may end at an event before, RUNNING, where many adaptive steps were needed.
    With a host it stops at every control step, when the sensors have been read, and goes on from
    there when the host has put its command into the state.
    """
    integrator, seed = without_reference_counts(box.integrator), box.seed
    plan, tables = without_reference_counts(box.plan), without_reference_counts(box.tables)
    state, record = without_reference_counts(box.state), without_reference_counts(box.record)
    around, timetable = environment_tables(plan, tables), plan.timetable
    at, step = state.at, state.at[0]
    x, here = motion_of(state.cells), environment_at(around, step * plan.step_s)
    number, cycle = row_from(timetable, step)
    due = cycle + timetable.rows[number].step
    to_record = step + -step % plan.record_steps
    enough = state.cells[0].steps + _STEPS_TO_LOOK
    while step < last:
        if step == due:
            row = timetable.rows[number]
            if at[1] == 0:
                if row.actions & COILS_OFF:
                    put_goal(state.cells, switch_off_coils(plan.plant.coils, state.coils))
                read_sensors(plan, tables, state, x, here, row.actions, step, seed)
                if row.actions & CONTROL:
                    begin_control_step(plan, tables, state, step)
            if row.actions & CONTROL:
                if not plan.hosted:
                    if not accept(state, control_step(plan.computer, state.board)):
                        return BAD_COMMAND
                elif at[1] == 0:
                    at[1] = 1
                    return WAITING
                at[1] = 0
                actuate(plan, state, row, step)
            number += 1
            if number == timetable.rows.shape[0]:
                number, cycle = 0, cycle + timetable.cycle_steps
            due = cycle + timetable.rows[number].step
        if step == to_record:
            place = step // plan.record_steps % record.rows.shape[0]
            record_row(plan, state, state.coils, step, record, place)
            to_record += plan.record_steps
            if not is_resolved(integrator, plan, state, x, here):
                return COARSE_STEP
        until = next_draw(plan.plant, step, min(due, to_record, last))
        draw_torques(plan.plant, state, seed, step)
        forces, cells = forces_now(plan, tables, state), state.cells[0]
        x, here = steps_by(integrator, forces, cells, x, here, step, until, plan.step_s)
        if not math.isfinite(dot(x.omega, x.omega) + x.q[0] + x.q[1] + x.q[2] + x.q[3]):
            return BAD_STATE
        put_motion(state.cells, x)
        advance_actuators(plan.plant.coils, state, (until - step) * plan.step_s)
        step = at[0] = until
        if state.cells[0].steps > enough:
            break
    return RUNNING
