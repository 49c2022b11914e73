"""How a scenario uses its laws: which of them work at the start, and how strongly."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from torquer.analysis.notes.assess import assess
from torquer.base.spec import Spec
from torquer.scenario.control import Program
from torquer.scenario.spec import Scenario


class Use(NamedTuple):
    """A law of a scenario.

    `at_start`: whether it works in the initial states; `factor`: the greatest by which a state
    multiplies its command; `set`: greatest sizes of the parameters that states set.
    """

    name: str
    law: Spec
    at_start: bool
    factor: float
    set: dict[str, float]

    def gain(self, own: float) -> float:
        """The greatest gain that it may have: its own or one that a state sets, times the factor.

        `own`: its parameter `gain`.
        """
        return self.factor * max(own, self.set.get("gain", 0.0))


def notes_on_laws(
    scenario: Scenario, checks: Mapping[str, Callable[[Scenario, Use], Iterable[str]]]
) -> Iterator[str]:
    """Notes on each law, led by its name where there are several; `checks`: as `assess` has."""
    uses = find_uses(scenario)
    for use in uses:
        lead = f"{use.name}: " if len(uses) > 1 else ""
        for note in assess(checks, scenario, use):
            yield f"{lead}{note}"


def find_uses(scenario: Scenario) -> list[Use]:
    """All laws, as the modes use them."""
    program = scenario.control.named()
    return [_use(program, name, law) for name, law in program.laws.items()]


def _use(program: Program, name: str, law: Spec) -> Use:
    if program.modes is None:
        return Use(name, law, True, 1.0, {})
    regions = program.modes.regions.values()
    at_start = any(name in region.states[region.initial].laws for region in regions)
    states = list(program.modes.states())
    factor = max(abs(state.laws.get(name, 0.0)) for state in states)
    given: dict[str, float] = {}
    for state in states:
        for key, value in state.set.items():
            law_name, _, parameter = key.partition(".")
            if law_name == name:
                given[parameter] = max(given.get(parameter, 0.0), float(np.max(np.abs(value))))
    return Use(name, law, at_start, factor, given)
