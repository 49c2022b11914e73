"""Members of a campaign flown together: attitudes and rates at the records, and how each ended."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.compile.arguments import Arguments
from torquer.compile.lanes import LANES
from torquer.computer.computer import Computer, estimates
from torquer.scenario.spec import Scenario
from torquer.simulation.lanes.laws import CELLS_AT, law_in_lanes
from torquer.simulation.lanes.packing import Packed, pack_member
from torquer.simulation.lanes.wheels import drive_wheels, own_space, same_allocation
from torquer.simulation.loop.computers import Boards, make_boards, same_computers, sensed_places
from torquer.simulation.loop.members import END, RUNNING, STREAMS, Many
from torquer.simulation.loop.state import AT_CELLS, CELLS, LOCAL_CELLS
from torquer.simulation.loop.step import NO_READERS, Loop, run_steps, with_readers
from torquer.simulation.propagate.interval import IN_LANES, LOOK_ONLY, Problem, propagate
from torquer.simulation.setup.prepare import first_rods
from torquer.simulation.setup.run import Piece, Run, make_environments, tabulate_piece
from torquer.simulation.setup.signals import noted_signals

_MOTION = 7


class FlownLanes(NamedTuple):
    """What members flew in lanes, and how they ended."""

    motion: np.ndarray
    """(r, 7, n): attitude and rate at the records"""
    cells: np.ndarray
    """(n,) of `CELLS`: their states at the end"""
    failed: np.ndarray
    """(n,): whether they ended early"""


class Pieces:
    """The pieces of runs on one orbit: each is made once, for all members."""

    def __init__(self, run: Run):
        self._run, self._known = run, {run.piece.first: run.piece}

    def of(self, scenario: Scenario) -> bool:
        """Whether the pieces are those of a scenario."""
        return make_environments(self._run.scenario) == make_environments(scenario)

    def at(self, first: int) -> Piece:
        """The piece that begins at a step."""
        if first not in self._known:
            run, last = self._run, min(first + self._run.piece_steps, self._run.steps)
            self._known[first] = tabulate_piece(run.scenario, run.plan, first, last)
        return self._known[first]


def _has_own_torques(run: Run) -> bool:
    return run.scenario.disturbance is not None and bool(run.scenario.disturbance.own)


#: What members are flown alone for, and whether a run has it.
_ALONE: dict[str, Callable[[Run], bool]] = {
    "an integrator that splits the motion": lambda run: type(run.integrator) not in IN_LANES,
    "coils driven by pulse-width modulation": lambda run: run.plan.plant.coils.pwm_period_s > 0.0,
    "a law in plain Python": lambda run: run.library is None and not run.blocks.compiled,
    "torques of the user's own": _has_own_torques,
    "a sensor of the user's own": lambda run: run.scenario.spacecraft.own_sensor is not None,
}


def why_not_in_lanes(run: Run) -> str:
    """Why a run cannot be flown next to others; "" if it can."""
    return next((f"they have {what}" for what, has_it in _ALONE.items() if has_it(run)), "")


def first_rate(numbers: np.ndarray) -> float:
    """Rate [rad/s] at the start of a member by its numbers: the higher, the more steps it takes."""
    return float(np.linalg.norm(numbers[CELLS_AT + 4 : CELLS_AT + _MOTION]))


class Lanes:
    """What all members of a group share: plan, compiled laws, layouts."""

    def __init__(self, run: Run, pieces: Pieces):
        self.run, self.pieces = run, pieces
        self.packed = pack_member(run.plan.plant, run.dynamics, run.state)
        computer = run.plan.computer
        has_modes, in_c = len(computer.modes.regions) > 0, run.library is not None
        selects, restarts = len(computer.selection.kinds) > 0, run.scenario.control.restarts()
        self._one_by_one = estimates(computer) or has_modes or in_c or selects or restarts
        self.plan = run.plan
        if not self._one_by_one:
            self._laws = [law_in_lanes(law) for law in run.blocks.laws.values()]
            self.plan = run.plan._replace(computer=self._computer(run.plan.computer))

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
            and other.plan.timetable.cycle_steps == self.plan.timetable.cycle_steps
            and other.plan.timetable.late == self.plan.timetable.late
            and np.array_equal(other.plan.timetable.rows, self.plan.timetable.rows)
            and _functions(other) == _functions(self.run)
            and same_computers(other.plan.computer, self.run.plan.computer)
            and same_allocation(other.plan.allocation, self.run.plan.allocation)
            and self.pieces.of(other.scenario)
        )
        return theirs if same else None

    def fly(self, numbers: np.ndarray, seeds: np.ndarray) -> FlownLanes:
        """Fly members (n, size), `LANES` at a time; the last ones fill the last lanes."""
        parts = [
            self._fly(numbers[first : first + LANES], seeds[first : first + LANES])
            for first in range(0, len(numbers), LANES)
        ]
        return FlownLanes(*(np.concatenate(part, axis=-1) for part in zip(*parts, strict=True)))

    def _boards(self, numbers: np.ndarray) -> Boards:
        """Boards of members (n, size) whose computers work one by one; of none for the others."""
        state, parameters_at = self.run.state, self.packed.parameters_at
        if not self._one_by_one:
            numbers = numbers[:0]
        memory_at = parameters_at + len(state.board.parameters)
        parameters = numbers[:, parameters_at:memory_at]
        memory = numbers[:, memory_at : memory_at + len(state.board.memory)]
        sensed = sensed_places(self.plan.timetable)
        return make_boards(state, parameters, memory, sensed)

    def _fly(self, numbers: np.ndarray, seeds: np.ndarray) -> FlownLanes:
        run, count = self.run, len(numbers)
        plan, integrator = own_space(self.plan, run.integrator)
        fill = np.minimum(np.arange(LANES), count - 1)
        cells = np.ascontiguousarray(numbers[fill].T).ravel()
        seeds, ends = np.ascontiguousarray(seeds[fill], np.int64), np.zeros(LANES, END)
        kept = np.zeros((run.steps // plan.record_steps + 1, _MOTION, LANES))
        drawn, boards = np.zeros((STREAMS, 3, LANES)), self._boards(numbers[fill])
        at, local = np.zeros(AT_CELLS, np.int64), np.zeros(LOCAL_CELLS)
        rest = (seeds, drawn, ends, LANES)
        members = Many(self.packed.of_loop, cells, plan.plant, *rest)
        moving = Many(self.packed.of_dynamics, cells, run.dynamics, *rest)
        for first in range(0, run.steps, run.piece_steps):
            piece = self.pieces.at(first)
            problem = Arguments(
                Problem(integrator, moving, piece.moving, local, plan.step_s, plan.record_steps)
            )
            compiled = propagate.address(problem)
            loop = Loop(
                *(plan, piece.tables, members, boards, at, local, kept, NO_READERS),
                *(0, compiled, problem.address),
            )
            if len(plan.plant.rotors.rows):
                loop = loop._replace(drive_wheels=drive_wheels.address(Arguments(loop)))
            arguments = Arguments(with_readers(loop))
            while at[0] < piece.last:
                if noted_signals().asked:
                    raise KeyboardInterrupt
                run_steps(arguments, piece.last)
        propagate(problem, run.steps, run.steps, LOOK_ONLY)
        ended = np.ascontiguousarray(
            cells.reshape(-1, LANES)[CELLS_AT : CELLS_AT + len(CELLS.names)].T
        )
        if run.steps % plan.record_steps == 0:
            kept[-1] = ended[:, :_MOTION].T
        states = ended.view(CELLS)[:, 0]
        return FlownLanes(kept[..., :count], states[:count], (ends["how"] != RUNNING)[:count])


def _functions(run: Run) -> list[Callable]:
    return [block.function for block in run.blocks.all()]
