"""Laws and estimators in plain Python: the compiled control step calls them back."""

from __future__ import annotations

import math

import numpy as np

from torquer.base.user_source import error_place, plain_function, printable, source_file
from torquer.compile.arguments import Callback
from torquer.computer.blocks.adapter import flat
from torquer.computer.blocks.block import Block
from torquer.computer.blocks.law import Law
from torquer.computer.computer import BEGIN, FIRST_ESTIMATOR, Blocks, Board, Computer
from torquer.computer.estimation.estimator import Estimator, has_failed, is_usable
from torquer.computer.inputs import Inputs, ReadingTimes
from torquer.computer.interface import (
    ESTIMATED,
    PLACES,
    ROWS,
    SENSED,
    SENSORS,
    UNKNOWN_ESTIMATE,
    Command,
    Ephemeris,
    Estimate,
    reading_places,
)
from torquer.computer.modes.table import LAW
from torquer.simulation.loop.state import Plan, State, find_arrays
from torquer.simulation.setup.signals import noted_signals
from torquer.spacecraft.sensors.device import MOST_PARTS


class HostFailed(Exception):
    """A function in plain Python raised an error, or its answer is not what it must be."""


#: Places in the record; a tuple is cut faster than its names are looked up.
_READINGS = tuple(map(reading_places, SENSORS))
_COILS = slice(PLACES["coils_x"].start, PLACES["coils_z"].stop)
_READ_S, _ROWS = PLACES["read_s"].start, PLACES["readings"].start
_TIMES, _ESTIMATED = slice(_READ_S, _READ_S + len(SENSORS)), slice(SENSED, ESTIMATED)
_GYRO_UNITS, _FLAGS = PLACES["gyro_units"].start, PLACES["isolated"].start
_ISOLATED = slice(_FLAGS, _FLAGS + len(SENSORS))
_UNITS_ISOLATED = slice(_ISOLATED.stop, _FLAGS + ROWS)
_UNITS = [
    (_READ_S + row, slice(_ROWS + MOST_PARTS * row, _ROWS + MOST_PARTS * (row + 1)))
    for row in range(len(SENSORS), ROWS)
]
_new = tuple.__new__  # a third of the time of a NamedTuple's own


def inputs_from(known: np.ndarray) -> Inputs:
    """The computer's record, as cells, as inputs for the interpreter: in 2 us."""
    k = tuple(known.tolist())
    e, p = k[_ESTIMATED], k[ESTIMATED:]
    flags = (k[_ISOLATED], k[_UNITS_ISOLATED])
    estimate = (e[0], e[1:5], e[5:8], e[8:11], e[11], e[12], *flags)
    ephemeris = (p[0:3], p[3:6], p[6:9], p[9:12], p[12:15], p[15])
    inputs = (
        k[0],
        *[k[places] for places in _READINGS],
        k[_COILS],
        _new(ReadingTimes, k[_TIMES]),
        _new(Estimate, estimate),
        _new(Ephemeris, ephemeris),
        tuple([(k[t], *k[r]) for t, r in _UNITS]),
        k[_GYRO_UNITS],
    )
    return _new(Inputs, inputs)


class Host:
    """Calls blocks in plain Python for the on-board computer, whose `computer` has its address.

    What a control step has changed on board is put back if a function fails, so that the control
    step can be taken again.
    """

    def __init__(self, computer: Computer, board: Board, blocks: Blocks):
        self._callback = Callback(self._call)
        self.computer = computer._replace(host=self._callback.address)
        self._board, self._laws = board, list(blocks.laws.values())
        self._estimators = list(blocks.estimators.values())
        self._signals, self._known = noted_signals(), board.known.view(np.float64)
        self._before: list[np.ndarray] = []
        self._error: BaseException | None = None

    def check(self) -> None:
        """Raise what a function has raised, once the loop has stopped for it."""
        if self._error is None:
            return
        for part, kept in zip(find_arrays(self._board), self._before, strict=False):
            part[...] = kept
        error, self._error = self._error, None
        raise error

    def _call(self, number: int) -> None:
        """What the control step calls; nothing may be raised through compiled code."""
        if number == BEGIN:
            self._before = [part.copy() for part in find_arrays(self._board)]
            return
        answer = self.computer.answer
        answer[:] = math.nan  # a command of no numbers stops the loop
        if self._error is not None:
            return
        try:
            if number < FIRST_ESTIMATOR:
                command = self._ask_block(self._laws[number], self.computer.law_blocks[number])
                answer[:6] = flat(tuple(command))
            else:
                number -= FIRST_ESTIMATOR
                row = self.computer.estimator_blocks[number]
                answer[:] = flat(tuple(self._ask_block(self._estimators[number], row)))
        except BaseException as error:  # an interrupt, too
            self._error = error

    def _ask_block(self, block: Block, row):
        """What a function answers, checked and unified."""
        before = self._signals.interrupt_at_once(True)
        try:
            return ask(block, row, self._board)
        finally:
            self._signals.interrupt_at_once(before)


