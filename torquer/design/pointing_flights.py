"""Releases that are flown until they point: errors over time, and from when on they stay small."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.analysis.attitude import find_attitude_error
from torquer.analysis.notes.run_notes import run_notes
from torquer.analysis.series import stays_from
from torquer.campaign.sampling import member_scenario
from torquer.campaign.spec import Campaign
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.simulate import simulate


class PointingFlights(NamedTuple):
    """Times of the records [s] (t,); attitude errors of the flights [deg] (n, t).

    `notes`: what the first one showed of which it did: what its steps did, a rotation that grew.
    """

    t_s: np.ndarray
    error_deg: np.ndarray
    notes: tuple[str, ...] = ()

    def settled_s(self, below_deg: float) -> np.ndarray:
        """Times [s] (n,) from which the error stays below an angle; infinite where it does not."""
        error_deg = self.error_deg.T
        found = stays_from(self.t_s, error_deg < below_deg)
        return np.where(np.isnan(found), np.inf, found)


def fly_releases(
    scenario: Scenario,
    campaign: Campaign,
    count: int,
    progress: Callable[[int, int], None] | None = None,
) -> PointingFlights:
    """Fly the first members of a campaign, each to its end."""
    errors: list[np.ndarray] = []
    notes: tuple[str, ...] = ()
    for number in range(count):
        result = simulate(member_scenario(scenario, campaign, number))
        errors.append(np.linalg.norm(find_attitude_error(result).error_deg, axis=1))
        notes = notes or (*run_notes(result),)
        if progress:
            progress(number + 1, count)
    return PointingFlights(result.time.values, np.array(errors), notes)
