"""A prepared run: constants, tables, state and record; and its way on, step by step."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from torquer.base.computing import by_scenario
from torquer.base.shared import shared
from torquer.base.user_code import admit, check_unchanged, own_files
from torquer.compile.arguments import Arguments
from torquer.computer.blocks.law import Law
from torquer.computer.blocks.user import UserBlock
from torquer.computer.computer import Blocks
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.ephemeris import AnyEnvironment, EphemerisModels
from torquer.environment.light import Light, shadow_edges
from torquer.scenario.held import check_judged
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.members import (
    RUNNING,
    Member,
    One,
)
from torquer.simulation.loop.record import Instant, record_instant
from torquer.simulation.loop.state import LOCAL_CELLS, Dynamics, Plan, ReadingTables, Record, State
from torquer.simulation.loop.step import (
    BETWEEN,
    NO_READERS,
    SENSED,
    Loop,
    drive_wheels,
    run_steps,
    with_readers,
)
from torquer.simulation.loop.timetable import COILS_OFF, Timetable, longest_interval, next_row
from torquer.simulation.outside.host import Host
from torquer.simulation.outside.library import Library
from torquer.simulation.propagate.adaptive import Auto
from torquer.simulation.propagate.fixed_steps import Rk4, Splitting
from torquer.simulation.propagate.forces import EnvironmentTables
from torquer.simulation.propagate.interval import LOOK_ONLY, Problem, propagate
from torquer.simulation.setup.ending import ends_now
from torquer.simulation.setup.own_functions import needs_of_own
from torquer.simulation.setup.prepare import (
    choose_integrator,
    empty_record,
    first_state,
    make_blocks,
    make_dynamics,
    make_plan,
    modes_for,
    with_given,
)
from torquer.simulation.setup.size import piece_steps
from torquer.spacecraft.actuators.coils import fail_coils, switch_off_coils
from torquer.spacecraft.failures import is_halted
from torquer.spacecraft.sensors.devices import DEVICES, STREAMS

#: What a file that gives a part of a run must be.
AS_BEGUN = "the one with which the run began"


class Piece(NamedTuple):
    """Steps first..last-1 of a run and the environment tabulated for them.

    `tables`: what sensors and computer need, `moving`: what moves the body, both None of a piece
    that is over. `environment`,
    `believed`: what is tabulated; `step_s`: of the steps; `has`: what is there besides the orbit's
    table.
    """

    first: int
    last: int
    tables: ReadingTables | None
    moving: EnvironmentTables | None
    relative_error: float
    environment: OrbitEnvironment
    believed: AnyEnvironment
    step_s: float
    has: frozenset[str]


class Uplink(NamedTuple):
    """Models that the computer was given in flight: in use from the first control step after
    `from_s` [s] on."""

    from_s: float
    models: EphemerisModels


class NoNextPiece(ValueError):
    """The environment of a run cannot be tabulated further."""


@dataclass
class Run:
    """A prepared run: constants, state, and the piece in which it stands.

    `advance_to` moves it on. `record` has the rows of the piece, each at its number modulo the
    length; `relative_error` is the greatest of the tables so far. `keep` is called with the run
    when a piece is complete and another follows. `is_at_end`: the piece is complete, has
    been kept, and no other can follow. `uplinked`: models of the ephemeris that the computer was
    given in flight, the latest last.
    """

    scenario: Scenario
    blocks: Blocks
    plan: Plan
    dynamics: Dynamics
    integrator: Auto | Rk4 | Splitting
    state: State
    record: Record
    steps: int
    piece_steps: int
    piece: Piece | None = None
    relative_error: float = 0.0
    keep: Callable = field(default=lambda run: None)
    host: Host | None = None
    library: Library | None = None
    files: dict[str, dict[str, str]] = field(default_factory=dict)
    is_at_end: bool = False
    uplinked: tuple[Uplink, ...] = ()
    _ready: "_Ready | None" = None

    @property
    def now_s(self) -> float:
        """Time that the run has reached [s]."""
        return self.state.at[0] * self.plan.step_s

    @property
    def first_row(self) -> int:
        """Number of the piece's first row."""
        return self.piece.first // self.plan.record_steps

    def rows(self) -> Record:
        """What is recorded of the piece, in order."""
        before = self.first_row % len(self.record.rows)
        count = int(np.count_nonzero(np.isfinite(self.record.rows["step"])))
        return Record(*(np.roll(part, -before, axis=0)[:count] for part in self.record))

    def enter(self) -> None:
        """Make the piece the one of the present step; the last one has the end in it."""
        size = self.piece_steps
        first = min(int(self.state.at[0]), self.steps - 1) // size * size
        if self.piece is not None and self.piece.first == first:
            return
        complete = self.record
        if self.piece is not None and len(self.rows().rows):  # else interrupted here: kept already
            self.keep(self)
            # the rows kept are views of the other
            inputs = self.scenario.simulation.record_inputs
            self.record = empty_record(self.plan, len(self.record.rows), inputs)
        try:
            self.piece = self._next_piece(first, min(first + size, self.steps))
        except NoNextPiece:
            self.record, self.is_at_end = complete, True
            raise
        self.relative_error = max(self.relative_error, self.piece.relative_error)

    def _next_piece(self, first: int, last: int) -> Piece:
        """The piece of the steps first..last-1; `NoNextPiece` for a later one that is not there."""
        if self.piece is None:
            return self._tabulate(first, last)
        self._ready = None  # two pieces' tables need not be in memory at once
        self.piece = self.piece._replace(tables=None, moving=None)
        try:
            check_unchanged(self.files, describe_files(self.scenario), AS_BEGUN)
            return self._tabulate(first, last)
        except ValueError as error:
            raise NoNextPiece(str(error)) from None

    def _tabulate(self, first: int, last: int) -> Piece:
        believed = self.believed()[-1][1] if self.uplinked else None
        return tabulate_piece(self.scenario, self.plan, first, last, believed)

    def believed(self) -> list[tuple[float, AnyEnvironment]]:
        """What the computer has believed of its surroundings, and after which time [s]."""
        truth, stated = make_environments(self.scenario)
        later = [(each.from_s, each.models.along(truth)) for each in self.uplinked]
        return [(-math.inf, stated), *later]

    def take_up(self, models: EphemerisModels, from_s: float) -> None:
        """Let the ephemeris on board come from these models after a time [s].

        ValueError for models that do not hold until the end; nothing is changed then.
        """
        before, piece = self.uplinked, self.piece
        earlier = tuple(each for each in before if each.from_s < from_s)
        was = earlier[-1].models if earlier else self.scenario.control.ephemeris
        self.uplinked = earlier if models == was else (*earlier, Uplink(from_s, models))
        try:
            believed, end_s = self.believed()[-1][1], self.steps * self.plan.step_s
            believed.check_dates(from_s, end_s)
            believed.state(np.array([from_s, end_s]))
            self.piece = self._tabulate(piece.first, piece.last)
        except ValueError:
            self.uplinked = before
            raise
        self.relative_error = max(self.relative_error, self.piece.relative_error)

    def make_ready(self) -> None:
        """Make tables, and compile what is not in the cache: up to a minute before the first step.

        `advance_to` does so, too, but a signal is not looked at there.
        """
        self.enter()
        self._made_ready()

    def advance_to(self, last: int) -> int:
        """Run on to a step, or to where the scenario's condition ends it; return how it ended."""
        ended = RUNNING
        while ended == RUNNING and self.state.at[0] < min(last, self.steps):
            to = self._next_look(last)
            if self.state.at[0] == self.steps:
                break
            self.enter()
            ended = self._call(min(to, self.piece.last))
        return ended

    def _next_look(self, last: int) -> int:
        """How far the run may go on; where it has ended by its condition it has no more steps."""
        when, step = self.scenario.simulation.end_when, int(self.state.at[0])
        if when is None:
            return last
        record_steps = self.plan.record_steps
        if step % record_steps == 0 and self.state.at[1] == BETWEEN:
            parts = self.state, self.dynamics, self.plan.plant.rotors
            if ends_now(when, self.now_s, *parts):
                self.steps = step
        return min(last, step + record_steps - step % record_steps)

    def _call(self, last: int) -> int:
        """Let the loop run on within the piece."""
        ready = self._made_ready()
        ended = ready.run_steps(ready.loop.address, last)
        if self.host is not None:
            try:
                self.host.check()
            except BaseException:
                self.state.at[1] = SENSED  # the computer works again
                raise
        return ended

    def _made_ready(self) -> "_Ready":
        """The compiled loop with its arguments in this piece."""
        ready = self._ready
        if ready is None or ready.piece is not self.piece or ready.record is not self.record:
            self._ready = ready = _ready_for(self)
        return ready

    def is_followed(self) -> bool:
        """Whether the integrator's step follows the motion where the run stands."""
        if not isinstance(self.integrator, Rk4):
            return True
        step = int(self.state.at[0])
        return propagate(self.look_up(), step, step, LOOK_ONLY) >= 0

    def look_up(self) -> Arguments:
        """What `propagate` takes, with the environment of where the run stands."""
        ready = self._made_ready()
        ready.run_steps(ready.loop.address, int(self.state.at[0]))
        return ready.problem


