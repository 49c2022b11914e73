"""Members that are flown together: what goes in and what comes out, one row each."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from torquer.campaign.checks import checks_for, of_steps
from torquer.campaign.outcomes import outcomes_with_series
from torquer.campaign.reduction import Reduction
from torquer.campaign.sampling import Drawn, draw, member_seeds
from torquer.campaign.spec import Campaign
from torquer.scenario.spec import Scenario

COMPLETE, FAILED = "complete", "failed"


class Chunk(NamedTuple):
    """Inputs and outcomes of some members; `series`: signals over time (n, t), by the first outcome
    of each; `checks`: see `campaign.checks`."""

    members: np.ndarray
    seeds: np.ndarray
    drawn: Drawn
    outcomes: dict[str, np.ndarray]
    series: dict[str, np.ndarray]
    ended: list[str]
    checks: dict[str, np.ndarray]

    def put(self, rows: np.ndarray, found: Reduction, totals: Mapping[str, np.ndarray]) -> None:
        """Put outcomes and signals of some members into their rows."""
        for name, values in found.outcomes(totals).items():
            self.outcomes[name][rows] = values
        for name, values in found.series.items():
            if values.shape[1]:
                self.series[name][rows] = values

    def put_checks(self, rows: np.ndarray, flown: Scenario, cells, also: Mapping) -> None:
        """Put the checks of some members into their rows, those that the campaign has."""
        of_all = {**of_steps(flown.simulation.integrator, cells), **also}
        for name in self.checks.keys() & of_all.keys():
            self.checks[name][rows] = of_all[name]

    def forget(self, row: int) -> None:
        """Take back what is known of a member's flight."""
        for values in (self.outcomes, self.series, self.checks):
            for each in values.values():
                each[row] = np.nan


def unflown_chunk(
    scenario: Scenario, campaign: Campaign, members: np.ndarray, instants: int
) -> Chunk:
    """Members by their numbers: their inputs, and no outcomes yet; `instants`: of their series."""
    count, kept_of = len(members), outcomes_with_series(campaign.outcomes)
    names = checks_for(scenario, campaign.varied_keys)
    return Chunk(
        members,
        member_seeds(campaign, members),
        draw(campaign, scenario, members),
        {name: np.full(count, np.nan) for name in campaign.outcomes},
        {name: np.full((count, instants), np.nan, np.float32) for name in kept_of},
        [COMPLETE] * count,
        {name: np.full(count, np.nan) for name in names},
    )
