"""The control step taken outside the loop: laws and estimators in plain Python.

The loop stops at the control step when the sensors have been read; the same control step is then
taken here, in the interpreter, and the loop goes on with its command. What is compiled of the
computer stays compiled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from torquer import plugin
from torquer.adapter import flat
from torquer.block import Block
from torquer.control.law import Law
from torquer.control.modes.table import LAW
from torquer.geometry.vec3 import add_scaled, scale
from torquer.interface import KNOWN, NO_COMMAND, Command, Ephemeris, Estimate, Inputs, ReadingTimes
from torquer.simulation import boxed
from torquer.simulation.state import arrays_of
from torquer.simulation.stopping import heeded

if TYPE_CHECKING:
    from torquer.simulation.run import Run

_ZERO = (0.0, 0.0, 0.0)


class HostFailed(Exception):
    """A function in plain Python raised an error, or its answer is not what it must be."""


_PLACE = {name: place for place, name in enumerate(KNOWN.names)}


def _part(first: str, count: int) -> slice:
    return slice(_PLACE[first], _PLACE[first] + count)


#: Places in the record; a tuple is cut faster than its names are looked up.
_B, _B_RATE, _OMEGA, _SUN = (_part(f"{name}_x", 3) for name in ("b", "b_rate", "omega", "sun"))
_Q, _WHEELS, _COILS, _TIMES = (
    _part("q_x", 4),
    _part("wheels_x", 3),
    _part("coils_x", 3),
    _part("b_s", 6),
)
_ESTIMATED, _ESTIMATED_AT = _part("estimate_s", 13), _PLACE["estimate_s"]
_ESTIMATED_Q, _ESTIMATED_OMEGA = _part("estimate_q_x", 4), _part("estimate_omega_x", 3)
_BIAS, _SIGMA = _part("estimate_bias_x", 3), _PLACE["sigma_rad"]
_R, _V, _MODEL_B = (_part(f"{name}_x", 3) for name in ("position", "velocity", "model_b"))
_MODEL_RATE, _TO_SUN, _LIT = _part("model_b_rate_x", 3), _part("to_sun_x", 3), _PLACE["lit"]
_new = tuple.__new__  # a third of the time of a NamedTuple's own


def inputs_from(known: np.ndarray) -> Inputs:
    """The computer's record, as cells, as inputs for the interpreter: in 2 us."""
    k = tuple(known.tolist())
    estimate = (
        k[_ESTIMATED_AT],
        k[_ESTIMATED_Q],
        k[_ESTIMATED_OMEGA],
        k[_BIAS],
        k[_SIGMA],
        k[_SIGMA + 1],
    )
    ephemeris = (k[_R], k[_V], k[_MODEL_B], k[_MODEL_RATE], k[_TO_SUN], k[_LIT])
    inputs = (
        k[0],
        k[_B],
        k[_B_RATE],
        k[_OMEGA],
        k[_SUN],
        k[_Q],
        k[_WHEELS],
        k[_COILS],
        _new(ReadingTimes, k[_TIMES]),
        _new(Estimate, estimate),
        _new(Ephemeris, ephemeris),
    )
    return _new(Inputs, inputs)


