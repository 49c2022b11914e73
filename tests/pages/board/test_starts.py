"""Starts in the background: the band is that of the campaign."""

import numpy as np
import pytest

from torquer.campaign.fly import fly_campaign
from torquer.compile import engine
from torquer.pages.board.starts import PART, QUANTILES, RUNS, Starts, make_campaign, rate_band
from torquer.scenario.load import scenario_from_text


def test_starts_differ_in_attitude_and_direction_of_the_rate(text):
    scenario = scenario_from_text(text)
    campaign = make_campaign(scenario)
    assert campaign.runs == RUNS == 256
    rate = campaign.vary["initial.rate_deg_s"]
    assert rate.direction == "uniform" and campaign.vary["initial.attitude"].rotation == "uniform"
    at_rest = scenario_from_text(text.replace("[8, -5, 3]", "[0, 0, 0]"))
    assert [*make_campaign(at_rest).vary] == ["initial.attitude"]


def test_a_band_is_the_quantiles_of_the_members():
    rates = np.arange(303.0).reshape(101, 3)
    band = rate_band(np.array([0.0, 1.0, 2.0]), rates, 256, 2)
    assert (band["flown"], band["failed"], band["runs"]) == (103, 2, 256)
    assert band["rate_deg_s"][0] == [0.0, 1.0, 2.0] and band["rate_deg_s"][-1] == [300, 301, 302]
    assert band["rate_deg_s"][2] == [150.0, 151.0, 152.0] and len(QUANTILES) == 5


@pytest.mark.slow
@pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
def test_the_band_is_that_of_the_campaign(text):
    scenario, bands, starts = scenario_from_text(text), [], Starts()
    try:
        starts.fly(scenario, bands.append, lambda: False)
    finally:
        starts.close()
    assert [band["flown"] for band in bands] == list(range(PART, RUNS + 1, PART))
    result = fly_campaign(scenario, make_campaign(scenario))
    expected = np.quantile(result["series.rate"].values, QUANTILES, axis=0)
    assert np.array_equal(np.array(bands[-1]["rate_deg_s"], np.float32), np.float32(expected))
    assert bands[-1]["t_s"] == result["time"].values.tolist()
