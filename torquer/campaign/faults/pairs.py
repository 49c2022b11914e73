"""Pairs of faults: drawn from the single ones, at the same time or one after the other; flown.

The verdict is that on single faults. A satellite is lost *unnoticed* if it entered no state that
switches the coils off, or only one that it enters without faults, too: then the coils may
go on speeding it up.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from torquer.analysis.goals import Goal, find_goals
from torquer.base.limits import at_least
from torquer.campaign.faults.fly import choose_faults, fly_all, fly_nominal, simulate_or_stop
from torquer.campaign.faults.kinds import Fault, find_faults
from torquer.campaign.faults.strikes import strike_at
from torquer.campaign.faults.verdict import (
    LOST,
    VERDICTS,
    Flown,
    Outcome,
    first_notice,
    judge,
    judge_flight,
    keep_flight,
)
from torquer.computer.modes.spec import Modes
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.ending import flown_whole

#: The first fault strikes within this part of the flight, a later one within this part after it.
FIRST_PART, LATER_PART = 0.5, 0.25


class Pair(NamedTuple):
    """Two faults, and when each strikes; `number`: of the draw."""

    number: int
    faults: tuple[Fault, Fault]
    at_s: tuple[float, float]

    def strikes(self, scenario: Scenario) -> Scenario:
        """The scenario with both."""
        for fault, at_s in zip(self.faults, self.at_s, strict=True):
            scenario = fault.strikes(scenario, at_s)
        return scenario

    def tables(self) -> dict:
        """The pair as a file of faults for `torquer fly`."""
        pairs = zip(self.at_s, self.faults, strict=True)
        return {"faults": [{"at_s": at_s, "fault": fault.name} for at_s, fault in pairs]}


class PairRow(NamedTuple):
    """A flight with a pair; `coils_off_by`: the state that switched the coils off, "" if none did.

    `ended`: why the flight ended early, "" if it did not.
    """

    pair: Pair
    outcome: Outcome
    coils_off_by: str
    ended: str

    @property
    def is_lost(self) -> bool:
        """Whether the satellite is lost."""
        return self.outcome.verdict == LOST

    @property
    def is_lost_unnoticed(self) -> bool:
        """Whether it is lost, and the coils were left to work."""
        return self.is_lost and not self.coils_off_by


class PairCampaign(NamedTuple):
    """All flights of pairs. `nominal`: without a fault; `verdict`: of that flight and why."""

    scenario: Scenario
    goals: list[Goal]
    nominal: Flown
    verdict: tuple[str, str]
    rows: list[PairRow]

    def counts(self) -> dict[str, int]:
        """Number of flights by verdict; those lost unnoticed, and those that ended early."""
        found = [row.outcome.verdict for row in self.rows]
        return {verdict: found.count(verdict) for verdict in VERDICTS} | {
            "lost_unnoticed": sum(row.is_lost_unnoticed for row in self.rows),
            "ended": sum(bool(row.ended) for row in self.rows),
        }

    def worst(self) -> PairRow:
        """The worst flight: lost unnoticed before noticed, then by the verdict, by the rate."""
        return max(self.rows, key=_badness)

    def scenario_of(self, row: PairRow) -> Scenario:
        """The scenario of a flight, to be flown again."""
        return row.pair.strikes(self.scenario)


def _badness(row: PairRow) -> tuple:
    outcome = row.outcome
    return row.is_lost_unnoticed, VERDICTS.index(outcome.verdict), outcome.rate_deg_s


def fly_pairs(
    scenario: Scenario,
    pairs: int,
    only: Sequence[str] = (),
    at_s: Sequence[float] = (),
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> PairCampaign:
    """Fly so many pairs of faults, drawn by the scenario's seed.

    `only`: pairs of faults whose names contain one of these texts. `at_s`: one of these is the time
    of the first fault; by default any in the first half of the flight. `workers`: flights at once,
    one per core unless given. `progress` is called with the fraction done. The result
    depends on none of the last two, and pair n not on how many are flown. ValueError for fewer than
    two faults, a time after the end, and a flight without a fault that stops early. No condition
    ends a flight.
    """
    at_least(1).check("pairs", pairs)
    scenario = flown_whole(scenario)
    faults = choose_faults(find_faults(scenario), only)
    if len(faults) < 2:
        raise ValueError(
            f"only: must leave two faults or more for pairs; received {faults[0].name} alone"
        )
    result, goals = fly_nominal(scenario), find_goals(scenario)
    nominal, times = keep_flight(result), [strike_at(result, each).at_s for each in at_s]
    drawn = [draw_pair(scenario, faults, number, times) for number in range(pairs)]

    def fly(pair: Pair) -> PairRow:
        flight = keep_flight(simulate_or_stop(pair.strikes(scenario)))
        outcome = judge_flight(flight, nominal, goals, pair.at_s[0])
        off = _only_off(flight, scenario.control.named().modes)
        return PairRow(pair, outcome, first_notice(off, nominal, pair.at_s[0])[1], flight.ended)

    rows = fly_all(fly, drawn, workers, progress)
    return PairCampaign(scenario, goals, nominal, judge(nominal, nominal, goals), rows)


def draw_pair(
    scenario: Scenario, faults: Sequence[Fault], number: int, at_s: Sequence[float] = ()
) -> Pair:
    """The pair of a number: two different faults, in half of all pairs at the same time.

    Times are whole seconds.
    """
    rng = np.random.default_rng((scenario.seed, number))
    first, second = rng.choice(len(faults), 2, replace=False)
    u, v, w = rng.random(3)
    begin_s = at_s[int(u * len(at_s))] if at_s else math.floor(u * FIRST_PART * scenario.length_s)
    later_s = 0.0 if v < 0.5 else math.floor(w * LATER_PART * scenario.length_s)
    times = float(begin_s), min(float(begin_s + later_s), scenario.length_s)
    return Pair(number, (faults[first], faults[second]), times)


def _only_off(flight: Flown, modes: Modes | None) -> Flown:
    """A flight with those of its states that switch the coils off."""
    regions = modes.regions if modes else {}
    off = {
        f"{region}.{name}"
        for region, own in regions.items()
        for name, state in own.states.items()
        if state.coils == "off"
    }
    return flight._replace(entered={key: s for key, s in flight.entered.items() if key in off})
