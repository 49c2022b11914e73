"""Members of an orbit flown side by side: when each has lost its momentum but for a part."""

import numpy as np

from gallery.studies.flying import digits
from torquer.campaign.fleet import Fleet
from torquer.campaign.load import campaign_from_data
from torquer.scenario.spec import Scenario


def hours_below(scenario: Scenario, table: dict[str, list], part: float) -> list[float | None]:
    """Hours until each member of a table of starts has less than a part of its first momentum."""
    campaign = campaign_from_data({"table": table}, scenario)
    fleet = Fleet(scenario, campaign)
    count = len(next(iter(table.values())))
    own = table.get("spacecraft.body.inertia_kg_m2", [scenario.spacecraft.body.inertia] * count)
    inertia = np.array([np.diag(each) if np.ndim(each) == 1 else each for each in own])
    first, hours = np.zeros(count), np.full(count, np.nan)
    record_h = scenario.simulation.record_s / 3600.0

    def take(rows: np.ndarray, at: int, motion: np.ndarray) -> None:
        momentum = np.einsum("nij,rjn->rin", inertia[rows], motion[:, 4:7])
        sizes = np.linalg.norm(momentum, axis=1)
        if at == 0:
            first[rows] = sizes[0]
        below = sizes < part * first[rows]
        new = below.any(axis=0) & np.isnan(hours[rows])
        hours[rows[new]] = record_h * (at + below.argmax(axis=0)[new])

    flown = fleet.fly_motion(np.arange(count), take)
    if not flown.all():
        raise ValueError(f"members: must fly in lanes; received {fleet.why_not_in_lanes}")
    return [digits(each) for each in hours]
