"""Times of B-dot with saturated coils: limits in closed form, another average, flights."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import simpson

from torquer.environment.field.averaged import b_y, cone_angle
from torquer.spacecraft.actuators.coils import Coils
from torquer.theory.slow.detumbling import (
    Tumbling,
    braking_torque_n_m,
    detumbling_time_s,
    knee_gain,
    least_braked,
    mean_dipole_a_m2,
    turning_gain,
)
from torquer.theory.slow.gains import Sampling, bdot_gain, damped_share

FIELDS = np.linspace(2e-5, 5e-5, 40)
INSTANT = Sampling(0.0, 0.0)


def tumbling(limit_a_m2=0.2, saturation="scale", sampling=INSTANT, duty=1.0):
    coils = Coils(limit_a_m2=limit_a_m2, saturation=saturation)
    return Tumbling(0.02, FIELDS, coils, sampling, duty)


@pytest.mark.parametrize("saturation", ["scale", "clip"])
def test_below_the_limits_the_coils_follow(saturation):
    coils = Coils(limit_a_m2=0.2, saturation=saturation)
    assert mean_dipole_a_m2(coils, [1e-6, 0.1]) == pytest.approx([1e-6, 0.1], rel=1e-12)


def test_saturated_dipoles_are_the_means_over_the_sphere():
    """'relay' gives the sum of direction cosines, 3/2 on average, 'clip' tends to it; 'scale' the
    inverse of the greatest cosine, here over a million random directions."""
    c = np.random.default_rng(1).normal(size=(1_000_000, 3))
    c /= np.linalg.norm(c, axis=1)[:, None]
    scaled = float((1.0 / np.abs(c).max(axis=1)).mean())
    for saturation, mean in (("relay", 1.5), ("clip", 1.5), ("scale", scaled)):
        coils = Coils(limit_a_m2=2.0, saturation=saturation)
        assert mean_dipole_a_m2(coils, 1e9)[0] == pytest.approx(2.0 * mean, rel=2e-3)


def test_reversed_coils_give_opposite_dipole_and_failed_one_third_less():
    whole = mean_dipole_a_m2(Coils(limit_a_m2=1.0), 0.1)[0]
    reversed_ = Coils(limit_a_m2=1.0, polarity=(-1, -1, -1))
    failed = Coils(limit_a_m2=1.0, polarity=(1, 0, 1))
    assert mean_dipole_a_m2(reversed_, 0.1)[0] == pytest.approx(-whole)
    assert mean_dipole_a_m2(failed, 0.1)[0] == pytest.approx(2.0 / 3.0 * whole, rel=1e-3)


def test_strong_coils_give_the_exponential_decay_of_the_gain_formula():
    case, gain = tumbling(limit_a_m2=1e6, duty=0.4), 3e3
    e_fold = bdot_gain(1.0, 0.02, math.sqrt(np.mean(FIELDS**2)), duty=0.4) / gain
    found = detumbling_time_s(case, gain, 0.3, 0.003)
    assert found == pytest.approx(e_fold * math.log(100.0), rel=1e-9)


def test_saturated_coils_brake_at_a_constant_rate():
    case = tumbling(saturation="relay")
    torque = 1.5 * 0.2 * FIELDS.mean() * math.pi / 4.0  # mean sine of isotropic directions
    assert braking_torque_n_m(case, 1.0, [0.01, 1.0]) == pytest.approx([torque] * 2, rel=2e-3)
    assert detumbling_time_s(case, 1.0, 1.0, 0.01) == pytest.approx(0.02 * 0.99 / torque, rel=4e-3)


@settings(max_examples=20, deadline=None)
@given(st.floats(1e2, 1e6), st.floats(0.05, 0.6))
def test_the_time_is_the_integral_over_the_rate(gain, from_rad_s):
    case = tumbling(sampling=Sampling(1.0, 2.0, 0.3))
    w = np.linspace(0.004, from_rad_s, 3000)
    wanted = simpson(case.inertia_kg_m2 / braking_torque_n_m(case, gain, w), x=w)
    assert detumbling_time_s(case, gain, from_rad_s, 0.004) == pytest.approx(wanted, rel=5e-3)


@settings(max_examples=20, deadline=None)
@given(st.floats(1e2, 1e6), st.floats(1.1, 10.0))
def test_a_greater_gain_is_never_slower(gain, factor):
    case = tumbling(sampling=Sampling(1.0, 2.0, 0.3))
    slow, fast = (detumbling_time_s(case, k, 0.4, 0.004) for k in (gain, gain * factor))
    assert fast <= slow * (1.0 + 1e-9)


def test_knee_gain_takes_a_tenth_longer_than_the_least_time():
    case = tumbling(sampling=Sampling(1.0, 2.0, 0.3))
    least = detumbling_time_s(case, 1e9, 0.4, 0.004)
    knee = knee_gain(case, 0.4, 0.004)
    assert detumbling_time_s(case, knee, 0.4, 0.004) == pytest.approx(1.1 * least, rel=1e-3)


def test_turning_field_gain_is_that_of_avanzini_and_giulietti():
    """Their k (b x (w x b)), k = 2 n (1 + sin i) J, has b of unit length: ours is k/B^2."""
    found = turning_gain(0.01, 3e-5, 1.1e-3, math.pi / 2.0, duty=0.5)
    assert found == pytest.approx(2.0 * 1.1e-3 * 2.0 * 0.01 / 9e-10 / 0.5)


def test_the_direction_that_is_braked_least():
    """In the averaged field 2p about the cone axis or 1 - p across it, over two thirds."""
    u = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)
    for inclination in (0.0, 0.3, 0.8, 1.4):
        fields = np.array([b_y(3e-5, each, cone_angle(inclination)) for each in u])
        least, _, _ = damped_share(inclination)
        assert least_braked(fields) == pytest.approx(1.5 * least, abs=1e-9)


def test_a_rate_that_the_law_does_not_brake_takes_forever():
    case = tumbling(sampling=Sampling(2.0, 2.0))  # braked below pi/4
    assert detumbling_time_s(case, 1e3, 0.78, 0.01) < math.inf
    assert detumbling_time_s(case, 1e3, 0.80, 0.01) == math.inf
    with pytest.raises(ValueError, match="from_rad_s: must be above below_rad_s and at rates"):
        knee_gain(case, 0.80, 0.01)


@pytest.mark.parametrize(
    ("gain", "below", "text"),
    [(0.0, 0.01, "gain: must be positive and finite; received 0.0"),
     (1.0, 0.0, "below_rad_s: must be positive and finite; received 0.0")],
)  # fmt: skip
def test_mistakes(gain, below, text):
    with pytest.raises(ValueError, match=text):
        detumbling_time_s(tumbling(), gain, 0.3, below)
