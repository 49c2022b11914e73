"""Elements and their yearly change: NOAA's test values, independent packages, and limits."""

from datetime import datetime

import numpy as np
import ppigrf
import pygeomag
import pytest

from torquer.environment.field import (
    Averaged,
    DirectDipole,
    Igrf14,
    TiltedDipole,
    Wmm2025,
    at_geodetic,
)
from torquer.environment.field.at_point import coefficients_name, point_field, yearly_change

#: NOAA/NCEI, test values of WMM2025 (public domain): year, km, lat, lon; X, Y, Z, H, F [nT],
#: I, D [deg]; their rates: X, Y, Z, H, F [nT/yr], I, D [deg/yr].
WMM = """
2025.0 0 80 0 6521.6 145.9 54791.5 6523.2 55178.5 83.21 1.28 -8.3 59.5 31.1 -7.0 30.1 0.01 0.52
2025.0 0 0 120 39677.8 -109.6 -10580.2 39677.9 41064.3 -14.93 -0.16 9.5 -23.1 79.4 9.6 -11.2 0.11 -0.03
2025.0 0 -80 240 6117.5 15751.9 -52022.5 16898.1 54698.2 -72.00 68.78 33.3 -8.6 95.5 4.0 -89.6 0.03 -0.12
2025.0 100 80 0 6216.0 92.4 52598.8 6216.7 52964.9 83.26 0.85 -7.7 56.5 28.7 -6.9 27.6 0.01 0.52
2025.0 100 -80 240 5907.6 14780.3 -49540.7 15917.1 52035.0 -72.19 68.21 30.6 -8.0 89.2 3.9 -83.8 0.03 -0.11
2027.5 0 80 0 6500.8 294.5 54869.4 6507.5 55253.9 83.24 2.59 -8.3 59.5 31.1 -5.6 30.3 0.01 0.53
2027.5 0 0 120 39701.6 -167.4 -10381.8 39702.0 41036.9 -14.65 -0.24 9.5 -23.1 79.4 9.6 -10.7 0.11 -0.03
"""  # noqa: E501
ORDER = ("x_nt", "y_nt", "z_nt", "h_nt", "f_nt", "i_deg", "d_deg")
#: As NOAA's own calculator (wmm-calculator 1.4.4) gives them at 80 N, 240 E, 50 km, 2025-07-01.
YEAR, PLACE = 2025.0 + 181.0 / 365.0, (80.0, 240.0, 50.0)
NOAA = {
    "x_nt": (2269.86182148, 72.30649536), "y_nt": (119.70813415, -19.26410024),
    "z_nt": (55880.30268222, -17.51451353), "h_nt": (2273.01621771, 71.19160985),
    "f_nt": (55926.51276972, -14.60660773), "d_deg": (3.01887217, -0.58090346),
    "i_deg": (87.67069122, -0.07360362),
}  # fmt: skip


@pytest.mark.parametrize("line", WMM.strip().splitlines())
def test_wmm_elements_and_rates_are_the_published_ones(line):
    year, height, lat, lon, *published = (float(word) for word in line.split())
    found = point_field(Wmm2025(), year, lat, lon, height)
    for part, values in ((found.elements, published[:7]), (found.rates, published[7:])):
        for name, value in zip(ORDER, values, strict=True):
            half_digit = 0.05 if name.endswith("_nt") else 0.005
            assert abs(getattr(part, name) - value) <= half_digit * (1.0 + 1e-9), name


def test_the_example_of_the_tutorial_is_what_noaas_calculator_gives():
    found = point_field(Wmm2025(), YEAR, *PLACE)
    for name, (value, rate) in NOAA.items():
        assert getattr(found.elements, name) == pytest.approx(value, abs=1e-8)
        assert getattr(found.rates, name) == pytest.approx(rate, abs=1e-8)


