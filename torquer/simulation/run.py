"""A prepared run: constants, tables, state and record; and its way on, step by step."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from torquer.control.law import Law, as_law, compile_law
from torquer.conventions import Measured
from torquer.engine import kernel
from torquer.environment.table import ProvenTable
from torquer.integrate.dop853 import workspace
from torquer.simulation import step as loop
from torquer.simulation.advance import Around, environment_at
from torquer.simulation.spec import Scenario, whole_steps
from torquer.spacecraft.sun_sensor import NO_SUN_SENSORS

#: Wall-clock time between looks at the progress and at the keyboard [s].
_PIECE_S = 0.05


@dataclass(frozen=True)
class Run:
    """A prepared run: constants, tables, state and record. `advance_to` moves it on."""

    scenario: Scenario
    law: Law
    plan: loop.Plan
    tables: loop.Tables
    state: loop.State
    record: np.ndarray
    orbit_table: ProvenTable

    @property
    def steps(self) -> int:
        """Number of steps of the whole run."""
        return (len(self.record) - 1) * self.plan.record_steps

    @property
    def now_s(self) -> float:
        """Time that the run has reached [s]."""
        return self.state.step[0] * self.plan.step_s

    def advance_to(self, last: int) -> int:
        """Run on to a step; return how it ended."""
        if self.law.compiled:
            law = compile_law(self.law.function)
            return self.step_to(law, self.plan, last)
        return _advance_in_python(self, last)

    def step_to(self, law, plan: loop.Plan, last: int) -> int:
        """The compiled loop under a compiled law, by the scenario's integrator."""
        name = self.scenario.simulation.integrator
        principal = self.scenario.spacecraft.body.pack_principal() if name == "splitting" else None
        work = workspace(7) if name == "dop853" else None
        return loop.run_steps(
            law, plan, self.tables, self.state, self.record, last, principal, work
        )


def plan_of(scenario: Scenario, law: Law) -> loop.Plan:
    """Constants of a run for the kernels."""
    craft, control, simulation = scenario.spacecraft, scenario.control, scenario.simulation
    step_s = simulation.step_s
    return loop.Plan(
        rigid=craft.body.pack(craft.aerodynamics),
        coils=craft.coils.pack(),
        magnetometer=craft.magnetometer.pack(),
        gyro=craft.gyro.pack(),
        sun_sensors=craft.sun_sensors.pack() if craft.sun_sensors else NO_SUN_SENSORS,
        attitude_sensor=craft.attitude_sensor.pack(),
        navigates=law.navigates,
        parameters=law.pack(),
        step_s=step_s,
        cycle_steps=whole_steps("cycle", control.cycle_s, step_s),
        measure_steps=round(control.measure_s / step_s),
        sample_steps=whole_steps("sample_s", control.sample_s, step_s),
        record_steps=whole_steps("record_s", simulation.record_s, step_s),
        tolerance=simulation.tolerance,
        gravity=1.0 if scenario.environment.gravity_gradient else 0.0,
        push=scenario.push(),
        seed=scenario.seed,
    )


def first_state(scenario: Scenario, law: Law, r_m, v_m_s) -> loop.State:
    """State at the start."""
    cells = np.zeros(loop.CELLS)
    cells[loop.MOTION : loop.COMMAND] = scenario.initial.motion(r_m, v_m_s)
    return loop.State(
        cells=cells,
        coils=np.zeros((2, len(scenario.spacecraft.coils.axes))),
        memory=np.array(law.memory, dtype=np.float64),
        step=np.zeros(1, dtype=np.int64),
    )


