"""Causes of pointing errors: those of the scenario that linear theory does not count on already."""

from torquer.analysis.causes import (
    COUNTED_ON,
    GAPS,
    PERIODIC,
    RANGE,
    Cause,
    acting_causes,
)
from torquer.computer.laws.law_spec import LawSpec
from torquer.scenario.spec import Scenario

#: What a budget calls the causes that are always there, and what other laws do.
ALWAYS, OTHER_LAWS = "gravity_and_reference", "other_laws"
#: Part of the loop itself, or refused.
_NOT_LISTED = (*COUNTED_ON, RANGE, GAPS)


def holder_of(scenario: Scenario) -> tuple[str, LawSpec]:
    """Name and spec of the law that holds the attitude; ValueError unless it is the only one, and
    works all the time."""
    named = scenario.control.named()
    laws = {name: law for name, law in named.laws.items() if isinstance(law, LawSpec)}
    found = {name: law for name, law in laws.items() if law.held() is not None}
    if len(found) != 1 or named.modes is not None:
        received = "modes" if named.modes is not None else f"{len(found)} such laws"
        raise ValueError(
            "control: must have one law that holds an attitude, and no modes, for a pointing "
            f"budget; received {received} (`torquer init NAME --example pointing_budget` writes a "
            "scenario that has it)"
        )
    return next(iter(found.items()))


def causes_of(scenario: Scenario) -> list[Cause]:
    """The causes that a scenario has, the one that is always there first."""
    found = [Cause(ALWAYS, "gravity gradient, motion of the reference", PERIODIC, "")]
    found += [each for each in acting_causes(scenario) if each.group not in _NOT_LISTED]
    holder, _ = holder_of(scenario)
    others = [name for name in scenario.control.laws if name != holder]
    if others:
        kept = {holder: scenario.control.laws[holder]}
        label = f"laws: {', '.join(others)}"
        found.append(Cause(OTHER_LAWS, label, PERIODIC, "", {"control.laws": kept}))
    return found
