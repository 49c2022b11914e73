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


COIL, FIELD, RATE = (
    f"spacecraft.{key}"
    for key in ("search_coil.noise_nt_s", "magnetometer.noise_nt", "gyro.noise_deg_s")
)


@pytest.mark.parametrize(
    ("law", "unread"),
    [("bdot", [COIL, RATE]), ("bdot_derivative", [FIELD, RATE]), ("bdot_rate", [COIL])],
)
def test_a_varied_sensor_that_no_law_reads_is_noted(notes_on, law, unread):
    """Of any kind, the search coil too; a campaign over laws may read all of them."""
    vary = {key: {"uniform": [0.1, 1.0]} for key in (COIL, FIELD, RATE)}
    has = {"control.law": {"kind": law, "gain_a_m2_s_per_t": 1e4}, "spacecraft.search_coil": {}}
    notes = notes_on(vary, has)
    assert sorted(note.partition(" varies, and nothing")[0] for note in notes) == sorted(unread)
    over_laws = vary | {"control.law.kind": {"values": ["bdot", "bdot_rate"]}}
    assert notes_on(over_laws, has) == []
