"""Two-body orbits: Kepler's equation, invariants, element geometry, errors."""

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.environment.orbit import ORBITS, Circular, Kepler, kepler

ECCENTRIC = {
    "semi_major_axis_km": 26600.0,
    "eccentricity": 0.72,
    "inclination_deg": 63.4,
    "raan_deg": 40.0,
    "argument_of_perigee_deg": 270.0,
    "mean_anomaly_deg": 12.0,
}
TIMES = np.linspace(-5e4, 9e4, 301)


@settings(max_examples=100, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(0.0, 1.0, exclude_max=True))
def test_keplers_equation_has_no_residual(mean, e):
    anomaly = kepler.eccentric_anomaly(mean, e)
    assert abs(anomaly - e * math.sin(anomaly) - mean) < 1e-14
    assert math.copysign(1.0, anomaly) == math.copysign(1.0, mean) or mean == 0.0


@settings(max_examples=100, deadline=None)
@given(st.floats(-16.0, 0.0), st.floats(-16.0, 0.0))
def test_keplers_equation_near_a_parabola(log_mean, log_gap):
    mean, e = math.pi * 10.0**log_mean, 1.0 - 10.0**log_gap
    anomaly = kepler.eccentric_anomaly(mean, min(e, 1.0 - 2.0**-53))
    assert abs(anomaly - e * math.sin(anomaly) - mean) < 1e-14


def test_keplers_equation_over_many_revolutions():
    for mean in np.linspace(-300.0, 300.0, 101):
        anomaly = kepler.eccentric_anomaly(mean, 0.3)
        assert abs(anomaly - 0.3 * math.sin(anomaly) - mean) < 3e-13


@settings(max_examples=50, deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(0.0, 0.95))
def test_true_anomaly_comes_back_from_the_state(true, e):
    mean = kepler.mean_from_true(true, e)
    r, _ = kepler.perifocal_state(mean, 1.0, e, 1.0)
    assert math.atan2(r[1], r[0]) == pytest.approx(true, abs=1e-12)
    distance = (1 - e * e) / (1 + e * math.cos(true))
    assert math.hypot(r[0], r[1]) == pytest.approx(distance, rel=1e-12)


def invariants(r, v):
    distance = np.linalg.norm(r, axis=1)
    h = np.cross(r, v)
    energy = np.sum(v * v, axis=1) / 2.0 - MU_EARTH_M3_S2 / distance
    laplace = np.cross(v, h) / MU_EARTH_M3_S2 - r / distance[:, None]
    return energy, h, laplace


def test_energy_momentum_and_laplace_vector_are_constant():
    orbit = Kepler(**ECCENTRIC)
    energy, h, laplace = invariants(*orbit.state(TIMES))
    assert np.allclose(energy, -MU_EARTH_M3_S2 / (2 * 26.6e6), rtol=1e-13)
    i, node = math.radians(63.4), math.radians(40.0)
    normal = (math.sin(i) * math.sin(node), -math.sin(i) * math.cos(node), math.cos(i))
    size = math.sqrt(MU_EARTH_M3_S2 * 26.6e6 * (1 - 0.72**2))
    assert np.abs(h / size - normal).max() < 1e-13
    # perigee at 270 deg of argument: the lowest point in latitude
    assert np.allclose(np.linalg.norm(laplace, axis=1), 0.72, rtol=1e-12)
    assert np.allclose(laplace[:, 2], -0.72 * math.sin(i), rtol=1e-12)


@pytest.mark.parametrize(
    "orbit",
    (Kepler(**ECCENTRIC), Circular(altitude_km=500.0, inclination_deg=98.0, raan_deg=10.0)),
)
def test_velocity_is_the_derivative_of_position(orbit):
    step = 0.5
    before, after = (orbit.state(TIMES + s)[0] for s in (-step, step))
    v = orbit.state(TIMES)[1]
    assert np.abs((after - before) / (2 * step) - v).max() < 5e-4
    half = (orbit.state(TIMES + step / 2)[0] - orbit.state(TIMES - step / 2)[0]) / step
    better = (4 * half - (after - before) / (2 * step)) / 3
    assert np.abs(better - v).max() < 1e-6


def test_state_equals_numerical_integration():
    orbit = Kepler(**ECCENTRIC)
    t = np.linspace(0.0, orbit.period_s, 21)
    r, v = orbit.state(t)

    def slope(_, y):
        return np.concatenate([y[3:], -MU_EARTH_M3_S2 * y[:3] / np.linalg.norm(y[:3]) ** 3])

    start = np.concatenate([r[0], v[0]])
    found = solve_ivp(slope, (0, t[-1]), start, "DOP853", t, rtol=1e-13, atol=1e-6).y
    assert np.abs(found[:3].T - r).max() < 0.1
    assert np.abs(r[-1] - r[0]).max() < 1e-5


def test_altitudes_are_the_same_orbit_as_elements():
    by_altitudes = Kepler(
        perigee_altitude_km=600.0, apogee_altitude_km=2000.0, inclination_deg=30.0
    )
    r, _ = by_altitudes.state([0.0, by_altitudes.period_s / 2])
    assert np.allclose(np.linalg.norm(r, axis=1) - 6378137.0, (6e5, 2e6), rtol=0, atol=1e-6)
    axis, e = by_altitudes.shape
    same = Kepler(semi_major_axis_km=axis / 1e3, eccentricity=e, inclination_deg=30.0)
    assert np.allclose(same.state(TIMES)[0], by_altitudes.state(TIMES)[0], rtol=0, atol=1e-6)