def ask(block: Block, row, board: Board):
    """What a block's plain function answers to what is on board; `row`: its `BLOCK`."""
    parameters = block.record_from(board.parameters[row["p0"] : row["p1"]])
    cells = block.record_of(board.memory[row["m0"] : row["m1"]])
    try:
        answer = block(inputs_from(board.known.view(np.float64)), parameters, cells)
    except (Exception, SystemExit) as error:
        place = error_place(error, source_file(plain_function(block.function)))
        text = f"must not raise; received {printable(error)}{place}"
        raise HostFailed(f"{block.said}: {text}{block.place_in(text)}") from error
    return _unify(block, answer)


def working_laws(computer: Computer, board: Board) -> list[int]:
    """Numbers of the laws that work now."""
    table = computer.modes
    if not len(table.regions):
        return list(range(len(computer.law_blocks)))
    actions = []
    for now in board.modes.regions:
        state = table.states[int(now["state"])]
        actions += list(table.actions[state["first_action"] : state["after_action"]])
    return [int(action["index"]) for action in actions if action["kind"] == LAW]


def what_failed(blocks: Blocks, plan: Plan, state: State) -> str:
    """What was wrong with the last command; a compiled function that raised answers NaN.

    Estimator or laws are called once more in plain Python. Their memory is what the failed answer
    left: where that matters, they may raise nothing now.
    """
    board, computer = state.board, plan.computer
    tried = board._replace(memory=board.memory.copy(), known=board.known.copy())
    if has_failed(board.known[0]):
        return _what_failed_to_estimate(blocks, computer, tried)
    laws, working = list(blocks.laws.values()), working_laws(computer, board)
    for number in working:
        try:
            ask(laws[number], computer.law_blocks[number], tried)
        except HostFailed as error:
            return str(error)
    c = state.cells[0]
    answers = [float(c[f"{what}_{axis}"]) for what in ("dipole", "torque") for axis in "xyz"]
    shown = ", ".join(f"{x:g}" for x in answers)
    names = ", ".join(laws[number].said for number in working)
    unknown = ""
    if not plan.needs_ephemeris:
        unknown = " (the ephemeris is not numbers unless a law needs 'ephemeris')"
    text = f"must return finite numbers and must not raise; received {shown}{unknown}"
    return f"{names}: {text}{''.join(laws[number].place_in(text) for number in working)}"


def _what_failed_to_estimate(blocks: Blocks, computer: Computer, tried: Board) -> str:
    """What was wrong with the last estimate, by a board that may be changed."""
    number, tried.known["isolated"] = int(tried.chosen[0]["estimator"]), 0.0
    estimators = [*blocks.estimators.values()]
    asked = estimators[number : number + 1] if number >= 0 else []
    for block in asked:
        try:
            ask(block, computer.estimator_blocks[number], tried)
        except HostFailed as error:
            return str(error)
    names = ", ".join(block.said for block in asked or estimators)
    text = f"{_MUST_ESTIMATE} and must not raise; received another answer or an error"
    return f"{names}: {text}{''.join(block.place_in(text) for block in asked)}"


#: What an estimator must return.
_MUST_ESTIMATE = (
    "must return a torquer.Estimate whose parts are finite, or unknown as a whole (nan)"
)


def _unify(block: Block, answer):
    kind = block.kind
    if isinstance(block, Law) and block.answers != "command" and isinstance(answer, Command):
        text = "must be declared with answers='command' to return a Command; "
        text += f"received one that answers {block.answers!r}"
        raise HostFailed(f"{block.said}: {text}{block.place_in(text)}")
    try:
        unified = plain_function(kind.unify)(answer)
    except (TypeError, ValueError, AttributeError, IndexError):
        must = "three numbers" if kind.returns.startswith("(") else kind.returns
        text = f"must return {must}; received {printable(answer)}"
        raise HostFailed(f"{block.said}: {text}{block.place_in(text)}") from None
    if isinstance(block, Estimator) and not is_usable(unified):
        text = f"{_MUST_ESTIMATE}; received {_unusable(unified)}"
        raise HostFailed(f"{block.said}: {text}{block.place_in(text)}")
    if isinstance(block, Law):
        for what, part in (("dipole", unified.dipole_a_m2), ("torque", unified.torque_n_m)):
            if not all(map(math.isfinite, part)):
                shown = ", ".join(f"{x:g}" for x in part)
                text = f"must return a finite {what}; received ({shown})"
                raise HostFailed(f"{block.said}: {text}{block.place_in(text)}")
    return unified


def _unusable(estimate: Estimate) -> str:
    """The parts of an estimate that cannot be used, by name."""
    parts = {name: [*map(float, flat([v]))] for name, v in estimate._asdict().items()}
    known = UNKNOWN_ESTIMATE._asdict()
    wrong = {
        name: v for name, v in parts.items() if not is_usable(Estimate(**{**known, name: _one(v)}))
    }
    return printable({name: _one(v) for name, v in wrong.items()})


def _one(numbers: list):
    """Numbers as a part of an estimate."""
    return tuple(numbers) if len(numbers) > 1 else numbers[0]
