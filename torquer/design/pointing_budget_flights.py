"""Flights of a pointing budget: a cause beside what is always there, and all causes together."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.analysis.causes import Cause
from torquer.analysis.filters.filter_flights import record_run
from torquer.analysis.pointing.setting import Setting
from torquer.analysis.pointing.statistics import Measured, Tally
from torquer.campaign.fleet import Fleet
from torquer.campaign.sampling import member_scenario
from torquer.campaign.spec import Campaign
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.run import Piece, prepare
from torquer.theory.three_axis.effects import relative_to_mean
from torquer.theory.three_axis.linearise import wanted_motion


class FlownErrors(NamedTuple):
    """Errors of flights: of the attitude (APE), less the means over windows (RPE), of what is known
    of it (AKE)."""

    absolute: Measured
    relative: Measured
    knowledge: Measured
    flights: int


class FlightErrors(NamedTuple):
    """Turns of a flight (n, 3) [rad] from the wanted attitude, and of what is known from the
    attitude."""

    pointing: np.ndarray
    knowledge: np.ndarray


class Flights:
    """Flies scenarios that share orbit, field and steps with that of a setting.

    Errors count from the setting's first command on. `confidence`: of the quantiles.
    """

    def __init__(self, setting: Setting, confidence: float):
        self._setting, self._confidence = setting, confidence
        self._piece: Piece | None = None
        self._wanted: np.ndarray | None = None

    def alone(self, scenario: Scenario) -> FlightErrors:
        """Errors of one flight from its start on; ValueError for one that ends early."""
        run = prepare(scenario.replace("simulation.record_inputs", True), piece=self._piece)
        self._piece = self._piece or run.piece
        recorded = record_run(run)
        q, known = (
            np.stack([each[f"{key}_{c}"] for c in "xyzw"], axis=1)
            for each, key in ((recorded.rows, "q"), (recorded.known, "estimate_q"))
        )
        wanted = self._wanted_at(len(q))
        return FlightErrors(rotation_vector(wanted, q), rotation_vector(q, known))

    def _wanted_at(self, count: int) -> np.ndarray:
        """The wanted attitudes (count, 4) at the records."""
        if self._wanted is None or len(self._wanted) < count:
            hold, record_s = self._setting.hold, self._setting.scenario.simulation.record_s
            at = hold.instants(record_s * np.arange(count) * hold.rate_rad_s)
            self._wanted, rates = np.empty((count, 4)), np.empty((count, 3))
            wanted_motion(hold.reference, at, self._wanted, rates)
        return self._wanted[:count]

    def _counted(self, turns: np.ndarray) -> np.ndarray:
        """Those that count: whole windows from the first command on."""
        first, size = self._setting.first, self._setting.size
        last = len(self._setting.loop.t_s) // size * size
        return turns[first : min(last, len(turns))]

    def with_causes(
        self,
        scenario: Scenario,
        causes: list[Cause],
        baseline: FlightErrors | None,
        count: int,
        known: bool,
        flown: Callable[[int], None],
    ) -> FlownErrors:
        """Errors of flights of a scenario that has these causes, less a flight without them.

        `known`: whether they err in what is known of the attitude, too: then flights are flown one
        by one, with a record of it, else in lanes. Flights that would all be the same are flown
        once. `flown` is called with the flights done.
        """
        drawn = {key: sigma for cause in causes for key, sigma in cause.drawn.items()}
        count = count if any(cause.differs for cause in causes) else 1
        vary = {key: {"normal": {"mean": [0.0] * 3, "sigma": size}} for key, size in drawn.items()}
        self._piece = None  # what moves the body differs from cause to cause
        campaign = Campaign.model_validate({"runs": count, "seed": 1, "vary": vary})
        tallies = Tally(), Tally(), Tally()
        alone = range(count if known or count == 1 else 1)
        for number in alone:
            errors = self.alone(member_scenario(scenario, campaign, number))
            self._add(tallies, errors, baseline, pointing=known or count == 1)
            flown(1 if known or count == 1 else 0)
        if count > len(alone):
            self._in_lanes(scenario, campaign, tallies, baseline)
            flown(count)
        absolute, relative, knowledge = (tally.measured(self._confidence) for tally in tallies)
        return FlownErrors(absolute, relative, knowledge, count)

    def _add(
        self, tallies, errors: FlightErrors, baseline: FlightErrors | None, pointing: bool
    ) -> None:
        absolute, relative, knowledge = tallies
        knowledge.add(self._counted(errors.knowledge))
        if pointing:
            self._add_pointing(absolute, relative, errors.pointing, baseline)

    def _add_pointing(self, absolute, relative, turns, baseline: FlightErrors | None) -> None:
        if baseline is not None:
            both = min(len(turns), len(baseline.pointing))
            turns = turns[:both] - baseline.pointing[:both]
        counted = self._counted(turns)
        absolute.add(counted)
        relative.add(relative_to_mean(counted, self._setting.size))

    def _in_lanes(
        self, scenario, campaign: Campaign, tallies, baseline: FlightErrors | None
    ) -> None:
        """Errors of the attitude of all members, side by side where they fit into lanes."""
        fleet = Fleet(scenario, campaign)
        turns = np.full((campaign.runs, fleet.rows, 3), np.nan)
        wanted = self._wanted_at(fleet.rows)

        def take(rows: np.ndarray, first: int, motion: np.ndarray) -> None:
            part = slice(first, first + len(motion))
            for column, row in enumerate(rows):
                turns[row, part] = rotation_vector(wanted[part], motion[:, :4, column])

        flown = fleet.fly_motion(np.arange(campaign.runs), take)
        for row in np.flatnonzero(~flown).tolist():
            errors = self.alone(member_scenario(scenario, campaign, row))
            turns[row, : len(errors.pointing)] = errors.pointing
        for row in range(campaign.runs):
            own = turns[row][np.isfinite(turns[row, :, 0])]
            self._add_pointing(tallies[0], tallies[1], own, baseline)
