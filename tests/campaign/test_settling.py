"""Settling times of a campaign beside first times: limits within the motion that remains."""

import numpy as np
import pytest

from torquer.campaign.fly import fly_campaign
from torquer.campaign.settling import settling
from torquer.campaign.spec import Campaign
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.report.campaign.tables import outcome_rows

#: A CubeSat that a residual dipole of 5 mA m^2 keeps turning at about 0.07 to 0.21 deg/s.
CUBESAT = {
    "start": "2026-07-01T00:00:00Z", "environment": {"field": {"kind": "igrf14", "degree": 4}},
    "orbit.altitude_km": 500.0, "orbit.inclination_deg": 97.4,
    "spacecraft.body.inertia_kg_m2": [0.0429, 0.0429, 0.0068],
    "spacecraft.coils": {"limit_a_m2": 0.24, "residual_dipole_a_m2": [5e-3, 5e-3, 5e-3]},
    "spacecraft.magnetometer.noise_nt": 100.0,
    "initial.rate_deg_s": [3.0, 3.0, 3.0],
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 7e4}},
    "simulation": {"revolutions": 6, "step_s": 1.0, "record_s": 10.0},
}  # fmt: skip


def times_below(limits) -> dict:
    return {
        name: {"signal": "rate_deg_s", "what": {key: limit}}
        for name, (key, limit) in limits.items()
    }


@pytest.fixture(scope="module")
def flown(make):
    outcomes = times_below({
        "within_s": ("settles_below", 0.19), "clear_s": ("settles_below", 1.0),
        "first_s": ("first_below", 0.19),
    })  # fmt: skip
    table = {"runs": 4, "vary": {"initial.attitude": "uniform"}, "outcomes": outcomes}
    return fly_campaign(make(CUBESAT), Campaign.model_validate(table))


def test_a_limit_within_the_residual_motion_is_noticed(flown):
    found = settling(flown, "within_s")
    assert found["again"] == found["within_residual"] == 4
    low, high = found["residual"]
    assert 0.03 < low < 0.12 < 0.18 < high < 0.3
    # the series keeps 200 instants: first times to that step
    step_s = np.diff(flown["series.within_s"]["time"].values).max()
    first_s = np.sort(flown["first_s"].values)[1]
    assert first_s <= found["first_median_s"] < first_s + 8.0 * step_s
    assert np.median(flown["within_s"].values) > 4.0 * found["first_median_s"]


def test_the_summary_says_first_and_for_good(flown):
    summary = campaign_summary(flown)
    ((label, words),) = [row for row in summary_rows(summary) if row[0].startswith("first below")]
    assert label == "first below 0.19 [s]"
    assert "; 4 of 4 members are above it again; in 4 the limit lies within the residual" in words
    assert words.endswith("deg/s: there the settling time is chance")
    rows = dict(outcome_rows(summary["outcomes"]["within_s"]))
    assert rows["First below 0.19 [s]"] == words


def test_a_clear_limit_and_other_outcomes_have_nothing_to_say(flown):
    assert settling(flown, "clear_s")["within_residual"] == 0
    assert settling(flown, "first_s") is None
    clear = campaign_summary(flown)["outcomes"]["clear_s"]
    assert not any(label.startswith("First below") for label, _ in outcome_rows(clear))