class Host:
    """Takes a run's control steps in the interpreter."""

    def __init__(self, run: Run):
        self.run = run
        self.box = run.box()
        self.signals = heeded()
        self.known = run.state.board.known.view(np.float64)
        self.laws = list(run.blocks.laws.values())
        self.estimators = list(run.blocks.estimators.values())

    def answer(self) -> None:
        """Take the control step; `HostFailed` if a function fails, memory as before then."""
        board = self.run.state.board
        before = [part.copy() for part in arrays_of(board)]
        try:
            self.run.accept(self._command())
        except BaseException:  # an interrupt, too: the control step will be taken again
            for part, kept in zip(arrays_of(board), before, strict=True):
                part[...] = kept
            raise

    def what_failed(self) -> str:
        """What was wrong with the last answers; a compiled function that raised answers NaN.

        The laws are called once more in plain Python. Their memory is what the failed answer left:
        where that matters, they may raise nothing now.
        """
        memory = self.run.state.board.memory.copy()
        rows = self.run.plan.computer.law_blocks
        for number, _ in self._working():
            try:
                self._called(self.laws[number], rows[number], memory)
            except HostFailed as error:
                return str(error)
        c = self.run.state.cells[0]
        answers = [float(c[f"{what}_{axis}"]) for what in ("dipole", "torque") for axis in "xyz"]
        shown = ", ".join(f"{x:g}" for x in answers)
        names = ", ".join(self.laws[number].name for number, _ in self._working())
        unknown = ""
        if not self.run.plan.needs_ephemeris:
            unknown = " (the ephemeris is not numbers unless a law needs 'ephemeris')"
        return (
            f"law {names}: must return finite numbers and must not raise; received {shown}{unknown}"
        )

    def _command(self) -> Command:
        """The control step: estimator, modes, laws."""
        self._estimate()
        if len(self.run.plan.computer.modes.regions):
            boxed.switch_in(self.box)
        dipole, torque, board = _ZERO, _ZERO, self.run.state.board
        for number, factor in self._working():
            command = self._command_of(number)
            dipole = add_scaled(dipole, factor, command.dipole_a_m2)
            torque = add_scaled(torque, factor, command.torque_n_m)
        chosen = board.chosen[0]
        return Command(
            scale(float(chosen["coils"]), dipole), scale(float(chosen["wheels"]), torque)
        )

    def _estimate(self) -> None:
        board = self.run.state.board
        number = int(board.chosen[0]["estimator"])
        if number < 0 or self.estimators[number].compiled:
            boxed.estimate_in(self.box)
            return
        row = self.run.plan.computer.estimator_blocks[number]
        estimate = self._called(self.estimators[number], row, board.memory)
        self.known[_ESTIMATED] = flat(tuple(estimate))

    def _working(self) -> Iterator[tuple[int, float]]:
        """Numbers and factors of the laws that work now."""
        table, modes = self.run.plan.computer.modes, self.run.state.board.modes
        if not len(table.regions):
            yield from ((number, 1.0) for number in range(len(self.laws)))
        for now in modes.regions:
            state = table.states[int(now["state"])]
            for action in table.actions[state["first_action"] : state["after_action"]]:
                if action["kind"] == LAW:
                    yield int(action["index"]), float(action["value"])

    def _command_of(self, number: int) -> Command:
        law = self.laws[number]
        if law.compiled:
            return Command(*boxed.command_in(self.box, number))
        estimate = inputs_from(self.known).estimate
        known = {"attitude": estimate.q_body_to_inertial[0], "rate": estimate.omega_body_rad_s[0]}
        if any(need in law.needs and not math.isfinite(part) for need, part in known.items()):
            return NO_COMMAND
        row = self.run.plan.computer.law_blocks[number]
        return self._called(law, row, self.run.state.board.memory)

    def _called(self, block: Block, row, memory: np.ndarray):
        """What a function answers, checked and unified."""
        board = self.run.state.board
        parameters = block.record_from(board.parameters[row["p0"] : row["p1"]])
        cells = block.record_of(memory[row["m0"] : row["m1"]])
        try:
            self.signals.heed_at_once(True)
            answer = block(inputs_from(self.known), parameters, cells)
        except (Exception, SystemExit) as error:
            place = plugin.place_of(error, plugin.file_of(plugin.plain_of(block.function)))
            raise HostFailed(
                f"{block.kind.name} {block.name}: must not raise; received {error!r}{place}"
            ) from error
        finally:
            self.signals.heed_at_once(False)
        return _unified(block, answer)


def _unified(block: Block, answer):
    kind = block.kind
    if isinstance(block, Law) and block.answers != "command" and isinstance(answer, Command):
        raise HostFailed(
            f"law {block.name}: must be declared with answers='command' to return a Command; "
            f"received one that answers {block.answers!r}"
        )
    try:
        unified = plugin.plain_of(kind.unify)(answer)
    except (TypeError, ValueError, AttributeError, IndexError):
        must = "three numbers" if kind.returns.startswith("(") else kind.returns
        raise HostFailed(
            f"{kind.name} {block.name}: must return {must}; received {answer!r}"
        ) from None
    if isinstance(block, Law):
        for what, part in (("dipole", unified.dipole_a_m2), ("torque", unified.torque_n_m)):
            if not all(map(math.isfinite, part)):
                shown = ", ".join(f"{x:g}" for x in part)
                raise HostFailed(
                    f"law {block.name}: must return a finite {what}; received ({shown})"
                )
    return unified
