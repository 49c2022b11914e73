"""Orbits that drift by J2, Sun-synchronous ones among them."""

import math
from datetime import datetime, timedelta

import numpy as np
import pytest
from sgp4.api import WGS72, Satrec

from torquer.base.time import DAY_S
from torquer.environment.orbit import Circular, Drifting
from torquer.environment.orbit.drifting import mean_sun_deg

START = datetime(2025, 3, 20, 12)
UTC = START.isoformat() + "Z"
#: Radius of the Earth in SGP4 [m].
SGP4_RADIUS_M = 6378135.0


def by_sgp4(orbit):
    """SGP4's satellite, without drag, of the same mean elements."""
    days = (START - datetime(1949, 12, 31)) / timedelta(days=1)
    motion, found = 60.0 * orbit.rate_rad_s(), Satrec()
    angles = orbit.argument_of_perigee_deg, orbit.mean_anomaly_deg, orbit.node_deg(UTC)
    perigee, anomaly, node = map(math.radians, angles)
    for _ in range(20):  # SGP4's mean motion is Kozai's; the axis is to be the same
        found = Satrec()
        shape = (max(orbit.eccentricity, 1e-9), perigee, orbit.inclination_rad, anomaly)
        found.sgp4init(WGS72, "i", 1, days, 0.0, 0.0, 0.0, *shape, motion, node)
        motion *= (found.a * SGP4_RADIUS_M / orbit.axis_m) ** 1.5
    return found


def nodes_rad(r, v):
    normal = np.cross(r, v)
    return np.unwrap(np.arctan2(normal[:, 0], -normal[:, 1]))


@pytest.mark.parametrize(
    "keys",
    [{"altitude_km": 400, "ltan_h": 6.0}, {"altitude_km": 500, "ltan_h": 10.5},
     {"altitude_km": 800, "ltan_h": 22.25},
     {"altitude_km": 800, "eccentricity": 0.05, "inclination_deg": 51.6, "raan_deg": 40.0}],
)  # fmt: skip
def test_for_sixty_days_plane_and_place_are_those_of_sgp4(keys):
    """SGP4 has J2 squared and J4, too: at 400 km 0.09 % and 0.24 % of the drift of the node."""
    orbit = Drifting(**keys)
    t_s = np.linspace(0.0, 60.0 * DAY_S, 4001)
    r, v = orbit.state(t_s, UTC)
    satellite = by_sgp4(orbit)
    at = np.full(len(t_s), satellite.jdsatepoch), satellite.jdsatepochF + t_s / DAY_S
    errors, r_km, v_km_s = satellite.sgp4_array(*at)
    assert not errors.any()
    off = nodes_rad(r, v) - nodes_rad(r_km, v_km_s)
    turned = nodes_rad(r, v)[-1] - nodes_rad(r, v)[0]
    assert np.abs(off).max() < 0.004 * abs(turned)
    assert np.linalg.norm(1e-3 * r - r_km, axis=1)[0] < 25.0
    assert np.linalg.norm(1e-3 * r - r_km, axis=1).max() < 300.0
    if "ltan_h" in keys:
        suns = [mean_sun_deg(UTC_after) for UTC_after in map(utc_after, t_s[::400])]
        hours = (np.degrees(nodes_rad(r_km, v_km_s)[::400]) - suns) / 15.0 + 12.0 - orbit.ltan_h
        assert (
            np.abs((hours + 12.0) % 24.0 - 12.0).max() < 1.0 / 60.0
        )  # 0.33 % of 59 deg, and short-periodic terms


def utc_after(t_s):
    return (START + timedelta(seconds=float(t_s))).isoformat() + "Z"


@pytest.mark.parametrize(("altitude_km", "inclination_deg"), [(500, 97.40), (800, 98.60)])
def test_the_inclination_of_a_sun_synchronous_orbit_is_the_known_one(altitude_km, inclination_deg):
    """D. A. Vallado, 'Fundamentals of Astrodynamics and Applications' (2013), table 11-2."""
    orbit = Drifting(altitude_km=altitude_km, ltan_h=12.0)
    assert math.degrees(orbit.inclination_rad) == pytest.approx(inclination_deg, abs=0.01)


def test_local_time_of_noon_is_the_mean_suns_right_ascension():
    """On 20 March 2025 the true Sun is at the equinox; the mean one is 7.5 minutes behind."""
    assert mean_sun_deg("2025-03-20T09:01:00Z") == pytest.approx(360.0 - 7.45 / 4.0, abs=0.05)
    assert Drifting(altitude_km=500, ltan_h=12.0).node_deg(UTC) == mean_sun_deg(UTC)


def test_a_revolution_leads_from_node_to_node():
    orbit = Drifting(altitude_km=700, inclination_deg=70.0, eccentricity=0.0)
    r, _ = orbit.state([0.0, orbit.period_s], UTC)
    assert r[:, 2] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_velocity_is_the_derivative_of_position():
    orbit = Drifting(altitude_km=900, ltan_h=3.0, eccentricity=0.1)
    t_s = 1000.0 + np.array([-1.0, 0.0, 1.0])
    r, v = orbit.state(t_s, UTC)
    # third derivative of the position, by the orbital rate
    assert (r[2] - r[0]) / 2.0 == pytest.approx(v[1], abs=2e-3)


def test_without_flattening_it_would_be_the_circular_orbit(monkeypatch):
    monkeypatch.setattr("torquer.environment.orbit.drifting.EARTH_J2", 0.0)
    t_s = np.linspace(0.0, 5e4, 50)
    keys = {"altitude_km": 600, "inclination_deg": 60.0, "raan_deg": 25.0}
    drifting, circular = Drifting(**keys), Circular(**keys)
    for ours, theirs in zip(drifting.state(t_s, UTC), circular.state(t_s), strict=True):
        assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-3)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"altitude_km": 500}, "inclination_deg: must be given without ltan_h; received none"),
        ({"altitude_km": 500, "ltan_h": 6.0, "raan_deg": 1.0},
         "must have raan_deg or ltan_h; received both"),
        ({"altitude_km": 9000, "ltan_h": 6.0}, "received none at an altitude of 9000 km"),
        ({"altitude_km": 500, "eccentricity": 0.2, "inclination_deg": 50.0},
         "received a perigee altitude of -875.6"),
        ({"altitude_km": 1e6, "eccentricity": 0.6, "inclination_deg": 50.0}, "Hill sphere"),
        ({"altitude_km": 500, "ltan_h": 24.0}, "less than 24"),
    ],
)  # fmt: skip
def test_elements_that_make_no_orbit_are_refused(keys, message):
    with pytest.raises(ValueError, match=message):
        Drifting(**keys)
