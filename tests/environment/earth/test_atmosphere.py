"""Density of the air: the standard's own formula written again, NRLMSIS, limits, every error."""

import itertools
import json
import math
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import get_args

import erfa
import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from own_parts import write
from pydantic import TypeAdapter

from torquer.environment.earth.atmosphere import (
    ATMOSPHERES,
    AnyAtmosphere,
    Exponential,
    Gost,
    Nrlmsis,
    gost as gost_room,
)
from torquer.environment.earth.atmosphere.air import (
    NO_AIR,
    bulge_angle_cosine,
    density,
    gost_density,
)
from torquer.environment.earth.atmosphere.exponential import TABLE
from torquer.environment.earth.atmosphere.model import heights_km
from torquer.environment.orbit.numerical import Drag
from torquer.maths.geometry.frames import ecef_from_geodetic

START = "2007-09-21T09:10:34Z"
STANDARD = json.loads(
    (Path(gost_room.FOLDER) / "gost_r_25645_166_2004.json").read_text(encoding="utf-8")
)
PLAIN = Gost(f107=150.0, ap=12.0)


def polynomial(table, group, h, column, size):
    return sum(table[group][f"{group}{i}"][column] * h**i for i in range(size))


def twin(moment, lat, lon, h, f107, f81, kp):
    """The density by the standard; h in km, lat geodetic."""
    rho, terms = twin_terms(moment, lat, lon, h, f107, f81, kp)
    return rho * (1.0 + sum(terms))


def twin_terms(moment, lat, lon, h, f107, f81, kp):
    """The standard, line by line, with angles and calendar of its own: rho K0, (K1, K2, K3, K4)."""
    column = min(range(7), key=lambda c: abs(STANDARD["columns_F0"][c] - f81))
    f0 = STANDARD["columns_F0"][column]

    def table(group):
        high = STANDARD["table_high"]
        return high if h > high[group]["h_limit"][column] else STANDARD["table_low"]

    rho = STANDARD["rho_0"] * math.exp(polynomial(table("a"), "a", h, column, 7))
    k0 = 1.0 + polynomial(table("l"), "l", h, column, 5) * (f81 - f0) / f0
    # Sun by the almanac's low-precision formulas, sidereal time of midnight by GMST 1982
    days = (moment - datetime(2000, 1, 1, 12, tzinfo=UTC)) / timedelta(days=1)
    anomaly = math.radians(357.528 + 0.9856003 * days)
    ecliptic = math.radians(
        280.460 + 0.9856474 * days + 1.915 * math.sin(anomaly) + 0.020 * math.sin(2 * anomaly)
    )
    obliquity = math.radians(23.439 - 4e-7 * days)
    alpha = math.atan2(math.cos(obliquity) * math.sin(ecliptic), math.cos(ecliptic))
    delta = math.asin(math.sin(obliquity) * math.sin(ecliptic))
    midnight = moment.replace(hour=0, minute=0, second=0, microsecond=0)
    sidereal = erfa.gmst82(2451545.0, (midnight - datetime(2000, 1, 1, 12, tzinfo=UTC)).days + 0.5)
    t = (moment - midnight).total_seconds()
    beta = alpha - sidereal - STANDARD["omega_earth_rad_s"] * t
    beta += table("c")["phi1"][column]
    x, y, z = ecef_from_geodetic(lat, lon, 1e3 * h)
    across = x * math.cos(beta) + y * math.sin(beta)
    phi = math.acos((z * math.sin(delta) + math.cos(delta) * across) / math.hypot(x, y, z))
    n = polynomial(table("c"), "n", h, column, 3)
    k1 = polynomial(table("c"), "c", h, column, 5) * math.cos(phi / 2.0) ** n
    d = moment.timetuple().tm_yday
    annual = sum(a * d**i for i, a in enumerate(STANDARD["A_day_of_year"]))
    k2 = polynomial(table("d"), "d", h, column, 5) * annual
    k3 = polynomial(table("b"), "b", h, column, 5) * (f107 - f81) / (f81 + abs(f107 - f81))
    e = [table("e")["e"][f"e{5 + i}"][column] * kp**i for i in range(4)]
    k4 = polynomial(table("e"), "e", h, column, 5) * sum(e)
    return rho * k0, (k1, k2, k3, k4)


