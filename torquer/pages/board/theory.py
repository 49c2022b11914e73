"""What theory says of a scenario, next to its flight: times, greatest rates and gains, stability.

Each line is computed by the functions of `torquer.theory` that the notes and designs use; what does
not apply to the laws of a scenario is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.analysis.notes.bdot_notes import BDOT, as_flown, most_gain, stopped_below
from torquer.analysis.notes.notes import write_notes
from torquer.analysis.notes.uses import Use, find_uses
from torquer.scenario.spec import Scenario
from torquer.theory.averaged.case import case_from_scenario
from torquer.theory.averaged.conditions import check_case, judge_case
from torquer.theory.averaged.flights import find_starts, fly
from torquer.theory.slow.detumbling import detumbling_time_s, turning_gain
from torquer.theory.slow.gain_and_time import GOALS
from torquer.theory.slow.gains import damping_efficiency
from torquer.theory.three_axis.gain_search import settling_time_s
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.sampled import Cycle, SampledHold, sampled_family

_ALONE = np.empty((1, 0))


class Line(NamedTuple):
    """A number of theory: name, value or None where there is none, unit, what it means."""

    name: str
    value: float | None
    unit: str
    about: str


def predict(scenario: Scenario) -> dict:
    """`lines` of theory, and the `notes` on the scenario, as plain data."""
    lines = [*_predict_bdot(scenario), *_predict_hold(scenario), *_predict_averages(scenario)]
    finite = (line._replace(value=_number(line.value)) for line in lines)
    return {"lines": [line._asdict() for line in finite], "notes": write_notes(scenario)}


def _number(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _predict_bdot(scenario: Scenario) -> Iterator[Line]:
    """B-dot that brakes from the start: highest rate, time, gains."""
    use = _only(scenario)
    if use is None or not isinstance(use.law, BDOT) or scenario.spacecraft.coils is None:
        return
    gain, case = use.gain(use.law.gain_a_m2_s_per_t), as_flown(scenario, use.law)
    rate = _rate_rad_s(scenario)
    below, _ = stopped_below(scenario)
    limit = math.degrees(case.sampling.limit_rad_s)
    yield Line("highest rate braked", limit, "deg/s", f"with {case.sampling.in_words}")
    left = 100.0 * float(damping_efficiency(rate, *case.sampling.times))
    yield Line("damping at the initial rate", left, "%", "of what B-dot without sampling has")
    time_s = detumbling_time_s(case, gain, rate, below)
    about = f"to {math.degrees(below):.3g} deg/s, mean over directions"
    yield Line("settling time", time_s / 3600.0, "h", about)
    field_t = float(np.sqrt(np.mean(case.fields_t**2)))
    least = float(scenario.spacecraft.body.principal()[0][0])
    orbit_rate = scenario.orbit.rate_rad_s(scenario.start)
    inclination = _inclination_rad(scenario)
    best = turning_gain(least, field_t, orbit_rate, inclination, case.duty)
    yield Line("gain as fast as the field turns", best, "A m² s/T", "more brakes some axes later")
    most = most_gain(scenario, case.sampling, float(case.fields_t.max()))
    yield Line("greatest gain", most, "A m² s/T", "beyond it a hold overshoots in slow motion")


def _predict_hold(scenario: Scenario) -> Iterator[Line]:
    """An attitude held by coils alone: Floquet degree of the sampled loop."""
    if scenario.control.named().modes is not None or scenario.spacecraft.coils is None:
        return
    try:
        hold = AttitudeHold.of_scenario(scenario)
        residual = scenario.spacecraft.coils.residual_dipole_a_m2
        sampled = SampledHold(hold, Cycle.of_control(scenario.control), residual)
        degree = float(sampled_family(sampled).degrees(_ALONE)[0])
    except (ValueError, ArithmeticError):  # of laws that linear theory does not know
        return
    about = f"of the sampled loop over {hold.revolutions} rev; below 0: unstable"
    yield Line("Floquet degree", degree, "1/rad", about)
    settled = settling_time_s(hold, degree) / 3600.0
    yield Line("settling time", settled, "h", "of a small error to 2 %")


def _predict_averages(scenario: Scenario) -> Iterator[Line]:
    """Laws with averaged equations, but for B-dot: time until most of their work is done."""
    use = _only(scenario)
    if use is None or isinstance(use.law, BDOT):
        return
    try:
        case = case_from_scenario(scenario)
        part = 2.0 if case.law == "spin_up" else 0.1
        check_case(case)
        starts = find_starts(case, part)
        flights = fly(case, part, case.gain or 0.0, starts)
        verdict = judge_case(case, part, flights)
    except (ValueError, ArithmeticError):  # of laws and orbits that are not averaged
        return
    eps = case.constants.eps
    yield Line("small parameter", eps, "", "eps of the averaged equations")
    time_h = (
        starts[1].slow / (2.0 * math.pi * eps) * case.period_s / 3600.0 if eps > 0.0 else math.inf
    )
    about = f"{GOALS[case.law].name} to {100.0 * part:g} %, by the averaged equations"
    yield Line("settling time", time_h, "h", about)
    said = "; ".join([flights.line(), *verdict.lines()])
    yield Line("true motions over the formula", flights.ratio, "", said)


def _only(scenario: Scenario) -> Use | None:
    """The only law of a scenario without modes."""
    uses = find_uses(scenario)
    return uses[0] if len(uses) == 1 and scenario.control.named().modes is None else None


def _rate_rad_s(scenario: Scenario) -> float:
    return float(np.linalg.norm(scenario.motion_at_start()[4:]))


def _inclination_rad(scenario: Scenario) -> float:
    r, v = (x[0] for x in scenario.orbit_environment().state(np.zeros(1)))
    normal = np.cross(r, v)
    return math.acos(normal[2] / float(np.linalg.norm(normal)))
