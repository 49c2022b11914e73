"""A prepared run in a box that compiled code opens for nothing.

Handing plan, tables, state and record over argument by argument costs 20 to 50 us a call.
Boxing costs 14 us once; then a call costs 1.3. The box shares all arrays with the run.
"""

from collections import namedtuple

from numba import types
from numba.experimental import structref

from torquer.control.computer import command_of, estimate, switch
from torquer.engine import COMPILED, kernel
from torquer.simulation.advance import is_resolved
from torquer.simulation.forces import environment_at, environment_tables
from torquer.simulation.state import motion_of
from torquer.simulation.step import WAITING, record_row, run_steps


@structref.register
class _BoxType(types.StructRef):
    def preprocess_fields(self, fields):
        return tuple((name, types.unliteral(of_type)) for name, of_type in fields)


class Box(structref.StructRefProxy):
    """The arguments of the loop, boxed."""


_PARTS = ["integrator", "plan", "tables", "state", "record", "seed"]
structref.define_proxy(Box, _BoxType, _PARTS)
if not COMPILED:  # plain Python reads the same names of a plain record
    Box = namedtuple("Box", _PARTS)  # type: ignore[misc,no-redef]


@kernel
def box_of(integrator, plan, tables, state, record, seed):
    """The box of a run."""
    return Box(integrator, plan, tables, state, record, seed)


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
def record_in(box, coils, step, place):
    """Record an instant; `coils`: their state."""
    record_row(box.plan, box.state, coils, step, box.record, place)


@kernel
def is_resolved_in(box):
    """Whether the integrator's step follows the motion where the run stands; adds nothing up."""
    state, cells = box.state, box.state.cells[0]
    damping, lag = cells.damping, cells.lag
    tables = environment_tables(box.plan, box.tables)
    here = environment_at(tables, state.at[0] * box.plan.step_s)
    found = is_resolved(box.integrator, box.plan, state, motion_of(state.cells), here)
    cells.damping, cells.lag = damping, lag
    return found


@kernel
def exchange(box, last):
    """Run on to the next control step, if there is one, and bring the estimate up to date."""
    ended = run_steps(box, last)
    if ended == WAITING:
        estimate(box.plan.computer, box.state.board)
    return ended
