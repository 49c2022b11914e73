"""Gains of B-dot against brute force: the sampled loop in the plane, and averages by quadrature."""

import math

import numpy as np
import pytest

from torquer.environment.field.averaged import b_z, cone_angle
from torquer.theory.gains import (
    bdot_gain,
    bdot_greatest_gain,
    damped_share,
    damping_efficiency,
    sampling_limit_rad_s,
    saturated_damping_time_s,
)

FIELD_T, INERTIA = 3e-5, 0.8


def sampled_plane(rate, difference_s, hold_s, gain, cycles, fine=200, windowed=True):
    """Rate after each cycle of a body that turns about the normal of a constant field.

    Brute force: the angle is integrated in small steps, the dipole is held in the body and its
    torque along the axis is m x B at every instant. With a window the coils are off while the
    two readings are taken; without one, readings and holds follow each other (d = a).
    """

    def field(angle):  # in the body, which has turned by the angle
        return FIELD_T * np.array([math.cos(angle), -math.sin(angle)])

    angle, rates = 0.3, []
    before = field(angle - rate * difference_s)
    for _ in range(cycles):
        if windowed:
            before = field(angle)
            angle += rate * difference_s
        now = field(angle)
        dipole = -gain * (now - before) / difference_s
        before = now
        h = hold_s / fine
        for _ in range(fine):  # leapfrog
            angle += 0.5 * h * rate
            b = field(angle)
            rate += h * (dipole[0] * b[1] - dipole[1] * b[0]) / INERTIA
            angle += 0.5 * h * rate
        rates.append(rate)
    return np.array(rates)


@pytest.mark.parametrize(("difference_s", "hold_s"), [(3.0, 3.0), (1.0, 6.0), (4.0, 0.5)])
@pytest.mark.parametrize("part", [0.01, 0.3, 0.8, 0.99, 1.01, 1.4, 2.5, 3.3])
def test_efficiency_is_that_of_one_hold_by_brute_force(difference_s, hold_s, part):
    rate = part * sampling_limit_rad_s(difference_s, hold_s)
    gain = 1e-6 * INERTIA / (FIELD_T**2 * hold_s)
    (after,) = sampled_plane(rate, difference_s, hold_s, gain, 1, fine=1000)
    ideal = 1e-6 * rate
    efficiency = damping_efficiency(rate, difference_s, hold_s)
    assert (rate - after) / ideal == pytest.approx(efficiency, abs=2e-6)


def test_the_sign_turns_at_the_limit_and_not_below():
    limit = sampling_limit_rad_s(3.0, 5.0)
    assert limit == pytest.approx(math.pi / 8.0)
    rates = np.linspace(1e-6, limit, 500)
    efficiency = damping_efficiency(rates, 3.0, 5.0)
    assert np.all(efficiency[:-1] > 0.0)
    assert efficiency[-1] == pytest.approx(0.0, abs=1e-12)
    assert efficiency[0] == pytest.approx(1.0, abs=1e-9)
    assert np.all(np.diff(efficiency) < 0.0)
    assert damping_efficiency(1.01 * limit, 3.0, 5.0) < 0.0


def test_a_hold_of_no_length_leaves_the_age_of_the_difference():
    assert sampling_limit_rad_s(2.0, 0.0) == pytest.approx(math.pi / 2.0)
    w = 0.4
    assert damping_efficiency(w, 2.0, 0.0) == pytest.approx(math.sin(w * 2.0) / (w * 2.0))


@pytest.mark.parametrize("windowed", [True, False])
@pytest.mark.parametrize(("part", "grows"), [(0.97, False), (1.03, True)])
def test_slow_motion_grows_above_the_greatest_gain(windowed, part, grows):
    hold_s = 2.0
    gain = part * bdot_greatest_gain(INERTIA, FIELD_T, hold_s)
    rates = sampled_plane(1e-7, hold_s, hold_s, gain, 300, fine=20, windowed=windowed)
    early, late = np.abs(rates[:20]).max(), np.abs(rates[-20:]).max()
    assert (late > 3.0 * early) if grows else (late < early / 3.0)


@pytest.mark.parametrize("inclination_deg", [0.0, 1.0, 30.0, 57.0, 90.0, 120.0, 180.0])
def test_damped_share_is_the_average_over_the_orbit(inclination_deg):
    inclination = math.radians(inclination_deg)
    cone = cone_angle(inclination)
    u = np.linspace(0.0, math.pi, 400, endpoint=False)
    b = np.array([b_z(1.0, x, cone) for x in u])
    open_share = np.eye(3) - np.einsum("ni,nj->ij", b, b) / len(u)
    shares = np.linalg.eigvalsh(open_share)
    least, mean, greatest = damped_share(inclination)
    assert least == pytest.approx(shares[0], abs=1e-12)
    assert greatest == pytest.approx(shares[2], abs=1e-12)
    assert mean == pytest.approx(np.trace(open_share) / 3.0, abs=1e-12)


def test_gain_damps_in_the_time_asked_for():
    """The averaged rate equation of a sphere, by its definition, integrated in small steps."""
    share, duty, time_s = 0.6, 0.4, 2000.0
    gain = bdot_gain(time_s, INERTIA, FIELD_T, share=share, duty=duty)
    rate, h = 1.0, 1.0
    for _ in range(int(time_s / h)):
        rate *= math.exp(-h * duty * gain * FIELD_T**2 * share / INERTIA)
    assert rate == pytest.approx(math.exp(-1.0), rel=1e-9)
    assert bdot_gain(time_s, INERTIA, FIELD_T) == pytest.approx(gain * share * duty * 1.5)


def test_saturated_coils_take_at_least_the_momentum_over_the_torque():
    momentum, limit, field = 0.4, 3.2, 3e-5
    time_s = saturated_damping_time_s(momentum, limit, field, duty=1.0 / 3.0)
    assert momentum - limit * field * time_s / 3.0 == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sampling_limit_rad_s(0.0, 1.0), "difference_s: must be positive and finite; "),
        (lambda: sampling_limit_rad_s(1.0, -1.0), "hold_s: must be 0 or positive; received -1.0"),
        (lambda: damping_efficiency(1.0, math.nan, 1.0), "difference_s: .* received nan"),
        (lambda: damped_share(4.0), r"inclination_rad: must lie within 0\.\.pi; received 4.0"),
        (lambda: bdot_gain(0.0, 1.0, 1.0), "damping_time_s: must be positive .* received 0.0"),
        (lambda: bdot_gain(1.0, -1.0, 1.0), "inertia_kg_m2: must be positive"),
        (lambda: bdot_gain(1.0, 1.0, math.inf), "field_t: must be positive .* received inf"),
        (lambda: bdot_gain(1.0, 1.0, 1.0, share=0.0), "share: must be above 0 and at most 1; "),
        (lambda: bdot_gain(1.0, 1.0, 1.0, duty=1.5), "duty: must be above 0 .* received 1.5"),
        (lambda: bdot_greatest_gain(1.0, 1.0, 0.0), "hold_s: must be positive and finite"),
        (lambda: saturated_damping_time_s(1.0, 1.0, 0.0), "field_t: must be positive and finite"),
    ],
)
def test_what_makes_no_sense_is_refused(call, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        call()
