"""Currents and temperatures: balances, the exact equation of heat, data sheets."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.spacecraft.actuators.coils import Coils
from torquer.spacecraft.house_keeping import (
    EARTH_INFRARED_W_M2,
    STEFAN_BOLTZMANN,
    SUNLIGHT_W_M2,
    HouseKeeping,
    absorbed_w,
    coil_draws,
    coils_draw,
    device_warmed,
    warmed,
    wheels_draw,
)

MODEL = HouseKeeping(area_m2=2.0, absorptivity=0.5, emissivity=0.9, capacity_j_k=2e4)
FAR_M = 1e12


def test_light_falls_on_a_quarter_of_the_surface_and_on_half_of_it_at_the_ground():
    assert absorbed_w(MODEL, 0.0, FAR_M) == pytest.approx(0.0, abs=1e-6)
    of_sun = absorbed_w(MODEL, 1.0, FAR_M)
    assert of_sun == pytest.approx(0.25 * 2.0 * 0.5 * SUNLIGHT_W_M2, rel=1e-9)
    at_ground = absorbed_w(MODEL, 0.0, EARTH_RADIUS_M)
    assert at_ground == pytest.approx(0.5 * 2.0 * 0.9 * EARTH_INFRARED_W_M2, rel=1e-12)
    # far away the Earth is a disc: a quarter of the surface times (R/r)^2
    far = absorbed_w(MODEL, 0.0, 100.0 * EARTH_RADIUS_M)
    assert far == pytest.approx(0.25 * 1e-4 * 2.0 * 0.9 * EARTH_INFRARED_W_M2, rel=1e-4)


@pytest.mark.parametrize("step_s", [5.0, 600.0, 1e5])
def test_temperature_ends_where_it_radiates_what_it_takes(step_s):
    kelvin, power_w = 150.0, 400.0
    for _ in range(int(1e7 / step_s)):
        kelvin = warmed(MODEL, kelvin, power_w, step_s)
    balance = (power_w / (0.9 * STEFAN_BOLTZMANN * 2.0)) ** 0.25
    assert kelvin == pytest.approx(balance, rel=1e-9)


def test_temperature_follows_the_equation_of_heat():
    """Light for an hour, shadow for half an hour, in steps of five seconds."""
    kelvin, power_w = 280.0, 350.0
    for k in range(1080):
        kelvin = warmed(MODEL, kelvin, power_w if k < 720 else 0.0, 5.0)

    def rate(_, t, power):
        return (power - 0.9 * STEFAN_BOLTZMANN * 2.0 * t**4) / 2e4

    lit = solve_ivp(rate, (0.0, 3600.0), [280.0], args=(350.0,), rtol=1e-10)
    dark = solve_ivp(rate, (0.0, 1800.0), lit.y[:, -1], args=(0.0,), rtol=1e-10)
    assert kelvin == pytest.approx(dark.y[0, -1], abs=0.01)
    assert kelvin < lit.y[0, -1] - 10.0


def test_device_is_warmer_by_its_dissipation():
    own = 280.0
    for _ in range(1000):
        own = device_warmed(MODEL, own, 290.0, 3.0, 5.0)
    assert own == pytest.approx(290.0 + 5.0 * 3.0, abs=1e-5)
    once = device_warmed(MODEL, 280.0, 290.0, 3.0, MODEL.device_s)
    assert once == pytest.approx(305.0 - 25.0 / np.e)


def test_coils_draw_what_their_windings_say():
    winding = {"turns": 100, "area_m2": 0.02, "current_a": 0.5, "resistance_ohm": 40.0}
    coils = coil_draws(Coils.model_validate({"windings": winding}), MODEL)
    draw = coils_draw(coils, (0.5, -1.0, 7.0))  # of 1 A m^2: half, all, and no more than all
    assert draw.current_a == pytest.approx(0.25 + 0.5 + 0.5)
    assert draw.heat_w == pytest.approx(10.0 * (0.25 + 1.0 + 1.0))


def test_coils_without_windings_take_their_power_from_the_supply():
    stated = coil_draws(Coils(limit_a_m2=3.2, power_at_limit_w=2.4), MODEL)
    assert coils_draw(stated, (3.2, 0.0, 0.0)) == pytest.approx((0.2, 2.4))
    default = coil_draws(Coils(limit_a_m2=3.2), MODEL)
    assert coils_draw(default, (0.0, -1.6, 0.0)) == pytest.approx((0.5 / 12.0, 0.25))
    assert coils_draw(default, (0.0, 0.0, 0.0)) == (0.0, 0.0)


def test_wheels_draw_mechanical_power_and_losses():
    """100 rad/s at 2 mN m are 0.2 W; energy is conserved, driving and braking."""
    inertia = [1e-4]
    drives = wheels_draw(MODEL, inertia, [0.01], [2e-3])
    electrical = 0.3 + 0.2 / 0.7
    assert drives == pytest.approx((electrical / 12.0, electrical - 0.2))
    brakes = wheels_draw(MODEL, inertia, [0.01], [-2e-3])
    assert brakes == pytest.approx((0.3 / 12.0, 0.3 + 0.2))
