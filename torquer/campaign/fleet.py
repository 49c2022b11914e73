"""Flying members: those that differ only in numbers together in lanes, all others one by one.

A member's result is the same to the bit in lanes, alone, and next to any other members.
"""

import os
from collections.abc import Callable

import numpy as np

from torquer.base.shared import Sharing
from torquer.base.user_code import check_unchanged
from torquer.campaign.alone import Alone
from torquer.campaign.at_once import AtOnce
from torquer.campaign.checks import Rotation
from torquer.campaign.chunk import Chunk, unflown_chunk
from torquer.campaign.ending import CELLS_AT_END, Ends
from torquer.campaign.files import admit_draws, own_draws
from torquer.campaign.momenta import carried_in, find_logs
from torquer.campaign.outcomes import TOTALS, needs_momentum
from torquer.campaign.reduction import Reduction
from torquer.campaign.room import MOST_INSTANTS
from torquer.campaign.sampling import as_changes, draw
from torquer.campaign.side_by_side import (
    MOTION_KEYS,
    TRIED,
    asks_for_alone,
    own_environment,
    try_key,
)
from torquer.campaign.signals import Flown
from torquer.campaign.spec import Campaign
from torquer.scenario.change import checked_again, fields_at, with_values
from torquer.scenario.spec import Scenario, Spacecraft
from torquer.simulation.lanes.group import (
    Kept,
    Lanes,
    Pieces,
    first_rate,
    why_not_in_lanes,
)
from torquer.simulation.outside.library import OtherComputer
from torquer.simulation.setup.run import Run, prepare
from torquer.simulation.setup.simulate import flown_by

#: Keys that every member has for itself.
_OWN_KEYS = ("name", "seed")
#: Is given rows of members, the number of their first record, attitudes and rates (r, 7, n).
Take = Callable[[np.ndarray, int, np.ndarray], None]


class Fleet:
    """All members of a campaign; what they share is prepared once.

    `computer`: an export whose computer in C flies in all members.
    """

    def __init__(
        self, scenario: Scenario, campaign: Campaign, computer: str | os.PathLike | None = None
    ):
        self.scenario, self.campaign, self.computer = scenario, campaign, computer
        admit_draws(campaign)
        #: What a result keeps of the functions by which members are drawn.
        self.draws = {place: own.described() for place, own in own_draws(campaign).items()}
        keys = [*as_changes(draw(campaign, scenario, [0]), 0)]
        self._sharing = Sharing(fields_at(scenario, [*_OWN_KEYS, *keys]), Scenario, Spacecraft)
        with self._sharing.learning():
            run = flown_by(computer, checked_again(scenario, keys))
        self._library = run.library
        found = find_logs(campaign, run)
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
        self._alone = Alone(scenario, campaign, run, self._kept, self._carries)

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
        now = {place: own.described() for place, own in own_draws(self.campaign).items()}
        check_unchanged(self.draws, now, "the one with which the campaign was begun")
        return unflown_chunk(self.scenario, self.campaign, members, len(self._kept))

    def fly(self, members: np.ndarray) -> Chunk:
        """Fly members by their numbers."""
        chunk = self.unflown(members)
        if self._lanes is not None:
            self._fly_in_lanes(self._lanes, chunk)
        else:
            for row in range(len(members)):
                self._fly_alone(chunk, row)
        return chunk

    def fly_motion(
        self, members: np.ndarray, take: Take, known: tuple[str, ...] = ()
    ) -> np.ndarray:
        """Fly members (n,) in lanes and give away their motion, part by part; which were flown.

        `take(rows, first, motion)`: rows of the members, number of the first record, attitudes and
        rates (r, 7, n), followed by numbers of what their computers know, by names of `KNOWN`.
        Left out are those that do not fit into lanes, or that end early there; and all whose
        computers answer one by one, if what they know is asked for.
        """
        chunk, flown = self.unflown(members), np.zeros(len(members), bool)
        if self._lanes is None or (known and self._lanes.one_by_one):
            return flown
        lanes = Lanes(self.base, self._pieces, Kept(known=known))
        fitting = self._numbers_of(lanes, chunk)
        rows = np.array([*fitting], int)
        if not len(rows):
            return flown

        def pass_on(columns: slice, first: int, motion: np.ndarray) -> None:
            take(rows[columns], first, motion)

        numbers = np.array([fitting[row] for row in rows])
        _, failed = lanes.fly_in_parts(numbers, chunk.seeds[rows], pass_on)
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
            motion, along = np.swapaxes(motion, 1, 2), self._alone.along.records(first, len(motion))
            flown = Flown(along[0], motion[..., :4], motion[..., 4:7], *along[1:])
            also, cells = self._also(motion[..., 7:], numbers[columns])
            for part, until in ends.parts(columns, flown._replace(**also), cells):
                taken.add(part, first, until)
                rotation.add(part, until)
            return ends.all_have(columns)

        cells, failed = lanes.fly_in_parts(numbers, chunk.seeds[rows], take)
        ends.put(cells)
        chunk.put(rows, taken, {name: cells[name] for name in TOTALS})
        chunk.put_checks(rows, self.scenario, cells, rotation.spun_up() | ends.checks())
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
                self._alone.fly(chunk, row, run)
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
        chunk.forget(row)
        if run := self._prepared(chunk, row):
            self._alone.fly(chunk, row, run)
