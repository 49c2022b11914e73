"""The field's date goes on along a run: independent packages, epochs, the table, refusals."""

import warnings
from datetime import datetime

import numpy as np
import ppigrf
import pygeomag
import pytest

from torquer.base.time import decimal_year, decimal_years, parse_utc
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.field import DirectDipole, Igrf14, TiltedDipole, Wmm2025
from torquer.environment.field.along import fields_along
from torquer.environment.field.drift import b_inertial_along, bends_s, check_span
from torquer.environment.orbit import Circular
from torquer.environment.table import DEGREE, build, build_proven, measured_error
from torquer.maths.geometry.frames import geodetic_from_ecef

DAY = 86400.0
ORBIT = Circular(altitude_km=300.0, inclination_deg=98.0)
EVE = parse_utc("2019-12-31T21:00:00Z")
MARCH = parse_utc("2026-03-01T12:00:00Z")


def met(model, start, **keys):
    return OrbitEnvironment(Environment(field=model, **keys), ORBIT, start)


def ecef_along(environment, t):
    """Positions [n, 3] m and fields [n, 3] nT in Earth-fixed axes."""
    r, v = environment.state(t)
    dcm, b = environment.dcm_to_ecef(t), environment.field(t, r, v)
    return np.einsum("nij,nj->ni", dcm, r), 1e9 * np.einsum("nij,nj->ni", dcm, b)


def in_ecef(lat, lon, north, east, down):
    """A vector of geocentric axes (latitude, longitude [rad]) in Earth-fixed ones."""
    sp, cp, sl, cl = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    zero = np.zeros_like(sp)
    axes = np.stack(
        [[-sp * cl, -sp * sl, cp], [-sl, cl, zero], [-cp * cl, -cp * sl, -sp]]
    )  # [axis, component, n]
    return np.einsum("an,acn->nc", np.stack([north, east, down]), axes)


def by_ppigrf(r, dates):
    size, lon = np.linalg.norm(r, axis=1), np.arctan2(r[:, 1], r[:, 0])
    lat = np.arcsin(r[:, 2] / size)
    out = []
    for k, date in enumerate(dates):
        place = (1e-3 * size[k], 90.0 - np.degrees(lat[k]), np.degrees(lon[k]))
        radial, south, east = (float(np.squeeze(x)) for x in ppigrf.igrf_gc(*place, date))
        out.append((-south, east, -radial))
    return in_ecef(lat, lon, *np.array(out).T)


