"""Several sensors of a kind in flight, one of each failing: the example of the tutorial."""

from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer.maths.geometry.quaternion import angle_between

EXAMPLE = Path(__file__).parents[2] / "examples/several_sensors.toml"


@pytest.fixture(scope="module")
def flown():
    """The example; its last row is that of the end, when nothing is estimated."""
    return torquer.simulate(torquer.load_scenario(EXAMPLE)).isel(time=slice(0, -1))


def isolated(run, t_s):
    """Names of the sensors that the filter does not use at a time."""
    row = run.isel(time=t_s)
    return [str(name) for name in row["sensor"].values[row["isolated"].values > 0]]


def test_the_scenario_is_short():
    assert len(EXAMPLE.read_text(encoding="utf-8").splitlines()) < 60


def test_units_that_fail_are_named_and_no_others(flown):
    assert isolated(flown, 599) == []
    assert isolated(flown, 1100) == ["panel"]
    assert isolated(flown, 1700) == ["panel", "a"]
    assert isolated(flown, 2900) == ["panel", "a", "side"]


def test_the_error_is_as_large_as_it_is_stated(flown):
    error = angle_between(flown["q_estimated"].values, flown["q_body_to_inertial"].values)
    ratio = (error / flown["attitude_sigma"].values)[100:] ** 2 / 3.0
    assert 0.8 < np.mean(ratio) < 1.2
    assert np.max(ratio) < 8.0


@pytest.mark.parametrize(("t_s", "unit"), [(1150, "a"), (1500, "b"), (2900, "b")])
def test_the_bias_is_that_of_the_gyro_in_use(flown, t_s, unit):
    given = torquer.load_scenario(EXAMPLE).spacecraft.gyros[unit].bias_deg_s
    bias = np.degrees(flown["gyro_bias_estimated"].values[t_s])
    assert bias == pytest.approx(given, abs=2e-3)