def test_true_anomaly_at_the_start():
    orbit = Kepler(
        perigee_altitude_km=600.0, apogee_altitude_km=2000.0, inclination_deg=0.0,
        true_anomaly_deg=70.0, argument_of_perigee_deg=20.0, raan_deg=10.0,
    )  # fmt: skip
    r, _ = orbit.state([0.0])
    assert math.degrees(math.atan2(r[0, 1], r[0, 0])) == pytest.approx(100.0, abs=1e-11)


def test_circular_orbit_is_uniform_in_the_plane():
    orbit = Circular(
        radius_km=6730.0, inclination_deg=62.0, raan_deg=90.0, argument_of_latitude_deg=30.0
    )
    r, v = orbit.state(TIMES)
    rate = math.sqrt(MU_EARTH_M3_S2 / 6.73e6**3)
    assert orbit.rate_rad_s() == pytest.approx(rate, rel=1e-15)
    assert orbit.period_s == pytest.approx(2 * math.pi / rate, rel=1e-15)
    assert np.allclose(np.linalg.norm(r, axis=1), 6.73e6, rtol=1e-14)
    assert np.allclose(np.linalg.norm(v, axis=1), 6.73e6 * rate, rtol=1e-14)
    u, i = math.radians(30.0) + rate * TIMES, math.radians(62.0)
    expected = np.stack([-np.sin(u) * math.cos(i), np.cos(u), np.sin(u) * math.sin(i)], axis=1)
    assert np.abs(r / 6.73e6 - expected).max() < 1e-12


def test_altitude_counts_from_the_equatorial_radius():
    by_altitude = Circular(altitude_km=500.0, inclination_deg=51.6)
    by_radius = Circular(radius_km=6878.137, inclination_deg=51.6)
    assert np.allclose(by_altitude.state(TIMES)[0], by_radius.state(TIMES)[0], rtol=0, atol=1e-6)


def test_orbits_reach_as_far_as_the_earth_holds_them():
    far = Circular(radius_km=1.5e6, inclination_deg=0.0)
    assert far.period_s == pytest.approx(211.6 * 86400.0, rel=1e-3)
    long = Kepler(semi_major_axis_km=1e6, eccentricity=0.499, inclination_deg=0.0)
    assert long.period_s == pytest.approx(far.period_s / 1.5**1.5)


def test_registry_names_each_kind():
    assert set(ORBITS) == {
        "circular", "kepler", "sgp4", "numerical", "bench", "drifting", "file", "user",
    }  # fmt: skip
    for kind, spec in ORBITS.items():
        assert get_args(spec.model_fields["kind"].annotation) == (kind,)
    assert Kepler(**ECCENTRIC).frame == "J"
    assert Circular(altitude_km=500.0, inclination_deg=0.0).frame == "J"


@pytest.mark.parametrize(
    ("spec", "keys", "message"),
    (
        (Circular, {}, "must have altitude_km or radius_km; received none of them"),
        (Circular, {"altitude_km": 5.0, "radius_km": 7e3}, "or radius_km; received both"),
        (Circular, {"altitude_km": -1.0}, "greater than 0"),
        (Circular, {"radius_km": 6000.0}, "greater than 6378.137"),
        (Circular, {"altitude_km": 500.0, "inclination_deg": 181.0}, "less than or equal to 180"),
        (Circular, {"altitude_km": float("nan")}, "finite"),
        (Circular, {"altitude_km": 1e30}, "less than or equal to 1500000"),
        (Circular, {"radius_km": 1e308}, "less than or equal to 1500000"),
        (
            Kepler,
            {"semi_major_axis_km": 1e6, "eccentricity": 0.6},
            "orbit: must stay within 1500000 km of the Earth's centre, its Hill sphere; received "
            r"one that goes out to 1.6e\+06 km",
        ),
        (Kepler, {"semi_major_axis_km": 1e300, "eccentricity": 0.5}, r"goes out to 1.5e\+300 km"),
        (
            Kepler,
            {"perigee_altitude_km": 500.0, "apogee_altitude_km": 1e30},
            r"goes out to 1e\+30 km",
        ),
        (Kepler, {}, "perigee_altitude_km and apogee_altitude_km; received none of them"),
        (Kepler, {"semi_major_axis_km": 7e3}, "received semi_major_axis_km"),
        (
            Kepler,
            {"semi_major_axis_km": 7e3, "eccentricity": 0.0, "perigee_altitude_km": 5e2},
            "received semi_major_axis_km, eccentricity, perigee_altitude_km",
        ),
        (Kepler, {"semi_major_axis_km": 7e3, "eccentricity": 1.0}, "less than 1"),
        (
            Kepler,
            {"semi_major_axis_km": 7e3, "eccentricity": 0.1},
            "perigee must lie above .* received a perigee altitude of -78.137 km",
        ),
        (Kepler, {"perigee_altitude_km": -2.0, "apogee_altitude_km": 9.0}, "altitude of -2 km"),
        (
            Kepler,
            {"perigee_altitude_km": 900.0, "apogee_altitude_km": 500.0},
            "apogee_altitude_km: must not be below .* 900 km; received 500",
        ),
        (
            Kepler,
            {**ECCENTRIC, "true_anomaly_deg": 1.0},
            "must have mean_anomaly_deg or true_anomaly_deg; received both",
        ),
    ),
)
def test_errors_name_the_key_and_the_value(spec, keys, message):
    with pytest.raises(ValueError, match=message):
        spec(**{"inclination_deg": 50.0, **keys})
