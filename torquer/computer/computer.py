"""The on-board computer: estimator, modes, laws. What it knows goes in, a command comes out.

Estimators and laws are called by their addresses, built-in and the user's alike; their parameters
and memory are slices of two arrays.
"""

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from torquer.compile.engine import addresses, call_host, caller, inlined, kernel, whole
from torquer.computer.blocks import plugin
from torquer.computer.blocks.adapter import flat
from torquer.computer.blocks.block import Block
from torquer.computer.blocks.law import KINDS, Law
from torquer.computer.estimation.estimator import Estimator, call_estimator
from torquer.computer.informed import is_informed, known_attitude, known_vector
from torquer.computer.inputs import flags, unit_flags
from torquer.computer.interface import (
    ATTITUDE_SENSOR,
    GYRO,
    KNOWN,
    NO_COMMAND,
    SENSORS,
    UNKNOWN_ESTIMATE,
    Command,
    Estimate,
    nothing_known,
    put_estimate,
)
from torquer.computer.modes.table import (
    AXIS_OFF,
    COILS,
    ESTIMATOR,
    LAW,
    LAW_OFF,
    NO_MODES,
    SELECT,
    SET,
    WHEELS,
    ModeState,
    ModeTable,
    check,
    first_state,
    switch_modes,
)
from torquer.computer.selection import FAILED, NO_SELECTION, WANTED, Selection, nothing_kept, select
from torquer.maths.geometry.vec3 import add, add_scaled

#: In place of an estimator's number: attitude sensor and gyro as they read; nothing known; what a
#: law states.
SENSOR_READINGS, NO_ESTIMATOR, OF_LAW = -1, -2, -3
#: A block: its function's number, -1 for one in plain Python; first and last place of its
#: parameters and of its memory; place of the estimate that it states, -1 for none; what it waits
#: for if it is a law.
BLOCK = np.dtype(
    [(name, np.int64) for name in ("function", "p0", "p1", "m0", "m1", "states", "waits")]
)
#: What a host is called for, besides laws by their numbers: a control step begins; estimator
#: number n is called for by FIRST_ESTIMATOR + n.
BEGIN, FIRST_ESTIMATOR = -1, 1 << 32


class Computer(NamedTuple):
    """What stays the same: functions and blocks of laws and estimators, mode table.

    `laws`, `estimators`, `switch`: addresses of the functions; `switch`: that which switches the
    modes, and that which checks sensors and coils before, if they are to be. `estimator`:
    the one that works where no mode chooses another. `host`: address of the function that calls
    blocks in plain Python, 0 where there are none; its `answer` is the numbers of a command or of
    an estimate. `library`: address of the control step in C that works in place of all of these, 0
    where none does. `selection`: how several devices of a kind become one, `select`: address of the
    function that does it, if any are.
    """

    laws: np.ndarray | tuple
    estimators: np.ndarray | tuple
    law_blocks: np.ndarray
    estimator_blocks: np.ndarray
    modes: ModeTable
    switch: np.ndarray
    estimator: int
    host: Any
    answer: np.ndarray
    library: Any
    selection: Selection
    select: np.ndarray


#: What the modes have chosen: estimator, and whether coils and wheels may work, the coils also by
#: the axes of the dipole. `stated`: 1 if a law stated the estimate at the last control step.
CHOSEN = np.dtype(
    [
        (name, np.float64)
        for name in ("estimator", "coils", "wheels", "coil_x", "coil_y", "coil_z", "stated")
    ]
)


class Board(NamedTuple):
    """What changes on board: what is known, parameters and memory of all blocks, modes.

    `selected`: what is kept to choose among several devices of a kind.
    """

    known: np.ndarray
    parameters: np.ndarray
    memory: np.ndarray
    modes: ModeState
    chosen: np.ndarray
    selected: np.ndarray


def _switch_modes(table, state, known):
    return switch_modes(table, state, known[0])


def _check(table, state, known):
    check(table, state, known[0])
    return True


def _select(selection, kept, known):
    select(selection, kept, known[0])
    return True


def switch_signature():
    """Numba's signature of what switches modes or checks sensors."""
    import numba

    state = numba.typeof(first_state(NO_MODES, []))
    return numba.boolean(numba.typeof(NO_MODES), state, numba.from_dtype(KNOWN)[::1])


def select_signature():
    """Numba's signature of what chooses among devices of a kind."""
    import numba

    kept = numba.float64[:, ::1]
    return numba.boolean(numba.typeof(NO_SELECTION), kept, numba.from_dtype(KNOWN)[::1])


#: Called by its address: only satellites with several devices of a kind compile it.
call_select = caller(select_signature)
#: Called by its address, as laws are: only a run with modes compiles it.
call_switch = caller(switch_signature)
call_law = caller(lambda: KINDS["command"].in_loop)


