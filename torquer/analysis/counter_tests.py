"""A scenario with less of its causes of errors: what a counter-test flies.

What a cause costs is what goes with it. A part of a cause has its direction and another size.
"""

from collections.abc import Iterable

import numpy as np

from torquer.analysis.causes import COUNTED_ON, GROUPS, Cause, acting_causes, causes_of
from torquer.base.explain import ScenarioError
from torquer.scenario.change import with_values
from torquer.scenario.spec import Scenario


def groups_of(scenario: Scenario) -> list[str]:
    """The groups of which a scenario's flights have a cause, in the order of `GROUPS`."""
    found = {cause.group for cause in acting_causes(scenario)}
    return [group for group in GROUPS if group in found]


def without(scenario: Scenario, causes: Iterable[Cause]) -> Scenario:
    """The scenario without some of its causes."""
    changes = {key: value for cause in causes for key, value in cause.off.items()}
    return with_values(scenario, changes) if changes else scenario


def lessened(scenario: Scenario, group: str, part: float) -> Scenario:
    """The scenario with that part of a group's sizes; at 0 without the group, if it can be."""
    own = [cause for cause in causes_of(scenario) if cause.group == group]
    try:
        if part == 0.0:
            return without(scenario, own)
        values = {
            key: _between(cause.off[key], value, part)
            for cause in own for key, value in cause.given.items()
        }  # fmt: skip
        return with_values(scenario, values) if values else scenario
    except ScenarioError:  # what else the scenario has does not fit: the cause stays
        return scenario


def undisturbed(scenario: Scenario) -> Scenario:
    """The scenario without any group but those that a law is designed with."""
    for group in GROUPS:
        scenario = scenario if group in COUNTED_ON else lessened(scenario, group, 0.0)
    return scenario


def _between(nothing, value, part: float):
    """What lies that part of the way from no cause to a number or vector."""
    least = 0.0 if nothing is None else np.asarray(nothing, dtype=float)
    return (least + part * (np.asarray(value, dtype=float) - least)).tolist()
