"""Slips in the values that a campaign lists are noted before it is flown."""

import pytest

from torquer.campaign.load import campaign_from_data
from torquer.campaign.notes import campaign_notes


@pytest.fixture
def notes_on(make):
    def found(vary, changes=()):
        scenario = make(changes)
        return campaign_notes(scenario, campaign_from_data({"runs": 2, "vary": vary}, scenario))

    return found


def test_a_listed_value_is_looked_at_as_the_scenarios_own(notes_on):
    turned = {"initial": {"quaternion": [0.0, 0.0, 0.0, 1.0], "rate_deg_s": [1.0, 0.0, 0.0]}}
    values = [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]]
    (note,) = notes_on({"initial.quaternion": {"values": values}}, turned)
    assert note.startswith('campaign.vary."initial.quaternion": initial.quaternion of [1, 0, 0, 0]')
    (note,) = notes_on({"orbit.altitude_km": {"values": [500.0, 500000.0]}})
    assert note.startswith('campaign.vary."orbit.altitude_km": orbit: the altitude is 500000 km')
    assert notes_on({"orbit.altitude_km": {"values": [500.0, 600.0]}}) == []


def test_what_the_scenario_has_itself_is_not_said_again(notes_on):
    low = {"orbit.altitude_km": 100.0}
    assert notes_on({"spacecraft.coils.limit_a_m2": {"values": [2.0, 3.0]}}, low) == []


def test_what_is_drawn_is_left_alone(notes_on):
    assert notes_on({"initial.attitude": {"rotation": "uniform"}}) == []