def prepare(scenario: Scenario, law: Law | Callable | None = None) -> Run:
    """Everything that a run needs; `law` takes the place of the scenario's."""
    law = scenario.control.law.law() if law is None else as_law(law)
    around = scenario.surroundings()
    plan = plan_of(scenario, law)
    duration_s = scenario.steps() * plan.step_s
    orbit_table = around.orbit_table(duration_s, plan.step_s)
    seen = scenario.spacecraft.sun_sensors is not None  # else the Sun's table is never read
    sun_table = around.sun_table(duration_s) if seen else orbit_table.table
    air = around.air_table(duration_s) if scenario.spacecraft.aerodynamics else ()
    tables = loop.Tables(orbit_table.table, sun_table, air)
    r, v = around.state(np.zeros(1))
    state = first_state(scenario, law, r[0], v[0])
    record = np.full((scenario.steps() // plan.record_steps + 1, loop.COLUMNS), np.nan)
    return Run(scenario, law, plan, tables, state, record, orbit_table)


def _next_event(plan: loop.Plan, step: int) -> int:
    """First step, from this one on, with a reading, a new cycle or a record.

    Runs pause there and nowhere else: what lies between two events is integrated in one go, so
    that the bits of a result do not depend on where the run was stopped.
    """
    phase = step % plan.cycle_steps
    to_sample = plan.cycle_steps - phase
    if phase <= plan.measure_steps:
        to_sample = -phase % plan.sample_steps
    return step + min(to_sample, -step % plan.record_steps)


def advance_in_pieces(run: Run, last: int, progress: Callable[[float], None] | None) -> str:
    """Run on to a step, with a look at the keyboard now and then; what made it stop, or ""."""
    piece = 1000
    while (done := int(run.state.step[0])) < last:
        clock = time.perf_counter()
        try:
            ended = run.advance_to(_next_event(run.plan, min(done + piece, last)))
        except _LawFailed as error:
            return f"{error} at t = {run.now_s:g} s"
        if ended != loop.RUNNING:
            return _reason(run, ended)
        if time.perf_counter() - clock < _PIECE_S:
            piece *= 2
        if progress:
            progress(int(run.state.step[0]) / run.steps)
    return ""


def record_this_instant(run: Run) -> None:
    """Record where the run stands, if a record is due there; a run that goes on writes it anew.

    The law is not asked: the readings are the last ones. Only the coils are known to be off where
    a measurement window begins.
    """
    plan, state, step = run.plan, run.state, int(run.state.step[0])
    row, early = divmod(step, plan.record_steps)
    if early:
        return
    coils = state.coils.copy()
    if step % plan.cycle_steps == 0 and plan.measure_steps > 0:
        loop.switch_off(plan.coils, coils)
    loop.record_row(plan.coils, state.cells, coils, step, run.record, row)


def _reason(run: Run, ended: int) -> str:
    t = run.now_s
    shown = ", ".join(f"{x:.6g}" for x in run.state.cells[loop.MOTION : loop.COMMAND])
    if ended == loop.BAD_LAW:
        return (
            f"law {run.law.name}: {_bad_answer(run)} at t = {t:g} s; quaternion and rate: {shown}"
        )
    return f"the state stopped being finite after t = {t:g} s; last quaternion and rate: {shown}"


def _bad_answer(run: Run) -> str:
    """What was wrong with the law's last answer; a compiled law that raised answers with NaNs."""
    answer = run.state.cells[loop.COMMAND : loop.DRIFT]
    shown = f"received ({', '.join(f'{x:g}' for x in answer)})"
    if not np.isnan(answer).all():
        return f"must return a finite dipole; {shown}"
    error = _error_raised(run)
    if error is not None:
        return f"must not raise; received {error!r}"
    if not run.law.navigates:
        shown += " (position and model field are not numbers unless the law says navigates=True)"
    return f"must return a finite dipole and must not raise; {shown}"


def _error_raised(run: Run) -> Exception | None:
    """What the law raises when it is asked once more, in plain Python.

    Its memory is what the failed answer left: where that matters, it may raise nothing now.
    """
    step = int(run.state.step[0])
    measured = _measured(run, step, step % run.plan.cycle_steps)
    try:
        run.law(measured, run.plan.parameters, run.state.memory.copy())
    except Exception as error:
        return error
    return None


@kernel
def _last_answer(measured, parameters, memory):
    """Stands in for a Python law: what it answered has been put into `parameters`."""
    return (parameters[0], parameters[1], parameters[2])


class _LawFailed(Exception):
    """A law in plain Python raised an error, or its answer is not three numbers."""


def _advance_in_python(run: Run, last: int) -> int:
    """The loop around a law in plain Python: out to the interpreter at every sampling instant."""
    plan, state = run.plan, run.state
    answer = np.zeros(3)
    held = plan._replace(parameters=answer)
    law = compile_law(_last_answer)
    while (step := int(state.step[0])) < last:
        memory = state.memory.copy()
        try:
            phase = step % plan.cycle_steps
            if phase <= plan.measure_steps and phase % plan.sample_steps == 0:
                answer[:] = _ask(run, step, phase)
            ended = run.step_to(law, held, min(_next_event(plan, step + 1), last))
        except BaseException:
            if state.step[0] == step:  # interrupted: the law will be asked again
                state.memory[:] = memory
            raise
        if ended != loop.RUNNING:
            return ended
    return loop.RUNNING


def _measured(run: Run, step: int, phase: int) -> Measured:
    """What the sensors read at a sampling instant; coils are off where a window begins."""
    plan, state = run.plan, run.state
    if phase == 0 and plan.measure_steps > 0:
        loop.switch_off(plan.coils, state.coils)
    x = loop.motion_of(state.cells)
    around = Around(run.tables.orbit, run.tables.air, plan.gravity)
    here = environment_at(around, step * plan.step_s)
    measured, _ = loop.sense(plan, run.tables, state.cells, state.coils, x, here, step)
    return Measured(*measured)


def _ask(run: Run, step: int, phase: int) -> tuple:
    """What a law in plain Python answers to the readings of this step; `_LawFailed` if it fails."""
    measured = _measured(run, step, phase)
    try:
        answer = run.law.function(measured, run.plan.parameters, run.state.memory)
    except (Exception, SystemExit) as error:
        raise _LawFailed(f"law {run.law.name}: must not raise; received {error!r}") from error
    try:
        mx, my, mz = (float(m) for m in answer)
    except (TypeError, ValueError):
        raise _LawFailed(
            f"law {run.law.name}: must return three numbers; received {answer!r}"
        ) from None
    return mx, my, mz