def same_moment(year):
    """The instant at which a package that counts days between epochs has our share of each."""
    first, last = (datetime(int(year // 5.0) * 5 + k, 1, 1) for k in (0, 5))
    return first + (last - first) * ((year - first.year) / 5.0)


def test_run_across_an_epoch_agrees_with_ppigrf_at_every_date():
    # half a year on either side of 2020-01-01, where the rates change
    start = parse_utc("2019-07-01T06:00:00Z")
    t = np.linspace(0.0, 368.0 * DAY, 17)
    environment = met(Igrf14(), start)
    r, b = ecef_along(environment, t)
    years = decimal_years(start, t)
    assert years[0] < 2019.5 < 2020.5 < years[-1]
    theirs = by_ppigrf(r, [same_moment(year) for year in years])
    # a microsecond of their date is 3e-12 nT; the sums of both are right to 1e-9
    assert np.abs(b - theirs).max() < 1e-7
    # a field that stays as it is at the start, or keeps the old rates, would be far off
    held = by_ppigrf(r, [same_moment(years[0])] * len(t))
    assert np.linalg.norm(b - held, axis=1)[-1] > 30.0
    old = by_ppigrf(r, [same_moment(2019.0)] * len(t))
    rate = by_ppigrf(r, [same_moment(2019.9)] * len(t)) - old
    straight = old + (years - 2019.0)[:, None] / 0.9 * rate
    off = np.linalg.norm(b - straight, axis=1)
    assert off[years < 2020.0].max() < 1e-6 and off[years > 2020.3].max() > 1.0


def test_wmm_along_a_run_agrees_with_pygeomag_at_every_date():
    environment, t = met(Wmm2025(), MARCH), np.linspace(0.0, 30.0 * DAY, 25)
    r, b = ecef_along(environment, t)
    lat, lon, height = geodetic_from_ecef(r)
    model = pygeomag.GeoMag(coefficients_file="wmm/WMM_2025.COF")
    places = np.stack([np.degrees(lat), np.degrees(lon), 1e-3 * height], axis=1)
    dates = decimal_years(MARCH, t)
    theirs = [model.calculate(*place, y).f for place, y in zip(places, dates, strict=True)]
    held = [model.calculate(*place, decimal_year(MARCH)).f for place in places]
    assert np.linalg.norm(b, axis=1) == pytest.approx(theirs, abs=1e-4)
    assert np.abs(np.subtract(theirs, held)).max() > 3.0


@pytest.mark.parametrize(
    "model", [Igrf14(), Igrf14(degree=5), Igrf14(degree=1), Wmm2025(degree=9), TiltedDipole()]
)
def test_each_point_has_the_field_of_its_own_date(model):
    t = np.linspace(0.0, 300.0 * DAY, 13)
    start = parse_utc("2019-07-01T06:00:00Z") if model.kind != "wmm2025" else MARCH
    environment = met(model, start)
    r, v = environment.state(t)
    dcm, b = environment.dcm_to_ecef(t), environment.field(t, r, v)
    for k, year in enumerate(decimal_years(start, t)):
        point = (x[k : k + 1] for x in (r, v, dcm))
        alone = model.b_inertial(model.prepare(year), *point)
        assert np.abs(b[k] - alone).max() < 1e-14 * np.abs(alone).max() * 10.0


def test_how_much_the_date_matters():
    environment = met(Igrf14(), MARCH)
    for days, low, high in ((10 * ORBIT.period_s / DAY, 0.1, 0.25), (30.0, 10.0, 15.0)):
        t = np.arange(max(0.0, days - 1.0) * DAY, days * DAY, 60.0)
        r, v = environment.state(t)
        held = met(Igrf14(held_at_year=decimal_year(MARCH)), MARCH).field(t, r, v)
        gone = 1e9 * np.linalg.norm(environment.field(t, r, v) - held, axis=1)
        assert low < gone.max() < high, days


def test_models_without_a_date_stay_as_they_are():
    given = TiltedDipole(mu_e_t_km3=7.8e6, tilt_deg=168.3, longitude_deg=20.0)
    t = np.array([0.0, 300.0 * DAY])
    for model in (DirectDipole(), given, Igrf14(held_at_year=2012.5)):
        environment = met(model, MARCH)
        r, v = environment.state(t)
        packed = model.prepare(2026.0)
        expected = model.b_inertial(packed, r, v, environment.dcm_to_ecef(t))
        assert np.array_equal(environment.field(t, r, v), expected)
        assert bends_s(model, MARCH, 0.0, 3000.0 * DAY).size == 0
        check_span(model, MARCH, 1e6 * DAY)
    held = Igrf14(held_at_year=2012.5).prepare(2026.0)
    assert np.array_equal(held.pairs, Igrf14().prepare(2012.5).pairs)


def test_no_instants_have_no_field():
    none = np.empty((0, 3))
    for model in (Igrf14(), DirectDipole()):
        environment = met(model, MARCH, earth_rotation="sidereal")
        assert environment.field(np.empty(0), none, none).shape == (0, 3)


def test_a_leap_second_is_no_step_in_the_field():
    start = parse_utc("2016-12-31T23:59:50Z")
    t = np.linspace(9.0, 13.0, 41)
    model, place = Igrf14(), np.tile([4e6, 3e6, 4.5e6], (t.size, 1))
    b = b_inertial_along(model, start, t, place, place, np.tile(np.eye(3), (t.size, 1, 1)))
    rates = np.diff(b, axis=0) / np.diff(t)[:, None]
    assert np.abs(rates - rates[0]).max() < 0.1 * np.abs(rates[0]).max()
    # (the rate changes by 1/365 as 2017 begins; a second of date would be a whole step)


def test_bends_are_first_of_januaries_epochs_first():
    start = parse_utc("2018-06-01T00:00:00Z")
    to_2019, to_2020, to_2021 = (214.0 * DAY, 579.0 * DAY, 945.0 * DAY)
    assert bends_s(Igrf14(), start, 0.0, 1000.0 * DAY).tolist() == [to_2020, to_2019, to_2021]
    assert bends_s(Igrf14(), start, 0.0, 200.0 * DAY).size == 0
    at_new_year = parse_utc("2020-01-01T00:00:00Z")
    assert bends_s(Igrf14(), at_new_year, 0.0, 100.0 * DAY).size == 0


@pytest.mark.parametrize("tolerance", [1e-9, 1e-11])
def test_the_tables_promise_holds_across_an_epoch(tolerance):
    environment = met(Igrf14(), EVE, table_tolerance=tolerance)
    span, bend = 6.0 * 3600.0, 3.0 * 3600.0
    proven = environment.orbit_table(span, 1.0)
    plain = met(Igrf14(), MARCH, table_tolerance=tolerance).orbit_table(span, 1.0)
    assert proven.table.segment_s == plain.table.segment_s  # the bend costs no halving
    place = (bend - proven.table.start_s) * proven.table.per_second
    assert (
        place == pytest.approx(round(place), abs=1e-9)
        and -proven.table.segment_s < proven.table.start_s < 0.0
    )
    rng = np.random.default_rng(2)
    t = np.concatenate([rng.uniform(0.0, span, 3000), bend + rng.uniform(-60.0, 60.0, 3000)])
    assert read_error(proven.table, environment.sample, t) <= proven.relative_error + 2e-13
    assert proven.relative_error <= tolerance


def read_error(table, sample, t):
    """Largest relative error of the field at the times, read in plain NumPy."""
    s = (t - table.start_s) * table.per_second
    k = np.clip(s.astype(int), 0, len(table.coefficients) - 1)
    x = 2.0 * (s - k) - 1.0
    read = sum(table.coefficients[k, p, 3:6] * x[:, None] ** p for p in range(DEGREE + 1))
    exact = sample(t)[:, 3:6]
    return float((np.linalg.norm(read - exact, axis=1) / np.linalg.norm(exact, axis=1)).max())


def bent(places):
    """A field with bends at some times, each a hundred times stronger than an epoch's."""

    def sample(t):
        slow = np.stack([2e-5 * np.cos(1e-3 * t), 3e-5 * np.sin(1e-3 * t), 0.0 * t + 1e-5])
        slow[0] += 1e-13 * sum(np.maximum(t - place, 0.0) for place in places)
        return np.hstack([np.ones((t.size, 3)), slow.T])

    return sample


def test_bend_at_a_knot_is_harmless_and_others_are_detected():
    groups, t = (slice(3, 6),), np.linspace(0.0, 6000.0, 60_001)
    one, two = bent((1234.5,)), bent((1234.5, 4321.0))
    table = build(one, 6000.0, 60.0, DEGREE, knot_s=1234.5)
    smooth = build(bent(()), 6000.0, 60.0, DEGREE)
    assert read_error(table, one, t) < 1.01 * read_error(smooth, bent(()), t)
    assert read_error(build(one, 6000.0, 60.0, DEGREE), one, t) > 5e-9
    proven = build_proven(two, 6000.0, 60.0, 1e-9, groups, bends_s=(1234.5, 4321.0))
    assert read_error(proven.table, two, t) <= proven.relative_error <= 1e-9
    # where the error of a smooth function peaks, that of a bend does not: the check would miss it
    worst = max(
        read_error(table, two, t) / (1.5 * measured_error(table, two, groups))
        for table in (
            build(two, 6000.0, h, DEGREE, knot_s=1234.5) for h in (60.0, 57.0, 55.0, 50.0)
        )
    )
    assert worst > 1.0
    for h in (60.0, 57.0, 55.0, 50.0):
        table = build(two, 6000.0, h, DEGREE, knot_s=1234.5)
        assert read_error(table, two, t) <= 1.5 * measured_error(table, two, groups, (4321.0,))


def test_a_run_must_end_within_the_models_years():
    late = parse_utc("2029-12-31T23:00:00Z")
    environment = met(Igrf14(), late)
    environment.orbit_table(3600.0, 1.0)  # ends as the model does, though its last segment does not
    line = (
        r"^environment.field: field model igrf14: date must lie within 1900.0..2030.0; received "
        r"2030.000002 at t = 3660 s$"
    )
    with pytest.raises(ValueError, match=line):
        environment.orbit_table(3660.0, 1.0)
    with pytest.raises(ValueError, match=line):
        environment.field(np.array([3660.0]), *environment.state(np.array([3660.0])))
    with pytest.raises(ValueError, match=line):
        fields_along((DirectDipole(), Igrf14()), ORBIT, late, [0.0, 3600.0, 3660.0])
    with pytest.raises(ValueError, match=r"wmm2025.* received 2024.999886$"):
        met(Wmm2025(), parse_utc("2024-12-31T23:00:00Z")).orbit_table(DAY, 1.0)
    with pytest.raises(ValueError, match=r"received inf at t = 1e\+15 s$"):
        environment.check_dates(1e15)


def test_extrapolation_is_reported_and_goes_on_in_a_straight_line():
    late = parse_utc("2029-12-31T00:00:00Z")
    environment = met(Igrf14(extrapolate=True), late)
    with pytest.warns(UserWarning, match=r"received 2030.246575 at t = 7.8624e\+06 s: extrap"):
        environment.check_dates(0.0, 91.0 * DAY)
    t = np.array([0.0, 91.0 * DAY])
    r, v = environment.state(t)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        b = environment.field(t, r, v)
        at_end = Igrf14(extrapolate=True).prepare(decimal_years(late, t)[1])
    expected = Igrf14().b_inertial(at_end, r[1:], v[1:], environment.dcm_to_ecef(t)[1:])
    assert b[1] == pytest.approx(expected[0], rel=1e-13)


def test_numbers_of_a_dipole_have_no_date_to_be_held():
    line = "held_at_year: must be left out with mu_e_t_km3, tilt_deg, longitude_deg"
    with pytest.raises(ValueError, match=line):
        TiltedDipole(mu_e_t_km3=7.8e6, tilt_deg=168.3, longitude_deg=20.0, held_at_year=2020.0)
    with pytest.raises(ValueError, match=r"date must lie within 1900.0..2030.0; received 2031.0"):
        met(Igrf14(held_at_year=2031.0), MARCH).orbit_table(100.0, 1.0)
