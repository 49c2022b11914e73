"""The Sun: published positions and instants, low-precision twin; eclipse by counting points."""

import erfa
import numpy as np
import pytest

from torquer.base.conventions import ASTRONOMICAL_UNIT_M, EARTH_RADIUS_M, SUN_RADIUS_M
from torquer.base.time import julian_dates
from torquer.environment import sun
from torquer.environment.earth import rotation
from torquer.environment.earth.apparent_sun import LIGHT_SPEED_M_S, apparent_sun_gcrf
from torquer.environment.orbit import Circular, Sgp4

START = "2012-03-04T10:31:47Z"


def ecliptic_of_date(start, t=(0.0,)):
    """Apparent longitude and latitude [deg] and distance [au], true ecliptic and equinox."""
    _, tt = julian_dates(start, np.asarray(t))
    obliquity = erfa.obl06(*tt) + erfa.nut06a(*tt)[1]
    turn = erfa.rx(obliquity, erfa.pnm06a(*tt))
    s = (turn @ sun.sun_position(t, start)[..., None])[..., 0]
    lon, lat = np.arctan2(s[:, 1], s[:, 0]), np.arctan2(s[:, 2], np.hypot(s[:, 0], s[:, 1]))
    return np.degrees(lon), np.degrees(lat), np.linalg.norm(s, axis=1) / ASTRONOMICAL_UNIT_M


def test_published_position():
    # Meeus, Astronomical Algorithms, example 25.b: 1992 October 13, 0h TD, by the full VSOP87:
    # apparent longitude 199 deg 54' 21.56", latitude +0.72", distance 0.99760853 au,
    # right ascension 13h 13m 30.749s, declination -7 deg 47' 01.74"
    moment = "1992-10-12T23:59:00.816Z"
    lon, lat, distance = ecliptic_of_date(moment)
    assert (lon[0] % 360.0 - 199.0) * 3600 == pytest.approx(54 * 60 + 21.56, abs=0.1)
    assert lat[0] * 3600 == pytest.approx(0.72, abs=0.05)
    x, y, z = erfa.pnm06a(*julian_dates(moment, 0.0)[1]) @ sun.sun_position([0.0], moment)[0]
    assert (np.degrees(np.arctan2(y, x)) % 360.0) * 240.0 - 13 * 3600 - 13 * 60 == pytest.approx(
        30.749, abs=0.01
    )
    declination = np.degrees(np.arctan2(z, np.hypot(x, y)))
    assert declination * 3600 == pytest.approx(-(7 * 3600 + 47 * 60 + 1.74), abs=0.1)
    assert distance[0] == pytest.approx(0.99760853, abs=2e-6)


@pytest.mark.parametrize(
    ("instant", "longitude"),
    (("2024-03-20T03:06:00Z", 0.0), ("2024-06-20T20:51:00Z", 90.0),
     ("2024-09-22T12:44:00Z", 180.0), ("2024-12-21T09:20:00Z", 270.0)),
)  # fmt: skip
def test_published_equinoxes_and_solstices(instant, longitude):
    lon, _, _ = ecliptic_of_date(instant)
    # rounded to the minute: half a minute is 1.2 arcsec
    assert (lon[0] - longitude + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=5e-4)


def test_low_precision_formula_of_the_almanac():
    """A formula with two sines, good to 0.01 deg, in the frame of date."""
    t = np.linspace(0.0, 365.25 * 86400.0, 200)
    _, tt = julian_dates(START, t)
    n = (tt[0] - 2451545.0) + tt[1]
    g = np.radians(357.528 + 0.9856003 * n)
    lon = np.radians(280.460 + 0.9856474 * n + 1.915 * np.sin(g) + 0.020 * np.sin(2 * g))
    tilt = np.radians(23.439 - 0.0000004 * n)
    twin = np.stack([np.cos(lon), np.cos(tilt) * np.sin(lon), np.sin(tilt) * np.sin(lon)], axis=1)
    s = sun.sun_position(t, START, "sidereal")
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    # nutation in longitude (0.005 deg) and in the equinox is beyond the formula
    assert np.degrees(np.linalg.norm(s - twin, axis=1)).max() < 0.02


