"""The on-board computers of `LANES` members of one orbit.

Laws alone are vectors over the members. Computers with modes or estimators work one after another:
which transition fires and what an estimator does is each member's own.
"""

from typing import NamedTuple

import numpy as np
from numba import types

from torquer.adapter import ARRAY
from torquer.control.computer import NO_ESTIMATOR, Board, Computer, control_step, take_readings
from torquer.control.modes.table import ModeState
from torquer.engine import caller, internal
from torquer.interface import KNOWN, UNKNOWN_ESTIMATE, put_ephemeris, put_estimate
from torquer.lanes import LANES, lane_state
from torquer.simulation.sensors import ephemeris_at, tell_dipole
from torquer.simulation.step import BAD_COMMAND, RUNNING, accept, finite3
from torquer.spacecraft.coils import remaining_and_mean

#: A law for all lanes: cells, how many, first place of its parameters and of its memory, what it
#: needs.
LANES_LAW = types.void(ARRAY, *[types.int64] * 5)
call_law = caller(LANES_LAW)
#: Of a member: how it ended, and the step.
END = np.dtype([("how", np.int64), ("step", np.int64)])
#: Numbers of `KNOWN` that sensors write; the rest is the computer's own.
SENSED = KNOWN.names.index("estimate_s")


class Boards(NamedTuple):
    """What is on board of n members: the arrays of `Board` with an axis of members before.

    `numbers` (n, k): what is known, as numbers.
    """

    all: Board
    numbers: np.ndarray


def boards_of(board: Board, parameters: np.ndarray, memory: np.ndarray) -> Boards:
    """Boards like this one for members with parameters (n, p) and memory (n, m) of their own."""

    def many(array: np.ndarray) -> np.ndarray:
        return np.repeat(array[None], len(parameters), axis=0)

    modes, known = ModeState(*map(many, board.modes)), many(board.known)
    numbers = known.view(np.float64).reshape(len(known), -1)
    return Boards(Board(known, parameters, memory, modes, many(board.chosen)), numbers)


def same_computers(one: Computer, other: Computer) -> bool:
    """Whether the computers of two members are the same but for parameters and memory."""

    def parts(computer: Computer) -> list:
        tables = [computer.law_blocks, computer.estimator_blocks, *computer.modes]
        return [*tables, computer.estimator]

    return all(map(np.array_equal, parts(one), parts(other)))


@internal
def end(ends, lane, how, step):
    """Note how and when a member ended, if it had not before."""
    if ends[lane].how == RUNNING:
        ends[lane].how, ends[lane].step = how, step


@internal
def tell_ephemeris(layout, cells, count, ephemeris):
    """Tell the computers where they are."""
    for lane in range(count):
        put_ephemeris(lane_state(layout, cells, lane).board.known[0], ephemeris)


@internal
def estimate_in_lanes(layout, cells, count, estimator):
    """The estimates: the readings of attitude sensor and gyro, or none."""
    if estimator == NO_ESTIMATOR:
        for lane in range(count):
            put_estimate(lane_state(layout, cells, lane).board.known[0], UNKNOWN_ESTIMATE)
    else:
        for lane in range(count):
            take_readings(lane_state(layout, cells, lane).board.known[0])


@internal
def begin_in_lanes(layout, plan, cells, count, t):
    """Tell the computers the time and what their coils have done.

    `count`: LANES; a number that the compiler knows would make it write out this short loop, member
    by member, instead of taking vectors.
    """
    since = t - lane_state(layout, cells, 0).board.known[0].t_s
    left, mean = remaining_and_mean(plan.plant.coils.lag_s, since)
    for lane in range(count):
        state = lane_state(layout, cells, lane)
        tell_dipole(state, left, mean)
        state.board.known[0].t_s = t


@internal
def ask_for_nothing(layout, cells, count):
    """Put no command in place of the last one; `count` as above."""
    for lane in range(count):
        c = lane_state(layout, cells, lane).cells[0]
        c.dipole_x, c.dipole_y, c.dipole_z = 0.0, 0.0, 0.0


@internal
def has_command(layout, cells, lane):
    """Whether a member's command is finite."""
    c = lane_state(layout, cells, lane).cells[0]
    return finite3((c.dipole_x, c.dipole_y, c.dipole_z))


@internal
def accept_commands(layout, cells, count, ends, step):
    """End the members whose command is not finite."""
    bad = 0
    for lane in range(count):
        bad += not has_command(layout, cells, lane)
    if bad > 0:
        for lane in range(count):
            if not has_command(layout, cells, lane):
                end(ends, lane, BAD_COMMAND, step)


@internal
def board_of(boards, lane):
    """The board of a member."""
    one, modes = boards.all, boards.all.modes
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
        ),
        one.chosen[lane],
    )


@internal
def tell_readings(cells, numbers, lane):
    """Copy what the sensors have read from a lane, where what is known comes first."""
    for place in range(SENSED):
        numbers[lane, place] = cells[place * LANES + lane]


@internal
def control_one_by_one(layout, plan, tables, boards, cells, count, ends, step):
    """Let computers with modes or estimators work, one after another.

    Which transition fires, which law works and what an estimator does is each member's own.
    """
    if plan.needs_ephemeris:
        ephemeris = ephemeris_at(plan.plant, tables, step * plan.step_s)
        for lane in range(count):
            put_ephemeris(boards.all.known[lane, 0], ephemeris)
    for lane in range(count):
        tell_readings(cells, boards.numbers, lane)
        command = control_step(plan.computer, board_of(boards, lane))
        if not accept(lane_state(layout, cells, lane), command):
            end(ends, lane, BAD_COMMAND, step)


@internal
def control_by_laws(layout, plan, tables, cells, count, ends, step):
    """Let computers work that have neither: the laws of all members, in vectors."""
    estimate_in_lanes(layout, cells, count, plan.computer.estimator)
    if plan.needs_ephemeris:
        ephemeris = ephemeris_at(plan.plant, tables, step * plan.step_s)
        tell_ephemeris(layout, cells, count, ephemeris)
    ask_for_nothing(layout, cells, count)
    for number in range(plan.computer.law_blocks.shape[0]):
        block = plan.computer.law_blocks[number]
        needs = (block.needs_attitude, block.needs_rate)
        call_law(plan.computer.laws[block.function], cells, count, block.p0, block.m0, *needs)
    accept_commands(layout, cells, count, ends, step)


@internal
def control_in_lanes(layout, plan, tables, boards, cells, count, ends, step):
    """Let the computers of all members work; `boards`: () where laws work in vectors."""
    begin_in_lanes(layout, plan, cells, count, step * plan.step_s)
    if len(boards) == 0:
        control_by_laws(layout, plan, tables, cells, count, ends, step)
        return
    control_one_by_one(layout, plan, tables, boards, cells, count, ends, step)
