"""Momentum under a kept attitude: closed forms, limits, and integration in another way."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from torquer.base.conventions import EARTH_RATE_RAD_S
from torquer.environment.orbit.kepler import mean_motion
from torquer.spacecraft.aerodynamics import Aerodynamics
from torquer.spacecraft.parts import Cylinder, Plate
from torquer.theory.slow.wheel_accumulation import (
    PHASES,
    Held,
    air_torque,
    cyclic_bounds,
    held_torque,
    momentum_growth,
    momentum_under,
    orbital_axes,
    saturation_time,
)

INERTIA = np.diag([2600.0, 11100.0, 10900.0])
RADIUS = 6803137.0
RATE = mean_motion(RADIUS)
SURFACE = Aerodynamics(
    parts=(
        Cylinder(axis=(1, 0, 0), radius_m=1.3, length_m=5.0, centre_m=(-1, 0, 0)),
        Plate(axis=(0, 0, 1), area_m2=33.0, centre_m=(0.3, 0, 0)),
    )
).pack()
OFFSET = np.array([0.02, -0.03, 0.05])


def test_nominal_attitude_is_right_handed_with_x1_along_the_motion():
    up, along, normal = orbital_axes((0.0, 0.0, 0.0))
    assert along == pytest.approx([1, 0, 0]) and normal == pytest.approx([0, 0, 1])
    assert np.cross(up, along) == pytest.approx(normal)
    # a turn about x3 by c: the motion is seen at -c from x1 towards x2
    assert orbital_axes((0, 0, 0.1))[1] == pytest.approx([np.cos(0.1), -np.sin(0.1), 0.0])


def test_torque_of_small_angles_is_the_linear_one():
    a, b, c = small = 1e-5 * np.array([2.0, -3.0, 5.0])
    i1, i2, i3 = np.diag(INERTIA)
    linear = RATE**2 * np.array([-4 * (i3 - i2) * a, (i1 - i3) * b, 3 * (i2 - i1) * c])
    push = np.array([1e-6, 2e-6, 3e-6])
    found = held_torque(INERTIA, RATE, orbital_axes(small), push)
    assert found - push == pytest.approx(linear, rel=1e-3)
    assert held_torque(INERTIA, RATE, orbital_axes((0, 0, 0))) == pytest.approx(np.zeros(3))


def integrated(torque, normal, t):
    """H' + w n x H = m by a general integrator."""

    def slope(_, h):
        return torque - RATE * np.cross(normal, h)

    return solve_ivp(slope, (0.0, t), np.zeros(3), rtol=1e-11, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("t", [100.0, 5e3, 3e4])
def test_closed_form_is_what_an_integrator_finds(t):
    axes = orbital_axes(OFFSET)
    torque = held_torque(INERTIA, RATE, axes, (1e-4, 2e-4, -1e-4))
    found = momentum_under(torque, axes[2], RATE, t)
    assert found == pytest.approx(integrated(torque, axes[2], t), abs=1e-8)
    held = Held(RATE, axes[2], np.tile(torque, (PHASES, 1)))
    assert momentum_growth(held).after(t) == pytest.approx(found, abs=2e-4)


def test_published_form_with_the_normal_along_x3_and_its_bounds():
    m1, m2, m3 = m = np.array([2e-4, -1e-4, 3e-5])
    t = np.linspace(0.0, 4e4, 4001)
    h = momentum_under(m, (0, 0, 1), RATE, t)
    s, c = np.sin(RATE * t), 1.0 - np.cos(RATE * t)
    wanted = np.column_stack([(m1 * s + m2 * c) / RATE, (m2 * s - m1 * c) / RATE, m3 * t])
    assert h == pytest.approx(wanted, abs=1e-12)
    bounds = cyclic_bounds(m, (0, 0, 1), RATE)
    size = np.hypot(m1, m2)
    assert bounds == pytest.approx([(abs(m2) + size) / RATE, (abs(m1) + size) / RATE, 0.0])
    assert np.abs(h[:, :2]).max(axis=0) == pytest.approx(bounds[:2], rel=1e-5)
    # the two that go round stay on a circle
    circle = np.hypot(h[:, 0] - m2 / RATE, h[:, 1] + m1 / RATE)
    assert circle == pytest.approx(size / RATE)


def test_still_air_torque_is_constant_and_turning_air_adds_crosswind():
    axes = orbital_axes((0.0, 0.0, 0.0))
    still = air_torque(SURFACE, 3e-12, RADIUS, RATE, axes)
    assert np.ptp(still, axis=0) == pytest.approx(np.zeros(3), abs=1e-18)
    assert still[0] == pytest.approx(np.zeros(3), abs=1e-15)  # centres on the axis
    turning = air_torque(SURFACE, 3e-12, RADIUS, RATE, axes, np.radians(63.0))
    # eastward wind blows along the normal when going south, against it when going north
    side = EARTH_RATE_RAD_S * np.sin(np.radians(63.0)) / RATE
    assert np.abs(turning[:, 1]).max() > 1e-6
    assert turning[0] == pytest.approx(-turning[PHASES // 2])
    assert turning[PHASES // 4] == pytest.approx(np.zeros(3), abs=1e-18)
    assert np.abs(turning[:, [0, 2]]).max() < 1e-15
    equator = air_torque(SURFACE, 3e-12, RADIUS, RATE, orbital_axes(OFFSET), 0.0)
    rest = air_torque(SURFACE, 3e-12, RADIUS, RATE, orbital_axes(OFFSET))
    assert equator == pytest.approx(rest * (1.0 - EARTH_RATE_RAD_S / RATE) ** 2)
    assert side < 0.07


def test_alternating_wind_accumulates_momentum_across_the_normal():
    """In phase with the turn of the body: half the amplitude counts, revolution by revolution."""
    amplitude, u = 6e-5, 2.0 * np.pi * np.arange(PHASES) / PHASES
    torque = np.column_stack([np.zeros(PHASES), amplitude * np.cos(u), np.zeros(PHASES)])
    growth = momentum_growth(Held(RATE, np.array([0.0, 0.0, 1.0]), torque))
    assert np.linalg.norm(growth.gain_n_m_s) == pytest.approx(0.5 * amplitude * 2 * np.pi / RATE)
    assert np.abs(growth.gain_n_m_s[2]) < 1e-12
    assert growth.over(7)[0] == pytest.approx(growth.over(6)[-1])
    assert growth.after(7 * growth.held.period_s) == pytest.approx(growth.over(7)[0], abs=1e-9)


def test_time_to_saturation():
    normal, m3 = np.array([0.0, 0.0, 1.0]), 4e-5
    torque = np.tile([0.0, 0.0, m3], (PHASES, 1))
    growth = momentum_growth(Held(RATE, normal, torque))
    rows = np.diag([1.0 / 18.0, 1.0 / 18.0, 1.0 / 20.0])
    assert saturation_time(growth, rows) == pytest.approx(20.0 / m3, rel=1e-9)
    # with a cycle on top, against a fine look at the closed form
    m = np.array([3e-3, -2e-3, m3])
    growth = momentum_growth(Held(RATE, normal, np.tile(m, (PHASES, 1))))
    skew = np.array([[0.06, 0.02, 0.04], [-0.03, 0.05, 0.03]])
    t = np.linspace(0.0, 8e5, 800_001)
    share = np.abs(momentum_under(m, normal, RATE, t) @ skew.T).max(axis=1)
    assert saturation_time(growth, skew) == pytest.approx(t[np.argmax(share > 1.0)], abs=3.0)
    at_once = saturation_time(growth, 1e9 * skew)
    assert 0.0 <= at_once < 10.0


def test_what_only_goes_round_never_saturates_if_it_fits():
    normal = np.array([0.0, 0.0, 1.0])
    growth = momentum_growth(Held(RATE, normal, np.tile([1e-5, 0.0, 0.0], (PHASES, 1))))
    assert saturation_time(growth, np.eye(3) / 18.0) == np.inf
    nothing = momentum_growth(Held(RATE, normal, np.zeros((PHASES, 3))))
    assert saturation_time(nothing, np.eye(3) / 18.0) == np.inf
