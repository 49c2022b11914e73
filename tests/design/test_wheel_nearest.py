"""What would meet the demands on a wheel array: limits, exact, and other layouts."""

import numpy as np
import pytest

from torquer.design.wheel_design import analyse, demand_shares
from torquer.design.wheel_file import wheels_from_text
from torquer.design.wheel_tables import summary_rows

TEXT = """
[wheels]
momentum_limit_n_m_s = {momentum}
torque_limit_n_m = {torque}
layout = {{ kind = "regular_pyramid", count = 4, gamma_deg = {gamma} }}
[body]
inertia_kg_m2 = [10, 12, 15]
[demand]
rate_deg_s = 3.0
acceleration_deg_s2 = 0.1
"""


def designed(momentum=2.0, torque=0.2, gamma=54.7):
    return wheels_from_text(TEXT.format(momentum=momentum, torque=torque, gamma=gamma))


def analysed(**given):
    return analyse(designed(**given))


def _is_met(key: str, value: float) -> bool:
    design = designed(**{key: value})
    shares = demand_shares(design, design.wheels.array(), np.array(design.body.inertia))
    return all(share <= 1.0 for share in shares.values())


def test_demands_that_are_met_need_nothing():
    found = analysed()
    assert all(each["met"] for each in found["demand"].values()) and found["nearest"] is None
    assert "Would meet them" not in dict(summary_rows(found))


@pytest.mark.parametrize("key", ["momentum", "torque"])
def test_the_limit_that_is_named_is_the_least_that_meets_the_demand(key):
    weak = {"momentum": 0.3, "torque": 0.01}[key]
    found = analysed(**{key: weak})
    (change,) = found["nearest"]["limits"]
    assert change["key"].startswith(key) and change["now"] == weak
    assert _is_met(key, change["value"] * 1.000001)
    assert not _is_met(key, change["value"] * 0.999)
    said = [text for label, text in summary_rows(found) if label == "Would meet them"]
    assert f"{change['key']} = {change['value']:.4g} in place of {weak:g}" in said


def test_a_layout_of_the_same_wheels_that_meets_the_demand_is_named():
    """A steep pyramid is weak across its height; with the same wheels others are not."""
    steep = analysed(momentum=0.5, gamma=15.0)
    assert not steep["demand"]["rate"]["met"] and steep["nearest"]["layouts"]
    names = {each["name"] for each in steep["nearest"]["layouts"]}
    assert names <= {each["name"] for each in steep["layouts"]} - {"given"}
