"""UT1 - UTC as it is given: Earth-fixed places, the field, integrated orbits, the air; skyfield."""

import erfa
import numpy as np
import pytest
from skyfield.api import EarthSatellite, load, wgs84
from skyfield.framelib import itrs

from torquer.base.conventions import EARTH_RATE_RAD_S
from torquer.base.time import julian_dates, parse_utc
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.earth.atmosphere import Gost
from torquer.environment.earth.rotation_table import rotation_at, rotation_table
from torquer.environment.field.along import fields_along
from torquer.environment.orbit import Circular, Numerical, Sgp4
from torquer.maths.geometry.frames import rot_z

START = parse_utc("2012-03-04T10:31:47Z")
TIMES = np.linspace(0.0, 57000.0, 60)
DAY = 86400.0
CIRCLE = Circular(altitude_km=500.0, inclination_deg=51.7)
CHIBIS = (
    "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
    "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
)


def met(orbit, dut1_s, start=START, **keys):
    return OrbitEnvironment(Environment(ut1_minus_utc_s=dut1_s, **keys), orbit, start)


def skyfield_scale(dut1_s):
    # TT - UT1 = 32.184 s + 34 leap seconds - (UT1 - UTC), the same at all times
    return load.timescale(builtin=True, delta_t=32.184 + 34.0 - dut1_s)


def skyfield_times(dut1_s):
    return skyfield_scale(dut1_s).utc(2012, 3, 4, 10, 31, 47.0 + TIMES)


@pytest.mark.parametrize("dut1_s", [-0.9, -0.78, 0.0, 0.3341, 0.9])
def test_earth_fixed_axes_are_those_of_skyfield_and_erfa(dut1_s):
    ours = met(CIRCLE, dut1_s).dcm_to_ecef(TIMES)
    theirs = np.moveaxis(itrs.rotation_at(skyfield_times(dut1_s)), -1, 0)
    assert np.abs(ours - theirs).max() < 1e-10
    (day, ut1), (_, tt) = julian_dates(START, TIMES)
    classic = erfa.c2t06a(day, tt, day, ut1 + dut1_s / DAY, 0.0, 0.0)
    assert np.abs(ours - classic).max() < 1e-10


@pytest.mark.parametrize("rotation", ["precise", "sidereal"])
def test_a_two_line_orbit_is_over_skyfields_places(rotation):
    dut1_s = -0.42
    along = fields_along(
        (Environment().field,), Sgp4(tle=CHIBIS), START, TIMES, rotation, dut1_s
    )  # fmt: skip
    satellite = EarthSatellite(*CHIBIS, "Chibis-M", skyfield_scale(dut1_s))
    theirs = wgs84.geographic_position_of(satellite.at(skyfield_times(dut1_s)))
    lon = (along.lon_deg - theirs.longitude.degrees + 180.0) % 360.0 - 180.0
    # its TEME is off ours by up to 0.1 m (see test_sgp4_orbit); 0.42 s would be 1.75e-3 deg
    assert np.abs(lon * np.cos(np.radians(along.lat_deg))).max() < 2e-6
    assert np.abs(along.lat_deg - theirs.latitude.degrees).max() < 2e-6
    assert np.abs(along.height_km - theirs.elevation.km).max() < 2e-4


@pytest.mark.parametrize("rotation", ["precise", "sidereal"])
def test_the_field_turns_with_the_earth(rotation):
    """The field under an Earth that is 0.9 s on is that of another place under one that is not."""
    plain, moved = (met(CIRCLE, d, earth_rotation=rotation) for d in (0.0, 0.9))
    r, v = plain.state(TIMES)
    there = np.einsum("nij,nj->ni", moved.dcm_to_ecef(TIMES), r)
    back = np.einsum("nji,nj->ni", plain.dcm_to_ecef(TIMES), there)
    b, elsewhere = moved.field(TIMES, r, v), plain.field(TIMES, back, v)
    to_ecef = (moved.dcm_to_ecef(TIMES), plain.dcm_to_ecef(TIMES))
    fixed = [np.einsum("nij,nj->ni", m, x) for m, x in zip(to_ecef, (b, elsewhere), strict=True)]
    assert np.abs(fixed[0] - fixed[1]).max() < 1e-13 * np.abs(b).max() * 10.0
    # 0.9 s: 13.5 arcsec of longitude, 450 m at this height, 1.5 nT
    moved_by = np.linalg.norm(there - np.einsum("nij,nj->ni", to_ecef[1], r), axis=1)
    assert moved_by.max() == pytest.approx(0.9 * EARTH_RATE_RAD_S * CIRCLE.radius_m, rel=1e-2)
    change = 1e9 * np.linalg.norm(b - plain.field(TIMES, r, v), axis=1)
    assert 1.0 < change.max() < 1.7


