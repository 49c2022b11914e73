"""A satellite over the map: against skyfield, spheres, and what stations see."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from skyfield.api import EarthSatellite, load, wgs84
from station_skies import CHIBIS, HOUR_MS, START_MS, TARUSA, chibis, kepler

from torquer.ground.footprint import below, below_sun, circle, coastline, map_at, reach_rad
from torquer.ground.passes import ms_of, seconds_of
from torquer.ground.sight import look, sun_elevation
from torquer.ground.stations import GroundStation


def central(one, other):
    """Angle [rad] at the centre of a sphere between places (latitude, longitude) [deg]."""
    a, b = (
        np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
        for lat, lon in (np.radians(one), np.radians(other))
    )
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def test_the_place_below_is_that_of_skyfield():
    scale = load.timescale(builtin=True, delta_t=32.184 + 34.0)
    theirs = EarthSatellite(*CHIBIS, "c", scale)
    for hours in (0.0, 3.3, 17.9):
        time_ms = START_MS + round(hours * HOUR_MS)
        lat, lon, height = below(chibis(), seconds_of(chibis(), time_ms))
        at = theirs.at(scale.from_datetime(datetime.fromtimestamp(time_ms / 1e3, UTC)))
        place = wgs84.geographic_position_of(at)
        assert abs(lat[0] - place.latitude.degrees) < 1e-4
        assert abs(lon[0] - place.longitude.degrees) < 1e-4
        assert abs(height[0] - place.elevation.m) < 10.0


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 8760.0))
def test_the_sun_is_in_the_zenith_below_it(hours):
    t_s = 3600.0 * hours
    lat, lon = below_sun(chibis_like(), t_s)
    place = GroundStation(latitude_deg=lat, longitude_deg=lon)
    # parallax of a radius of the Earth does not matter in the zenith
    assert np.degrees(sun_elevation(chibis_like(), place, t_s)[0]) > 89.99


def chibis_like():
    return kepler(6900.0, 0.0, 51.6)


@settings(max_examples=60, deadline=None)
@given(st.floats(-90.0, 90.0), st.floats(-180.0, 180.0), st.floats(0.01, 1.5))
def test_a_circle_has_its_angle_everywhere(lat, lon, angle):
    ring = circle(lat, lon, angle)
    assert all(-180.0 <= each[1] <= 180.0 for each in ring)
    np.testing.assert_allclose([central((lat, lon), each) for each in ring], angle, atol=1e-6)


@pytest.mark.parametrize("lowest", [0.0, 5.0, 30.0])
@pytest.mark.parametrize("height_km", [400.0, 2000.0, 35_786.0])
def test_the_reach_is_where_a_station_sees_it_at_its_lowest_elevation(lowest, height_km):
    """By the triangle of station, satellite and centre."""
    angle = reach_rad(1e3 * height_km, np.radians(lowest))
    radius, r = 6378.137, 6378.137 + height_km
    across, up = r * np.sin(angle), r * np.cos(angle) - radius
    assert np.degrees(np.arctan2(up, across)) == pytest.approx(lowest, abs=1e-9)


def test_a_station_within_the_footprint_sees_the_satellite():
    """But for the Earth's flattening, which moves the edge by a fifth of a degree."""
    around = chibis_like()
    t_s = 1000.0
    (lat,), (lon,), (height,) = below(around, t_s)
    reach = reach_rad(height)
    for part, is_seen in ((0.97, True), (1.03, False)):
        for place in circle(lat, lon, part * reach)[::6]:
            station = GroundStation(latitude_deg=place[0], longitude_deg=place[1])
            assert (look(around, station, t_s).elevation_rad[0] > 0.0) == is_seen


def test_the_map_at_a_time():
    time_ms = START_MS + HOUR_MS
    found = map_at(chibis(), {"tarusa": TARUSA}, time_ms)
    times = [row[0] for row in found["track"]]
    assert times == sorted(times) and times[0] < time_ms < times[-1]
    # two revolutions, a quarter of which has passed
    assert times[-1] - times[0] == pytest.approx(2e3 * chibis().orbit.period_s, abs=2.0)
    nearest = min(found["track"], key=lambda row: abs(row[0] - time_ms))
    assert central(nearest[1:], found["at"]) < 0.06
    assert found["sunlit"] in (0.0, 1.0) and 300.0 < found["height_km"] < 700.0
    (station,) = found["stations"]
    assert station["name"] == "tarusa" and station["at"] == [54.73, 37.18]
    at_noon = map_at(chibis(), {}, ms_of("2012-03-20T12:07:00Z", "t"))
    np.testing.assert_allclose(at_noon["sun"], [0.1, 0.0], atol=0.3)


def test_land_is_land():
    """Cities lie within the rings, places at sea do not."""
    from matplotlib.path import Path

    rings = [Path(np.array(ring)) for ring in coastline()]

    def is_land(lat, lon):
        return sum(ring.contains_point((lon, lat)) for ring in rings) % 2 == 1

    land = [(55.8, 37.6), (-25.0, 135.0), (40.0, -100.0), (-15.0, -55.0), (-85.0, 0.0),
            (66.0, -175.0), (66.0, 178.0), (-89.0, 170.0), (72.0, -40.0)]  # fmt: skip
    sea = [(0.0, -30.0), (40.0, -150.0), (-30.0, 80.0), (89.0, 0.0), (0.0, 180.0), (35.0, 18.0)]
    assert [is_land(*place) for place in land] == [True] * len(land)
    assert [is_land(*place) for place in sea] == [False] * len(sea)
    lons = np.concatenate([np.array(ring)[:, 0] for ring in coastline()])
    steps = [np.abs(np.diff(np.array(ring)[:, 0])) for ring in coastline()]
    assert lons.max() < 191.0  # Asia goes on beyond the edge of the map, to 169.9° west
    # but for the edge of the Antarctic along the pole no line crosses the map
    assert sorted(s.max() for s in steps)[-2] < 30.0
