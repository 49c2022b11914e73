"""How long it takes from tip-off to pointing, by theory."""

import math

import numpy as np
import pytest

from torquer.spacecraft.actuators.coils import Coils
from torquer.theory.magneto_gyro.capture import DAMPING, Stage1Design
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.times import Hysteresis, TimeToPoint, phase_left, time_to_point
from torquer.theory.slow.detumbling import Tumbling
from torquer.theory.slow.gains import Sampling

CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, 1.0317e-3)
FIRST = Stage1Design(4.0, 6.0, 0.1, 0.6)
SWITCH = Hysteresis(math.radians(15.0), 1500.0)
FIELDS = np.linspace(2e-5, 4.5e-5, 20)


def time_of(limit_a_m2=250.0, tip_off_deg_s=3.0, craft=CRAFT, first=FIRST):
    coils = Coils(limit_a_m2=limit_a_m2)
    tumbling = Tumbling(3200.0, FIELDS, coils, Sampling(0.0, 1.0, 0.0, 0.0, 0.0))
    return time_to_point(craft, tumbling, first, 0.25, math.radians(tip_off_deg_s), SWITCH)


def test_the_lag_is_that_of_the_filter():
    w, f = np.linspace(0.01, 0.3, 7), 0.1
    transfer = f**2 / (f**2 - w**2 + 2j * DAMPING * f * w)
    assert phase_left(w, f) == pytest.approx(transfer.real / np.abs(transfer))


def test_saturated_coils_brake_and_turn_in_proportion_to_their_limit():
    one, other = time_of(20.0), time_of(40.0)
    assert one.braking_s == pytest.approx(2.0 * other.braking_s, rel=0.02)
    assert one.turning_s == pytest.approx(2.0 * other.turning_s, rel=0.02)
    assert one.switch_s == other.switch_s


def test_a_stronger_wheel_takes_longer_to_turn():
    strong = CRAFT.with_wheel(2.0 * CRAFT.wheel_n_m_s)
    assert time_of(craft=strong).turning_s == pytest.approx(2.0 * time_of().turning_s)


def test_strong_coils_wait_for_the_decay_of_stage_1():
    decay = math.log(90.0 / 15.0) / (0.6 * CRAFT.orbital_rate_rad_s)
    assert time_of(1e5).turning_s == pytest.approx(decay)


def test_it_never_brakes_beyond_the_frequency_of_the_filters():
    assert time_of(tip_off_deg_s=5.7).braking_s < math.inf
    assert time_of(tip_off_deg_s=6.0).braking_s == math.inf


def test_a_satellite_at_rest_is_not_braked():
    assert time_of(tip_off_deg_s=0.1).braking_s == 0.0


def test_stage_2_decays_from_what_is_left():
    time = TimeToPoint(100.0, 20.0, 3.0, math.radians(10.0), 0.01)
    assert time.below(math.radians(10.0)) == time.stage_2_s == 123.0
    assert time.below(math.radians(30.0)) == 123.0
    assert time.below(math.radians(1.0)) == pytest.approx(123.0 + 100.0 * math.log(10.0))