@inlined
def _answered_estimate(a):
    q, omega, bias = (a[1], a[2], a[3], a[4]), (a[5], a[6], a[7]), (a[8], a[9], a[10])
    units = unit_flags(a, 13 + len(SENSORS))
    return Estimate(a[0], q, omega, bias, a[11], a[12], flags(a[13:]), units)


@inlined
def _answered_command(a):
    return Command((a[0], a[1], a[2]), (a[3], a[4], a[5]))


@kernel
def estimate_step(computer, board, number):
    """Let an estimator work."""
    block = computer.estimator_blocks[number]
    if block.function < 0:
        call_host(computer.host, FIRST_ESTIMATOR + number)
        put_estimate(board.known[0], _answered_estimate(computer.answer))
        return
    parameters = board.parameters[block.p0 : block.p1]
    memory = board.memory[block.m0 : block.m1]
    estimate = call_estimator(computer.estimators[block.function], board.known, parameters, memory)
    put_estimate(board.known[0], estimate)


@inlined
def put_readings(known):
    """Attitude and rate of the estimate are what sensor and gyro read, finite or unknown."""
    q, omega = known.readings[ATTITUDE_SENSOR], known.readings[GYRO]
    x, y, z = known_vector((omega[0], omega[1], omega[2]))
    known.estimate_omega_x, known.estimate_omega_y, known.estimate_omega_z = x, y, z
    x, y, z, w = known_attitude((q[0], q[1], q[2], q[3]))
    known.estimate_s = known.read_s[ATTITUDE_SENSOR]
    known.estimate_q_x, known.estimate_q_y = x, y
    known.estimate_q_z, known.estimate_q_w = z, w


@inlined
def take_readings(known):
    """The estimate is what attitude sensor and gyro read; they state neither error nor bias.

    Those of an estimator that worked in an earlier mode are dropped.
    """
    put_readings(known)
    known.estimate_bias_x, known.estimate_bias_y, known.estimate_bias_z = 0.0, 0.0, 0.0
    known.sigma_rad, known.sigma_rad_s = math.nan, math.nan
    for sensor in range(known.isolated.shape[0]):
        known.isolated[sensor] = 0.0


@inlined
def want(computer, board, sensor, row):
    """Let laws read one of several devices of a kind."""
    if len(computer.select) > 0:
        board.selected[sensor, WANTED] = row


@inlined
def name_failed(computer, board):
    """Isolate those of several devices that have failed, whatever the estimator makes of them."""
    if len(computer.select) > 0:
        for row in range(len(SENSORS), board.selected.shape[0]):
            if board.selected[row, FAILED] > 0.0:
                board.known[0].isolated[row] = 1.0


@inlined
def take_stated(computer, board, number):
    """The estimate is what a law has just stated, where it states one and the modes choose it."""
    chosen, at = board.chosen[0], computer.law_blocks[number].states
    if at < 0 or chosen.estimator != OF_LAW or board.memory[at] == 0.0:
        return
    m, e, known = board.memory, UNKNOWN_ESTIMATE, board.known[0]
    q, omega = (m[at + 1], m[at + 2], m[at + 3], m[at + 4]), (m[at + 5], m[at + 6], m[at + 7])
    bias, sigma, sigma_rate = e.gyro_bias_rad_s, e.sigma_rad, e.sigma_rad_s
    put_estimate(
        known, Estimate(known.t_s, q, omega, bias, sigma, sigma_rate, e.isolated, e.isolated_units)
    )
    name_failed(computer, board)
    chosen.stated = 1.0


@inlined
def put_simple_estimate(known, number):
    """The estimate without an estimator: what attitude sensor and gyro read, or none."""
    if number == SENSOR_READINGS:
        take_readings(known)
    else:
        put_estimate(known, UNKNOWN_ESTIMATE)


@inlined
def estimate(computer, board):
    """Bring the estimate up to date; one that a law stated lasts until the law's next command."""
    number, stated = int(board.chosen[0].estimator), board.chosen[0].stated
    board.chosen[0].stated = 0.0
    if number == OF_LAW and stated > 0.0:
        return
    if number < 0:
        put_simple_estimate(board.known[0], number)
    else:
        estimate_step(computer, board, number)


