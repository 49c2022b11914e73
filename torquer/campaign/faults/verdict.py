"""What became of a flight with a fault: safe, degraded or lost; noticed or not.

One rule. *Lost*: the flight ended early, or the rate exceeds 2 deg/s in the last revolution (or
twice that of the flight without a fault, if this is more). *Safe*: not lost, every limit of
`[mission]` (or a limit usual for the laws) holds during the whole last revolution, since settled
means stays, and the coils used at most three times the energy of the flight without a fault.
*Degraded*: all else.

A fault is *noticed* when the modes enter a state, of a guard or of any other region, which the
flight without the fault does not enter from that instant on.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.attitude import with_held
from torquer.analysis.goals import Goal, find_goals, goal_signal
from torquer.analysis.mode_use import find_regions, state_uses
from torquer.scenario.resolution import notes_on_steps
from torquer.simulation.results.dataset import COMPLETE, flown_scenario

SAFE, DEGRADED, LOST = "safe", "degraded", "lost"
VERDICTS = (SAFE, DEGRADED, LOST)
#: Rate in the last revolution [deg/s] above which a satellite is lost, and as a multiple of that
#: without a fault; energy of the coils above which it is degraded, as such a multiple.
LOST_DEG_S, LOST_TIMES, ENERGY_TIMES = 2.0, 2.0, 3.0


class Flown(NamedTuple):
    """What is kept of a flight.

    `rate_deg_s`, `goals`: the greatest in the last revolution, of the rate and of the signal of
    each goal; `energy_j`: of the coils; `entered`: when each state was entered last, by its
    region and name; `begins`: times of the first records of its stays; `steps`: what the steps of
    its integrator did by themselves, "" if it is not much.
    """

    ended: str
    rate_deg_s: float
    goals: tuple[float, ...]
    energy_j: float
    entered: dict[str, float]
    begins: dict[str, np.ndarray]
    steps: str = ""


class Outcome(NamedTuple):
    """What became of a fault.

    `why`: what kept it from being safe, "" if it is. `noticed_after_s`: infinite if it was not;
    `noticed_by`: the state that was entered. `steps`: see `Flown`.
    """

    verdict: str
    why: str
    rate_deg_s: float
    goals: tuple[float, ...]
    energy_j: float
    noticed_after_s: float
    noticed_by: str
    steps: str = ""


def keep_flight(result: xr.Dataset) -> Flown:
    """What is kept of a result."""
    scenario, t = flown_scenario(result), result["time"].values
    last = t >= t[-1] - scenario.orbit.period_s
    tail = with_held(result).isel(time=np.flatnonzero(last))
    goals = [goal_signal(goal, tail, scenario) for goal in find_goals(scenario)]
    energy = float(result["coil_energy"]) if "coil_energy" in result else 0.0
    complete = result.attrs["how_it_ended"] == COMPLETE
    return Flown(
        "" if complete else str(result.attrs["ended"]),
        float(np.degrees(np.linalg.norm(tail["omega_body"].values, axis=1)).max()),
        tuple(math.nan if signal is None else float(signal.max()) for signal in goals),
        energy,
        {
            f"{region}.{name}": -math.inf if use.last_entered_s is None else use.last_entered_s
            for region, uses in state_uses(result).items()
            for name, use in uses.items()
        },
        {
            f"{region.name}.{name}": t[np.diff((region.numbers == k).astype(int), prepend=0) > 0]
            for region in find_regions(result)
            for k, name in enumerate(region.states)
        },
        "; ".join(notes_on_steps(result)),
    )


def judge_flight(flight: Flown, nominal: Flown, goals: list[Goal], at_s: float) -> Outcome:
    """The verdict on a flight with a fault from `at_s` on, compared with one without."""
    verdict, why = judge(flight, nominal, goals)
    after_s, by = first_notice(flight, nominal, at_s)
    rest = flight.rate_deg_s, flight.goals, flight.energy_j
    return Outcome(verdict, why, *rest, after_s, by, flight.steps)


def steps_in_words(nominal: Flown, outcomes: Sequence[Outcome]) -> list[str]:
    """What must be known beside the number of safe flights: what steps did by themselves."""
    told = [each.steps for each in outcomes if each.steps]
    lines = [f"Without a fault {nominal.steps}"] if nominal.steps else []
    if told:
        count = f"{len(told)} of {len(outcomes)}"
        lines.append(f"In {count} flights with faults, one of them: {told[0]}")
    return lines


def judge(flight: Flown, nominal: Flown, goals: list[Goal]) -> tuple[str, str]:
    """(Verdict, what kept it from being safe)."""
    if flight.ended:
        return LOST, flight.ended
    limit = max(LOST_DEG_S, LOST_TIMES * nominal.rate_deg_s)
    if not flight.rate_deg_s <= limit:
        return LOST, f"rate up to {flight.rate_deg_s:.3g} deg/s"
    for goal, greatest in zip(goals, flight.goals, strict=True):
        if math.isnan(greatest):
            return DEGRADED, f"{goal.signal} unknown: no attitude was held all the time"
        if not greatest < goal.below:
            return DEGRADED, f"{goal.signal} up to {greatest:.3g} {goal.unit}"
    if flight.energy_j > ENERGY_TIMES * nominal.energy_j:
        times = flight.energy_j / nominal.energy_j if nominal.energy_j else math.inf
        return DEGRADED, f"{times:.3g} times the energy"
    return SAFE, ""


def first_notice(flight: Flown, nominal: Flown, at_s: float) -> tuple[float, str]:
    """(Time from the fault until the first state that it alone leads to, that state)."""
    found = [
        (_first_s(flight, state, at_s) - at_s, state)
        for state, entered_s in flight.entered.items()
        if entered_s >= at_s > nominal.entered[state]
    ]
    return min(found, default=(math.inf, ""))


def _first_s(flight: Flown, state: str, at_s: float) -> float:
    """When a state was first entered after an instant: by the records, or when entered last."""
    begins = flight.begins[state]
    after = begins[begins > at_s]
    return min(float(after[0]) if len(after) else math.inf, flight.entered[state])
