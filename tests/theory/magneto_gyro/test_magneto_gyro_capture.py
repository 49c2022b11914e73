"""Gains of stage 1 by its exact model."""

import math

import pytest

from torquer.theory.magneto_gyro.capture import design_stage_1, filter_rate_for
from torquer.theory.magneto_gyro.craft import GyroCraft, greatest_tip_off
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.periodic.floquet import degree_of_stability, monodromy, multipliers

CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, 1.0317e-3)


def test_stage_1_gains_have_the_stated_degree():
    found = design_stage_1(CRAFT, 0.1, (-0.1, 0.02))
    degrees = []
    for normal in (-0.1, 0.02):
        loop = STAGE_1.with_parameters(
            **CRAFT.satellite()._asdict(), normal=normal, frequency=0.1 / 1.0317e-3, damping=0.7,
            angle_gain=found.angle_gain, rate_gain=found.rate_gain,
        )  # fmt: skip
        rho = multipliers(monodromy(loop, tolerance=1e-8))
        degrees.append(float(degree_of_stability(rho, 2.0 * math.pi)))
    assert found.degree == pytest.approx(min(degrees), abs=1e-3)
    assert found.degree > 0.5


def test_too_weak_a_wheel_has_no_stable_stage_1():
    weak = CRAFT.with_wheel(CRAFT.wheel_at(-0.2))
    assert design_stage_1(weak, 0.1).degree < 0.0


def test_the_filters_brake_the_tip_off_rate_with_a_reserve():
    assert greatest_tip_off(filter_rate_for(0.05)) == pytest.approx(1.5 * 0.05)
