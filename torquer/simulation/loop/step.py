"""The one loop: sensors -> on-board computer -> actuators -> propagate -> record.

It is written once for one satellite and for several side by side (`members`). What is due when is
in the timetable (`timetable`); a run can stop at any step and go on bit for bit.
"""

from typing import Any, NamedTuple

import numpy as np

from torquer.compile.arguments import Arguments, Entry, entry_caller, record_at
from torquer.compile.engine import inlined
from torquer.computer.allocation import allocate_torque, switch_off_motors
from torquer.computer.interface import OWN_SENSOR
from torquer.environment.table import lookup6
from torquer.simulation.loop.calibrated import drive_coils
from torquer.simulation.loop.computers import (
    Boards,
    compute,
    estimate_for_outside,
    has_command,
    restart_computers,
)
from torquer.simulation.loop.due import BY_READERS, READERS
from torquer.simulation.loop.members import (
    BAD_COMMAND,
    BAD_READING,
    RUNNING,
    WAITING,
    Many,
    One,
    each,
    first_member,
    must_stop,
)
from torquer.simulation.loop.record import record_members
from torquer.simulation.loop.sensors import ephemeris_at, ephemeris_step, read_sensors, update_step
from torquer.simulation.loop.state import Plan, ReadingTables, Record, put_goal, put_local
from torquer.simulation.loop.timetable import (
    COILS_OFF,
    COILS_ON,
    COILS_STAY,
    CONTROL,
    READ,
    all_actions,
    row_from,
)
from torquer.simulation.propagate.interval import GO_ON, LOOK, call_propagate
from torquer.spacecraft.actuators.coil_driver import drive_as_given
from torquer.spacecraft.actuators.coils import (
    fail_coils,
    remaining_and_mean,
    switch_off_coils,
)
from torquer.spacecraft.failures import is_back, is_halted

#: Adaptive steps after which the loop returns at the next event, for a look at signals.
_STEPS_TO_LOOK = 100_000
#: How far a control step has come: not begun; sensors read; the computers have worked.
BETWEEN, SENSED, WORKED = range(3)


class Loop(NamedTuple):
    """What the loop takes.

    `at`: steps done, how far the control step has come, bits of readings that are not taken.
    `local`: field and gravity-gradient vector at that step, which `propagate` keeps up to date.
    `record`: of one satellite a `Record`; of several, numbers of each (rows, 7 or more, LANES).
    `readers`: addresses of what reads the devices that not every satellite has; `drive_wheels`,
    `propagate`: of these functions; `problem`: of what the last takes.
    """

    plan: Plan
    tables: ReadingTables
    members: One | Many
    boards: Boards | tuple[()]
    at: np.ndarray
    local: np.ndarray
    record: Record | np.ndarray
    readers: np.ndarray
    drive_wheels: Any
    propagate: Any
    problem: Any


def with_readers(loop: Loop) -> Loop:
    """A loop with what reads the devices of its satellite."""
    due, counts = all_actions(loop.plan.timetable), loop.plan.plant.unit_counts
    if not due & BY_READERS:
        return loop
    arguments = Arguments(loop)
    addresses = [
        reader.address(arguments)
        for key, reader in READERS.items()
        if (due & (READ << key) if isinstance(key, int) else getattr(counts, key))
    ]
    # without the compiler they are the functions themselves
    return loop._replace(readers=np.array(addresses))


#: Of a loop that reads only what every satellite has.
NO_READERS = np.zeros(0, np.int64)


@inlined
def coils_off_step(member):
    """Let the coils go to zero."""
    coils = member.constants.coils
    put_goal(member.state.cells, switch_off_coils(coils, member.state.coils))


@inlined
def coil_driver_step(member, step):
    """Let the coils' driver change what they are commanded to."""
    state = member.state
    goal = drive_as_given(member.constants.coils, state.coils, member.seed, step)
    put_goal(state.cells, goal)


@inlined
def fail_coils_step(member, failures, t):
    """Let the coils go where failures, which begin or end now, let them go."""
    goal = fail_coils(member.constants.coils, failures, member.state.coils, t)
    put_goal(member.state.cells, goal)


@inlined
def fail_members_coils(members, plant, t):
    """Let failures act on the coils of all members, if there are any."""
    failures = plant.failures.coils
    if failures.shape[0] > 0:
        each(members, fail_coils_step, failures, t)


@inlined
def leave_coils_off_step(member):
    """Remember that the coils stay off until the next control step."""
    c = member.state.cells[0]
    c.set_x, c.set_y, c.set_z = 0.0, 0.0, 0.0


def _drive_wheels(address, hold_steps, step):
    """Set the motors of the wheels until the next control step.

    In modes that leave the wheels off there is a torque only if it is commanded from outside.
    """
    loop = record_at(address)
    state, c = loop.members.member.state, loop.members.member.state.cells[0]
    torque, hold_s = (c.torque_x, c.torque_y, c.torque_z), hold_steps * loop.plan.step_s
    if state.board.chosen[0].wheels == 0.0 and torque == (0.0, 0.0, 0.0):
        switch_off_motors(state.allocation, state.rotors)
        return 0
    allocate_torque(loop.plan.allocation, state.allocation, state.rotors, torque, hold_s, step)
    return 0


