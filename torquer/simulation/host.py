"""The control step answered outside the loop: laws and estimators in plain Python.

The loop stops at the control step when the sensors have been read; the same control step is then
taken here, in the interpreter, and the loop goes on with its command.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from torquer import plugin
from torquer.block import Block
from torquer.control.computer import control_step
from torquer.engine import kernel
from torquer.interface import Command, Inputs, inputs_of
from torquer.simulation.state import arrays_of
from torquer.simulation.step import accept

if TYPE_CHECKING:
    from torquer.simulation.run import Run


@kernel
def first_inputs(known):
    """The inputs that the computer's record holds."""
    return inputs_of(known[0])


class HostFailed(Exception):
    """A function in plain Python raised an error, or its answer is not what it must be."""


def inputs_from(known: np.ndarray) -> Inputs:
    """The inputs that the computer's record holds, for the interpreter."""
    return first_inputs(known)


class Host:
    """Takes a run's control steps in the interpreter."""

    def __init__(self, run: Run):
        self.run = run
        blocks, computer = run.blocks, run.plan.computer
        laws = list(blocks.laws.values())
        rows = computer.law_blocks.copy(), computer.estimator_blocks.copy()
        rows[0]["function"], rows[1]["function"] = range(len(laws)), range(len(blocks.estimators))
        self.computer = computer._replace(
            laws=tuple(self._called(law) for law in laws),
            estimators=tuple(self._called(each) for each in blocks.estimators.values()),
            law_blocks=rows[0].view(np.recarray),
            estimator_blocks=rows[1].view(np.recarray),
        )

    def inputs(self) -> Inputs:
        """What the computer knows where the run stands."""
        return inputs_from(self.run.state.board.known)

    def answer(self) -> None:
        """Take the control step; `HostFailed` if a function fails, memory as before then."""
        board = self.run.state.board
        before = [part.copy() for part in arrays_of(board)]
        try:
            command = plugin.plain_of(control_step)(self.computer, board)
        except BaseException:  # an interrupt, too: the control step will be taken again
            for part, kept in zip(arrays_of(board), before, strict=True):
                part[:] = kept
            raise
        accept(self.run.state, command)

    def what_failed(self) -> str:
        """What was wrong with the last answers; a compiled function that raised answers NaN.

        The functions are called once more in plain Python. Their memory is what the failed answer
        left: where that matters, they may raise nothing now.
        """
        board = self.run.state.board
        copies = board._replace(memory=board.memory.copy(), known=board.known.copy())
        self.raising = True
        try:
            command = plugin.plain_of(control_step)(self.computer, copies)
        except HostFailed as error:
            return str(error)
        answers = (*command.dipole_a_m2, *command.torque_n_m)
        shown = ", ".join(f"{x:g}" for x in answers)
        names = ", ".join(law.name for law in self.run.blocks.laws.values())
        unknown = ""
        if not self.run.plan.needs_ephemeris:
            unknown = " (the ephemeris is not numbers unless a law needs='ephemeris')"
        return (
            f"law {names}: must return finite numbers and must not raise; received {shown}{unknown}"
        )

    def _called(self, block: Block):
        """A block's function on cells, with its answer checked and unified."""

        def call(known, parameters, memory):
            try:
                answer = block(
                    inputs_from(known), block.record_from(parameters), block.record_of(memory)
                )
            except (Exception, SystemExit) as error:
                raise HostFailed(
                    f"{block.kind.name} {block.name}: must not raise; received {error!r}"
                ) from error
            return _unified(block, answer)

        return call


def _unified(block: Block, answer):
    kind = block.kind
    if kind.name == "law" and block.answers != "command" and isinstance(answer, Command):
        raise HostFailed(
            f"law {block.name}: must be declared with answers='command' to return a Command; "
            f"received one that answers {block.answers!r}"
        )
    try:
        answer = plugin.plain_of(kind.unify)(answer)
    except (TypeError, ValueError, AttributeError, IndexError):
        must = "three numbers" if kind.returns.startswith("(") else kind.returns
        raise HostFailed(
            f"{kind.name} {block.name}: must return {must}; received {answer!r}"
        ) from None
    if kind.name == "law":
        for what, part in (("dipole", answer.dipole_a_m2), ("torque", answer.torque_n_m)):
            if not all(map(math.isfinite, part)):
                shown = ", ".join(f"{x:g}" for x in part)
                raise HostFailed(
                    f"law {block.name}: must return a finite {what}; received ({shown})"
                )
    return answer