def heights_of_change(f81):
    """Heights [km] at which the standard goes from one polynomial to another, with a jump."""
    column = min(range(7), key=lambda c: abs(STANDARD["columns_F0"][c] - f81))
    return [STANDARD["table_high"][group]["h_limit"][column] for group in "alcdbe"]


@given(
    h=st.floats(120.001, 1499.999),
    lat=st.floats(-1.57, 1.57),
    lon=st.floats(-3.14, 3.14),
    hours=st.floats(0.0, 24.0 * 365.0 * 4),
    f107=st.floats(60.0, 300.0),
    f81=st.floats(60.0, 300.0),
    kp=st.floats(0.0, 9.0),
)
@settings(max_examples=100, deadline=None)
def test_gost_equals_the_standard_line_by_line(h, lat, lon, hours, f107, f81, kp):
    moment = datetime(2024, 6, 1, tzinfo=UTC) + timedelta(hours=hours)
    model = Gost(f107=f107, f81=f81, kp=kp)
    assume(min(abs(h - change) for change in heights_of_change(f81)) > 1e-6)
    found = model.density([0.0], moment, ecef_from_geodetic(lat, lon, 1e3 * h))[0]
    rho, terms = twin_terms(moment, lat, lon, h, f107, f81, kp)
    # the two Suns differ by up to 0.01 deg; the terms may cancel, even below zero
    away = 3e-4 * rho * (1.0 + sum(map(abs, terms)))
    assert found == pytest.approx(rho * (1.0 + sum(terms)), rel=0.0, abs=away)


def test_times_move_the_sun_and_the_day():
    times = np.linspace(0.0, 9e6, 50)
    place = ecef_from_geodetic(0.3, 1.0, 400e3)
    found = PLAIN.density(times, START, np.tile(place, (50, 1)))
    start = datetime(2007, 9, 21, 9, 10, 34, tzinfo=UTC)
    moments = [start + timedelta(seconds=t) for t in times]
    expected = [twin(m, 0.3, 1.0, 400.0, 150.0, 150.0, 8 / 3) for m in moments]
    assert found == pytest.approx(expected, rel=1e-3, abs=0.0)


@pytest.mark.parametrize(
    ("f81", "above"), [(75, 0.021), (100, 0.022), (150, 0.034), (200, 0.043), (250, 0.056)]
)
def test_night_density_begins_at_the_standards_120_km_and_falls(f81, above):
    """The fitted polynomials start 2 to 6 per cent above the rho_0 they are multiplied with."""
    gost = Gost(f107=f81, kp=0.0).pack().gost
    polynomials = gost.polynomials.copy()
    polynomials[:, 3:] = 0.0  # no season, no storms; the antapex has no bulge
    night = gost._replace(polynomials=polynomials)
    assert gost_density(night, 120.0, -1.0, 1) / 1.58868e-8 - 1 == pytest.approx(above, abs=6e-4)
    profile = [gost_density(night, h, -1.0, 1) for h in np.arange(120.0, 1500.0, 10.0)]
    assert np.all(np.diff(np.log(profile)) < 0.0)


@pytest.mark.parametrize(("column", "f81"), list(enumerate(STANDARD["columns_F0"])))
def test_lower_range_holds_where_two_height_ranges_meet(column, f81):
    gost = Gost(f107=f81, kp=0.0).pack().gost
    polynomials = gost.polynomials.copy()
    polynomials[:, 3:] = 0.0  # no season, no storms; the antapex has no bulge
    night = gost._replace(polynomials=polynomials)
    logarithm = polynomial(STANDARD["table_low"], "a", 500.0, column, 7)
    expected = STANDARD["rho_0"] * math.exp(logarithm)
    assert gost_density(night, 500.0, -1.0, 1) == pytest.approx(expected, rel=1e-9, abs=0.0)


