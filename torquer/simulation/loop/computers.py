"""The on-board computers of the members at a control step.

In lanes, laws alone are vectors over the members. Computers with modes or estimators work one after
another: which transition fires and what an estimator does is each member's own.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from torquer.compile.c_library import call_c
from torquer.compile.engine import caller, inlined
from torquer.compile.lanes import LANES
from torquer.compile.numba_private import INLINED_OPTIONS
from torquer.computer.allocation import AllocationState
from torquer.computer.computer import (
    NO_ESTIMATOR,
    SENSOR_READINGS,
    Board,
    Computer,
    combine,
    control_step,
    estimate,
    put_readings,
    put_simple_estimate,
    restart,
)
from torquer.computer.estimation.estimator import has_failed
from torquer.computer.interface import KNOWN, PLACES, ROWS, Command, put_ephemeris
from torquer.computer.modes.table import ModeState
from torquer.maths.geometry.vec3 import is_finite
from torquer.simulation.loop.members import One, each, member_in
from torquer.simulation.loop.sensors import ephemeris_at
from torquer.simulation.loop.state import State
from torquer.simulation.loop.timetable import READ, Timetable, all_actions
from torquer.spacecraft.sensors.device import MOST_PARTS
from torquer.spacecraft.sensors.devices import DEVICES

#: A law for all lanes: cells, how many, first place of its parameters and of its memory.
LANES_LAW = types.void(types.float64[::1], *[types.int64] * 3)
call_law_in_lanes = caller(LANES_LAW)


class WheelSpace(NamedTuple):
    """Where computers work on the wheels of one member: what they believe, the rotors' state."""

    believed: AllocationState
    rotors: np.ndarray


class Boards(NamedTuple):
    """What is on board of n members: the arrays of `Board` with an axis of members before.

    `numbers` (n, k): what is known, as numbers; n = 0 where laws work in vectors. `sensed`: places
    in it of what the loop tells the computers. `first`: as they were at the start; `wheels`: where
    they work on one member's wheels.
    """

    all: Board
    first: Board
    numbers: np.ndarray
    sensed: np.ndarray
    wheels: WheelSpace