def test_frames_of_the_two_modes_agree():
    t = np.linspace(0.0, 5 * 86400.0, 60)
    turn = rotation.teme_to_gcrf(t, START)
    of_date = (turn @ sun.sun_position(t, START, "sidereal")[..., None])[..., 0]
    assert np.abs(of_date - sun.sun_position(t, START)).max() / ASTRONOMICAL_UNIT_M < 1e-11


def test_light_time_and_aberration_one_by_one():
    """Light-time by iteration on the Sun's barycentric place, then erfa's rigorous aberration."""
    t = np.linspace(0.0, 30 * 86400.0, 25)
    day, fraction = julian_dates(START, t)[1]
    expected = []
    for f in fraction:
        heliocentric, observer = erfa.epv00(day, f)
        delay = 0.0
        for _ in range(3):
            past, past_observer = erfa.epv00(day, f - delay)
            to_sun = past_observer["p"] - past["p"] - observer["p"]
            delay = np.linalg.norm(to_sun) * ASTRONOMICAL_UNIT_M / LIGHT_SPEED_M_S / 86400.0
        beta = observer["v"] * ASTRONOMICAL_UNIT_M / 86400.0 / LIGHT_SPEED_M_S
        distance = np.linalg.norm(heliocentric["p"])
        expected.append(erfa.ab(to_sun / np.linalg.norm(to_sun), beta, distance,
                                np.sqrt(1 - beta @ beta)))  # fmt: skip
    s = sun.sun_position(t, START)
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    assert np.abs(s - expected).max() < 3e-8  # second order in v/c: 1e-8


def test_costly_series_is_evaluated_at_few_dates(monkeypatch):
    calls = []
    series = erfa.epv00
    monkeypatch.setattr(erfa, "epv00", lambda *date: calls.append(date[1].size) or series(*date))
    days_of_no_other_test = "2031-09-09T09:09:09Z"  # a grid that was evaluated before is kept
    for mode in ("precise", "sidereal"):
        sun.sun_position(np.linspace(0.0, 57000.0, 6000), days_of_no_other_test, mode)
        assert len(calls) == 1 and calls.pop() <= 8
        sun.sun_position(np.linspace(0.0, 5700.0, 600), days_of_no_other_test, mode)
        sun.sun_position(np.linspace(0.0, 57000.0, 6000), days_of_no_other_test, mode)
        assert len(calls) == 1 and calls.pop() <= 7  # of fewer days


def test_interpolated_position_equals_the_series():
    t = np.linspace(0.0, 20 * 86400.0, 300)
    _, tt = julian_dates(START, t)
    every_time = apparent_sun_gcrf(*tt)
    error = np.abs(sun.sun_position(t, START) - every_time).max() / ASTRONOMICAL_UNIT_M
    assert error < 1e-11


SUN = np.array([0.6, -0.64, 0.48]) * ASTRONOMICAL_UNIT_M


def behind_earth(distance, offset):
    """Points behind the Earth: `distance` from it, `offset` [rad] off the shadow's axis."""
    axis = -SUN / ASTRONOMICAL_UNIT_M
    side = np.cross(axis, (0.8, 0.6, 0.0))
    side /= np.linalg.norm(side)
    offset = np.asarray(offset)[:, None]
    return distance * (np.cos(offset) * axis + np.sin(offset) * side)