#: Called by its address: only a satellite with wheels compiles it.
drive_wheels = Entry(_drive_wheels, 2)
_call_drive_wheels = entry_caller(2)


@inlined
def sense(address, actions, step, works):
    """Read the sensors; on a control step bring up to date what the computers know.

    `works`: whether the computers are not halted.
    """
    loop = record_at(address)
    members, plan, tables, t = loop.members, loop.plan, loop.tables, step * loop.plan.step_s
    if works and actions & COILS_OFF:
        each(members, coils_off_step)
    fail_members_coils(members, plan.plant, t)
    read_sensors(address, actions & ~loop.at[2], step)
    if works and actions & CONTROL:
        before_s = first_member(members).state.board.known[0].t_s
        if is_back(plan.plant.failures.computer, before_s, t):
            restart_computers(members, loop.boards, plan.first_board)
        left, mean = remaining_and_mean(plan.plant.coils.lag_s, t - before_s)
        each(members, update_step, left, mean, t)
        if plan.needs_ephemeris:
            each(members, ephemeris_step, ephemeris_at(plan.plant, tables, t))


@inlined
def actuate(address, row, step):
    """Hand the commands to coils and wheels."""
    loop = record_at(address)
    members = loop.members
    if row.actions & COILS_ON:
        drive_coils(members)
        if loop.plan.plant.coils.driver != 0:
            each(members, coil_driver_step, step)
    elif row.actions & COILS_STAY == 0:
        each(members, leave_coils_off_step)
    fail_members_coils(members, loop.plan.plant, step * loop.plan.step_s)
    if loop.plan.plant.rotors.rows.shape[0] > 0:
        _call_drive_wheels(loop.drive_wheels, address, row.hold_steps, step)


@inlined
def control(loop, step):
    """Let the computers work on what they know; how it ended."""
    members, plan, at = loop.members, loop.plan, loop.at
    if at[1] != WORKED:
        at[1] = SENSED
        if plan.driven_from_outside:
            estimate_for_outside(members, plan.computer)
        else:
            compute(members, plan, loop.tables, loop.boards, step)
        if plan.stops:
            at[1] = WORKED
            return WAITING
    if must_stop(members, has_command, BAD_COMMAND, step):
        return BAD_COMMAND
    at[1] = BETWEEN
    return RUNNING


@inlined
def has_reading(member):
    """Whether the sensor of the user's own has not failed at its last reading."""
    return member.state.sensors[OWN_SENSOR].own[0] == 0.0


def _run_steps(address, last):
    """Run on to step `last`; how it ended. `at` says how far it came.

    It may end at an event before, RUNNING, where many adaptive steps were needed. A run that
    `stops` ends at every control step, WAITING: when the computer has worked or, driven from
    outside, when the sensors have been read. It goes on from there with the command in the state.
    """
    loop = record_at(address)
    members, plan, at, timetable = loop.members, loop.plan, loop.at, loop.plan.timetable
    step = at[0]
    put_local(loop.local, lookup6(loop.tables.orbit, step * plan.step_s, 3))
    number, cycle = row_from(timetable, step)
    due = cycle + timetable.rows[number].step
    to_record = step + -step % plan.record_steps
    enough = first_member(members).state.cells[0].steps + _STEPS_TO_LOOK
    while step < last:
        look = GO_ON
        if step == due:
            row = timetable.rows[number]
            works = not is_halted(plan.plant.failures.computer, step * plan.step_s)
            if at[1] == BETWEEN:
                sense(address, row.actions, step, works)
                own_is_read = row.actions & (READ << OWN_SENSOR) != 0
                if own_is_read and must_stop(members, has_reading, BAD_READING, step):
                    return BAD_READING
            if works and row.actions & CONTROL:
                ended = control(loop, step)
                if ended != RUNNING:
                    return ended
                actuate(address, row, step)
            number += 1
            if number == timetable.rows.shape[0]:
                number, cycle = 0, cycle + timetable.cycle_steps
            due = cycle + timetable.rows[number].step
        if step == to_record:
            record_members(members, plan, step, loop.record, loop.boards)
            to_record += plan.record_steps
            look = LOOK
        until = min(due, to_record, last)
        until = call_propagate(loop.propagate, loop.problem, step, until, look)
        if until < 0:
            return -until
        step = at[0] = until
        if first_member(members).state.cells[0].steps > enough:
            break
    return RUNNING


#: `(address of a Loop, last) -> how it ended`, from Python.
run_steps = Entry(_run_steps, 1)


def _record_together(address, step):
    """Record this instant of several members, which the loop itself does not reach."""
    loop = record_at(address)
    record_members(loop.members, loop.plan, step, loop.record, loop.boards)
    return 0


#: `(address of a Loop, step)`, from Python.
record_together = Entry(_record_together, 1)
