"""Why hardly any gain of B-dot stops the releases in time, by flights with the gain chosen."""

import math
from collections.abc import Callable

import numpy as np

from torquer.campaign.capture import flight
from torquer.campaign.statistics import quantile
from torquer.design.failure import RUNS, Failure, Flown, explain, is_enough
from torquer.design.gain_flights import Releases, fly_gains
from torquer.design.gain_sweep import ANY, GainSweep
from torquer.design.nearest import COILS_ALONE
from torquer.design.residual_rate import LAST_REVOLUTIONS
from torquer.scenario.spec import Scenario


def fails(sweep: GainSweep) -> bool:
    """Whether the gain chosen leaves more than a tenth of the releases tumbling."""
    stopped = sweep.chosen.settled_within(sweep.wanted.allowed_s)
    return not is_enough(stopped, len(sweep.chosen.settled_s))


def explain_stop(sweep: GainSweep, theory_gain: Callable[[Scenario], float]) -> Failure:
    """Why the gain chosen fails, or that of theory where no release stops with any.

    `theory_gain`: that of a changed satellite.
    """
    wanted, stopped = sweep.wanted, sweep.chosen.settled_within(sweep.wanted.allowed_s)
    chosen = sweep.chosen.gain if stopped else sweep.theory_gain
    law = sweep.law or ANY
    end_s = sweep.duration_s

    def fly(changed: Scenario, seed: int, gain: float = chosen) -> Flown:
        named = law.model_copy(update={"gain_a_m2_s_per_t": gain}).law()
        releases = Releases(math.degrees(wanted.tip_off_rad_s), RUNS, 1)
        limits, times = [sweep.below_deg_s], (sweep.revolutions, LAST_REVOLUTIONS)
        flown = fly_gains(changed, [named], releases, limits, *times, seed=seed)[0]
        median_s = quantile(np.minimum(flown.settled_s, end_s), 0.5)
        return Flown(flown.settled_within(wanted.allowed_s), RUNS, median_s / 3600.0)

    def fly_anew(changed: Scenario, seed: int) -> Flown:
        return fly(changed, seed, theory_gain(changed))

    until = "" if wanted.within_s is None else f" within {wanted.within_s / 3600.0:.3g} h"
    told = (
        f"the gain of {chosen:.4g} A m^2 s/T",
        f"releases that stay below {sweep.below_deg_s:.3g} deg/s{until}; time to get there, at "
        f"most the {end_s / 3600.0:.3g} h flown",
        "h",
    )

    def as_flown(each: Scenario) -> Scenario:
        return flight(each, law.law(), sweep.revolutions, end_s / sweep.revolutions)

    return explain(sweep.scenario, told, as_flown, fly, fly_anew, COILS_ALONE, {})