def counted_fraction(r, points):
    """Lit part of the disc by asking for many points of it whether the Earth covers them."""
    to_sun = SUN - r
    far = np.linalg.norm(to_sun)
    w = to_sun / far
    u = np.cross(w, (0.0, 0.0, 1.0))
    u /= np.linalg.norm(u)
    angle = np.arcsin(SUN_RADIUS_M / far) * np.sqrt((np.arange(points) + 0.5) / points)
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(points)
    across = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * np.cross(w, u)
    ray = np.cos(angle)[:, None] * w + np.sin(angle)[:, None] * across
    edge = np.arcsin(min(EARTH_RADIUS_M / np.linalg.norm(r), 1.0))
    to_earth = -r / np.linalg.norm(r)
    return np.mean(np.arccos(np.clip(ray @ to_earth, -1.0, 1.0)) > edge)


@pytest.mark.parametrize("distance", (6.9e6, 4.2e7, 1.2e9, 1.6e9))
def test_conical_shadow_equals_counting_points(distance):
    reach = np.arcsin(min(EARTH_RADIUS_M / distance, 1.0)) + 0.006
    low = max(reach - 0.03, 0.0) if distance < 1e9 else 0.0
    r = behind_earth(distance, np.linspace(low, reach, 40))
    ours = sun.sunlit_fraction(r, SUN)
    counted = [counted_fraction(row, 40000) for row in r]
    # the disc of the Earth is curved on a sky seen from close by: flat discs are off by 0.1 %
    assert np.abs(ours - counted).max() < 2e-3
    assert np.all(np.diff(ours) >= -1e-12)
    assert np.count_nonzero((ours > 0.01) & (ours < 0.99)) > 5


def test_limits_of_the_conical_shadow():
    r = np.stack([*behind_earth(7e6, [0.0, 0.9, 2.0, np.pi]), [0.0, 0.0, 7e6]])
    assert np.array_equal(sun.sunlit_fraction(r, SUN), (0.0, 0.0, 1.0, 1.0, 1.0))


def test_earth_inside_the_sun_is_an_annular_eclipse():
    r = behind_earth(1.6e9, [0.0])
    size_sun = np.arcsin(SUN_RADIUS_M / (1.6e9 + ASTRONOMICAL_UNIT_M))
    sizes = np.arcsin(EARTH_RADIUS_M / 1.6e9) / size_sun
    assert sun.sunlit_fraction(r, SUN)[0] == pytest.approx(1.0 - sizes**2, abs=1e-12)
    assert 0.1 < 1.0 - sizes**2 < 0.3


def test_penumbra_is_continuous_at_both_edges():
    distance = 7e6
    size_sun = np.arcsin(SUN_RADIUS_M / (ASTRONOMICAL_UNIT_M + 2.5e6))
    size_earth = np.arcsin(EARTH_RADIUS_M / distance)
    for edge, value in ((size_earth - size_sun, 0.0), (size_earth + size_sun, 1.0)):
        near = behind_earth(distance, edge + np.linspace(-3e-6, 3e-6, 41))
        assert np.abs(sun.sunlit_fraction(near, SUN) - value).max() < 5e-3


@pytest.mark.parametrize("au", (0.983, 1.017))
@pytest.mark.parametrize("radius", (6.3782e6, 6.6e6, 7.5e6, 4.2e7, 3e8, 1.05e9, 1.5e9))
def test_discs_apart_are_lit_and_covered_ones_dark(radius, au):
    # the umbra and full sunlight are found without comparing the discs
    rng = np.random.default_rng(7)
    there = au * SUN
    offset = np.concatenate([rng.uniform(0.0, np.pi, 3000), np.linspace(1.5, 1.65, 3000)])
    edge = np.arcsin(min(EARTH_RADIUS_M / radius, 1.0))
    offset = np.append(offset, np.abs(edge + rng.uniform(-0.03, 0.03, 6000)))
    r = behind_earth(radius, offset)
    to_sun = there - r
    far = np.linalg.norm(to_sun, axis=1)
    sizes = np.arcsin(SUN_RADIUS_M / far), np.full(len(r), edge)
    apart = np.arctan2(
        np.linalg.norm(np.cross(to_sun, r), axis=1), -np.einsum("ni,ni->n", to_sun, r)
    )
    sunlit_fraction = sun.sunlit_fraction(r, there)
    assert np.all(sunlit_fraction[apart > sizes[0] + sizes[1] + 1e-9] == 1.0)
    assert np.all(sunlit_fraction[apart < sizes[1] - sizes[0] - 1e-9] == 0.0)
    between = np.abs(apart - sizes[1]) < sizes[0] - 1e-9
    assert np.all((sunlit_fraction[between] > 0.0) & (sunlit_fraction[between] < 1.0))


