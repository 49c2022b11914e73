"""What is recorded of an instant."""

from typing import NamedTuple

import numpy as np
from numba.extending import overload

from torquer.compile.arguments import Entry, record_at
from torquer.compile.engine import kernel
from torquer.compile.lanes import LANES
from torquer.compile.numba_private import INLINED_OPTIONS
from torquer.computer.interface import GYRO, MAGNETOMETER, SUN_SENSORS, reading3
from torquer.simulation.loop.members import One, member_in
from torquer.simulation.loop.state import Plan, Record, State, read_motion
from torquer.spacecraft.actuators.coils import present_dipole
from torquer.spacecraft.actuators.rotors import relative_momentum


@kernel
def record_wheels(rotors, state, omega, kept):
    """Write what is kept of the wheels: momentum and motor torque of each."""
    count = rotors.rows.shape[0]
    for k in range(count):
        kept[k] = relative_momentum(rotors.rows, state, omega, k)
        kept[count + k] = state[k].motor


@kernel
def record_row(plan, state, coils, step, record):
    """Write what is kept of this instant into its row of the record; `coils`: their state."""
    number = step // plan.record_steps % record.rows.shape[0]
    cells, row, known = state.cells[0], record.rows[number], state.board.known[0]
    omega = (cells.omega_x, cells.omega_y, cells.omega_z)
    row.step = step
    row.q_x, row.q_y, row.q_z, row.q_w = cells.q_x, cells.q_y, cells.q_z, cells.q_w
    row.omega_x, row.omega_y, row.omega_z = omega
    row.dipole_x, row.dipole_y, row.dipole_z = present_dipole(plan.plant.coils, coils)
    row.b_measured_x, row.b_measured_y, row.b_measured_z = reading3(known, MAGNETOMETER)
    row.omega_measured_x, row.omega_measured_y, row.omega_measured_z = reading3(known, GYRO)
    row.sun_measured_x, row.sun_measured_y, row.sun_measured_z = reading3(known, SUN_SENSORS)
    row.command_x, row.command_y, row.command_z = cells.dipole_x, cells.dipole_y, cells.dipole_z
    row.torque_x, row.torque_y, row.torque_z = cells.torque_x, cells.torque_y, cells.torque_z
    record_wheels(plan.plant.rotors, state.rotors, omega, record.wheels[number])
    for k in range(plan.log_cells.shape[0]):
        record.log[number, k] = state.board.memory[plan.log_cells[k]]
    for region in range(record.modes.shape[1]):
        record.modes[number, region] = state.board.modes.regions[region].state
    if record.known.shape[0] > 0:
        record.known[number] = known


def record_members(members, plan, step, record, boards):
    """Record this instant: of one satellite a row, of several what `_record_members` says.

    Each at its number modulo the length of the record.
    """
    state = members.member.state
    record_row(plan, state, state.coils, step, record)


@overload(record_members, jit_options=INLINED_OPTIONS)
def _record_members(members, plan, step, record, boards):
    """Of several: attitude, rate, the numbers at `plan.log_cells`, and, as far as there is room,
    the momentum of each wheel. A place below 0 is one in the memory of a board, -1 the first."""
    if members.instance_class is One:
        return record_members

    def in_lanes(members, plan, step, record, boards):
        place, cells = step // plan.record_steps % record.shape[0], plan.log_cells
        for lane in range(members.lanes):
            x = read_motion(member_in(members, lane).state.cells)
            for k in range(4):
                record[place, k, lane] = x.q[k]
            for k in range(3):
                record[place, 4 + k, lane] = x.omega[k]
        for k in range(cells.shape[0]):
            cell = cells[k]
            for lane in range(members.lanes):
                if cell >= 0:
                    record[place, 7 + k, lane] = members.cells[cell * LANES + lane]
                else:
                    record[place, 7 + k, lane] = boards.all.memory[lane, -1 - cell]
        first = 7 + cells.shape[0]
        for k in range(record.shape[1] - first):
            for lane in range(members.lanes):
                member = member_in(members, lane)
                rows, state = member.constants.rotors.rows, member.state
                omega = read_motion(state.cells).omega
                record[place, first + k, lane] = relative_momentum(rows, state.rotors, omega, k)

    return in_lanes


class Instant(NamedTuple):
    """What `record_instant` takes; `coils`: their state."""

    plan: Plan
    state: State
    coils: np.ndarray
    record: Record


def _record_instant(address, step):
    """Record an instant of one satellite outside the loop."""
    instant = record_at(address)
    record_row(instant.plan, instant.state, instant.coils, step, instant.record)
    return 0


#: `(address of an Instant, step)`, from Python.
record_instant = Entry(_record_instant, 1)