def make_boards(
    state: State, parameters: np.ndarray, memory: np.ndarray, sensed: list[int]
) -> Boards:
    """Boards like that of a state for members with parameters (n, p) and memory (n, m)."""
    board = state.board

    def many(array: np.ndarray) -> np.ndarray:
        return np.repeat(array[None], len(parameters), axis=0)

    def boards() -> Board:
        modes, rest = ModeState(*map(many, board.modes)), (many(board.chosen), many(board.selected))
        return Board(many(board.known), parameters.copy(), memory.copy(), modes, *rest)

    flown = boards()
    numbers = flown.known.view(np.float64).reshape(len(parameters), KNOWN.itemsize // 8)
    believed = AllocationState(*(part.copy() for part in state.allocation))
    return Boards(
        flown,
        boards(),
        numbers,
        np.array(sensed, np.int64),
        WheelSpace(believed, state.rotors.copy()),
    )


def sensed_places(timetable: Timetable) -> list[int]:
    """Places in the record of what changes without the computer: time, coils, what is read."""
    due = all_actions(timetable)
    rows = [row for row in range(ROWS) if due & (READ << row)]
    readings, read_s = PLACES["readings"].start, PLACES["read_s"].start
    places = [*range(readings)]
    for row in rows:
        count = DEVICES[row].count if row < len(DEVICES) else MOST_PARTS
        first = readings + MOST_PARTS * row
        places += [*range(first, first + count), read_s + row]
    return places


def same_computers(one: Computer, other: Computer) -> bool:
    """Whether the computers of two members are the same but for parameters and memory."""

    def parts(computer: Computer) -> list:
        tables = [computer.law_blocks, computer.estimator_blocks, *computer.modes]
        tables += computer.selection
        return [*tables, computer.estimator]

    pairs = zip(parts(one), parts(other), strict=True)
    return all(a is b or np.array_equal(a, b) for a, b in pairs)


@inlined
def accept(cells, command):
    """Keep a command."""
    c = cells[0]
    c.dipole_x, c.dipole_y, c.dipole_z = command.dipole_a_m2
    c.torque_x, c.torque_y, c.torque_z = command.torque_n_m


@inlined
def has_command(member):
    """Whether a member's command is one of finite numbers, and no estimator has failed."""
    c = member.state.cells[0]
    dipole, torque = (c.dipole_x, c.dipole_y, c.dipole_z), (c.torque_x, c.torque_y, c.torque_z)
    worked = not has_failed(member.state.board.known[0])
    return is_finite(dipole) and is_finite(torque) and worked


@inlined
def _readings_step(member):
    put_readings(member.state.board.known[0])


@inlined
def _no_command_step(member):
    c = member.state.cells[0]
    c.dipole_x, c.dipole_y, c.dipole_z = 0.0, 0.0, 0.0
    c.torque_x, c.torque_y, c.torque_z = 0.0, 0.0, 0.0


@inlined
def select_board(one, lane):
    """The board of a member among those of all."""
    modes = one.modes
    return Board(
        one.known[lane],
        one.parameters[lane],
        one.memory[lane],
        ModeState(
            modes.regions[lane],
            modes.states[lane],
            modes.transitions[lane],
            modes.conditions[lane],
            modes.clock[lane],
            modes.sensors[lane],
            modes.checks[lane],
            modes.flags[lane],
        ),
        one.chosen[lane],
        one.selected[lane],
    )


@inlined
def command_from(computer, board):
    """The command for what is known on board: by the library in C, else by the control step.

    C has no estimate that nothing on board reads; the record has it all the same.
    """
    if computer.library != 0:
        number = int(board.chosen[0].estimator)
        m, of_blocks = board.modes, (board.known, board.parameters, board.memory)
        of_modes = (m.regions, m.states, m.transitions, m.conditions, m.clock, m.sensors, m.checks)
        of_rest = (m.flags, board.chosen, board.selected)
        a = call_c(computer.library, of_blocks + of_modes + of_rest)
        if number in (SENSOR_READINGS, NO_ESTIMATOR) and len(computer.select) == 0:
            put_simple_estimate(board.known[0], number)
        return Command((a[0], a[1], a[2]), (a[3], a[4], a[5]))
    return control_step(computer, board)


@inlined
def _laws_in_vectors(members, computer):
    """Computers with laws alone: those of all members at once.

    Of an estimate they know at most what sensors read: the rest is unknown from the start.
    """
    if computer.estimator == SENSOR_READINGS:
        each(members, _readings_step)
    each(members, _no_command_step)
    for number in range(computer.law_blocks.shape[0]):
        block = computer.law_blocks[number]
        law = computer.laws[block.function]
        call_law_in_lanes(law, members.cells, members.lanes, block.p0, block.m0)


@inlined
def _one_by_one(members, plan, tables, boards, step):
    """Computers with modes or estimators, one after another."""
    if plan.needs_ephemeris:
        ephemeris = ephemeris_at(plan.plant, tables, step * plan.step_s)
        for lane in range(members.lanes):
            put_ephemeris(boards.all.known[lane, 0], ephemeris)
    for lane in range(members.lanes):
        for place in boards.sensed:
            boards.numbers[lane, place] = members.cells[place * LANES + lane]
        board, member = select_board(boards.all, lane), member_in(members, lane)
        accept(member.state.cells, command_from(plan.computer, board))
        if has_failed(board.known[0]):
            member.state.cells[0].dipole_x = math.nan


def compute(members, plan, tables, boards, step):
    """Let the computers of all members find their commands."""
    state = members.member.state
    accept(state.cells, command_from(plan.computer, state.board))


@overload(compute, jit_options=INLINED_OPTIONS)
def _compute(members, plan, tables, boards, step):
    if members.instance_class is One:
        return compute

    def in_lanes(members, plan, tables, boards, step):
        if boards.numbers.shape[0] == 0:
            _laws_in_vectors(members, plan.computer)
        else:
            _one_by_one(members, plan, tables, boards, step)

    return in_lanes


def restart_computers(members, boards, first):
    """Let the computers begin as at the start of the run, but for their latest readings."""
    restart(members.member.state.board, first)


@overload(restart_computers, jit_options=INLINED_OPTIONS)
def _restart_computers(members, boards, first):
    if members.instance_class is One:
        return restart_computers

    def in_lanes(members, boards, first):
        for lane in range(boards.numbers.shape[0]):
            restart(select_board(boards.all, lane), select_board(boards.first, lane))

    return in_lanes


def estimate_for_outside(members, computer):
    """Bring the estimate up to date for software outside, which drives one satellite."""
    combine(computer, members.member.state.board)
    estimate(computer, members.member.state.board)


@overload(estimate_for_outside, jit_options=INLINED_OPTIONS)
def _estimate_for_outside(members, computer):
    if members.instance_class is One:
        return estimate_for_outside
    return lambda members, computer: None
