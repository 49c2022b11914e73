"""Gains that follow the orbit: their series, and the law of constant ones."""

import math

import numpy as np
import pytest
from law_cases import inputs

from torquer.computer.laws.periodic_gains import PeriodicGains
from torquer.computer.laws.three_axis import ThreeAxis
from torquer.environment.field.averaged import argument_of_latitude
from torquer.environment.orbit import Circular

ONE = np.eye(3).tolist()


def known(u_deg=30.0):
    """What the computer knows at an argument of latitude on an inclined orbit."""
    orbit = Circular(
        altitude_km=500.0, inclination_deg=60.0, raan_deg=80.0, argument_of_latitude_deg=u_deg
    )
    r, v = orbit.state(np.zeros(1))
    motion = {"omega": (1e-3, -2e-3, 3e-3), "q": (0.1, -0.2, 0.3, math.sqrt(0.86))}
    return inputs(b=(1e-5, -2e-5, 3e-5), r=r[0], v=v[0], **motion)


@pytest.mark.parametrize("reference", ["orbital", "inertial"])
def test_constant_multiples_of_one_are_the_three_axis_law(reference):
    keys = {"reference": reference, "euler_deg": (40.0, -20.0, 10.0)}
    scalar = ThreeAxis(rate_gain_n_m_s_per_t2=1e5, angle_gain_n_m_per_t2=30.0, **keys).law()
    rates, angles = (1e5 * np.eye(3)).tolist(), (30.0 * np.eye(3)).tolist()
    matrix = PeriodicGains(rate_gains_n_m_s_per_t2=[rates], angle_gains_n_m_per_t2=[angles], **keys)
    assert matrix.law()(known()) == pytest.approx(scalar(known()), rel=1e-12)


@pytest.mark.parametrize("u_deg", [0.0, 30.0, 200.0, 359.0])
def test_the_series_is_that_of_the_argument_of_latitude(u_deg):
    rng = np.random.default_rng(1)
    rates, angles = rng.normal(size=(2, 5, 3, 3))
    u = math.radians(u_deg)
    waves = np.array([1.0, math.cos(u), math.sin(u), math.cos(2 * u), math.sin(2 * u)])
    now = {"rate_gains_n_m_s_per_t2": rates, "angle_gains_n_m_per_t2": angles}
    series = PeriodicGains(**{name: value.tolist() for name, value in now.items()})
    at = {name: [np.tensordot(waves, value, 1).tolist()] for name, value in now.items()}
    assert series.law()(known(u_deg)) == pytest.approx(
        PeriodicGains(**at).law()(known(u_deg)), rel=1e-9, abs=1e-15
    )


def test_the_argument_of_latitude_counts_from_the_ascending_node():
    for u_deg in (0.0, 10.0, 170.0, -100.0):
        place = known(u_deg).ephemeris
        r, v = place.r_inertial_m, place.v_inertial_m_s
        found = argument_of_latitude(r, tuple(np.cross(r, v).tolist()))
        assert math.degrees(found) == pytest.approx(u_deg, abs=1e-9)
    # on the equator from axis 1
    assert argument_of_latitude((0.0, 7e6, 0.0), (0.0, 0.0, 5e10)) == pytest.approx(0.5 * math.pi)


@pytest.mark.parametrize(
    ("rates", "angles", "message"),
    [
        ([ONE], [ONE] * 3, "must have as many matrices as rate_gains_n_m_s_per_t2.* 3 and 1"),
        ([ONE] * 2, [ONE] * 2, "an odd number .* received 2 and 2"),
        ([], [], "must have 1 or more values"),
        ([[[1.0, 2.0], [3.0, 4.0]]], [ONE], "rate_gains_n_m_s_per_t2"),
    ],
)
def test_messages(rates, angles, message):
    with pytest.raises(ValueError, match=message):
        PeriodicGains(rate_gains_n_m_s_per_t2=rates, angle_gains_n_m_per_t2=angles)