@kernel
def enter_modes(computer, board, t_s):
    """Do what the states that have been entered are to set; estimator and actuators of all."""
    table, chosen = computer.modes, board.chosen[0]
    chosen.estimator, chosen.coils, chosen.wheels = float(computer.estimator), 1.0, 1.0
    chosen.coil_x, chosen.coil_y, chosen.coil_z = 1.0, 1.0, 1.0
    if len(computer.select) > 0:
        for n in range(computer.selection.kinds.shape[0]):
            board.selected[computer.selection.kinds[n].sensor, WANTED] = -1.0
    for region in range(table.regions.shape[0]):
        now = board.modes.regions[region]
        state = table.states[int(now.state)]
        for place in range(state.first_action, state.after_action):
            action = table.actions[place]
            if action.kind == SET and now.since_s == t_s:
                board.parameters[action.index] = action.value
            elif action.kind == ESTIMATOR:
                chosen.estimator = float(action.index)
            elif action.kind == COILS:
                chosen.coils = action.value
            elif action.kind == WHEELS:
                chosen.wheels = action.value
            elif action.kind == AXIS_OFF:
                chosen.coil_x = 0.0 if action.index == 0 else chosen.coil_x
                chosen.coil_y = 0.0 if action.index == 1 else chosen.coil_y
                chosen.coil_z = 0.0 if action.index == 2 else chosen.coil_z
            elif action.kind == SELECT:
                want(computer, board, action.index, action.value)


@inlined
def run_law(computer, board, number):
    """The command of a law; none, and nothing remembered, while it lacks what it waits for."""
    block = computer.law_blocks[number]
    if not is_informed(block.waits, board.known[0]):
        return NO_COMMAND
    if block.function < 0:
        call_host(computer.host, number)
        return _answered_command(computer.answer)
    parameters = board.parameters[block.p0 : block.p1]
    memory = board.memory[block.m0 : block.m1]
    command = call_law(computer.laws[block.function], board.known, parameters, memory)
    take_stated(computer, board, number)
    return command


@inlined
def switch(computer, board):
    """Switch the modes, and do what the states that have been entered are to set.

    Checks of sensors and coils, where there are any, come first.
    """
    known = board.known[0]
    table, state = whole(computer.modes), whole(board.modes)
    if len(computer.switch) > 1:
        call_switch(computer.switch[1], table, state, board.known)
    if call_switch(computer.switch[0], table, state, board.known):
        enter_modes(computer, board, known.t_s)


@inlined
def allow_dipole(chosen, dipole):
    """The part of a dipole that the modes let the coils make, whatever a law asks of the others."""
    x, y, z = dipole
    on = chosen.coils > 0.0
    return (
        x if on and chosen.coil_x > 0.0 else 0.0,
        y if on and chosen.coil_y > 0.0 else 0.0,
        z if on and chosen.coil_z > 0.0 else 0.0,
    )


@inlined
def is_off(table, modes, law):
    """Whether a present state keeps a law from working."""
    off = False
    for region in range(table.regions.shape[0]):
        state = table.states[int(modes.regions[region].state)]
        for place in range(state.first_action, state.after_action):
            action = table.actions[place]
            off = off or (action.kind == LAW_OFF and action.index == law)
    return off


@kernel
def command_by_modes(computer, board):
    """Switch the modes; the command of the present states' laws, added by their factors."""
    switch(computer, board)
    table = computer.modes
    dipole, torque = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for region in range(table.regions.shape[0]):
        state = table.states[int(board.modes.regions[region].state)]
        for place in range(state.first_action, state.after_action):
            action = table.actions[place]
            if action.kind == LAW and not is_off(table, board.modes, action.index):
                command = run_law(computer, board, action.index)
                dipole = add_scaled(dipole, action.value, command.dipole_a_m2)
                torque = add_scaled(torque, action.value, command.torque_n_m)
    torque = torque if board.chosen[0].wheels > 0.0 else (0.0, 0.0, 0.0)
    return Command(allow_dipole(board.chosen[0], dipole), torque)


@inlined
def combine(computer, board):
    """Let several devices of a kind become one."""
    if len(computer.select) > 0:
        call_select(computer.select[0], whole(computer.selection), board.selected, board.known)


@inlined
def control_step(computer, board):
    """The command for what the computer knows; without modes that of all laws, added."""
    if computer.host != 0:
        call_host(computer.host, BEGIN)
    combine(computer, board)
    estimate(computer, board)
    name_failed(computer, board)
    if computer.modes.regions.shape[0] > 0:
        return command_by_modes(computer, board)
    dipole, torque = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for number in range(computer.law_blocks.shape[0]):
        command = run_law(computer, board, number)
        dipole = add(dipole, command.dipole_a_m2)
        torque = add(torque, command.torque_n_m)
    return Command(dipole, torque)


@inlined
def _copy(to, source):
    for place in range(source.shape[0]):
        to[place] = source[place]


@kernel
def restart(board, first):
    """Begin as with another board: parameters, memory, modes and estimate; readings are kept."""
    _copy(board.parameters, first.parameters)
    _copy(board.memory, first.memory)
    _copy(board.chosen, first.chosen)
    for row in range(first.selected.shape[0]):
        for place in range(first.selected.shape[1]):
            board.selected[row, place] = first.selected[row, place]
    _copy(board.modes.regions, first.modes.regions)
    _copy(board.modes.states, first.modes.states)
    _copy(board.modes.transitions, first.modes.transitions)
    _copy(board.modes.conditions, first.modes.conditions)
    _copy(board.modes.clock, first.modes.clock)
    _copy(board.modes.sensors, first.modes.sensors)
    _copy(board.modes.checks, first.modes.checks)
    _copy(board.modes.flags, first.modes.flags)
    board.known[0].gyro_units = 0.0
    put_estimate(board.known[0], UNKNOWN_ESTIMATE)


