"""Passes: against skyfield, and against a station that looks every second."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from skyfield.api import EarthSatellite, load, wgs84
from station_skies import CHIBIS, HOUR_MS, START, START_MS, TARUSA, chibis, kepler, sampled

from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import Bench
from torquer.ground import sight
from torquer.ground.passes import CURVE, doppler, find_passes, ms_of, seconds_of
from torquer.ground.stations import GroundStation

DAY_MS = 24 * HOUR_MS
#: Here UT1 = UTC: TT - UT1 = 32.184 s + 34 leap seconds.
SCALE = load.timescale(builtin=True, delta_t=32.184 + 34.0)
THEIRS = EarthSatellite(*CHIBIS, "Chibis-M", SCALE)


def topos(station):
    return wgs84.latlon(station.latitude_deg, station.longitude_deg, station.altitude_m)


def at(time_ms):
    return SCALE.from_datetime(datetime.fromtimestamp(time_ms / 1e3, UTC))


@pytest.fixture(scope="module")
def three_days():
    return find_passes(chibis(), {"tarusa": TARUSA}, START_MS, START_MS + 3 * DAY_MS)


# Against skyfield


def test_times_are_those_of_skyfield(three_days):
    times, _ = THEIRS.find_events(topos(TARUSA), at(START_MS), at(START_MS + 3 * DAY_MS), 0.0)
    theirs = [round(each.utc_datetime().timestamp() * 1e3) for each in times]
    ours = [point.time_ms for each in three_days for point in (each.aos, each.highest, each.los)]
    assert len(three_days) == 18
    # their search ends within some tenths of a second
    np.testing.assert_allclose(ours, theirs, atol=400)


def test_directions_distances_and_rates_are_those_of_skyfield(three_days):
    place = topos(TARUSA)
    for each in three_days:
        for point in (each.aos, each.highest, each.closest, each.los, *each.curve[::10]):
            (height, azimuth, distance, *_, rate) = (
                (THEIRS - place).at(at(point.time_ms)).frame_latlon_and_rates(place)
            )
            # times are given to a millisecond, in half of which it turns by 5e-4 deg at most
            assert abs(height.degrees - point.elevation_deg) < 5e-4
            apart = (azimuth.degrees - point.azimuth_deg + 180.0) % 360.0 - 180.0
            assert abs(apart) * np.cos(np.radians(point.elevation_deg)) < 5e-4
            assert abs(distance.km - point.range_km) < 0.01
            assert abs(rate.km_per_s - point.range_rate_km_s) < 1e-4


def test_a_rise_and_a_set_are_at_the_lowest_elevation():
    station = TARUSA.model_copy(update={"lowest_elevation_deg": 7.5})
    found = find_passes(chibis(), {"tarusa": station}, START_MS, START_MS + DAY_MS)
    ends = [point.elevation_deg for each in found for point in (each.aos, each.los)]
    # 0.1 s are 3e-3 deg at most there
    np.testing.assert_allclose(ends, 7.5, atol=1e-4)
    assert all(each.rises and each.sets for each in found)


def test_the_highest_and_the_closest_point_are_so(three_days):
    for each in three_days:
        t_s = np.linspace(*(seconds_of(chibis(), p.time_ms) for p in (each.aos, each.los)), 4001)
        seen = sight.look(chibis(), TARUSA, t_s)
        assert np.degrees(seen.elevation_rad.max()) <= each.highest.elevation_deg + 1e-6
        assert 1e-3 * seen.range_m.min() >= each.closest.range_km - 1e-6
        assert abs(each.closest.range_rate_km_s) < 1e-4
        assert len(each.curve) == CURVE


def test_the_sun_over_the_station(three_days):
    """At the equinox of March 2012, at the subsolar point, it is in the zenith."""
    moment_ms = ms_of("2012-03-20T05:14:00Z", "t")
    noon = GroundStation(latitude_deg=0.0, longitude_deg=180.0 - 15.0 * (5 + 14 / 60) + 1.85)
    t_s = seconds_of(chibis(), moment_ms)
    height = np.degrees(sight.sun_elevation(chibis(), noon, t_s)[0])
    assert 89.9 < height <= 90.0
    for each in three_days:
        expected = (
            "day" if each.sun_elevation_deg > -0.833
            else "twilight" if each.sun_elevation_deg > -6.0 else "night"
        )  # fmt: skip
        assert each.light == expected
    assert {each.light for each in three_days} == {"day", "twilight", "night"}


# Doppler


def test_doppler_is_the_change_of_what_is_received(three_days):
    frequency_hz, place = 437.5e6, topos(TARUSA)
    for point in (three_days[2].aos, three_days[2].highest, three_days[2].los):

        def range_m(offset_s, at_ms=point.time_ms):
            return (THEIRS - place).at(at(at_ms + 1e3 * offset_s)).distance().m

        shift, rate = doppler(point, frequency_hz)
        received = -frequency_hz * (range_m(0.5) - range_m(-0.5)) / 299792458.0
        assert abs(shift - received) < 0.05
        bend = range_m(1.0) - 2.0 * range_m(0.0) + range_m(-1.0)
        assert abs(rate + frequency_hz * bend / 299792458.0) < 0.3
    shifts = [doppler(point, frequency_hz)[0] for point in three_days[2].curve]
    assert shifts[0] > 8e3 and shifts[-1] < -8e3 and shifts == sorted(shifts, reverse=True)


# Eclipse


def test_eclipse_parts_are_those_of_the_shadow(three_days):
    around, some = chibis(), 0
    for each in three_days:
        t_ms = np.arange(each.aos.time_ms, each.los.time_ms, 250)
        t_s = np.array([seconds_of(around, int(t)) for t in t_ms])
        r, _ = around.state(t_s)
        is_dark = around.sunlit_fraction(t_s, r) < 0.5
        within = np.zeros(len(t_ms), dtype=bool)
        for first, last in each.eclipse_ms:
            within |= (t_ms >= first) & (t_ms <= last)
        assert np.count_nonzero(within != is_dark) <= len(each.eclipse_ms)
        assert all(p.sunlit != any(a <= p.time_ms <= b for a, b in each.eclipse_ms)
                   for p in each.curve[1:-1])  # fmt: skip
        some += bool(each.eclipse_ms) and not is_dark.all()
    assert some > 0


# The slow twin

#: What a satellite of low orbit, of transfer, Molniya and geosynchronous orbit may be.
ORBITS = st.one_of(
    st.tuples(st.floats(6650.0, 8500.0), st.floats(0.0, 0.01)),
    st.tuples(st.floats(12_000.0, 27_000.0), st.floats(0.0, 0.4)),
    st.tuples(st.floats(24_000.0, 30_000.0), st.floats(0.7, 0.74)),
    st.tuples(st.just(42_164.17), st.floats(0.0, 0.2)),
)
ANGLE = st.floats(0.0, 360.0)
STATIONS = st.builds(
    GroundStation,
    latitude_deg=st.one_of(st.floats(-90.0, 90.0), st.sampled_from([-90.0, 90.0])),
    longitude_deg=st.floats(-180.0, 180.0),
    altitude_m=st.floats(0.0, 4000.0),
    lowest_elevation_deg=st.floats(-2.0, 60.0),
)
HORIZONS = st.lists(st.tuples(st.floats(0.0, 359.0), st.floats(0.0, 40.0)), max_size=5).map(
    lambda pairs: tuple(sorted({round(a): (float(round(a)), e) for a, e in pairs}.values()))
)


def check_against_samples(around, station, hours):
    """Each second at which it is in sight lies in a pass; one without sight in none."""
    found = find_passes(around, {"s": station}, START_MS, START_MS + hours * HOUR_MS)
    t_s, is_seen = sampled(around, station, hours * 3600.0)
    edges = [seconds_of(around, p.time_ms) for each in found for p in (each.aos, each.los)]
    within = np.searchsorted(edges, t_s) % 2 == 1
    near_edge = np.abs(t_s[:, None] - np.array([*edges, np.inf])).min(axis=1) < 2e-3
    assert not np.any((within != is_seen) & ~near_edge)
    assert edges == sorted(edges)


@settings(max_examples=60, deadline=None)
@given(ORBITS, st.floats(0.0, 180.0), ANGLE, ANGLE, ANGLE, STATIONS)
def test_passes_are_what_a_station_sees(shape, tilt, node, perigee, anomaly, station):
    angles = {"raan_deg": node, "argument_of_perigee_deg": perigee, "mean_anomaly_deg": anomaly}
    check_against_samples(kepler(*shape, tilt, **angles), station, 12)


@settings(max_examples=40, deadline=None)
@given(ORBITS, st.floats(0.0, 180.0), ANGLE, ANGLE, STATIONS, HORIZONS)
def test_passes_are_what_is_seen_over_a_horizon(shape, tilt, node, anomaly, station, horizon):
    station = station.model_copy(update={"horizon_deg": horizon})
    around = kepler(*shape, tilt, raan_deg=node, mean_anomaly_deg=anomaly)
    check_against_samples(around, station, 6)


@pytest.mark.parametrize("short_s", [0.2, 2.0, 20.0])
def test_a_grazing_pass_is_not_missed(three_days, short_s):
    """The lowest elevation is set just below the top of each pass in turn."""
    for each in three_days[:6]:
        off_s = 0.5 * short_s
        t_s = seconds_of(chibis(), each.highest.time_ms)
        edge = np.degrees(sight.look(chibis(), TARUSA, [t_s - off_s, t_s + off_s]).elevation_rad)
        station = TARUSA.model_copy(update={"lowest_elevation_deg": float(edge.max())})
        found = find_passes(chibis(), {"s": station}, START_MS, START_MS + 2 * DAY_MS)
        (same,) = [one for one in found if abs(one.highest.time_ms - each.highest.time_ms) < 1000]
        assert same.duration_s <= short_s


def test_a_pass_at_the_edge_of_the_span_is_cut_and_says_so(three_days):
    whole = three_days[3]
    inside_ms = whole.aos.time_ms + 60_000
    (cut,) = find_passes(chibis(), {"t": TARUSA}, inside_ms, inside_ms + 30_000)
    assert (cut.rises, cut.sets) == (False, False)
    assert (cut.aos.time_ms, cut.los.time_ms) == (inside_ms, inside_ms + 30_000)
    # a top that lies in the very first or last step is found
    for first, last in ((-10_000, 1000), (-1000, 10_000)):
        top_ms = whole.highest.time_ms
        (near,) = find_passes(chibis(), {"t": TARUSA}, top_ms + first, top_ms + last)
        assert abs(near.highest.time_ms - top_ms) <= 1


def test_geosynchronous_satellites_are_always_seen_or_never():
    around = kepler(42_164.17, 0.0, 0.0)
    t_s = np.zeros(1)
    r = around.dcm_to_ecef(t_s)[0] @ around.state(t_s)[0][0]
    under = float(np.degrees(np.arctan2(r[1], r[0])))
    below = GroundStation(latitude_deg=0.0, longitude_deg=under)
    behind = GroundStation(latitude_deg=0.0, longitude_deg=under - 180.0 * np.sign(under))
    stations = {"below": below, "behind": behind, "pole": GroundStation(
        latitude_deg=90.0, longitude_deg=0.0)}  # fmt: skip
    (seen,) = find_passes(around, stations, START_MS, START_MS + 2 * DAY_MS)
    assert (seen.station, seen.rises, seen.sets) == ("below", False, False)
    assert seen.duration_s == 172_800.0
    assert seen.highest.elevation_deg > 89.0


def test_a_polar_station_sees_each_revolution_of_a_polar_orbit():
    around = kepler(7000.0, 0.0, 90.0)
    pole = GroundStation(latitude_deg=90.0, longitude_deg=0.0)
    found = find_passes(around, {"pole": pole}, START_MS, START_MS + DAY_MS)
    assert len(found) in (14, 15)
    assert min(each.highest.elevation_deg for each in found) > 89.0


# Wrong inputs


@pytest.mark.parametrize("hours", [0, -1, 24 * 101])
def test_a_span_must_be_one(hours):
    with pytest.raises(ValueError, match=r"^hours: must be above 0 and at most 2400; received"):
        find_passes(chibis(), {}, START_MS, START_MS + hours * HOUR_MS)


@pytest.mark.parametrize("time_ms", [-(2**53), 2**53, 10**30, -(10**13)])
def test_times_beyond_the_models_get_one_line(time_ms):
    with pytest.raises(ValueError, match=r"^from: must be a time from 1950 to 2150"):
        find_passes(chibis(), {"t": TARUSA}, time_ms, time_ms + HOUR_MS)


def test_elements_that_are_far_too_old_get_one_line():
    with pytest.raises(ValueError, match=r"^sgp4: no orbit at [^\n]+$"):
        find_passes(chibis(), {"t": TARUSA}, START_MS + 5000 * DAY_MS, START_MS + 5001 * DAY_MS)


def test_a_bench_has_no_passes():
    bench = OrbitEnvironment(Environment(), Bench(kind="bench", latitude_deg=1.0), START)
    with pytest.raises(ValueError, match=r"^orbit: must go around the Earth"):
        find_passes(bench, {"t": TARUSA}, START_MS, START_MS + HOUR_MS)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"latitude_deg": 91.0}, "latitude_deg"),
        ({"longitude_deg": -181.0}, "longitude_deg"),
        ({"longitude_deg": float("nan")}, "longitude_deg"),
        ({"lowest_elevation_deg": 90.0}, "lowest_elevation_deg"),
        ({"horizon_deg": ((0.0, 1.0), (0.0, 2.0))}, "must have azimuths that increase"),
        ({"horizon_deg": ((20.0, 1.0), (10.0, 2.0))}, "must have azimuths that increase"),
        ({"horizon_deg": ((360.0, 1.0),)}, "horizon_deg"),
    ],
)
def test_a_station_must_be_on_the_earth(keys, text):
    with pytest.raises(ValueError, match=text):
        GroundStation(**{"latitude_deg": 0.0, "longitude_deg": 0.0} | keys)


def test_a_horizon_is_straight_between_its_points():
    station = GroundStation(
        latitude_deg=0.0, longitude_deg=0.0, lowest_elevation_deg=2.0,
        horizon_deg=((10.0, 0.0), (20.0, 10.0), (350.0, 4.0)),
    )  # fmt: skip
    azimuths = np.radians([10.0, 15.0, 20.0, 185.0, 350.0, 0.0, 5.0, 365.0])
    expected = [2.0, 5.0, 10.0, 7.0, 4.0, 2.0, 2.0, 2.0]
    np.testing.assert_allclose(np.degrees(station.limit_rad(azimuths)), expected, atol=1e-12)
    assert np.degrees(station.least_rad) == pytest.approx(2.0)
