"""Flights of a pointing budget: a cause beside what is always there, and all causes together."""

import math
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
from torquer.compile.lanes import LANES
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.scenario.resolution import part_damped, told_of_steps
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.run import Piece, prepare
from torquer.theory.three_axis.effects import relative_to_mean
from torquer.theory.three_axis.linearise import wanted_motion

_ATTITUDE = tuple(f"q_{c}" for c in "xyzw")
#: Of `KNOWN`: the attitude as the computer has it.
_KNOWN = tuple(f"estimate_q_{c}" for c in "xyzw")


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
        self._damping, self._lag = 0.0, 0.0

    @property
    def steps(self) -> tuple[str, ...]:
        """What the steps of RK4 did in the flights alone, if it is not small."""
        return (*told_of_steps(float(part_damped(self._damping)), math.degrees(self._lag)),)

    def alone(self, scenario: Scenario) -> FlightErrors:
        """Errors of one flight from its start on; ValueError for one that ends early."""
        run = prepare(scenario.replace("simulation.record_inputs", True), piece=self._piece)
        self._piece = self._piece or run.piece
        recorded = record_run(run)
        cells = run.state.cells[0]
        self._damping = max(self._damping, float(cells["damping"]))
        self._lag = max(self._lag, float(cells["lag"]))
        q, known = (
            np.stack([each[name] for name in names], axis=1)
            for each, names in ((recorded.rows, _ATTITUDE), (recorded.known, _KNOWN))
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
        flown: Callable[[int], None],
    ) -> FlownErrors:
        """Errors of flights of a scenario that has these causes, less a flight without them.

        Flights that would all be the same are flown once. `flown` is called with the flights done.
        """
        drawn = {key: sigma for cause in causes for key, sigma in cause.drawn.items()}
        count = count if any(cause.differs for cause in causes) else 1
        vary = {key: {"normal": {"mean": [0.0] * 3, "sigma": size}} for key, size in drawn.items()}
        self._piece = None  # what moves the body differs from cause to cause
        campaign = Campaign.model_validate({"runs": count, "seed": 1, "vary": vary})
        tallies = Tally(), Tally(), Tally()
        if count == 1:
            self._add(tallies, self.alone(member_scenario(scenario, campaign, 0)), baseline)
            flown(1)
        else:
            self._in_lanes(scenario, campaign, tallies, baseline, flown)
        absolute, relative, knowledge = (tally.measured(self._confidence) for tally in tallies)
        return FlownErrors(absolute, relative, knowledge, count)

    def _add(self, tallies, errors: FlightErrors, baseline: FlightErrors | None) -> None:
        absolute, relative, knowledge = tallies
        knowledge.add(self._counted(errors.knowledge))
        turns = errors.pointing
        if baseline is not None:
            both = min(len(turns), len(baseline.pointing))
            turns = turns[:both] - baseline.pointing[:both]
        counted = self._counted(turns)
        absolute.add(counted)
        relative.add(relative_to_mean(counted, self._setting.size))

    def _in_lanes(
        self,
        scenario: Scenario,
        campaign: Campaign,
        tallies,
        baseline: FlightErrors | None,
        flown: Callable[[int], None],
    ) -> None:
        """Errors of all members, side by side where they fit into lanes: a group after another."""
        fleet = Fleet(scenario, campaign)
        wanted = self._wanted_at(fleet.rows)
        turns = FlightErrors(*np.empty((2, LANES, fleet.rows, 3)))

        def take(rows: np.ndarray, first: int, motion: np.ndarray) -> None:
            part = slice(first, first + len(motion))
            for column, row in enumerate(rows):
                q, known = motion[:, :4, column], motion[:, -4:, column]
                turns.pointing[row, part] = rotation_vector(wanted[part], q)
                turns.knowledge[row, part] = rotation_vector(q, known)

        for first in range(0, campaign.runs, LANES):
            members = np.arange(first, min(first + LANES, campaign.runs))
            is_flown = fleet.fly_motion(members, take, _KNOWN)
            for row, number in enumerate(members.tolist()):
                errors = FlightErrors(turns.pointing[row], turns.knowledge[row])
                if not is_flown[row]:
                    errors = self.alone(member_scenario(scenario, campaign, number))
                self._add(tallies, errors, baseline)
            flown(len(members))
