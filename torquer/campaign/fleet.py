"""Flying members: those that differ only in numbers together in lanes, all others one by one.

A member's result is the same to the bit in lanes, alone, and next to any other members.
"""

import contextlib
import functools
import os
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from torquer.base.shared import Sharing
from torquer.campaign.at_once import AtOnce
from torquer.campaign.checks import ENDED_S, Rotation, checks_for, of_steps
from torquer.campaign.ending import CELLS_AT_END, Ends
from torquer.campaign.momenta import carried_in, find_logs, recorded_logs
from torquer.campaign.outcomes import (
    TOTALS,
    log_names,
    needs_field,
    needs_modes,
    needs_momentum,
    needs_sun,
    outcomes_with_series,
)
from torquer.campaign.reduction import Reduction
from torquer.campaign.room import MOST_INSTANTS
from torquer.campaign.sampling import Drawn, as_changes, draw, member_seeds
from torquer.campaign.signals import Flown
from torquer.campaign.spec import Campaign
from torquer.campaign.variation import ATTITUDE
from torquer.scenario.change import checked_again, fields_at, with_values
from torquer.scenario.spec import InitialMotion, Scenario, Spacecraft
from torquer.simulation.lanes.group import (
    RECORDS,
    Kept,
    Lanes,
    Pieces,
    first_rate,
    why_not_in_lanes,
)
from torquer.simulation.outside.library import OtherComputer
from torquer.simulation.results.dataset import mode_numbers
from torquer.simulation.setup.checkpoints import Checkpoints, advance_in_pieces
from torquer.simulation.setup.ending import carried_by
from torquer.simulation.setup.run import Run, prepare, record_this_instant
from torquer.simulation.setup.simulate import flown_by

COMPLETE, FAILED = "complete", "failed"
#: Keys that change a member's motion at the start and nothing else.
MOTION_KEYS = {ATTITUDE, *(f"initial.{name}" for name in InitialMotion.model_fields)}
#: Keys that every member has for itself.
_OWN_KEYS = ("name", "seed")
#: Beginnings of keys that change the surroundings of a run, what its computer believes of them, or
#: when it looks at them.
_OF_ORBIT_ENVIRONMENT = ("orbit", "start", "environment", "control.ephemeris", "simulation")
#: Members that are tried in lanes before a campaign is flown.
TRIED = 8
#: Members that fail are flown again from their start: nothing is saved on the way.
_UNSAVED = Checkpoints(lambda run: None, np.inf)
#: Records at which the environment along the orbit is found at once, and such blocks that are kept.
#: How a flight is cut must not matter: models round one record differently from many.
FOUND_AT_ONCE, PARTS = 2048, 256


#: Is given rows of members, the number of their first record, attitudes and rates (r, 7, n).
Take = Callable[[np.ndarray, int, np.ndarray], None]


class Chunk(NamedTuple):
    """Inputs and outcomes of some members; `series`: signals over time (n, t), by the first outcome
    of each; `checks`: see `campaign.checks`."""

    members: np.ndarray
    seeds: np.ndarray
    drawn: Drawn
    outcomes: dict[str, np.ndarray]
    series: dict[str, np.ndarray]
    ended: list[str]
    checks: dict[str, np.ndarray]


