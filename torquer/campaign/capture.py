"""From how many random attitudes a law that holds one settles: a campaign without a file."""

import math
from dataclasses import dataclass

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
    fewer than half do."""

    runs: int
    captured: int
    interval: Interval
    within_deg: float
    revolutions: float
    median_s: float


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
    period_s = 2.0 * math.pi / n
    flown = fly_campaign(
        flight(scenario, candidate.law, revolutions, period_s),
        _campaign(runs, rate_deg_s, within_deg, (revolutions - 1.0) * period_s),
    )
    captured = int(flown.succeeded.values.sum())
    interval, median_s = rate_interval(captured, runs), quantile(flown.settling_s.values, 0.5)
    return Capture(runs, captured, interval, within_deg, revolutions, median_s)


def flight(scenario: Scenario, law, revolutions: float, period_s: float) -> Scenario:
    """The scenario with that law alone, its sensors without an estimator, and RK4."""
    control, simulation = scenario.control, scenario.simulation
    own = control.model_dump(mode="json", include={"sample_s", "measure_s", "actuate_s"})
    if control.measure_s == 0.0:
        del own["actuate_s"]
    step_s = simulation.step_s or control.sample_s / math.ceil(control.sample_s / _STEP_S)
    record_s = step_s * max(1, round(period_s / _RECORDS / step_s))
    return (
        scenario.replace("control", {**own, "law": law.spec.model_dump(mode="json")})
        .replace("simulation", {"revolutions": revolutions, "step_s": step_s, "record_s": record_s})
        .replace("initial", {"reference": "orbital", "rate_relative_to": "orbital",
                             "euler_deg": [0.0, 0.0, 0.0], "rate_deg_s": [0.0, 0.0, 0.0]})
    )  # fmt: skip


def _campaign(runs: int, rate_deg_s: float, within_deg: float, until_s: float) -> Campaign:
    vary: dict = {"initial.attitude": "uniform"}
    if rate_deg_s > 0.0:
        sizes = {"uniform": [0.0, rate_deg_s]}
        vary["initial.rate_deg_s"] = {"direction": "uniform", "magnitude": sizes}
    settles = {"signal": "attitude_error_deg", "what": {"settles_below": within_deg}}
    return Campaign.model_validate({
        "runs": runs, "seed": 1, "vary": vary, "outcomes": {"settling_s": settles},
        "success": {"settling_s": {"below": until_s}},
    })  # fmt: skip
