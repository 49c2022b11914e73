"""A scenario flown for the page: the variables of its run from the rows, without a Dataset.

What costs most of a short run are the tables of the environment along the orbit. They are kept by
orbit, models and span of the run, and serve every run that differs in the satellite only. The
numbers are those of `simulate`, to the bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.maths.geometry.attitudes import dcm_body_to_reference
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.state import Record
from torquer.simulation.results.dataset import mode_numbers, rate_in_orbit, sun_direction
from torquer.simulation.results.variables import RECORDED, read
from torquer.simulation.setup.checkpoints import Checkpoints, advance_in_pieces
from torquer.simulation.setup.run import Piece, Run, make_environments, prepare, record_this_instant
from torquer.simulation.setup.size import check_memory, estimate_size

#: Orbits whose tables are kept.
MOST_ORBITS = 6
_UNSAVED = Checkpoints(lambda run: None, np.inf)


class Superseded(Exception):
    """The run is no longer wanted."""


class NotFlown(ValueError):
    """A run that ended early: one line with the reason."""


class Values(NamedTuple):
    """The values of a variable."""

    values: np.ndarray


class Along(NamedTuple):
    """Position [m], velocity [m/s] and direction to the Sun at the records of a run, in J."""

    r: np.ndarray
    v: np.ndarray
    sun: np.ndarray


class Orbits:
    """What is kept of the last orbits flown: tables of the run's first piece, and its records."""

    def __init__(self) -> None:
        self._pieces: list[Piece] = []
        self._along: list[tuple[OrbitEnvironment, np.ndarray, Along]] = []

    def prepare(self, scenario: Scenario) -> Run:
        """A prepared run, with kept tables where some fit."""
        for piece in self._fitting(scenario):
            try:
                run = prepare(scenario, piece=piece)
            except ValueError:  # of a run that needs the Sun, the air or a shadow as well
                continue
            self._keep(piece)
            return run
        run = prepare(scenario)
        if run.piece is not None:
            self._keep(run.piece)
        return run

    def along(self, environment: OrbitEnvironment, t_s: np.ndarray) -> Along:
        """Place and Sun at the records, kept like tables."""
        for each in self._along:
            if each[0] == environment and np.array_equal(each[1], t_s):
                return each[2]
        r, v = environment.state(t_s)
        found = Along(r, v, sun_direction(environment, t_s, r))
        self._along = [(environment, t_s, found), *self._along][:MOST_ORBITS]
        return found

    def _fitting(self, scenario: Scenario) -> list[Piece]:
        wanted = (*make_environments(scenario), scenario.grid_s)
        return [p for p in self._pieces if (p.environment, p.believed, p.step_s) == wanted]

    def _keep(self, piece: Piece) -> None:
        others = [each for each in self._pieces if each is not piece]
        self._pieces = [piece, *others][:MOST_ORBITS]


class Flown:
    """A complete run by the names of its variables, as a result has them."""

    def __init__(self, run: Run, record: Record, orbits: Orbits):
        self.scenario, self.totals = run.scenario, run.state.cells[0]
        self.t_s = record.rows["step"] * run.plan.step_s
        self._environment, self._orbits = run.scenario.orbit_environment(), orbits
        self._found = {name: each[1] for name, each in read(record.rows, RECORDED).items()}
        if len(run.plan.plant.rotors.rows):
            momentum, motor = np.split(record.wheels, 2, axis=1)
            speed = momentum / run.plan.plant.rotors.rows["inertia"]
            self._found |= {"wheel_momentum": momentum, "wheel_torque": motor, "wheel_speed": speed}
        self._found["time"] = self.t_s
        numbers = mode_numbers(run.scenario, record)
        self._found |= {f"mode_{name}": values for name, values in numbers.items()}

    def __getitem__(self, name: str) -> Values:
        if name not in self._found:
            self._found[name] = _COMPUTED[name](self)
        return Values(self._found[name])

    def __contains__(self, name: str) -> bool:
        return name in self._found or name in _COMPUTED

    @property
    def along(self) -> Along:
        """Place and Sun at the records."""
        return self._orbits.along(self._environment, self.t_s)

    def rate_in_orbit(self) -> np.ndarray:
        """Rate relative to the orbital frame [rad/s], in body axes."""
        to_body = dcm_body_to_reference(self["q_body_to_inertial"].values).transpose(0, 2, 1)
        return rate_in_orbit(to_body, self["omega_body"].values, self.along.r, self.along.v)


_COMPUTED: dict[str, Callable[[Flown], np.ndarray]] = {
    "position_inertial": lambda flown: flown.along.r,
    "velocity_inertial": lambda flown: flown.along.v,
    "sun_inertial": lambda flown: flown.along.sun,
    "omega_orbital": Flown.rate_in_orbit,
}


def fly(
    scenario: Scenario, orbits: Orbits, is_superseded: Callable[[], bool] = lambda: False
) -> Flown:
    """Fly a scenario to its end.

    `Superseded` soon after `is_superseded` says so; `NotFlown` for a run that ends early,
    ValueError for one that cannot be flown.
    """
    check_memory(estimate_size(scenario), False)

    def look(done: float) -> None:
        if is_superseded():
            raise Superseded

    look(0.0)
    run, parts = orbits.prepare(scenario), []
    run.keep = lambda run: parts.append(run.rows())
    look(0.0)
    ended = advance_in_pieces(run, run.steps, look, _UNSAVED)
    if ended:
        raise NotFlown(ended)
    run.enter()
    record_this_instant(run)
    run.keep(run)
    return Flown(run, _join(parts), orbits)


def _join(parts: list[Record]) -> Record:
    if len(parts) == 1:
        return parts[0]
    return Record(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