class Fleet:
    """All members of a campaign; what they share is prepared once.

    `computer`: an export whose computer in C flies in all members.
    """

    def __init__(
        self, scenario: Scenario, campaign: Campaign, computer: str | os.PathLike | None = None
    ):
        self.scenario, self.campaign, self.computer = scenario, campaign, computer
        keys = [*as_changes(draw(campaign, scenario, [0]), 0)]
        self._sharing = Sharing(fields_at(scenario, [*_OWN_KEYS, *keys]), Scenario, Spacecraft)
        with self._sharing.learning():
            run = flown_by(computer, checked_again(scenario, keys))
        self._library = run.library
        found = find_logs(campaign, run)
        self._log_names = [*log_names(campaign.outcomes)]
        self._log_cells = {name: each.cell for name, each in found.items()}
        self.log_units = {name: each.unit for name, each in found.items()}
        self._end_when = scenario.simulation.end_when
        of_end = self._end_when is not None and self._end_when.signal == "momentum_n_m_s"
        self._carries = needs_momentum(campaign.outcomes) or of_end
        self.rows = run.steps // run.plan.record_steps + 1
        places = np.linspace(0, self.rows - 1, MOST_INSTANTS)
        self._kept = np.unique(places.round().astype(int))
        self.kept_s = self._kept * run.plan.record_steps * run.plan.step_s
        self.base, self._pieces = run, Pieces(run)
        self._first_piece = None if own_environment(campaign) else run.piece
        if self._library is not None:
            self._check_tables()
        self._at_once = AtOnce(run, self._sharing, self._first_piece)
        self._lanes, self.why_not_in_lanes = self._side_by_side()
        self._along = functools.lru_cache(PARTS)(self._block_along)

    def _check_tables(self) -> None:
        """ValueError for a key that changes what the computer in C has as constants."""
        for key in self.campaign.varied_keys:
            if key in MOTION_KEYS:
                continue
            for member in try_key(self.scenario, self.campaign, key):
                try:
                    prepare(member, piece=self._first_piece, library=self._library)
                except OtherComputer:
                    raise ValueError(
                        f"computer: must be given without campaign.vary.{key}, which changes the "
                        "tables of the computer; in C these are constants, and only parameters and "
                        "memory of laws and estimators can vary"
                    ) from None
                except ValueError:  # by itself it may be no scenario
                    continue

    def _side_by_side(self) -> tuple[Lanes | None, str]:
        """Lanes for the members; None, and the reason, if all must be flown one by one."""
        if (asked := asks_for_alone(self.scenario, self.campaign)) is not None:
            return None, asked.at_length
        if why := why_not_in_lanes(self.base):
            return None, why
        try:
            cells = CELLS_AT_END if self._end_when else ()
            kept = Kept(tuple(self._log_cells.values()), cells, wheels=self._carries)
            lanes = Lanes(self.base, self._pieces, kept)
        except ValueError as error:  # of a user's law
            return None, str(error)
        for key in self.campaign.varied_keys:
            if not self._may_vary(key, lanes):
                return None, f"{key} varies, and members flown together share it"
        return lanes, ""

    def _may_vary(self, key: str, lanes: Lanes) -> bool:
        """Whether at least one of some members fits into lanes if it differs only at a key."""
        if key in MOTION_KEYS:
            return True
        members = list(try_key(self.scenario, self.campaign, key))
        if len(members) < TRIED:  # by itself it may be no scenario
            return True
        for member in members:
            try:
                run = prepare(member, piece=self._first_piece, library=self._library)
            except ValueError:
                return True
            if self._taken(lanes, run) is not None:
                return True
        return False

    def unflown(self, members: np.ndarray) -> Chunk:
        """Members by their numbers: their inputs, and no outcomes yet."""
        drawn = draw(self.campaign, self.scenario, members)
        seeds = member_seeds(self.campaign, members)
        count = len(members)
        outcomes = {name: np.full(count, np.nan) for name in self.campaign.outcomes}
        shape = (count, len(self._kept))
        kept_of = outcomes_with_series(self.campaign.outcomes)
        series = {name: np.full(shape, np.nan, np.float32) for name in kept_of}
        names = checks_for(self.scenario, self.campaign.varied_keys)
        checks = {name: np.full(count, np.nan) for name in names}
        return Chunk(members, seeds, drawn, outcomes, series, [COMPLETE] * count, checks)

    def fly(self, members: np.ndarray) -> Chunk:
        """Fly members by their numbers."""
        chunk = self.unflown(members)
        if self._lanes is not None:
            self._fly_in_lanes(self._lanes, chunk)
        else:
            for row in range(len(members)):
                self._fly_alone(chunk, row)
        return chunk

    def fly_motion(self, members: np.ndarray, take: Take) -> np.ndarray:
        """Fly members (n,) in lanes and give away their motion, part by part; which were flown.

        `take(rows, first, motion)`: rows of the members, number of the first record, attitudes and
        rates (r, 7, n). Left out are those that do not fit into lanes, or that end early there.
        """
        chunk, flown = self.unflown(members), np.zeros(len(members), bool)
        if self._lanes is None:
            return flown
        fitting = self._numbers_of(self._lanes, chunk)
        rows = np.array([*fitting], int)
        if not len(rows):
            return flown

        def pass_on(columns: slice, first: int, motion: np.ndarray) -> None:
            take(rows[columns], first, motion[:, :7])

        numbers = np.array([fitting[row] for row in rows])
        _, failed = self._lanes.fly_in_parts(numbers, chunk.seeds[rows], pass_on)
        flown[rows[~failed]] = True
        return flown

    def _fly_in_lanes(self, lanes: Lanes, chunk: Chunk) -> None:
        """Fly all members, alone those that do not fit into lanes or that end early there.

        Those of similar rates fly together: a fast one takes more steps, and slow ones would wait.
        """
        fitting = self._numbers_of(lanes, chunk)
        rows = np.array(sorted(fitting, key=lambda row: first_rate(fitting[row])), int)
        if not len(rows):
            return
        numbers, length_s = np.array([fitting[row] for row in rows]), self.scenario.length_s
        taken = Reduction(self.campaign.outcomes, self.scenario, len(rows), self._kept)
        rotation = Rotation(self.scenario, len(rows), length_s)
        ends = Ends(self._end_when, len(rows), length_s)

        def take(columns: slice, first: int, motion: np.ndarray) -> bool:
            motion, along = np.swapaxes(motion, 1, 2), self._records_along(first, len(motion))
            flown = Flown(along[0], motion[..., :4], motion[..., 4:7], *along[1:])
            also, cells = self._also(motion[..., 7:], numbers[columns])
            for part, until in ends.parts(columns, flown._replace(**also), cells):
                taken.add(part, first, until)
                rotation.add(part, until)
            return ends.all_have(columns)

        cells, failed = lanes.fly_in_parts(numbers, chunk.seeds[rows], take)
        ends.put(cells)
        self._put(chunk, rows, taken, {name: cells[name] for name in TOTALS})
        self._put_checks(chunk, rows, self.scenario, cells, rotation.spun_up() | ends.checks())
        for row in rows[failed].tolist():
            self._fly_alone(chunk, row)

    def _also(self, kept: np.ndarray, numbers: np.ndarray) -> tuple[dict, np.ndarray]:
        """What `Flown` has of members in lanes beside their motion, and cells (r, n, k).

        `kept` (r, n, k): logs, cells, wheels.
        """
        logs = {name: kept[..., k] for k, name in enumerate(self._log_cells)}
        count = len(CELLS_AT_END) if self._end_when else 0
        cells, wheels = np.split(kept[..., len(logs) :], [count], axis=-1)
        if not self._carries:
            return {"logs": logs}, cells
        carried = carried_in(self._lanes.packed, numbers)
        return {"logs": logs, "carried": carried, "wheels_n_m_s": wheels}, cells

    def _records_along(self, first: int, count: int) -> list:
        """Times, and what `Flown` has along the orbit, of records that all members share."""
        skipped = first % FOUND_AT_ONCE
        numbers = range(first // FOUND_AT_ONCE, (first + count - 1) // FOUND_AT_ONCE + 1)
        parts = zip(*map(self._along, numbers), strict=True)
        joined = (None if part[0] is None else np.concatenate(part) for part in parts)
        return [None if part is None else part[skipped : skipped + count] for part in joined]

    def _block_along(self, number: int) -> tuple:
        """The same of a block of records."""
        plan, first = self.base.plan, number * FOUND_AT_ONCE
        after = min(first + FOUND_AT_ONCE, self.base.steps // plan.record_steps + 1)
        t_s = np.arange(first, after) * plan.record_steps * plan.step_s
        return t_s, *_along(self.scenario, self.campaign, t_s)

    def _numbers_of(self, lanes: Lanes, chunk: Chunk) -> dict[int, np.ndarray]:
        """Numbers of members in their lanes, by their rows; those that do not fit are flown."""
        found = self._at_once.numbers(lanes, chunk.drawn, chunk.seeds)
        for row in range(len(chunk.members)):
            if row in found:
                continue
            with self._sharing.used():
                run = self._prepared(chunk, row)
                numbers = self._taken(lanes, run) if run else None
            if numbers is not None:
                found[row] = numbers
            elif run:
                self._finish(chunk, row, run)
        return found

    def _taken(self, lanes: Lanes, run: Run) -> np.ndarray | None:
        """The numbers of a member that fits in with the others."""
        if why_not_in_lanes(run):
            return None
        packed = lanes.takes(run)
        return None if packed is None else packed.numbers

    def _scenario_of(self, chunk: Chunk, row: int) -> Scenario:
        own = {"name": f"{self.scenario.name}-{chunk.members[row]}", "seed": int(chunk.seeds[row])}
        return with_values(self.scenario, {**own, **as_changes(chunk.drawn, row)})

    def _prepared(self, chunk: Chunk, row: int) -> Run | None:
        """A member's run; None, with the reason in its row, if it cannot be flown."""
        try:
            member = self._scenario_of(chunk, row)
            return prepare(member, piece=self._first_piece, library=self._library)
        except ValueError as error:
            chunk.ended[row] = " ".join(str(error).split("\n"))
            return None

    def _fly_alone(self, chunk: Chunk, row: int) -> None:
        """Fly a member by itself."""
        for values in (chunk.outcomes, chunk.series, chunk.checks):
            for each in values.values():
                each[row] = np.nan
        if run := self._prepared(chunk, row):
            self._finish(chunk, row, run)

    def _finish(self, chunk: Chunk, row: int, run: Run) -> None:
        """Fly a member's run to its end."""
        shared = _times(run) == _times(self.base)
        kept = self._kept if shared else self._kept[:0]
        found = Reduction(self.campaign.outcomes, self.scenario, 1, kept)
        rotation = Rotation(self.scenario, 1, run.scenario.length_s)
        shared = shared and run.piece.environment == self.base.piece.environment
        changes: dict[str, np.ndarray] = {}
        run.keep = lambda run: self._take_alone(run, (found, rotation), shared, changes)
        try:
            ended = advance_in_pieces(run, run.steps, None, _UNSAVED)
        except ValueError as error:
            ended = " ".join(str(error).split("\n"))
        if ended:
            chunk.ended[row] = ended
            return
        run.enter()
        record_this_instant(run)
        run.keep(run)
        totals = {name: np.array(run.state.cells[name]) for name in TOTALS}
        self._put(chunk, np.array([row]), found, totals)
        ended_s = np.array([run.now_s if run.steps < run.scenario.steps() else np.nan])
        also = rotation.spun_up() | {ENDED_S: ended_s}
        self._put_checks(chunk, np.array([row]), run.scenario, run.state.cells, also)

    def _take_alone(
        self,
        run: Run,
        taken: tuple[Reduction, Rotation],
        shared: bool,
        changes: dict[str, np.ndarray],
    ) -> None:
        """Take what a piece of a run gives; `shared`: its records' times and orbit are those of all
        members; `changes`: states of its regions so far, without records in which none changes."""
        record, (found, rotation) = run.rows(), taken
        needed = needs_modes(self.campaign.outcomes, self.scenario)
        modes = mode_numbers(run.scenario, record) if needed else {}
        for at in range(0, len(record.rows), RECORDS):
            rows, first = record.rows[at : at + RECORDS], run.first_row + at
            t_s = rows["step"] * run.plan.step_s
            along = (
                _along(run.scenario, self.campaign, t_s)
                if not shared
                else self._records_along(first, len(rows))[1:]
            )
            q = np.stack([rows[f"q_{c}"] for c in "xyzw"], axis=1)[:, None]
            omega = np.stack([rows[f"omega_{c}"] for c in "xyz"], axis=1)[:, None]
            for name, numbers in modes.items():
                before = changes.get(name, numbers[:0])
                changes[name] = np.concatenate([before, numbers[at : at + RECORDS]])
            states = {name: numbers[:, None] for name, numbers in changes.items()}
            flown = Flown(t_s, q, omega, *along)._replace(modes=states if needed else None)
            here = slice(at, at + RECORDS)
            flown = flown._replace(logs=recorded_logs(record, run, here, self._log_names))
            if self._carries:
                wheels = record.wheels[here, None, : len(run.state.rotors)]
                carried = carried_by(run.dynamics, run.plan.plant.rotors)
                flown = flown._replace(carried=carried, wheels_n_m_s=wheels)
            found.add(slice(0, 1), first, flown)
            rotation.add(slice(0, 1), flown)
            changes |= _where_changed(changes)

    def _put(
        self, chunk: Chunk, rows: np.ndarray, found: Reduction, totals: Mapping[str, np.ndarray]
    ) -> None:
        """Put outcomes and signals of some members into their rows."""
        for name, values in found.outcomes(totals).items():
            chunk.outcomes[name][rows] = values
        for name, values in found.series.items():
            if values.shape[1]:
                chunk.series[name][rows] = values

    def _put_checks(
        self, chunk: Chunk, rows: np.ndarray, flown: Scenario, cells, also: Mapping
    ) -> None:
        """Put the checks of some members into their rows, those that the campaign has."""
        of_all = {**of_steps(flown.simulation.integrator, cells), **also}
        for name in chunk.checks.keys() & of_all.keys():
            chunk.checks[name][rows] = of_all[name]


def try_key(scenario: Scenario, campaign: Campaign, key: str) -> Iterator[Scenario]:
    """Some members as far as they are scenarios, each with its value of one key alone."""
    members = np.linspace(0, campaign.runs - 1, TRIED).astype(int)
    values = draw(campaign, scenario, members)[key]
    for row in range(TRIED):
        with contextlib.suppress(ValueError):
            yield with_values(scenario, as_changes({key: values}, row))


class Asked(NamedTuple):
    """Why a campaign's members fly one by one whatever their scenario has: in short, at length."""

    why: str
    at_length: str


def asks_for_alone(scenario: Scenario, campaign: Campaign) -> Asked | None:
    """What a campaign asks for that members flown together do not give."""
    if needs_modes(campaign.outcomes, scenario):
        return Asked(
            "attitude_error_deg depends on the modes",
            "attitude_error_deg is from the attitude that the modes hold at the time, and "
            "members flown together do not record their modes",
        )
    when = scenario.simulation.end_when
    if when is not None and when.signal == "momentum_n_m_s" and scenario.spacecraft.wheels:
        return Asked(
            "the momentum of wheels ends them",
            "simulation.end_when looks at the momentum of wheels, which members flown together "
            "round otherwise",
        )
    if varied := own_environment(campaign):
        text = "members flown together share orbit, environment, ephemeris and steps"
        return Asked(f"{varied[0]} varies", f"{varied[0]} varies, and {text}")
    return None


def own_environment(campaign: Campaign) -> list[str]:
    """Keys that vary of the orbit, the environment, the ephemeris or the steps."""
    return [key for key in campaign.varied_keys if key.startswith(_OF_ORBIT_ENVIRONMENT)]


def _times(run: Run) -> tuple:
    """What the times of a run's records follow from."""
    return run.steps, run.plan.step_s, run.plan.record_steps


def _where_changed(numbers: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Numbers (r,) by name, without those records that equal the one before in all of them."""
    if not numbers:
        return {}
    together = np.stack([*numbers.values()], axis=1)
    kept = np.append(True, (together[1:] != together[:-1]).any(axis=1))
    return {name: values[kept] for name, values in numbers.items()}


def _along(scenario: Scenario, campaign: Campaign, t_s: np.ndarray) -> tuple:
    """Position, velocity, field and direction to the Sun at the records, as `Flown` has them."""
    environment = scenario.orbit_environment()
    r, v = environment.state(t_s)
    field = environment.field(t_s, r, v) if needs_field(campaign.outcomes) else None
    sun = environment.sun(t_s) - r if needs_sun(campaign.outcomes, scenario) else None
    return r, v, field, sun
