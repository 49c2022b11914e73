"""A fault campaign flown: every fault at every strike, with the guards of the modes and without."""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import NamedTuple, TypeVar

import xarray as xr

from torquer.analysis.goals import Goal, find_goals
from torquer.base.cores import cores
from torquer.base.limits import at_least
from torquer.campaign.faults.kinds import Fault, find_faults
from torquer.campaign.faults.strikes import (
    Strike,
    strike_at,
    strikes_in,
    without_guards,
)
from torquer.campaign.faults.verdict import (
    VERDICTS,
    Flown,
    Outcome,
    judge,
    judge_flight,
    keep_flight,
)
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.ending import flown_whole
from torquer.simulation.setup.simulate import RunStopped, simulate

P = TypeVar("P")
R = TypeVar("R")


class Row(NamedTuple):
    """A flight with a fault; `guarded`: whether the guards were at work."""

    fault: Fault
    strike: Strike
    guarded: bool
    outcome: Outcome


class FaultCampaign(NamedTuple):
    """All flights of a fault campaign.

    `nominal`: without a fault, with guards; `verdict`: of that flight and why. `guards`: regions
    that only guard; without any all flights are with what the modes have.
    """

    scenario: Scenario
    goals: list[Goal]
    guards: list[str]
    nominal: Flown
    verdict: tuple[str, str]
    strikes: list[Strike]
    faults: list[Fault]
    rows: list[Row]

    def counts(self, guarded: bool) -> dict[str, int]:
        """Number of flights by verdict."""
        found = [row.outcome.verdict for row in self.rows if row.guarded == guarded]
        return {verdict: found.count(verdict) for verdict in VERDICTS}

    def worst(self) -> Row:
        """The worst flight with guards: by the verdict, unnoticed before noticed, by the rate."""
        return max((row for row in self.rows if row.guarded), key=_badness)

    def scenario_of(self, row: Row) -> Scenario:
        """The scenario of a flight, to be flown again."""
        scenario = self.scenario if row.guarded else without_guards(self.scenario)
        return row.fault.strikes(scenario, row.strike.at_s)


def _badness(row: Row) -> tuple:
    outcome = row.outcome
    return VERDICTS.index(outcome.verdict), not outcome.noticed_by, outcome.rate_deg_s


def fly_faults(
    scenario: Scenario,
    only: Sequence[str] = (),
    at_s: Sequence[float] = (),
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> FaultCampaign:
    """Fly every single fault of a scenario.

    `only`: faults whose names contain one of these texts. `at_s`: when faults strike; by default
    in each mode that the flight without a fault visits. `workers`: flights at once, one per core
    unless given. `progress` is called with the fraction done. The result depends on none of the
    last two. ValueError for `only` that names no fault, a time after the end, and a flight without
    a fault that stops early. No condition ends a flight: what comes later is judged, too.
    """
    _check_workers(workers)
    scenario = flown_whole(scenario)
    faults = choose_faults(find_faults(scenario), only)
    modes, goals = scenario.control.modes, find_goals(scenario)
    guards = modes.guards() if modes else []
    sides = {True: scenario, False: without_guards(scenario)} if guards else {True: scenario}
    result = fly_nominal(scenario)
    nominal = {True: keep_flight(result)}
    if guards:
        nominal[False] = keep_flight(simulate_or_stop(sides[False]))
    strikes = [strike_at(result, each) for each in at_s] or strikes_in(result)
    places, quiet = [*product(faults, strikes)], _quiet(nominal[True], scenario, guards)

    def fly(place: tuple[Fault, Strike]) -> list[Row]:
        fault, strike = place
        found: list[Row] = []
        for guarded, side in sides.items():
            flight = keep_flight(simulate_or_stop(fault.strikes(side, strike.at_s)))
            outcome = judge_flight(flight, nominal[guarded], goals, strike.at_s)
            found.append(Row(fault, strike, guarded, outcome))
            if guarded and quiet and _quiet(flight, scenario, guards):  # the same without guards
                return [found[0]._replace(guarded=each) for each in sides]
        return found

    rows = [row for found in fly_all(fly, places, workers, progress) for row in found]
    verdict = judge(nominal[True], nominal[True], goals)
    return FaultCampaign(scenario, goals, guards, nominal[True], verdict, strikes, faults, rows)


def fly_nominal(scenario: Scenario) -> xr.Dataset:
    """The flight without a fault; ValueError if it ends early."""
    result = simulate_or_stop(scenario)
    ended = keep_flight(result).ended
    if ended:
        raise ValueError(
            f"scenario: must fly to its end without a fault; received one that ended: {ended}"
        )
    return result


def _check_workers(workers: int | None) -> None:
    if workers is not None:
        at_least(1).check("workers", workers)


def fly_all(
    fly: Callable[[P], R],
    places: Sequence[P],
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[R]:
    """The results of flights, in order, several at once; all stop with the first that fails."""
    _check_workers(workers)
    found: list[R] = []
    with ThreadPoolExecutor(cores() if workers is None else workers) as pool:
        try:
            for each in pool.map(fly, places):
                found.append(each)
                if progress:
                    progress(len(found) / len(places))
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return found


def _quiet(flight: Flown, scenario: Scenario, guards: list[str]) -> bool:
    """Whether all guards stayed in their first states: the flight is the same without them."""
    regions = scenario.control.modes.regions if guards else {}
    return all(
        flight.entered[f"{name}.{state}"] == -math.inf
        for name in guards
        for state in regions[name].states
        if state != regions[name].initial
    )


def choose_faults(faults: list[Fault], only: Sequence[str]) -> list[Fault]:
    """The faults whose names contain one of some texts, in any case; all without any."""
    for text in only:
        if not any(_is_named(fault, text) for fault in faults):
            devices = ", ".join(dict.fromkeys(fault.device for fault in faults))
            raise ValueError(
                f"only: must be part of the name of a fault, which begins with one of {devices}; "
                f"received {text!r}"
            )
    return [fault for fault in faults if not only or any(_is_named(fault, text) for text in only)]


def _is_named(fault: Fault, text: str) -> bool:
    return text.lower() in fault.name.lower()


def simulate_or_stop(scenario: Scenario) -> xr.Dataset:
    """The result of a run, also of one that ended early."""
    try:
        return simulate(scenario)
    except RunStopped as stopped:
        if stopped.interrupted:
            raise KeyboardInterrupt from None
        return stopped.result
