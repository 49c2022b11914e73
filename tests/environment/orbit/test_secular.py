"""Keplerian orbit that drifts by J2: against two bodies, differences, and a numerical orbit."""

import math

import numpy as np
import pytest

from torquer.computer.on_board_environment import ELEMENTS
from torquer.environment.orbit import Kepler, Numerical
from torquer.environment.orbit.secular import (
    EARTH_J2,
    drifting_positions,
    drifting_state,
    secular_rates,
)

GIVEN = {
    "semi_major_axis_m": 7.2e6, "eccentricity": 0.03, "inclination_deg": 63.0, "raan_deg": 40.0,
    "argument_of_perigee_deg": 100.0, "mean_anomaly_deg": 310.0, "j2": EARTH_J2,
}  # fmt: skip


def elements(**changes):
    row = np.zeros(1, ELEMENTS["kepler"])
    for name, value in {**GIVEN, **changes}.items():
        row[name] = value
    return row


def test_without_flattening_it_is_the_orbit_of_two_bodies():
    orbit = Kepler(
        semi_major_axis_km=7200.0, eccentricity=0.03, inclination_deg=63.0, raan_deg=40.0,
        argument_of_perigee_deg=100.0, mean_anomaly_deg=310.0,
    )  # fmt: skip
    for t in (0.0, 777.0, 86400.0):
        r, v = orbit.state([t])
        found = drifting_state(elements(j2=0.0)[0], t)
        assert np.abs(np.array(found[0]) - r[0]).max() < 1e-5
        assert np.abs(np.array(found[1]) - v[0]).max() < 1e-8


def test_the_velocity_is_the_rate_of_the_position():
    for t in (0.0, 4321.0):
        before, after = drifting_positions(elements(), np.array([t - 0.5, t + 0.5]))
        _, v = drifting_state(elements()[0], t)
        assert np.abs(after - before - v).max() < 1e-3  # 7 m/s are those of the drift


def test_an_orbit_synchronous_with_the_sun_turns_once_a_year():
    # 98.19 deg at 700 km, as every table of such orbits has it
    drift = secular_rates(6378137.0 + 700e3, 0.0, math.radians(98.19), EARTH_J2)
    assert math.degrees(drift.node) * 86400.0 == pytest.approx(360.0 / 365.2422, rel=2e-3)


def test_perigee_rests_at_the_critical_inclination():
    drift = secular_rates(7.5e6, 0.1, math.acos(1.0 / math.sqrt(5.0)), EARTH_J2)
    assert abs(drift.perigee) < 1e-20


def test_node_drifts_as_that_of_an_integrated_orbit():
    orbit = Numerical(
        start=Kepler(semi_major_axis_km=7200.0, eccentricity=0.03, inclination_deg=63.0),
        degree=2, order=0, earth_rotation="sidereal", start_frame="TEME",
    )  # fmt: skip
    t_s = np.linspace(0.0, 86400.0, 500)
    r, v = orbit.state(t_s, "2020-01-01T00:00:00Z")
    normal = np.cross(r, v)
    node = np.unwrap(np.arctan2(normal[:, 0], -normal[:, 1]))
    rate = np.polyfit(t_s, node, 1)[0]
    expected = secular_rates(7.2e6, 0.03, math.radians(63.0), EARTH_J2).node
    assert rate == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    "change",
    [{"semi_major_axis_m": 0.0}, {"semi_major_axis_m": math.nan}, {"eccentricity": 1.0},
     {"eccentricity": -0.1}, {"mean_anomaly_deg": math.inf}],
)  # fmt: skip
def test_elements_of_no_ellipse_have_no_place(change):
    r, v = drifting_state(elements(**change)[0], 0.0)
    assert all(math.isnan(x) for x in (*r, *v))