def steps_at_changes(more_flux, day, is_plain):
    """Relative steps of the night density where polynomials meet, of all indices."""
    found = []
    for f81 in STANDARD["columns_F0"]:
        gost = Gost(f107=f81 + more_flux, f81=f81, kp=0.0).pack().gost
        polynomials = gost.polynomials.copy()
        polynomials[:, 3:] *= 0.0 if is_plain else 1.0
        gost = gost._replace(polynomials=polynomials)
        for h in gost.above_km[gost.above_km < 1500.0]:
            below, above = (gost_density(gost, h + d, -1.0, day) for d in (-1e-9, 1e-9))
            found.append(abs(above / below - 1.0))
    return found


def test_steps_where_the_tables_meet_are_as_large_as_the_errata_say():
    """2.2 % of the night density; 2.6 % with the season and a flux 20 above its mean."""
    assert max(steps_at_changes(0.0, 1, True)) == pytest.approx(0.022, abs=5e-4)
    most = max(max(steps_at_changes(20.0, day, False)) for day in range(1, 366, 20))
    assert most == pytest.approx(0.026, abs=5e-4)


@pytest.mark.parametrize(
    ("days", "most"), [(range(1, 366), 0.018), ([0], 0.048)], ids=["in the year", "at its turn"]
)
def test_steps_at_midnight_are_as_large_as_the_errata_say(days, most):
    """The number of the day is an integer, and falls from 365 to 1."""
    found = []
    heights = 1e3 * np.arange(120.0, 1500.0, 20.0)
    places = np.array([ecef_from_geodetic(0.0, 0.0, h) for h in heights])
    for flux, day in itertools.product((100.0, 125.0, 150.0), days):
        midnight = datetime(2024, 1, 1, tzinfo=UTC) + timedelta(days=day)
        before = midnight - timedelta(seconds=0.1)
        model = Gost(f107=flux, ap=12.0)
        one, other = (model.density(np.zeros(len(heights)), t, places) for t in (before, midnight))
        found.append(np.abs(other / one - 1.0).max())
    assert max(found) == pytest.approx(most, abs=5e-4)


@pytest.mark.parametrize("f81", [75, 100, 125, 150, 175, 200, 250])
def test_the_two_tables_meet_within_some_per_cent(f81):
    """A mistyped coefficient would tear them apart."""
    gost = Gost(f107=f81 + 20.0, f81=f81, kp=3.0).pack().gost
    for h in gost.above_km[gost.above_km < 1500.0]:
        below, above = (gost_density(gost, h + d, 0.3, 100) for d in (-1e-9, 1e-9))
        assert above / below == pytest.approx(1.0, abs=0.025)


def test_the_densest_place_lies_behind_the_sun():
    lag, sun = 0.55, (0.8, 0.0, 0.6)
    apex = (0.8 * math.cos(lag), 0.8 * math.sin(lag), 0.6)
    assert bulge_angle_cosine(lag, apex, sun) == pytest.approx(1.0, abs=1e-15)
    assert bulge_angle_cosine(lag, tuple(-7e6 * v for v in apex), sun) == pytest.approx(-1.0)


def test_more_activity_gives_more_air():
    place = ecef_from_geodetic(0.3, 1.0, 600e3)
    by_flux = [Gost(f107=f, kp=2.0).density([0], START, place)[0] for f in range(75, 251, 25)]
    by_storm = [Gost(f107=150, kp=k).density([0], START, place)[0] for k in range(10)]
    assert np.all(np.diff(by_flux) > 0.0)
    assert np.all(np.diff(by_storm) > 0.0)
    three_hours = Gost(f107=150, kp_3h=5.0).density([0], START, place)[0]
    assert three_hours == pytest.approx(by_storm[5], rel=0.05, abs=0.0)
    assert three_hours != by_storm[5]