class Blocks(NamedTuple):
    """Laws and estimators of a run, by name."""

    laws: dict[str, Law]
    estimators: dict[str, Estimator]

    def all(self) -> list[Block]:
        """Laws, then estimators: the order of their parameters and memory."""
        return [*self.laws.values(), *self.estimators.values()]

    def by_key(self) -> dict[str, Block]:
        """Laws and estimators by their keys."""
        return self.laws | self.estimators

    @property
    def compiled(self) -> bool:
        """Whether the loop can call all of them."""
        return all(block.compiled for block in self.all())


def make_computer(
    blocks: Blocks,
    estimator: int,
    modes: ModeTable,
    selection: Selection = NO_SELECTION,
    is_flown: bool = True,
) -> Computer:
    """The computer for the loop; blocks in plain Python are left to a host.

    `is_flown`: False for a description alone, without functions that switch the modes.
    """
    laws, law_numbers = _functions(blocks.laws.values())
    estimators, numbers = _functions(blocks.estimators.values())
    p = np.cumsum([0, *(len(block.pack()) for block in blocks.all())])
    m = np.cumsum([0, *(len(block.first_memory()) for block in blocks.all())])
    rows = np.zeros(len(blocks.all()), BLOCK)
    rows["p0"], rows["p1"], rows["m0"], rows["m1"] = p[:-1], p[1:], m[:-1], m[1:]
    rows["function"] = [*law_numbers, *numbers]
    split = len(blocks.laws)
    for row, law in zip(rows, blocks.laws.values(), strict=False):
        row["waits"] = law.waits
    stated = np.array([law.states_at for law in blocks.laws.values()], dtype=np.int64)
    rows["states"] = -1
    rows["states"][:split] = np.where(stated < 0, -1, rows["m0"][:split] + stated)
    law_rows, estimator_rows = rows[:split].copy(), rows[split:].copy()
    switch = _switch(modes.is_checked) if is_flown and len(modes.regions) else addresses([])
    answer = np.zeros(len(flat(tuple(UNKNOWN_ESTIMATE))))
    select = _selecting() if is_flown and len(selection.kinds) else addresses([])
    return Computer(
        *(laws, estimators, law_rows, estimator_rows, modes, switch, estimator, 0, answer, 0),
        *(selection, select),
    )


def estimates(computer: Computer) -> bool:
    """Whether there is an estimate beyond what sensors read: of an estimator or of a law."""
    actions = computer.modes.actions
    chosen = {computer.estimator, *actions["index"][actions["kind"] == ESTIMATOR].tolist()}
    return len(computer.estimator_blocks) > 0 or OF_LAW in chosen


def _functions(blocks) -> tuple[np.ndarray | tuple, list[int]]:
    """Addresses of the different functions of blocks; the number of each block's."""
    compiled = [block.in_loop() for block in blocks if block.compiled]
    different = list(dict.fromkeys(compiled))
    numbers = [different.index(block.in_loop()) if block.compiled else -1 for block in blocks]
    return addresses(different), numbers


@functools.cache
def _switch(checked: bool) -> np.ndarray | tuple:
    functions = [_switch_modes, _check] if checked else [_switch_modes]
    return addresses(
        [plugin.first_class(f, switch_signature(), "modes: must compile") for f in functions]
    )


@functools.cache
def _selecting() -> np.ndarray | tuple:
    return addresses([plugin.first_class(_select, select_signature(), "selection: must compile")])


def parameter_places(blocks: Blocks) -> dict[str, tuple[int, int]]:
    """Where each parameter of a law stands on the board: `law.parameter` -> first place, count."""
    places, first = {}, 0
    for name, block in blocks.by_key().items():
        own = block.places()
        places |= {f"{name}.{key}": (first + at, count) for key, (at, count) in own.items()}
        first += len(block.pack())
    return places


def first_board(
    blocks: Blocks, modes: ModeState, estimator: int, selection: Selection = NO_SELECTION
) -> Board:
    """What is on board at the start."""
    parameters = [block.pack() for block in blocks.all()]
    memory = [block.first_memory() for block in blocks.all()]
    return Board(
        known=nothing_known(),
        parameters=np.concatenate([*parameters, []]),
        memory=np.concatenate([*memory, []]),
        modes=modes,
        chosen=np.array([(estimator, *[1.0] * 5, 0.0)], CHOSEN),
        selected=nothing_kept(selection),
    )