def test_cylindrical_shadow():
    aside = np.arcsin(EARTH_RADIUS_M / 7e6)
    r = behind_earth(7e6, [0.0, aside - 1e-9, aside + 1e-9, np.pi - aside + 1e-3, np.pi])
    assert np.array_equal(sun.sunlit_fraction(r, SUN, "cylindrical"), (0.0, 0.0, 1.0, 1.0, 1.0))


@pytest.mark.parametrize("model", ["conical", "oblate", "cylindrical"])
def test_eclipse_lasts_as_long_as_geometry_says(model):
    orbit = Circular(altitude_km=500.0, inclination_deg=0.0)
    t = np.arange(0.0, orbit.period_s, 1.0)
    s = np.broadcast_to([ASTRONOMICAL_UNIT_M, 0.0, 0.0], (t.size, 3))
    dark = np.sum(1.0 - sun.sunlit_fraction(orbit.state(t)[0], s, model))
    half = np.arcsin(EARTH_RADIUS_M / orbit.radius_m)
    assert dark == pytest.approx(orbit.period_s * half / np.pi, abs=1.0)


def test_flight_session_of_chibis_m():
    """Session of 2012-03-04: printed shadow 'about' 14:33 to 15:09 Moscow time (UTC+4).

    Those 36 min are the longest shadow of this orbit. With the printed elements the Sun stood
    40 deg off its plane, which leaves 32 min, from 14:30.5 to 15:02.5.
    """
    chibis = Sgp4(
        tle=(
            "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
            "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
        )
    )
    start, t = "2012-03-04T10:20:00Z", np.arange(0.0, 3600.0, 5.0)
    r, v = chibis.state(t, start)
    s = sun.sun_position(t, start, "sidereal")
    dark = t[sun.sunlit_fraction(r, s) < 0.5] / 60.0
    assert dark[0] == pytest.approx(10 + 27 / 60, abs=0.1)  # 14:30:27 Moscow time
    assert dark[-1] == pytest.approx(42 + 28 / 60, abs=0.1)  # 15:02:28
    normal = np.cross(r[0], v[0])
    sine = normal @ s[0] / np.linalg.norm(normal) / np.linalg.norm(s[0])
    assert np.degrees(np.arcsin(sine)) == pytest.approx(-39.7, abs=0.1)
    # chord of a circular orbit through a cylinder, at the mean radius in the shadow
    radius = np.linalg.norm(r, axis=1)[(t > 630.0) & (t < 2550.0)].mean()
    horizon = np.sqrt(1.0 - (EARTH_RADIUS_M / radius) ** 2)
    chord = chibis.period_s / 60.0 * np.arccos(horizon / np.sqrt(1.0 - sine**2)) / np.pi
    assert dark[-1] - dark[0] == pytest.approx(chord, abs=0.3)


def test_unknown_models_are_one_clear_line():
    with pytest.raises(ValueError) as error:
        sun.sunlit_fraction([7e6, 0, 0], SUN, "x")
    assert (
        str(error.value)
        == "eclipse: must be one of conical, oblate, cylindrical, none; received 'x'"
    )
    with pytest.raises(ValueError, match=r"^earth rotation: must be one of precise, sidereal"):
        sun.sun_position([0.0], START, "x")
