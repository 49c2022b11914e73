"""Degrees over the wheel's momentum, and which wheel is better."""

import math

import numpy as np
import pytest

from torquer.theory.magneto_gyro.accuracy import follow_revolution
from torquer.theory.magneto_gyro.capture import DAMPING, Stage1Design, design_stage_1
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Weights, design_stage_2, stage_2_gains
from torquer.theory.magneto_gyro.wheel_choice import WEAKER, better_wheel, over_stiffness
from torquer.theory.periodic.floquet import degree_of_stability, monodromy, multipliers

CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, 1.0317e-3)
WEIGHTS = Stage2Weights(20.5, 152.7, 91.1, 39.8)
FIRST = Stage1Design(4.0, 6.0, 0.1, 0.6)


def test_degrees_are_those_of_a_satellite_with_that_wheel():
    found = over_stiffness(CRAFT, FIRST, WEIGHTS, [4.0, 2.0, 0.8], -0.1)
    craft = CRAFT.with_wheel(CRAFT.wheel_at(4.0))
    gains = stage_2_gains(craft.gyrostat, WEIGHTS)
    second = stage_2_loop(craft.satellite(), craft.gyrostat, gains, normal=-0.1)
    assert found.second[0] == pytest.approx(follow_revolution(second).degree)
    first = STAGE_1.with_parameters(
        **craft.satellite()._asdict(), normal=-0.1, damping=DAMPING, angle_gain=4.0,
        rate_gain=6.0, frequency=0.1 / 1.0317e-3,
    )  # fmt: skip
    exact = degree_of_stability(multipliers(monodromy(first, tolerance=1e-8)), 2.0 * math.pi)
    assert found.first[0] == pytest.approx(float(exact), abs=1e-4)
    assert np.isnan(found.second[1]) and np.isnan(found.frozen[1])  # no gains at h = 2
    assert found.first[2] < 0.0 < found.frozen[2]


def test_better_wheel_beats_the_degrees_of_one_near_h_2():
    weak = CRAFT.with_wheel(CRAFT.wheel_at(2.05))
    better = better_wheel(weak, 0.1, 0.25, (-0.1,))
    own = design_stage_2(weak, normals=(-0.1,), evaluations=40).degree
    assert better.wheel_n_m_s == pytest.approx(CRAFT.wheel_at(better.stiffness))
    assert better.second > own + 0.05
    assert better.first > design_stage_1(weak, 0.1, (-0.1,)).degree + 0.1
    assert better.least > 0.23


def test_for_a_wheel_that_nutates_too_fast_a_weaker_one_is_found():
    """Stage 1 does not brake what its filters do not follow."""
    strong = CRAFT.with_wheel(CRAFT.wheel_at(150.0))
    assert strong.wheel_n_m_s / strong.inertia > 0.1
    assert not design_stage_1(strong, 0.1, (-0.1,)).degree > 0.0
    better = better_wheel(strong, 0.1, 0.25, (-0.1,))
    assert better.stiffness in WEAKER and better.wheel_n_m_s < 0.5 * strong.wheel_n_m_s
    assert better.least > 0.1
