"""Members of a campaign flown together: attitudes and rates at the records, and how each ended."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.compile.arguments import Arguments
from torquer.compile.lanes import LANES
from torquer.computer.computer import Computer, estimates
from torquer.computer.interface import PLACES
from torquer.scenario.spec import Scenario
from torquer.simulation.lanes.laws import CELLS_AT, law_in_lanes
from torquer.simulation.lanes.packing import Packed, pack_member
from torquer.simulation.lanes.sensed import same_timetable, without_unread
from torquer.simulation.lanes.wheels import drive_wheels, own_space, same_allocation
from torquer.simulation.loop.computers import Boards, make_boards, same_computers, sensed_places
from torquer.simulation.loop.members import END, RUNNING, Many
from torquer.simulation.loop.state import AT_CELLS, CELLS, LOCAL_CELLS, Plan
from torquer.simulation.loop.step import (
    NO_READERS,
    Loop,
    record_together,
    run_steps,
    with_readers,
)
from torquer.simulation.propagate.adaptive import Auto
from torquer.simulation.propagate.fixed_steps import Rk4, Splitting
from torquer.simulation.propagate.interval import IN_LANES, LOOK_ONLY, Problem, propagate
from torquer.simulation.setup.prepare import choose_integrator, first_rods
from torquer.simulation.setup.run import Piece, Run, make_environments, tabulate_piece
from torquer.simulation.setup.signals import noted_signals
from torquer.spacecraft.sensors.devices import STREAMS

_MOTION = 7
#: Records of members that are in memory at most, and pieces that are kept.
RECORDS, PIECES = 2048, 64
#: Is given what members have flown: their rows, the number of the first record, attitudes and rates
#: (r, 7, n) at the records from there on; with `Kept`, what it names in further places.
#: It answers whether these members need not be flown on.
Take = Callable[[slice, int, np.ndarray], bool | None]


class Kept(NamedTuple):
    """What is recorded of members beside their motion.

    `memory`: cells of the memory of laws and estimators; `cells`: names of `CELLS`; `known`: names
    of `KNOWN`, of computers with laws alone; `wheels`: whether the momentum of each wheel. It
    follows the motion in this order.
    """

    memory: tuple[int, ...] = ()
    cells: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    wheels: bool = False


#: The motion alone.
MOTION_ALONE = Kept()


class FlownLanes(NamedTuple):
    """What members flew in lanes, and how they ended."""

    motion: np.ndarray
    """(r, 7, n): attitude and rate at the records, and in further places what `Kept` names"""
    cells: np.ndarray
    """(n,) of `CELLS`: their states at the end"""
    failed: np.ndarray
    """(n,): whether they ended early"""


class _Batch(NamedTuple):
    """Members side by side, where they stand: what the loop works on between two pieces."""

    rows: slice
    plan: Plan
    integrator: Auto | Rk4 | Splitting
    members: Many
    moving: Many
    boards: Boards
    at: np.ndarray
    local: np.ndarray


class Pieces:
    """The pieces of runs on one orbit: each of the first ones is made once, for all members."""

    def __init__(self, run: Run):
        self._run, self._known = run, {run.piece.first: run.piece}

    def of(self, scenario: Scenario) -> bool:
        """Whether the pieces are those of a scenario."""
        return make_environments(self._run.scenario) == make_environments(scenario)

    def at(self, first: int) -> Piece:
        """The piece that begins at a step."""
        if (known := self._known.get(first)) is not None:
            return known
        run, last = self._run, min(first + self._run.piece_steps, self._run.steps)
        piece = tabulate_piece(run.scenario, run.plan, first, last)
        if len(self._known) < PIECES:
            self._known[first] = piece
        return piece


def _has_own_torques(scenario: Scenario) -> bool:
    return scenario.disturbance is not None and bool(scenario.disturbance.own)


def _has_pulses(scenario: Scenario) -> bool:
    coils = scenario.spacecraft.coils
    return coils is not None and coils.pwm_period_s is not None


#: What members are flown alone for, and whether a scenario has it.
_ALONE: dict[str, Callable[[Scenario], bool]] = {
    "an integrator that splits the motion": lambda s: type(choose_integrator(s)) not in IN_LANES,
    "coils driven by pulse-width modulation": _has_pulses,
    "torques of the user's own": _has_own_torques,
    "a sensor of the user's own": lambda s: s.spacecraft.own_sensor is not None,
}


def why_not_in_lanes(run: Run) -> str:
    """Why a run cannot be flown next to others; "" if it can."""
    return why_alone(run.scenario, run.library is None and not run.blocks.compiled)


def why_alone(scenario: Scenario, in_python: bool) -> str:
    """Why runs of a scenario cannot be flown side by side; `in_python`: a law is not compiled."""
    if in_python:
        return "they have a law in plain Python"
    return next((f"they have {what}" for what, has_it in _ALONE.items() if has_it(scenario)), "")


def first_rate(numbers: np.ndarray) -> float:
    """Rate [rad/s] at the start of a member by its numbers: the higher, the more steps it takes."""
    return float(np.linalg.norm(numbers[CELLS_AT + 4 : CELLS_AT + _MOTION]))


class Lanes:
    """What all members of a group share: plan, compiled laws, layouts; `kept`: what is recorded.

    `one_by_one`: computers answer each for itself, and what they know is not recorded.
    """

    def __init__(self, run: Run, pieces: Pieces, kept: Kept = MOTION_ALONE):
        self.run, self.pieces = run, pieces
        self.packed = pack_member(run.plan.plant, run.dynamics, run.state)
        computer = run.plan.computer
        has_modes, in_c = len(computer.modes.regions) > 0, run.library is not None
        selects, restarts = len(computer.selection.kinds) > 0, run.scenario.control.restarts()
        self.one_by_one = estimates(computer) or has_modes or in_c or selects or restarts
        self.plan = run.plan._replace(log_cells=self._places(kept))
        wheels = len(run.state.rotors) if kept.wheels else 0
        self._width = _MOTION + len(self.plan.log_cells) + wheels
        if not self.one_by_one:
            self._laws = [law_in_lanes(law) for law in run.blocks.laws.values()]
            self.plan = self.plan._replace(
                computer=self._computer(run.plan.computer),
                timetable=without_unread(run.plan.timetable, run.blocks.laws.values()),
            )

    def _places(self, kept: Kept) -> np.ndarray:
        """Where what is recorded stands in a lane; below 0: in the memory of a board."""
        memory_at = self.packed.parameters_at + len(self.run.state.board.parameters)
        memory = [-1 - k if self.one_by_one else memory_at + k for k in kept.memory]
        cells = [CELLS_AT + CELLS.names.index(name) for name in kept.cells]
        if kept.known and self.one_by_one:
            raise ValueError("known: must be left out where computers work one by one")
        known = [PLACES[name].start for name in kept.known]  # what is known comes first in a lane
        return np.array(memory + cells + known, np.int64)

    def _computer(self, computer: Computer) -> Computer:
        """The computer with the laws for lanes, and the places of their cells there."""
        blocks, parameters_at = computer.law_blocks.copy(), self.packed.parameters_at
        blocks["function"] = np.arange(len(blocks))
        blocks["p0"] += parameters_at
        blocks["m0"] += parameters_at + len(self.run.state.board.parameters)
        addresses = np.array([law.address for law in self._laws], np.int64)
        return computer._replace(laws=addresses, law_blocks=blocks)

    def numbers_of(self, motion: np.ndarray) -> np.ndarray:
        """Numbers (n, size) of members that differ by their motion (n, 7) at the start."""
        numbers = np.tile(self.packed.numbers, (len(motion), 1))
        numbers[:, CELLS_AT : CELLS_AT + _MOTION] = motion
        if count := 2 * len(self.run.state.rods):
            # the field in the body at the start is each member's own
            at = self.packed.rods_at
            for row, rods in zip(numbers, self._first_rods(motion), strict=True):
                row[at : at + count] = rods.view(np.float64)
        if wheels := self.run.scenario.spacecraft.wheels:
            rotors, at = self.run.plan.plant.rotors, self.packed.rotors_at
            for row, omega in zip(numbers, np.asarray(motion)[:, 4:], strict=True):
                state = wheels.first_state(rotors, omega).view(np.float64).ravel()
                row[at : at + len(state)] = state
        return numbers

    def _first_rods(self, motion: np.ndarray) -> list[np.ndarray]:
        return first_rods(self.run.scenario, self.run.dynamics, np.asarray(motion))

    def takes(self, other: Run) -> Packed | None:
        """A run's numbers if it can be flown in this group; None if it cannot."""
        own, told = self.packed, (other.plan.plant, other.dynamics, other.state)
        theirs = pack_member(*told, own.parts)
        same = (
            theirs.shared == own.shared
            and theirs.parameters_at == own.parameters_at
            and theirs.of_loop == own.of_loop
            and theirs.of_dynamics == own.of_dynamics
            and other.steps == self.run.steps
            and other.plan.step_s == self.plan.step_s
            and other.plan.record_steps == self.plan.record_steps
            and same_timetable(other.plan.timetable, self.run.plan.timetable)
            and _functions(other) == _functions(self.run)
            and same_computers(other.plan.computer, self.run.plan.computer)
            and same_allocation(other.plan.allocation, self.run.plan.allocation)
            and self.pieces.of(other.scenario)
        )
        return theirs if same else None

    def fly(self, numbers: np.ndarray, seeds: np.ndarray) -> FlownLanes:
        """Fly members (n, size), with their whole motion in memory."""
        records = self.run.steps // self.plan.record_steps + 1
        motion = np.zeros((records, self._width, len(numbers)))

        def keep(rows: slice, first: int, part: np.ndarray) -> None:
            motion[first : first + len(part), :, rows] = part

        return FlownLanes(motion, *self.fly_in_parts(numbers, seeds, keep))

    def fly_in_parts(
        self, numbers: np.ndarray, seeds: np.ndarray, take: Take
    ) -> tuple[np.ndarray, np.ndarray]:
        """Fly members (n, size), `LANES` at a time; states at the end, and who ended early (n,).

        The last ones fill the last lanes. All fly a piece of the run before the first fly the next
        one, so its tables are made once for them; and `take` is given what each `LANES` have flown
        before `RECORDS` of their records are full: memory does not depend on the length.
        """
        run, plan = self.run, self.plan
        parts = [slice(k, min(k + LANES, len(numbers))) for k in range(0, len(numbers), LANES)]
        batches = [self._batch(rows, numbers[rows], seeds[rows]) for rows in parts]
        rows = min(run.steps // plan.record_steps + 1, RECORDS)
        kept = np.zeros((rows, self._width, LANES))
        flying = batches
        for first in range(0, run.steps, run.piece_steps):
            if not flying:
                break
            piece = self.pieces.at(first)
            flying = [batch for batch in flying if self._fly_piece(batch, piece, kept, take)]
        states = [_states(each) for each in batches]
        failed = [each.members.ends["how"][: _count(each)] != RUNNING for each in batches]
        return np.concatenate(states), np.concatenate(failed)

    def _boards(self, numbers: np.ndarray) -> Boards:
        """Boards of members (n, size) whose computers work one by one; of none for the others."""
        state, parameters_at = self.run.state, self.packed.parameters_at
        if not self.one_by_one:
            numbers = numbers[:0]
        memory_at = parameters_at + len(state.board.parameters)
        parameters = numbers[:, parameters_at:memory_at]
        memory = numbers[:, memory_at : memory_at + len(state.board.memory)]
        sensed = sensed_places(self.plan.timetable)
        return make_boards(state, parameters, memory, sensed)

    def _batch(self, rows: slice, numbers: np.ndarray, seeds: np.ndarray) -> _Batch:
        """Members at their start, at most `LANES`."""
        plan, integrator = own_space(self.plan, self.run.integrator)
        fill = np.minimum(np.arange(LANES), len(numbers) - 1)
        cells = np.ascontiguousarray(numbers[fill].T).ravel()
        seeds, ends = np.ascontiguousarray(seeds[fill], np.int64), np.zeros(LANES, END)
        rest = (seeds, np.zeros((STREAMS, 3, LANES)), ends, LANES)
        members = Many(self.packed.of_loop, cells, plan.plant, *rest)
        moving = Many(self.packed.of_dynamics, cells, self.run.dynamics, *rest)
        at, local = np.zeros(AT_CELLS, np.int64), np.zeros(LOCAL_CELLS)
        return _Batch(
            *(rows, plan, integrator, members, moving),
            *(self._boards(numbers[fill]), at, local),
        )

    def _fly_piece(self, batch: _Batch, piece: Piece, kept: np.ndarray, take: Take) -> bool:
        """Fly on to the end of a piece; whether members are to fly on.

        `kept`: place for records, each at its number modulo its length.
        """
        run, plan, at, count = self.run, batch.plan, batch.at, _count(batch)
        problem = Arguments(
            Problem(
                *(batch.integrator, batch.moving, piece.moving, batch.local),
                *(plan.step_s, plan.record_steps),
            )
        )
        loop = Loop(
            *(plan, piece.tables, batch.members, batch.boards, at, batch.local, kept, NO_READERS),
            *(0, propagate.address(problem), problem.address),
        )
        if len(plan.plant.rotors.rows):
            loop = loop._replace(drive_wheels=drive_wheels.address(Arguments(loop)))
        arguments, most = Arguments(with_readers(loop)), len(kept) * plan.record_steps
        for first in range(piece.first, piece.last, most):
            last = min(first + most, piece.last)
            while at[0] < last:
                if noted_signals().asked:
                    raise KeyboardInterrupt
                run_steps(arguments, last)
            records = np.arange(first // plan.record_steps, -(-last // plan.record_steps))
            if take(batch.rows, int(records[0]), kept[records % len(kept), :, :count]):
                return False
        if piece.last == run.steps:
            propagate(problem, run.steps, run.steps, LOOK_ONLY)
            if run.steps % plan.record_steps == 0:
                self._take_end(batch, arguments, kept, take)
        return True

    def _take_end(self, batch: _Batch, arguments: Arguments, kept: np.ndarray, take: Take) -> None:
        """Give away the record at the end, which the loop does not reach."""
        number, count = self.run.steps // self.plan.record_steps, _count(batch)
        last = _lanes_of(batch)[:, :_MOTION].T
        if self._width > _MOTION:
            record_together(arguments, self.run.steps)
            last = kept[number % len(kept)]
        take(batch.rows, number, last[None, :, :count].copy())


def _count(batch: _Batch) -> int:
    return batch.rows.stop - batch.rows.start


def _lanes_of(batch: _Batch) -> np.ndarray:
    """The numbers of `CELLS` of each lane (LANES, k)."""
    rows = batch.members.cells.reshape(-1, LANES)[CELLS_AT : CELLS_AT + len(CELLS.names)]
    return np.ascontiguousarray(rows.T)


def _states(batch: _Batch) -> np.ndarray:
    """The members' states (n,) of `CELLS`."""
    return _lanes_of(batch).view(CELLS)[: _count(batch), 0]


def _functions(run: Run) -> list[Callable]:
    return [block.function for block in run.blocks.all()]
