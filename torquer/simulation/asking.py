"""Laws asked outside the compiled loop: in plain Python, and once more when they have failed.

Runs are handed in prepared; see `run`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from torquer.control.law import Law, compile_law
from torquer.conventions import Measured
from torquer.engine import kernel
from torquer.simulation import step as loop
from torquer.simulation.advance import Around, environment_at

if TYPE_CHECKING:
    from torquer.simulation.run import Run


def next_event(plan: loop.Plan, step: int) -> int:
    """First step, from this one on, with a reading, a new cycle or a record.

    Runs pause there and nowhere else: what lies between two events is integrated in one go, so
    that the bits of a result do not depend on where the run was stopped.
    """
    phase = step % plan.cycle_steps
    to_sample = plan.cycle_steps - phase
    if phase <= plan.measure_steps:
        to_sample = -phase % plan.sample_steps
    return step + min(to_sample, -step % plan.record_steps)


def reason(run: Run, ended: int) -> str:
    """What made the loop stop, with the time and the state: one line."""
    t = run.now_s
    shown = ", ".join(f"{x:.6g}" for x in run.state.cells[loop.MOTION : loop.COMMAND])
    if ended == loop.BAD_STATE:
        return (
            f"the state stopped being finite after t = {t:g} s; last quaternion and rate: {shown}"
        )
    if ended == loop.COARSE_STEP:
        return (
            f"simulation.step_s: must be shorter for RK4 to follow the motion from t = {t:g} s on, "
            f"or the integrator 'dop853'; received {run.plan.step_s:g} s; quaternion and rate: "
            f"{shown}"
        )
    place = 0 if ended == loop.BAD_LAW else 1
    told = _bad_answer(run, place)
    return f"law {run.laws[place].name}: {told} at t = {t:g} s; quaternion and rate: {shown}"


def _bad_answer(run: Run, place: int) -> str:
    """What was wrong with a law's last answer; a compiled law that raised answers with NaNs."""
    wanted = ("a finite dipole", "a finite torque")[place]
    first = (loop.COMMAND, loop.TORQUE)[place]
    answer = run.state.cells[first : first + 3]
    shown = f"received ({', '.join(f'{x:g}' for x in answer)})"
    if not np.isnan(answer).all():
        return f"must return {wanted}; {shown}"
    error = _error_raised(run, place)
    if error is not None:
        return f"must not raise; received {error!r}"
    if not run.plan.navigates:
        shown += " (position and model field are not numbers unless the law says navigates=True)"
    return f"must return {wanted} and must not raise; {shown}"


def _error_raised(run: Run, place: int) -> Exception | None:
    """What a law raises when it is asked once more, in plain Python.

    Its memory is what the failed answer left: where that matters, it may raise nothing now.
    """
    step = int(run.state.step[0])
    measured = _measured(run, step, step % run.plan.cycle_steps)
    parameters, memory = _given_to_laws(run)[place]
    try:
        run.laws[place](measured, parameters, memory.copy())
    except Exception as error:
        return error
    return None


def _given_to_laws(run: Run) -> list[tuple]:
    """(Parameters, memory) of every law."""
    plan, state = run.plan, run.state
    given = [(plan.parameters, state.memory)]
    return [*given, (plan.wheels.parameters, state.wheel_memory)] if plan.wheels else given


@kernel
def _last_answer(measured, parameters, memory):
    """Stands in for a Python law: what it answered has been put into `parameters`."""
    return (parameters[0], parameters[1], parameters[2])


class LawFailed(Exception):
    """A law in plain Python raised an error, or its answer is not three numbers."""


def advance_in_python(run: Run, last: int) -> int:
    """The loop around laws in plain Python: out to the interpreter at every sampling instant."""
    plan, state = run.plan, run.state
    answers = [np.zeros(3) for _ in run.laws]
    held = plan._replace(parameters=answers[0])
    if plan.wheels:
        held = held._replace(wheels=plan.wheels._replace(parameters=answers[1]))
    laws = [compile_law(_last_answer)] * len(answers)
    while (step := int(state.step[0])) < last:
        memories = [memory.copy() for _, memory in _given_to_laws(run)]
        try:
            phase = step % plan.cycle_steps
            if phase <= plan.measure_steps and phase % plan.sample_steps == 0:
                _ask(run, step, phase, answers)
            ended = run.step_to(laws, held, min(next_event(plan, step + 1), last))
        except BaseException:
            if state.step[0] == step:  # interrupted: the laws will be asked again
                for (_, memory), before in zip(_given_to_laws(run), memories, strict=True):
                    memory[:] = before
            raise
        if ended != loop.RUNNING:
            return ended
    return loop.RUNNING


def standing(run: Run) -> tuple:
    """(Motion, environment) where a run stands."""
    around = Around(run.tables.orbit, run.tables.air, run.plan.gravity)
    return loop.motion_of(run.state.cells), environment_at(around, run.now_s)


def _measured(run: Run, step: int, phase: int) -> Measured:
    """What the sensors read at a sampling instant; coils are off where a window begins."""
    plan, state = run.plan, run.state
    if phase == 0 and plan.measure_steps > 0:
        loop.switch_off(plan.coils, state.coils)
    x, here = standing(run)
    measured, _ = loop.sense(plan, run.tables, state, x, here, step)
    return Measured(*measured)


def _ask(run: Run, step: int, phase: int, answers: list) -> None:
    """Write what the laws answer to the readings of this step; `LawFailed` if one fails."""
    measured = _measured(run, step, phase)
    given = zip(run.laws, _given_to_laws(run), answers, strict=True)
    for law, (parameters, memory), answer in given:
        answer[:] = _answer_of(law, measured, parameters, memory)


def _answer_of(law: Law, measured: Measured, parameters, memory) -> tuple:
    try:
        answer = law.function(measured, parameters, memory)
    except (Exception, SystemExit) as error:
        raise LawFailed(f"law {law.name}: must not raise; received {error!r}") from error
    try:
        x, y, z = (float(component) for component in answer)
    except (TypeError, ValueError):
        raise LawFailed(f"law {law.name}: must return three numbers; received {answer!r}") from None
    return x, y, z
