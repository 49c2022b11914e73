"""Releases that are flown until they point."""

from pathlib import Path

import numpy as np
import pytest

from torquer.analysis.attitude import find_attitude_error
from torquer.campaign.load import load_campaign
from torquer.campaign.sampling import member_scenario
from torquer.design.pointing_flights import PointingFlights, fly_releases
from torquer.simulation.setup.simulate import simulate

EXAMPLE = Path(__file__).parents[2] / "examples/magneto_gyro.toml"


def test_settled_is_what_stays_below():
    """A first crossing does not count, nor a flight that ends above the limit."""
    errors = [[9, 4, 9, 4, 3], [9, 4, 3, 2, 9], [1, 1, 1, 1, 1]]
    flights = PointingFlights(np.arange(5) * 10.0, np.array(errors, dtype=float))
    assert flights.settled_s(5.0).tolist() == [30.0, np.inf, 0.0]


def test_flights_are_the_first_members_of_the_campaign():
    scenario, campaign = load_campaign(EXAMPLE)
    scenario = scenario.replace("simulation.revolutions", 0.1)
    flown = fly_releases(scenario, campaign, 2)
    one = find_attitude_error(simulate(member_scenario(scenario, campaign, 1)))
    assert flown.error_deg.shape == (2, len(flown.t_s))
    assert flown.error_deg[1] == pytest.approx(np.linalg.norm(one.error_deg, axis=1))