class _Ready(NamedTuple):
    """The loop ready to run on in a piece."""

    piece: Piece
    record: Record
    run_steps: Callable
    loop: Arguments
    problem: Arguments


def _ready_for(run: Run) -> _Ready:
    plan, piece, state, seed = run.plan, run.piece, run.state, run.scenario.seed
    drawn = np.zeros((STREAMS, 3))
    moving, local = One(Member(state, run.dynamics, seed, drawn)), np.zeros(LOCAL_CELLS)
    problem = Arguments(
        Problem(run.integrator, moving, piece.moving, local, plan.step_s, plan.record_steps)
    )
    loop = Loop(
        plan,
        piece.tables,
        One(Member(state, plan.plant, seed, np.zeros((STREAMS, 3)))),
        (),
        state.at,
        local,
        run.record,
        NO_READERS,
        0,
        propagate.address(problem),
        problem.address,
    )
    if len(plan.plant.rotors.rows):
        loop = loop._replace(drive_wheels=drive_wheels.address(Arguments(loop)))
    arguments = Arguments(with_readers(loop))
    return _Ready(piece, run.record, run_steps.of(arguments), arguments, problem)


def prepare(
    scenario: Scenario,
    law: Law | Callable | None = None,
    laws: Mapping[str, Law | Callable] | None = None,
    piece: Piece | None = None,
    stops: bool = False,
    driven_from_outside: bool = False,
    library: Library | None = None,
) -> Run:
    """Everything that a run needs; `law` and `laws` take the place of the scenario's.

    The run's scenario names the laws that are flown. `piece`: the first piece of another run on
    the same orbit, whose tables are shared; ValueError if they are not those of this run.
    `stops`: the run stops at every control step; `driven_from_outside`: for a command, and no law
    of the scenario works. `library`: the computer in C that works in place of laws, estimators and
    modes; `OtherComputer`, a ValueError, unless it is one of these.
    """
    admit(scenario)
    scenario, given = with_given(scenario, law, laws)
    by_scenario(check_judged)(scenario.control, scenario.mission)
    blocks = make_blocks(scenario, given)
    run = _without_tables(scenario, blocks, _start_of(scenario), stops, driven_from_outside)
    if library is not None:
        library.check(run.plan.computer, blocks)
        run.library = library
        computer = run.plan.computer._replace(library=library.address)
        run.plan = run.plan._replace(computer=computer)
    elif not blocks.compiled:
        run.host = Host(run.plan.computer, run.state.board, blocks)
        run.plan = run.plan._replace(computer=run.host.computer)
    if piece is not None:
        _check_shared(piece, run)
        run.piece, run.relative_error = piece, piece.relative_error
    run.enter()
    return run


