"""From data sheet to filter: simulated readings have the Allan deviation that was meant."""

import math

import numpy as np
import pytest

from torquer.computer.estimation.gyro_noise import FLICKER, filter_noise


def allan_deviation(rates, count):
    """Of averages over `count` readings."""
    means = rates[: len(rates) // count * count].reshape(-1, count).mean(axis=1)
    return math.sqrt(0.5 * np.mean(np.diff(means) ** 2))


def test_units():
    """0.3 deg/sqrt(h) is 0.005 deg/sqrt(s); 3600 * 60 deg/h/sqrt(h) is 1 deg/s/sqrt(s)."""
    found = filter_noise(angle_random_walk_deg_sqrt_h=0.3, rate_random_walk_deg_h_sqrt_h=216_000.0)
    assert found == {
        "angle_random_walk_deg_sqrt_s": pytest.approx(0.005),
        "rate_random_walk_deg_s_sqrt_s": pytest.approx(1.0),
    }


def test_filter_noise_has_the_datasheet_allan_deviation():
    """Readings of 1 Hz by the filter's model: short averages by the angle random walk, those over
    the bridged time by the bias instability."""
    sheet = {"angle_random_walk_deg_sqrt_h": 0.3, "bias_instability_deg_h": 20.0}
    found, rng = filter_noise(**sheet, bridged_s=2000.0), np.random.default_rng(2)
    count = 4_000_000
    rates = found["angle_random_walk_deg_sqrt_s"] * rng.normal(size=count)
    rates += found["rate_random_walk_deg_s_sqrt_s"] * np.cumsum(rng.normal(size=count))
    assert allan_deviation(rates, 10) == pytest.approx(0.005 / math.sqrt(10.0), rel=0.05)
    white = 0.005 / math.sqrt(2000.0)
    flicker = FLICKER * 20.0 / 3600.0
    assert allan_deviation(rates, 2000) == pytest.approx(math.hypot(white, flicker), rel=0.08)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"angle_random_walk_deg_sqrt_h": 0.0},
         "angle_random_walk_deg_sqrt_h: must be above zero; received 0.0"),
        ({"bias_instability_deg_h": -1.0},
         "bias_instability_deg_h: must not be below zero; received -1.0"),
        ({"bridged_s": math.nan}, "bridged_s: must be above zero; received nan"),
    ],
)  # fmt: skip
def test_mistakes_are_reported(keys, message):
    with pytest.raises(ValueError) as error:
        filter_noise(**{"angle_random_walk_deg_sqrt_h": 0.3} | keys)
    assert str(error.value) == message