def test_kp_of_ap_is_the_standards_table():
    assert gost_room.kp_from_ap(12.0) == pytest.approx(8 / 3)
    assert gost_room.kp_from_ap(0.0) == 0.0
    assert gost_room.kp_from_ap(400.0) == 9.0
    assert gost_room.kp_from_ap(13.5) == pytest.approx(17 / 6)
    assert Gost(f107=150, ap=12.0).pack().gost.storm == pytest.approx(
        Gost(f107=150, kp=8 / 3).pack().gost.storm
    )


def test_f81_weighs_today_twice_as_much_as_the_first_day():
    assert gost_room.mean_f107(np.full(81, 140.0)) == pytest.approx(140.0)
    first, today = np.eye(81)[0], np.eye(81)[-1]
    assert gost_room.mean_f107(today) == pytest.approx(2.0 * gost_room.mean_f107(first))
    assert gost_room.mean_f107(today) == pytest.approx(1.0 / (81 - 0.5 * 81 * 40 / 80.0))


def test_nrlmsis_and_gost_agree_as_far_as_such_models_do():
    pytest.importorskip("pymsis")
    rng = np.random.default_rng(5)
    lat, lon = np.arcsin(rng.uniform(-1, 1, 300)), rng.uniform(-math.pi, math.pi, 300)
    r = ecef_from_geodetic(lat, lon, rng.uniform(200e3, 700e3, 300))
    times = np.linspace(0.0, 5 * 86400.0, 300)
    ours = PLAIN.density(times, START, r)
    theirs = Nrlmsis(f107=150.0, ap=12.0).density(times, START, r)
    ratio = np.log(ours / theirs)
    assert abs(np.median(ratio)) < 0.2
    assert np.std(ratio) < 0.2
    assert np.corrcoef(np.log(ours), np.log(theirs))[0, 1] > 0.995


def test_nrlmsis_hands_over_place_and_indices():
    pymsis = pytest.importorskip("pymsis")
    r = ecef_from_geodetic(math.radians(40.0), math.radians(-75.0), 400e3)
    for version, number in (("00", 0), ("2.1", 2.1)):
        found = Nrlmsis(f107=180, f81=170, ap=20, version=version).density([3600.0], START, r)
        out = pymsis.calculate(
            np.datetime64("2007-09-21T10:10:34"), -75, 40, 400, 180, 170, [[20] * 7], version=number
        )
        assert found[0] == pytest.approx(float(out.ravel()[0]), rel=1e-6, abs=0.0)


def test_without_the_package_nrlmsis_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymsis", None)
    message = r'must have the package pymsis \(pip install "torquer\[nrlmsis\]"\)'
    with pytest.raises(ValueError, match=message):
        Nrlmsis(f107=150, ap=12).density([0.0], START, ecef_from_geodetic(0, 0, 400e3))


def test_exponential_meets_its_table_and_has_no_jump():
    heights, rho = np.array(TABLE).T
    place = np.array([ecef_from_geodetic(0.4, 0.1, 1e3 * h + 1e-3) for h in heights])
    below = np.array([ecef_from_geodetic(0.4, 0.1, 1e3 * h - 1e-3) for h in heights[1:]])
    model = Exponential()
    assert model.density(np.zeros(len(rho)), START, place) == pytest.approx(rho, rel=1e-6, abs=0.0)
    assert model.density(np.zeros(len(rho) - 1), START, below) == pytest.approx(
        rho[1:], rel=1e-6, abs=0.0
    )
    # above the table it falls on by the last scale height
    high = ecef_from_geodetic(0.4, 0.1, 1268e3)
    assert model.density([0], START, high)[0] == pytest.approx(
        3.019e-15 / math.e, rel=1e-6, abs=0.0
    )


def test_exponential_of_ones_own():
    model = Exponential(density_kg_m3=1e-12, at_height_km=500.0, scale_height_km=60.0)
    r = ecef_from_geodetic([0.1, 0.1, 0.1], 0.0, np.array([440e3, 500e3, 560e3]))
    expected = 1e-12 * np.exp([1.0, 0.0, -1.0])
    assert model.density(0.0, START, r) == pytest.approx(expected, rel=1e-9, abs=0.0)


