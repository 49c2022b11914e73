"""What members share along the orbit: position, field and Sun at the records, found once."""

import functools

import numpy as np

from torquer.campaign.outcomes import needs_field, needs_sun
from torquer.campaign.spec import Campaign
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.run import Run

#: Records at which the environment along the orbit is found at once, and such blocks that are kept.
#: How a flight is cut must not matter: models round one record differently from many.
FOUND_AT_ONCE, PARTS = 2048, 256


class Along:
    """The records of a run that all members share, in blocks."""

    def __init__(self, scenario: Scenario, campaign: Campaign, base: Run):
        self._scenario, self._campaign, self._base = scenario, campaign, base
        self._block = functools.lru_cache(PARTS)(self._find_block)

    def records(self, first: int, count: int) -> list:
        """Times, and what `Flown` has along the orbit, of records by the number of the first."""
        skipped = first % FOUND_AT_ONCE
        numbers = range(first // FOUND_AT_ONCE, (first + count - 1) // FOUND_AT_ONCE + 1)
        parts = zip(*map(self._block, numbers), strict=True)
        joined = (None if part[0] is None else np.concatenate(part) for part in parts)
        return [None if part is None else part[skipped : skipped + count] for part in joined]

    def _find_block(self, number: int) -> tuple:
        """The same of a block of records."""
        plan, first = self._base.plan, number * FOUND_AT_ONCE
        after = min(first + FOUND_AT_ONCE, self._base.steps // plan.record_steps + 1)
        t_s = np.arange(first, after) * plan.record_steps * plan.step_s
        return t_s, *along_at(self._scenario, self._campaign, t_s)


def along_at(scenario: Scenario, campaign: Campaign, t_s: np.ndarray) -> tuple:
    """Position, velocity, field and direction to the Sun at the records, as `Flown` has them."""
    environment = scenario.orbit_environment()
    r, v = environment.state(t_s)
    field = environment.field(t_s, r, v) if needs_field(campaign.outcomes) else None
    sun = environment.sun(t_s) - r if needs_sun(campaign.outcomes, scenario) else None
    return r, v, field, sun