@pytest.mark.parametrize("mode", ["precise", "sidereal"])
def test_compiled_turn_is_that_of_the_environment(mode):
    expected = met(CIRCLE, 0.61, earth_rotation=mode).dcm_to_ecef(TIMES)
    table = rotation_table(START, 0.0, TIMES[-1], mode, 0.61)
    for t, dcm in zip(TIMES, expected, strict=True):
        assert np.abs(np.array(rotation_at(table, t)[0]) - dcm).max() < 2e-13


def test_an_integrated_orbit_turns_with_its_gravity():
    """With UT1 later, the same flight is met by a start turned on with the Earth."""
    turn = np.array(rot_z(0.9 * 2.0 * np.pi * 1.00273781191135448 / DAY))
    r = np.array([6800.0, 100.0, 300.0])
    v = np.array([-0.2, 4.6, 6.1])

    def flown(r, v, dut1_s):
        start = {"kind": "state_vector", "position_km": tuple(r), "velocity_km_s": tuple(v)}
        orbit = Numerical(start=start, degree=8, earth_rotation="sidereal")
        return met(orbit, dut1_s, earth_rotation="sidereal").state(TIMES)[0]

    plain, turned, moved = flown(r, v, 0.0), flown(turn @ r, turn @ v, 0.9), flown(r, v, 0.9)
    assert np.abs(turned - plain @ turn.T).max() < 1e-3
    assert np.abs(moved - plain).max() > 0.05  # the test can tell


def test_ut1_is_continuous_over_leap_second_between_elements_and_start():
    """Elements of 2016-12-31, a start in 2017: the Earth under the flight is the run's own."""
    first = CHIBIS[0].replace("12058.91450162", "16366.50000000")
    first = first[:68] + str((sum(map(int, filter(str.isdigit, first[:68]))) + 2) % 10)
    start = parse_utc("2017-01-01T12:00:00Z")
    by_elements = Numerical(start={"kind": "sgp4", "tle": (first, CHIBIS[1])}, degree=8)
    r, v = by_elements.state([0.0], start, 0.6)
    vector = {"kind": "state_vector", "position_km": tuple(r[0] / 1e3)}
    vector["velocity_km_s"] = tuple(v[0] / 1e3)
    by_vector = Numerical(start=vector, degree=8)
    t = np.linspace(0.0, DAY, 20)
    error = [
        np.abs(by_elements.state(t, start, 0.6)[0] - by_vector.state(t, start, d)[0]).max()
        for d in (0.6, -0.4)
    ]
    assert error[0] < 5e-3 and error[1] > 0.05


def test_the_bulge_of_the_air_stays_under_the_sun():
    air, t = Gost(f107=150.0, kp=3.0), np.linspace(0.0, DAY, 30)
    r = np.tile([5.0e6, 3.0e6, 3.6e6], (t.size, 1))
    back = r @ np.array(rot_z(-EARTH_RATE_RAD_S * 0.9)).T  # an Earth turned on, the place back
    plain, moved = air.density(t, START, r), air.density(t, START, back, 0.9)
    assert moved == pytest.approx(plain, rel=1e-9)
    assert np.abs(air.density(t, START, r, 0.9) / plain - 1.0).max() > 1e-6


@pytest.mark.parametrize("value", [-0.91, 0.95, 3.0])
def test_ut1_stays_within_nine_tenths_of_a_second(value):
    with pytest.raises(ValueError, match="ut1_minus_utc_s"):
        Environment(ut1_minus_utc_s=value)
