"""A prepared run: constants, tables, state and record; and its way on, step by step."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from torquer.control import LAWS, WHEEL_LAWS
from torquer.control.law import Law, as_law, compile_law
from torquer.control.off import Off, no_answer
from torquer.control.user import spec_of
from torquer.integrate.dop853 import workspace
from torquer.simulation import step as loop
from torquer.simulation.asking import LawFailed, advance_in_python, next_event, reason, standing
from torquer.simulation.size import piece_steps
from torquer.simulation.spec import Scenario, whole_steps
from torquer.spacecraft.coils import NO_COILS
from torquer.spacecraft.sun_sensor import IDEAL_SUN_SENSOR, NO_SUN_SENSORS, SunSensorSet

#: Wall-clock time between looks at the progress and at the keyboard [s].
_PIECE_S = 0.05


class Piece(NamedTuple):
    """Steps first..last-1 of a run and the environment tabulated for them."""

    first: int
    last: int
    tables: loop.Tables
    relative_error: float


@dataclass
class Run:
    """A prepared run: constants, state, and the piece in which it stands.

    `advance_to` moves it on. `law` is that of the coils, `wheel_law` that of the wheels, None for
    a satellite without. `record` has the rows of the piece, each at its number modulo the length;
    `relative_error` is the greatest of the tables so far. `keep` is called with the run when a
    piece is complete and another follows.
    """

    scenario: Scenario
    law: Law
    wheel_law: Law | None
    plan: loop.Plan
    state: loop.State
    record: np.ndarray
    steps: int
    piece_steps: int
    piece: Piece | None = None
    relative_error: float = 0.0
    keep: Callable = field(default=lambda run: None)

    @property
    def now_s(self) -> float:
        """Time that the run has reached [s]."""
        return self.state.step[0] * self.plan.step_s

    @property
    def tables(self) -> loop.Tables:
        """The tabulated environment of the piece."""
        return self.piece.tables

    @property
    def first_row(self) -> int:
        """Number of the piece's first row."""
        return self.piece.first // self.plan.record_steps

    def rows(self) -> np.ndarray:
        """What is recorded of the piece, in order."""
        before = self.first_row % len(self.record)
        rows = np.roll(self.record, -before, axis=0) if before else self.record
        return rows[: int(np.count_nonzero(np.isfinite(rows[:, 0])))]

    def enter(self) -> None:
        """Make the piece the one of the present step; the last one has the end in it."""
        size = self.piece_steps
        first = min(int(self.state.step[0]), self.steps - 1) // size * size
        if self.piece is not None and self.piece.first == first:
            return
        if self.piece is not None and len(self.rows()):  # else interrupted here, and kept already
            self.keep(self)
            self.record = np.full_like(self.record, np.nan)  # the rows kept are views of the other
        self.piece = _piece(self.scenario, self.plan, first, min(first + size, self.steps))
        self.relative_error = max(self.relative_error, self.piece.relative_error)

    def advance_to(self, last: int) -> int:
        """Run on to a step; return how it ended."""
        ended = loop.RUNNING
        while ended == loop.RUNNING and self.state.step[0] < last:
            self.enter()
            ended = self._advance_within(min(last, self.piece.last))
        return ended

    def _advance_within(self, last: int) -> int:
        if all(law.compiled for law in self.laws):
            return self.step_to([compile_law(law.function) for law in self.laws], self.plan, last)
        return advance_in_python(self, last)

    @property
    def laws(self) -> list[Law]:
        """The law of the coils and, if there is one, that of the wheels."""
        return [self.law] if self.wheel_law is None else [self.law, self.wheel_law]

    def step_to(self, laws: list, plan: loop.Plan, last: int) -> int:
        """The compiled loop under compiled laws, by the scenario's integrator."""
        name = self.scenario.simulation.integrator
        principal = self.scenario.spacecraft.body.pack_principal() if name == "splitting" else None
        work = workspace(7) if name == "dop853" else None
        law, wheel_law = (*laws, None)[:2]
        return loop.run_steps(
            law, wheel_law, plan, self.tables, self.state, self.record, last, principal, work
        )


def plan_of(scenario: Scenario, law: Law, wheel_law: Law | None) -> loop.Plan:
    """Constants of a run for the kernels."""
    craft, control, simulation = scenario.spacecraft, scenario.control, scenario.simulation
    step_s = simulation.step_s
    wheels, rotors_kg_m2 = (), None
    if wheel_law is not None:
        driven = wheel_law.function is not no_answer
        wheels = craft.wheels.pack(wheel_law.pack(), step_s, driven)
        rotors_kg_m2 = craft.wheels.rotor_tensor_kg_m2()
    return loop.Plan(
        rigid=craft.body.pack(craft.aerodynamics, rotors_kg_m2),
        coils=craft.coils.pack() if craft.coils else NO_COILS,
        wheels=wheels,
        magnetometer=craft.magnetometer.pack(),
        gyro=craft.gyro.pack(),
        sun_sensors=_sun_sensors(scenario, [law, wheel_law]),
        shadow=scenario.surroundings().shadow,
        attitude_sensor=craft.attitude_sensor.pack(),
        navigates=law.navigates or (wheel_law is not None and wheel_law.navigates),
        parameters=law.pack(),
        step_s=step_s,
        cycle_steps=whole_steps("cycle", control.cycle_s, step_s),
        measure_steps=round(control.measure_s / step_s),
        sample_steps=whole_steps("sample_s", control.sample_s, step_s),
        record_steps=whole_steps("record_s", simulation.record_s, step_s),
        tolerance=simulation.tolerance,
        gravity=1.0 if scenario.environment.gravity_gradient else 0.0,
        disturbance=scenario.disturbance_torque(),
        seed=scenario.seed,
    )