@given(st.floats(-1.5707, 1.5707), st.floats(-3.0, 3.0), st.floats(0.0, 3e6))
@settings(max_examples=60, deadline=None)
def test_heights_are_geodetic(lat, lon, height):
    assert heights_km(ecef_from_geodetic(lat, lon, height))[0] * 1e3 == pytest.approx(
        height, abs=1e-3
    )


def test_height_over_the_pole():
    assert heights_km([0.0, 0.0, -6756752.3142])[0] == pytest.approx(400.0, abs=1e-6)


def test_no_air_has_no_density():
    assert density(NO_AIR, (7e6, 0.0, 0.0), (1.0, 0.0, 0.0), 1) == 0.0


def test_outside_its_heights_a_kernel_gives_no_number():
    for h in (119.9, 1500.1):
        r = tuple(ecef_from_geodetic(0.0, 0.0, 1e3 * h))
        assert math.isnan(density(PLAIN.pack(), r, (1.0, 0.0, 0.0), 1))


@pytest.mark.parametrize(
    ("height_km", "message"),
    [
        (100.0, "atmosphere gost: height must lie within 120..1500 km; received 100 km at t = 7 s"),
        (1600.0, "atmosphere gost: height must lie within 120..1500 km; received 1600 km"),
    ],
)
def test_heights_outside_are_an_error(height_km, message):
    r = ecef_from_geodetic(0.2, 0.1, np.array([400e3, 1e3 * height_km]))
    with pytest.raises(ValueError, match=message):
        PLAIN.density([0.0, 7.0], START, r)


def test_positions_must_be_rows_of_three():
    with pytest.raises(ValueError, match=r"r_ecef_m: must have shape \[n, 3\]; received \[1, 2\]"):
        PLAIN.density([0.0], START, [7e6, 0.0])
    with pytest.raises(ValueError, match="r_ecef_m: must be finite"):
        PLAIN.density([0.0], START, [7e6, math.nan, 0.0])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"kind": "gost", "f107": 150}, "must have one of kp, ap and kp_3h; received none of them"),
        ({"kind": "gost", "f107": 150, "kp": 2, "ap": 9}, "kp_3h; received kp, ap"),
        ({"kind": "gost", "f107": 400, "kp": 2}, "f107: must lie within 60..300 where f81 is left"),
        ({"kind": "gost", "f107": 150, "kp": 9.1}, "kp"),
        ({"kind": "gost", "f107": 20, "kp": 2}, "f107"),
        ({"kind": "gost", "f107": 150, "f81": 320, "kp": 2}, "f81"),
        ({"kind": "nrlmsis", "f107": 150}, "ap"),
        (
            {"kind": "exponential", "density_kg_m3": 1e-12},
            "must have all or none of density_kg_m3, at_height_km, scale_height_km; "
            "received density_kg_m3",
        ),
        ({"kind": "jacchia"}, "jacchia"),
    ],
)
def test_wrong_models_are_errors(data, message):
    with pytest.raises(ValueError, match=message):
        TypeAdapter(AnyAtmosphere).validate_python(data)


def test_nrlmsis_cannot_be_packed():
    with pytest.raises(ValueError, match="must be one that compiles"):
        Nrlmsis(f107=150, ap=12).pack()


def test_registry_names_its_kinds():
    for kind, spec in ATMOSPHERES.items():
        assert get_args(spec.model_fields["kind"].annotation) == (kind,)


def test_no_users_function_is_called_where_an_orbit_is_integrated(tmp_path):
    keys = {"kind": "user", "file": write(tmp_path), "function": "air"}
    with pytest.raises(
        ValueError,
        match=r"^atmosphere: must be one that compiles .* received a user's function",
    ):  # the table's key is put before it
        Drag(area_m2=0.1, mass_kg=4.0, drag_coefficient=2.2, atmosphere=keys)
