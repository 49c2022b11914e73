"""A prepared run in a box that compiled code opens for nothing.

Handing plan, tables, state and record over argument by argument costs 20 to 50 us a call; boxed
once, a call costs less than one. The box shares all arrays with the run.
"""

from numba import types
from numba.experimental import structref

from torquer.control.computer import command_of, estimate, switch
from torquer.engine import COMPILED, kernel
from torquer.simulation.step import run_steps


@structref.register
class _BoxType(types.StructRef):
    def preprocess_fields(self, fields):
        return tuple((name, types.unliteral(of_type)) for name, of_type in fields)


class Box(structref.StructRefProxy if COMPILED else object):
    """The arguments of the loop, boxed."""

    if not COMPILED:

        def __init__(self, *fields):
            self.integrator, self.plan, self.tables, self.state, self.record, self.seed = fields


if COMPILED:
    structref.define_proxy(
        Box, _BoxType, ["integrator", "plan", "tables", "state", "record", "seed"]
    )


@kernel
def box_of(integrator, plan, tables, state, record, seed):
    """The box of a run."""
    return Box(integrator, plan, tables, state, record, seed)


@kernel
def advance(box, last):
    """Run on to step `last`, or to the control step that a host is to take; how it ended."""
    return run_steps(box.integrator, box.plan, box.tables, box.state, box.record, box.seed, last)


@kernel
def estimate_in(box):
    """Let the compiled estimator work."""
    estimate(box.plan.computer, box.state.board)


@kernel
def switch_in(box):
    """Switch the modes."""
    switch(box.plan.computer, box.state.board)


@kernel
def command_in(box, law):
    """The command of a compiled law."""
    return command_of(box.plan.computer, box.state.board, law)


@kernel
def exchange(box, last):
    """Run on to the next control step, and bring the estimate up to date."""
    ended = run_steps(box.integrator, box.plan, box.tables, box.state, box.record, box.seed, last)
    estimate(box.plan.computer, box.state.board)
    return ended