def _sun_sensors(scenario: Scenario, laws: list[Law | None]) -> SunSensorSet:
    """The Sun sensors; an ideal one where they are left out and a law wants to know the Sun."""
    if scenario.spacecraft.sun_sensors:
        return scenario.spacecraft.sun_sensors.pack()
    wanted = any(law is not None and law.needs_sun for law in laws)
    return IDEAL_SUN_SENSOR if wanted else NO_SUN_SENSORS


def first_state(scenario: Scenario, plan: loop.Plan, laws: list[Law], r_m, v_m_s) -> loop.State:
    """State at the start."""
    cells = np.zeros(loop.CELLS)
    cells[loop.MOTION : loop.COMMAND] = scenario.initial.motion(r_m, v_m_s)
    wheels, memories = np.zeros((0, 0)), [np.array(law.memory, dtype=np.float64) for law in laws]
    if plan.wheels:
        omega = cells[loop.MOTION + 4 : loop.COMMAND]
        wheels = scenario.spacecraft.wheels.first_state(plan.wheels, omega)
    return loop.State(
        cells=cells,
        coils=np.zeros((2, len(plan.coils.rows))),
        wheels=wheels,
        memory=memories[0],
        wheel_memory=memories[1] if len(memories) > 1 else np.zeros(0),
        step=np.zeros(1, dtype=np.int64),
    )


def _with_given(scenario: Scenario, law, wheel_law) -> tuple[Scenario, dict[str, Law]]:
    """The scenario that is flown when laws take the place of its own, and those laws by key."""
    craft, told, given = scenario.spacecraft, {}, {}
    for key, function, of_what, hardware, kinds in (
        ("law", law, "coils", craft.coils, LAWS),
        ("wheel_law", wheel_law, "wheels", craft.wheels, WHEEL_LAWS),
    ):
        if function is None:
            continue
        if hardware is None:
            raise ValueError(
                f"spacecraft.{of_what}: must be given for a law of theirs; received none"
            )
        given[key] = as_law(function, key)
        given[key].pack()
        told[key] = spec_of(given[key], kinds)
    if told:
        control = scenario.control.model_copy(update=told)
        scenario = scenario.model_copy(update={"control": control})
    return scenario, given


def _laws_for(scenario: Scenario, given: dict[str, Law]) -> tuple[Law, Law | None]:
    """Laws of coils and wheels: as given, or the scenario's, or 'off'; None without wheels."""
    own = {"law": scenario.control.law, "wheel_law": scenario.control.wheel_law or Off()}
    law, wheel_law = (given.get(key) or spec.law() for key, spec in own.items())
    return law, wheel_law if scenario.spacecraft.wheels else None


def prepare(
    scenario: Scenario,
    law: Law | Callable | None = None,
    wheel_law: Law | Callable | None = None,
) -> Run:
    """Everything that a run needs; `law` and `wheel_law` take the place of the scenario's.

    The run's scenario names the laws that are flown.
    """
    scenario, given = _with_given(scenario, law, wheel_law)
    law, wheel_law = _laws_for(scenario, given)
    plan = plan_of(scenario, law, wheel_law)
    around = scenario.surroundings()
    around.check_dates(0.0, scenario.steps() * plan.step_s)
    r, v = around.state(np.zeros(1))
    laws = [law] if wheel_law is None else [law, wheel_law]
    state = first_state(scenario, plan, laws, r[0], v[0])
    columns = loop.COLUMNS + (3 + 2 * state.wheels.shape[1] if plan.wheels else 0)
    steps, size = scenario.steps(), piece_steps(scenario)
    record = np.full((min(steps, size) // plan.record_steps + 1, columns), np.nan)
    run = Run(scenario, law, wheel_law, plan, state, record, steps, size)
    run.enter()
    return run


def _piece(scenario: Scenario, plan: loop.Plan, first: int, last: int) -> Piece:
    """Tables for the steps first..last-1."""
    craft, around = scenario.spacecraft, scenario.surroundings()
    start_s, duration_s = first * plan.step_s, (last - first) * plan.step_s
    orbit = around.orbit_table(duration_s, plan.step_s, start_s)
    seen = plan.sun_sensors is not NO_SUN_SENSORS  # else the Sun's table is never read
    sun = around.sun_table(duration_s, start_s) if seen else orbit.table
    air = around.air_table(duration_s, start_s) if craft.aerodynamics else ()
    return Piece(first, last, loop.Tables(orbit.table, sun, air), orbit.relative_error)


def advance_in_pieces(run: Run, last: int, progress: Callable[[float], None] | None) -> str:
    """Run on to a step, with a look at the keyboard now and then; what made it stop, or ""."""
    piece = 1000
    while (done := int(run.state.step[0])) < last:
        clock = time.perf_counter()
        try:
            ended = run.advance_to(next_event(run.plan, min(done + piece, last)))
        except LawFailed as error:
            return f"{error} at t = {run.now_s:g} s"
        if ended != loop.RUNNING:
            return reason(run, ended)
        if time.perf_counter() - clock < _PIECE_S:
            piece *= 2
        if progress:
            progress(int(run.state.step[0]) / run.steps)
    return "" if _resolved_at_the_end(run) else reason(run, loop.COARSE_STEP)


def _resolved_at_the_end(run: Run) -> bool:
    """Whether RK4's step resolves the motion at the end of the run, where the loop does not ask."""
    if run.state.step[0] < run.steps or run.scenario.simulation.integrator != "rk4":
        return True
    state = run.state._replace(cells=run.state.cells.copy())  # this adds nothing up
    return loop.resolves(run.plan, state, *standing(run))


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
    loop.record_row(plan, state, coils, step, run.record, row % len(run.record))