@shared
def _start_of(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] and velocity [m/s] at the start; ValueError for a run beyond the models."""
    for each in make_environments(scenario):
        each.check_dates(0.0, scenario.steps() * scenario.grid_s)
    r, v = scenario.orbit_environment().state(np.zeros(1))
    return r[0], v[0]


def _without_tables(
    scenario: Scenario,
    blocks: Blocks,
    start: tuple[np.ndarray, np.ndarray],
    stops: bool = False,
    driven_from_outside: bool = False,
) -> Run:
    """A run from a position [m] and velocity [m/s], before its environment is tabulated."""
    table, modes = modes_for(scenario, blocks)
    plan = make_plan(scenario, blocks, table, modes, stops, driven_from_outside)
    dynamics = make_dynamics(scenario, plan.plant)
    state = first_state(scenario, plan, dynamics, blocks, modes, *start)
    steps, size = scenario.steps(), piece_steps(scenario)
    rows, inputs = min(steps, size) // plan.record_steps + 1, scenario.simulation.record_inputs
    record, integrator = empty_record(plan, rows, inputs), choose_integrator(scenario)
    files = describe_files(scenario)
    return Run(
        scenario, blocks, plan, dynamics, integrator, state, record, steps, size, files=files
    )


def describe_files(scenario: Scenario) -> dict[str, dict[str, str]]:
    """What a result keeps of the files that give parts of a run, but for laws, by key."""
    parts = {k: each for k, each in own_files(scenario).items() if not isinstance(each, UserBlock)}
    return {key: part.described() for key, part in parts.items()}


def tabulate_piece(
    scenario: Scenario, plan: Plan, first: int, last: int, uplinked: AnyEnvironment | None = None
) -> Piece:
    """Tables for the steps first..last-1; `uplinked`: what the computer believes, if others."""
    environment, stated = make_environments(scenario)
    believed = stated if uplinked is None else uplinked
    start_s, duration_s = first * plan.step_s, (last - first) * plan.step_s
    orbit = environment.orbit_table(duration_s, plan.step_s, start_s)
    needed = _tables_needed(scenario, plan, believed)
    sun = environment.sun_table(duration_s, start_s) if "sun" in needed else orbit.table
    moon = environment.moon_table(duration_s, start_s) if "moon" in needed else orbit.table
    air = environment.air_table(duration_s, start_s) if "air" in needed else ()
    light: Light | tuple[()] = ()
    if "light" in needed:
        shadow, period_s = environment.shadow, environment.orbit.period_s
        edges_s = shadow_edges(shadow, orbit.table, sun, start_s, duration_s, period_s)
        light = Light(sun, shadow, edges_s)
    gravity = 1.0 if scenario.environment.gravity_gradient else 0.0
    moving = EnvironmentTables(orbit.table, air, gravity, light, scenario.orbit_angle())
    tables, error = ReadingTables(orbit.table, sun, moon, orbit.table, sun), orbit.relative_error
    if "ephemeris" in needed:
        own = believed.orbit_table(duration_s, plan.step_s, start_s)
        own_sun = believed.sun_table(duration_s, start_s)
        tables = tables._replace(believed_orbit=own.table, believed_sun=own_sun)
        error = max(error, own.relative_error)
    return Piece(first, last, tables, moving, error, environment, believed, plan.step_s, needed)


def make_environments(scenario: Scenario) -> tuple[OrbitEnvironment, AnyEnvironment]:
    """The environment of a run, and what its computer believes of it."""
    return scenario.orbit_environment(), scenario.believed_environment()


def _check_shared(piece: Piece, run: Run) -> None:
    """ValueError unless a piece is what the run would begin with."""
    own = (*make_environments(run.scenario), run.plan.step_s, 0, min(run.piece_steps, run.steps))
    if (piece.environment, piece.believed, piece.step_s, piece.first, piece.last) != own:
        raise ValueError(
            "piece: must have the orbit, environment, start and steps of this run, and the models "
            "of its computer; "
            f"received steps {piece.first} to {piece.last} of {piece.step_s:g} s"
        )
    needed = _tables_needed(run.scenario, run.plan, own[1])
    if not needed <= piece.has or (needed ^ piece.has) - {"sun", "moon", "ephemeris"}:
        raise ValueError(
            "piece: must have the Sun, the Moon and the air that this run needs; received others"
        )


def _tables_needed(scenario: Scenario, plan: Plan, believed: AnyEnvironment) -> frozenset[str]:
    """What is read besides the orbit's table: Sun, Moon, air, light that pushes, the place on the
    orbit, an ephemeris that is not the truth."""
    light = scenario.disturbance is not None and scenario.disturbance.solar_pressure is not None
    of_own = needs_of_own(scenario)
    light = light or "light" in of_own
    sun = plan.needs_ephemeris or light or _looks_for("by_sunlight", scenario, plan)
    moon = _looks_for("by_moon", scenario, plan)
    air = bool(scenario.spacecraft.aerodynamics) or "air" in of_own
    angle = bool(scenario.acting_torques())
    own = plan.needs_ephemeris and believed != scenario.orbit_environment()
    needed = {"sun": sun, "moon": moon, "air": air, "light": light, "orbit angle": angle}
    needed["ephemeris"] = own
    return frozenset(name for name, wanted in needed.items() if wanted)


def _looks_for(what: str, scenario: Scenario, plan: Plan) -> bool:
    """Whether a device that is read looks for the Sun ('by_sunlight') or the Moon ('by_moon')."""
    sensors = plan.plant.sensors
    read = [DEVICES[number] for number in _rows_read(plan.timetable)]
    found = [(each, getattr(sensors, each.name)) for each in read if each.read]
    found += [
        (each.device, by_scenario(each.device.to_unit)(each.spec))
        for each in scenario.spacecraft.units()
    ]
    asked = [(getattr(device, what), constants) for device, constants in found]
    return any(looks(constants) for looks, constants in asked if looks)


@shared
def _rows_read(timetable: Timetable) -> tuple[int, ...]:
    """Numbers of the devices, of those of which there is one, that are read at times."""
    return tuple(number for number in range(len(DEVICES)) if longest_interval(timetable, number))


def next_event(plan: Plan, step: int) -> int:
    """First step, from this one on, with a row of the timetable or a record.

    Runs pause there and nowhere else: what lies between two events is integrated in one go, so
    that the bits of a result do not depend on where the run was stopped.
    """
    return min(next_row(plan.timetable, step)[0], step + -step % plan.record_steps)


def record_this_instant(run: Run) -> None:
    """Record where the run stands, if a record is due there; a run that goes on writes it again.

    The laws are not called: the readings are the last ones. Only the coils are known to be off
    where a measurement window begins.
    """
    plan, state, step = run.plan, run.state, int(run.state.at[0])
    if step % plan.record_steps:
        return
    coils, (due, actions) = state.coils.copy(), next_row(plan.timetable, step)
    failures, t = plan.plant.failures, run.now_s
    if due == step and actions & COILS_OFF and not is_halted(failures.computer, t):
        switch_off_coils(plan.plant.coils, coils)
    if due == step:
        fail_coils(plan.plant.coils, failures.coils, coils, t)
    record_instant(Arguments(Instant(plan, state, coils, run.record)), step)