def test_igrf_and_its_rate_at_the_example_agree_with_ppigrf():
    def theirs(date):
        east, north, up = ppigrf.igrf(PLACE[1], PLACE[0], PLACE[2], date)
        return np.array([north[0], east[0], -up[0]])

    first, last = datetime(2025, 1, 1), datetime(2030, 1, 1)
    rate = (theirs(last) - theirs(first)) / 5.0
    found = point_field(Igrf14(), YEAR, *PLACE)
    assert np.array(found.rates[:3]) == pytest.approx(rate, abs=1e-3)
    # its geodetic turn is a series that ends at 1e-8 rad
    now = theirs(first) + (YEAR - 2025.0) * rate
    assert np.array(found.elements[:3]) == pytest.approx(now, abs=2e-3)


@pytest.mark.parametrize(("year", "epoch"), [(1900.0, 1900), (1962.3, 1960), (2024.99, 2020)])
def test_igrf_changes_at_the_rate_of_its_own_five_years(year, epoch):
    b = [at_geodetic(Igrf14(), y, *PLACE) for y in (epoch, epoch + 5.0)]
    assert yearly_change(Igrf14(), year, *PLACE) == pytest.approx((b[1] - b[0]) / 5.0, rel=1e-12)


def test_rate_at_an_epoch_looks_ahead_except_at_the_last():
    at, after = (yearly_change(Igrf14(), y, *PLACE) for y in (2020.0, 2021.0))
    before = yearly_change(Igrf14(), 2019.9, *PLACE)
    assert np.array_equal(at, after) and not np.allclose(at, before, rtol=1e-3, atol=0.0)
    ends = (yearly_change(Wmm2025(), y, *PLACE) for y in (2030.0, 2026.0))
    assert np.array_equal(*ends)


@pytest.mark.parametrize("model", [Igrf14(), Igrf14(degree=3), Wmm2025(), TiltedDipole()])
@pytest.mark.parametrize("geocentric", [False, True])
def test_rates_are_slopes_of_the_elements(model, geocentric):
    lat, lon = np.array([-63.0, 2.0, 47.0]), np.array([-170.0, 11.0, 300.0])
    step = 1e-3
    after, before = (
        point_field(model, 2026.5 + s, lat, lon, 400.0, geocentric).elements for s in (step, -step)
    )
    rates = point_field(model, 2026.5, lat, lon, 400.0, geocentric).rates
    for name, rate in rates._asdict().items():
        slope = (getattr(after, name) - getattr(before, name)) / (2.0 * step)
        assert rate == pytest.approx(slope, rel=1e-5, abs=1e-6), name


def test_geocentric_is_another_place():
    here, there = (
        point_field(Wmm2025(), 2026.0, 45.0, 7.0, 0.0, g).elements for g in (False, True)
    )
    b = pygeomag.GeoMag(coefficients_file="wmm/WMM_2025.COF").calculate(45.0, 7.0, 0.0, 2026.0)
    assert here.f_nt == pytest.approx(b.f, abs=1e-4)
    assert 10.0 < abs(here.f_nt - there.f_nt) < 500.0


def test_models_without_a_date_have_no_rates():
    assert point_field(DirectDipole(), 2025.0, 10.0, 20.0, 0.0).rates is None
    given = TiltedDipole(mu_e_t_km3=7.8e6, tilt_deg=168.3, longitude_deg=20.0)
    assert coefficients_name(given) is None and coefficients_name(Averaged()) is None
    assert coefficients_name(TiltedDipole(source="wmm2025")) == "wmm2025"


def test_no_direction_where_the_field_is_vertical():
    pole = point_field(DirectDipole(), 2025.0, 90.0, 0.0, 100.0).elements
    assert np.isnan(pole.d_deg)
    assert pole.i_deg == pytest.approx(90.0) and pole.f_nt > 5e4
    near = point_field(DirectDipole(), 2025.0, 89.9, 0.0, 100.0).elements
    assert near.d_deg == 0.0


def test_a_model_tied_to_an_orbit_is_refused():
    with pytest.raises(ValueError, match="averaged: must have an Earth-fixed form"):
        point_field(Averaged(), 2025.0, 0.0, 0.0, 0.0)
