"""Control steps of a simulated flight, recorded for the replay of an export."""

import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from torquer.base.user_source import plain_function
from torquer.compile.engine import with_attributes
from torquer.computer.computer import Board
from torquer.computer.gate import within_bounds
from torquer.computer.interface import PLACES, ROWS
from torquer.flight.c99.computer import Export
from torquer.flight.c99.interface import Input, handed_in
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.tables import count_state_words, state_numbers
from torquer.flight.c99.texts import fill_template
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.members import WAITING
from torquer.simulation.loop.state import CELLS
from torquer.simulation.setup.prepare import make_blocks
from torquer.simulation.setup.run import Run, prepare
from torquer.spacecraft.failures import is_back

_MAGIC = b"ADCSREC2"
#: Where attitude and rate of the estimate stand in the computer's record, and their names in C.
_PLACES = slice(PLACES["estimate_q_x"].start, PLACES["estimate_bias_x"].start)
_ESTIMATE = [name for name, of in PLACES.items() if _PLACES.start <= of.start < _PLACES.stop]
_FIRST = (CELLS.names or ()).index("dipole_x")
#: The hash FNV-1a: where it begins, its prime; modulo 2^64.
_BEGIN, _PRIME = np.uint64(0xCBF29CE484222325), np.uint64(0x100000001B3)


class Recorded(NamedTuple):
    """Control steps: whether the computer began afresh, inputs, commands, estimates (attitude,
    rate), marks of the state; `words` of 64 bits that the state has in C.
    """

    afresh: np.ndarray
    inputs: np.ndarray
    commands: np.ndarray
    estimates: np.ndarray
    marks: np.ndarray
    words: int

    def first(self, steps: int) -> "Recorded":
        """The first steps alone."""
        rows = (self.afresh, self.inputs, self.commands, self.estimates)
        afresh, inputs, commands, estimates = (part[:steps] for part in rows)
        return Recorded(afresh, inputs, commands, estimates, self.marks[:steps], self.words)

    def as_bytes(self) -> bytes:
        """The file that `test/replay.c` reads (little-endian)."""
        head = struct.pack("<8sQQQ", _MAGIC, len(self.marks), self.inputs.shape[1], self.words)
        answers = np.concatenate([self.commands, self.estimates], axis=1)
        rows = zip(self.afresh, self.inputs, answers, self.marks, strict=True)
        return head + b"".join(
            np.array([a, *i, *c], dtype="<f8").tobytes() + struct.pack("<Q", mark)
            for a, i, c, mark in rows
        )


def recorded_in_c(words: bytes) -> str:
    """The text of `test/recorded.c`: a record as an array, for boards without files."""
    texts = [f"UINT64_C(0x{word:016x})" for word in np.frombuffer(words, "<u8").tolist()]
    lines = [", ".join(texts[k : k + 4]) for k in range(0, len(texts), 4)]
    return fill_template("recorded.c", {"words": str(len(texts)), "rows": ",\n    ".join(lines)})


def mark_numbers(numbers: np.ndarray) -> np.ndarray:
    """Marks of the bits of all numbers of each row; one that is not a number has one mark."""
    words = numbers.view(np.uint64).copy()
    words[np.isnan(numbers)] = 0x7FF8000000000000
    marks = np.full(len(words), _BEGIN)
    for column in words.T:
        marks = (marks ^ column) * _PRIME
    return marks


def record_steps(scenario: Scenario, most: int, made: Export, given: Sequence[Input]) -> Recorded:
    """The first control steps of a run, at most so many; commands as the gate limits them.

    They have no marks for an export in single precision, whose state has other bits. ValueError if
    a law or an estimator of the user's would begin again there.
    """
    run = prepare(scenario, stops=True)
    afresh, commands, estimates, before_s = [], [], [], run.state.board.known["t_s"][0]
    inputs: list[np.ndarray] = []
    numbers: list[np.ndarray] = []
    first = run.state.board.known.copy()
    limited = plain_function(within_bounds)
    checks = made.checks
    dipole = [with_attributes(each) for each in (checks.dipole_axes, checks.dipole)]
    torque = [with_attributes(each) for each in (checks.torque_axes, checks.torque)]
    places = [*handed_in(given).values()]
    estimated = [name in made.known for name in _ESTIMATE]
    numbers_of, has_marks = state_numbers(made), not is_single()
    while len(inputs) < most and run.advance_to(run.steps) == WAITING:
        known = run.state.board.known.view(np.float64).reshape(-1)
        afresh.append(float(_begins_afresh(run, before_s, known[0])))
        inputs.append(known[places])
        asked = run.state.cells.view(np.float64).reshape(-1)[_FIRST : _FIRST + 6].tolist()
        commands.append(
            np.array([*limited(*dipole, (*asked[:3],)), *limited(*torque, (*asked[3:],))])
        )
        estimates.append(np.where(estimated, known[_PLACES], np.nan))
        _check_kept(scenario, run, made)
        board = _as_in_c(run, first, made)
        if has_marks:
            numbers.append(numbers_of(board))
        before_s = known[0]
    if not inputs:
        raise ValueError("simulation: must have a control step to be recorded; received none")
    a, i, c, e = map(np.array, (afresh, inputs, commands, estimates))
    marks = mark_numbers(np.array(numbers)) if has_marks else np.zeros(len(inputs), np.uint64)
    return Recorded(a, i, c, e, marks, count_state_words(run.state.board, made))


def _check_kept(scenario: Scenario, run: Run, made: Export) -> None:
    """ValueError for memory of the user's that the gate would let begin again: see `begin_anew`."""
    memory, first = run.state.board.memory, made.checks.first
    lost = np.flatnonzero(np.isfinite(first) & ~np.isfinite(memory))
    for m0, m1 in made.checks.own.tolist():
        for cell in lost[(lost >= m0) & (lost < m1)].tolist()[:1]:
            raise ValueError(
                f"control: {_owner(scenario, cell)} must keep finite numbers in its memory, where "
                f"it begins with such: in flight it would begin again; received {memory[cell]} "
                f"at t = {run.state.board.known['t_s'][0]:g} s"
            )


def _owner(scenario: Scenario, cell: int) -> str:
    """The law or estimator whose memory has this cell."""
    for name, block in make_blocks(scenario).by_key().items():
        cell -= len(block.first_memory())
        if cell < 0:
            return f"{block.kind.name} {name}"
    raise IndexError("no block has this cell")


def _as_in_c(run: Run, first: np.ndarray, made: Export) -> Board:
    """The board with readings as at the start that nothing on board uses: C is not given them.
    Nor those of a kind of several devices, but these it makes of the devices' readings itself.
    """
    board = run.state.board
    known = board.known.copy()
    kinds = run.plan.computer.selection.kinds["sensor"]
    unused = np.setdiff1d(np.arange(ROWS), [*made.checks.readings["row"], *kinds])
    for name in ("readings", "read_s"):
        known[name][:, unused] = first[name][:, unused]
    return board._replace(known=known)


def _begins_afresh(run: Run, before_s: float, t_s: float) -> bool:
    """Whether the computer comes back from a failure at this step."""
    failures = with_attributes(run.plan.plant.failures.computer)
    return bool(len(failures)) and bool(plain_function(is_back)(failures, before_s, t_s))
