"""Capture of `torquer design three-axis`: from how many random attitudes a law settles."""

import math
from dataclasses import dataclass

from torquer.campaign.fly import fly_campaign
from torquer.campaign.spec import Campaign
from torquer.campaign.statistics import Interval, quantile, rate_interval
from torquer.control.law import Law
from torquer.scenario.spec import Scenario
from torquer.theory.three_axis.design import Candidate, DesignTask
from torquer.theory.validity import Limit, within

#: Revolutions flown: at least, times to settle, at most. Records of a revolution.
_LEAST, _SETTLINGS, _MOST, _RECORDS = 10.0, 4.0, 40.0, 120
#: Longest step of RK4 [s], where the scenario has none.
_STEP_S = 2.0


@dataclass(frozen=True)
class CaptureTask:
    """Starts to fly: their number, greatest initial rate relative to the orbital frame."""

    runs: int
    rate_deg_s: float

    def __post_init__(self):
        within(Limit("--capture-runs", 1, 1_000_000), self.runs)
        within(Limit("--capture-rate-deg-s", 0.0, 360.0), self.rate_deg_s)


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
    scenario: Scenario, task: DesignTask, candidate: Candidate, how: CaptureTask
) -> Capture | None:
    """Fly a law from random initial attitudes; None for an unstable loop."""
    if candidate.error is None:
        return None
    n = task.sampled.hold.rate_rad_s
    within_deg = task.linear_range_deg + math.degrees(candidate.error.greatest_rad)
    settling = candidate.settling_s * n / (2.0 * math.pi)
    revolutions = math.ceil(min(max(_LEAST, _SETTLINGS * settling), _MOST))
    period_s = 2.0 * math.pi / n
    flown = fly_campaign(
        flight(scenario, candidate.law, revolutions, period_s),
        _campaign(how, within_deg, (revolutions - 1.0) * period_s),
    )
    captured = int(flown.succeeded.values.sum())
    interval, median_s = rate_interval(captured, how.runs), quantile(flown.settling_s.values, 0.5)
    return Capture(how.runs, captured, interval, within_deg, revolutions, median_s)


def law_keys(law) -> dict:
    """A law's keys, as in a scenario file."""
    return law.spec.model_dump(mode="json")


def flight(scenario: Scenario, law: Law, revolutions: float, period_s: float) -> Scenario:
    """The scenario with that law alone, its sensors without an estimator, and RK4."""
    control, simulation = scenario.control, scenario.simulation
    own = control.model_dump(mode="json", include={"sample_s", "measure_s", "actuate_s"})
    if control.measure_s == 0.0:
        del own["actuate_s"]
    step_s = simulation.step_s or control.sample_s / math.ceil(control.sample_s / _STEP_S)
    record_s = step_s * max(1, round(period_s / _RECORDS / step_s))
    return (
        scenario.replace("control", {**own, "law": law_keys(law)})
        .replace("simulation", {"revolutions": revolutions, "step_s": step_s, "record_s": record_s})
        .replace("initial", {"reference": "orbital", "rate_relative_to": "orbital",
                             "euler_deg": [0.0, 0.0, 0.0], "rate_deg_s": [0.0, 0.0, 0.0]})
    )  # fmt: skip


def _campaign(how: CaptureTask, within_deg: float, until_s: float) -> Campaign:
    vary: dict = {"initial.attitude": "uniform"}
    if how.rate_deg_s > 0.0:
        sizes = {"uniform": [0.0, how.rate_deg_s]}
        vary["initial.rate_deg_s"] = {"direction": "uniform", "magnitude": sizes}
    settles = {"signal": "attitude_error_deg", "what": {"settles_below": within_deg}}
    return Campaign.model_validate({
        "runs": how.runs, "seed": 1, "vary": vary, "outcomes": {"settling_s": settles},
        "success": {"settling_s": {"below": until_s}},
    })  # fmt: skip


def told(name: str, found: Capture | None) -> str:
    """The result in one line."""
    if found is None:
        return f"{name}: captures nothing"
    low, high = (100.0 * end for end in found.interval)
    return (
        f"{name}: captures {found.captured} of {found.runs} random initial attitudes "
        f"({low:.0f}..{high:.0f} % with 95 % confidence) to within {found.within_deg:.3g} deg "
        f"in {found.revolutions:g} rev"
    )
