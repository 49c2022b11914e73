"""Why no law of a three-axis design holds the satellite, by flights of the best of them."""

import math
from collections.abc import Callable, Mapping

from torquer.analysis.counter_tests import undisturbed
from torquer.campaign.capture import Capture, captured_by, flight
from torquer.computer.blocks.law import Law
from torquer.design.failure import RUNS, Failure, Flown, explain, is_enough
from torquer.design.nearest import LEVERS
from torquer.design.requests import ThreeAxisRequest
from torquer.design.three_axis_trim import TrimAnswer
from torquer.scenario.spec import Scenario
from torquer.theory.three_axis.gain_search import (
    WEIGHTS,
    Candidate,
    DesignTask,
    ThreeAxisDesign,
    regulator_of,
)

#: Revolutions of each flight.
REVOLUTIONS = 10.0
REGULATOR = "regulator"


def fails(
    candidates: Mapping[str, Candidate],
    captures: Mapping[str, Capture | None],
    within_deg: float,
) -> bool:
    """Whether no law is stable, with a steady error of use, and captures if that was flown."""
    return not any(
        each.error is not None
        and math.degrees(each.error.greatest_rad) <= within_deg
        and _captures(captures.get(name))
        for name, each in candidates.items()
    )


def _captures(flown: Capture | None) -> bool:
    """Whether starts arrive more often than not; nothing speaks against it where none was flown."""
    return flown is None or 2 * flown.captured > flown.runs


def explain_hold(
    scenario: Scenario,
    request: ThreeAxisRequest,
    design: ThreeAxisDesign,
    candidates: Mapping[str, Candidate],
    trim: TrimAnswer | None,
    task_of: Callable[[Scenario], DesignTask],
) -> tuple[str, Failure]:
    """The law that captures most starts once nothing disturbs them, and why it fails.

    `task_of`: what is designed for, by scenario. A regulator is made anew for a changed satellite;
    gains stay as they are.
    """

    def fly(changed: Scenario, seed: int, law=None) -> Flown:
        starts = RUNS, request.capture_rate_deg_s, request.capture_within_deg
        found = captured_by(changed, law or best, REVOLUTIONS, *starts, seed)
        return Flown(found.captured, found.runs, found.error_deg)

    def fly_anew(changed: Scenario, seed: int) -> Flown:
        if name != REGULATOR:
            return fly(changed, seed)
        task = task_of(changed)
        return fly(changed, seed, regulator_of(task, task.sampled.hold, design.weight))

    laws = {name: each.law for name, each in candidates.items()}
    name = max(laws, key=lambda each: fly(undisturbed(scenario), 1, laws[each])[0])
    best = laws[name]
    told = (
        f"{name}, the best of these laws",
        f"starts in any attitude up to {request.capture_rate_deg_s:g} deg/s that stay within "
        f"{request.capture_within_deg:g} deg over the last of {REVOLUTIONS:g} rev; mean error "
        "there",
        "deg",
    )
    others = _others(scenario, task_of(scenario), design.weight, best, trim, fly)
    return name, explain(
        scenario, told, lambda each: flight(each, best, REVOLUTIONS, 1.0), fly, fly_anew, LEVERS,
        others,
    )  # fmt: skip


def _others(
    scenario: Scenario,
    task: DesignTask,
    weight: float,
    best: Law,
    trim: TrimAnswer | None,
    fly: Callable[..., Flown],
) -> dict[str, Flown]:
    """Laws for the same satellite: the trim beside the best law, and a regulator with another
    weight, the next to the design's that works."""
    found = {}
    if trim is not None:
        laws = {"hold": best, "trim": trim.design.spec.law()}
        found["law dipole_trim beside it"] = fly(scenario, 2, laws)
    for part in sorted(WEIGHTS, key=lambda part: abs(math.log(part / weight))):
        if part == weight:
            continue
        try:
            law = regulator_of(task, task.sampled.hold, float(part))
        except ArithmeticError:
            continue
        flown = fly(scenario, 2, law)
        if is_enough(*flown[:2]):
            name = f"regulator whose dipole weighs {part:.2g} of the coils' limit"
            left_out = "which the design leaves out for its gain margin, pace or dipole"
            return found | {f"{name}, {left_out}": flown}
    return found
