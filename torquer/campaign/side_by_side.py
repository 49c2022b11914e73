"""Whether the members of a campaign fly side by side: what it asks for, and which keys vary."""

import contextlib
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.campaign.outcomes import needs_modes
from torquer.campaign.sampling import as_changes, draw
from torquer.campaign.spec import Campaign
from torquer.campaign.variation import ATTITUDE
from torquer.scenario.change import with_values
from torquer.scenario.spec import InitialMotion, Scenario

#: Keys that change a member's motion at the start and nothing else.
MOTION_KEYS = {ATTITUDE, *(f"initial.{name}" for name in InitialMotion.model_fields)}
#: Beginnings of keys that change the surroundings of a run, what its computer believes of them, or
#: when it looks at them.
_OF_ORBIT_ENVIRONMENT = ("orbit", "start", "environment", "control.ephemeris", "simulation")
#: Members that are tried in lanes before a campaign is flown.
TRIED = 8


def try_key(scenario: Scenario, campaign: Campaign, key: str) -> Iterator[Scenario]:
    """Some members as far as they are scenarios, each with its value of one key alone."""
    members = np.linspace(0, campaign.runs - 1, TRIED).astype(int)
    values = draw(campaign, scenario, members)[key]
    for row in range(TRIED):
        with contextlib.suppress(ValueError):
            yield with_values(scenario, as_changes({key: values}, row))


class Asked(NamedTuple):
    """Why a campaign's members fly one by one whatever their scenario has: in short, at length."""

    why: str
    at_length: str


def asks_for_alone(scenario: Scenario, campaign: Campaign) -> Asked | None:
    """What a campaign asks for that members flown together do not give."""
    if needs_modes(campaign.outcomes, scenario):
        return Asked(
            "attitude_error_deg depends on the modes",
            "attitude_error_deg is from the attitude that the modes hold at the time, and "
            "members flown together do not record their modes",
        )
    when = scenario.simulation.end_when
    if when is not None and when.signal == "momentum_n_m_s" and scenario.spacecraft.wheels:
        return Asked(
            "the momentum of wheels ends them",
            "simulation.end_when looks at the momentum of wheels, which members flown together "
            "round otherwise",
        )
    if varied := own_environment(campaign):
        text = "members flown together share orbit, environment, ephemeris and steps"
        return Asked(f"{varied[0]} varies", f"{varied[0]} varies, and {text}")
    return None


def own_environment(campaign: Campaign) -> list[str]:
    """Keys that vary of the orbit, the environment, the ephemeris or the steps."""
    return [key for key in campaign.varied_keys if key.startswith(_OF_ORBIT_ENVIRONMENT)]
