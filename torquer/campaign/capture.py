"""From how many random attitudes a law that holds one settles: a campaign without a file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from torquer.campaign.checks import column
from torquer.campaign.fly import fly_campaign
from torquer.campaign.spec import Campaign
from torquer.campaign.statistics import Interval, quantile, rate_interval
from torquer.scenario.spec import Scenario
from torquer.theory.three_axis.gain_search import Candidate, DesignTask

#: Revolutions flown: at least, times to settle, at most. Records of a revolution.
_LEAST, _SETTLINGS, _MOST, _RECORDS = 10.0, 4.0, 40.0, 120
#: Longest step of RK4 [s], where the scenario has none.
_STEP_S = 2.0


@dataclass(frozen=True)
class Capture:
    """`captured` of `runs` starts stay within `within_deg` of the wanted attitude over the last of
    `revolutions`; `interval` of that rate (95 %); median time to get there [s], infinite if
    fewer than half do; `error_deg`: median of the mean errors over the last revolution; `damping`,
    `lag_deg`: what the steps of RK4 did by themselves, the most of all starts."""

    runs: int
    captured: int
    interval: Interval
    within_deg: float
    revolutions: float
    median_s: float
    error_deg: float
    damping: float = 0.0
    lag_deg: float = 0.0


def capture(
    scenario: Scenario,
    task: DesignTask,
    candidate: Candidate,
    runs: int,
    rate_deg_s: float,
    within_deg: float,
) -> Capture | None:
    """Fly a law from random initial attitudes and rates up to one; None for an unstable loop.

    `rate_deg_s`: greatest initial rate relative to the orbital frame; `within_deg`: error that the
    mission allows, the same for every law.
    """
    if candidate.error is None:
        return None
    n = task.sampled.hold.rate_rad_s
    settling = candidate.settling_s * n / (2.0 * math.pi)
    revolutions = math.ceil(min(max(_LEAST, _SETTLINGS * settling), _MOST))
    return captured_by(scenario, candidate.law, revolutions, runs, rate_deg_s, within_deg)


def captured_by(
    scenario: Scenario,
    law,
    revolutions: float,
    runs: int,
    rate_deg_s: float,
    within_deg: float,
    seed: int = 1,
) -> Capture:
    """As `capture`: a law, or laws by name whose commands are added, for some revolutions."""
    period_s = 2.0 * math.pi / scenario.orbit.rate_rad_s(scenario.start)
    campaign = _campaign(runs, rate_deg_s, within_deg, (revolutions - 1.0) * period_s)
    flown = fly_campaign(
        flight(scenario, law, revolutions, period_s), campaign.model_copy(update={"seed": seed})
    )
    captured, error_deg = int(flown.succeeded.values.sum()), flown.error_deg.values
    return Capture(
        runs, captured, rate_interval(captured, runs), within_deg, revolutions,
        quantile(flown.settling_s.values, 0.5),
        quantile(np.where(np.isnan(error_deg), 180.0, error_deg), 0.5),
        *(float(flown[column(name)].max()) for name in ("rk4_damping", "rk4_lag_deg")),
    )  # fmt: skip


def flight(scenario: Scenario, law, revolutions: float, period_s: float) -> Scenario:
    """The scenario with that law, or laws by name, alone, its sensors without an estimator, RK4."""
    control, simulation = scenario.control, scenario.simulation
    own = control.model_dump(mode="json", include={"sample_s", "measure_s", "actuate_s"})
    if control.measure_s == 0.0:
        del own["actuate_s"]
    step_s = simulation.step_s or control.sample_s / math.ceil(control.sample_s / _STEP_S)
    record_s = step_s * max(1, round(period_s / _RECORDS / step_s))
    return (
        scenario.replace("control", own | _laws(law))
        .replace("simulation", {"revolutions": revolutions, "step_s": step_s, "record_s": record_s})
        .replace("initial", {"reference": "orbital", "rate_relative_to": "orbital",
                             "euler_deg": [0.0, 0.0, 0.0], "rate_deg_s": [0.0, 0.0, 0.0]})
    )  # fmt: skip


def _laws(law) -> dict:
    """Keys of a control table for a law, or for laws by name."""
    if isinstance(law, Mapping):
        return {"laws": {name: each.spec.model_dump(mode="json") for name, each in law.items()}}
    return {"law": law.spec.model_dump(mode="json")}


def _campaign(runs: int, rate_deg_s: float, within_deg: float, until_s: float) -> Campaign:
    vary: dict = {"initial.attitude": "uniform"}
    if rate_deg_s > 0.0:
        sizes = {"uniform": [0.0, rate_deg_s]}
        vary["initial.rate_deg_s"] = {"direction": "uniform", "magnitude": sizes}
    settles = {"signal": "attitude_error_deg", "what": {"settles_below": within_deg}}
    error = {"signal": "attitude_error_deg", "what": {"mean_after_s": until_s}}
    return Campaign.model_validate({
        "runs": runs, "seed": 1, "vary": vary,
        "outcomes": {"settling_s": settles, "error_deg": error},
        "success": {"settling_s": {"below": until_s}},
    })  # fmt: skip
