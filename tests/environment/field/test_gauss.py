"""IGRF-14 and WMM2025 against independent packages, NOAA's test values and Maxwell's equations."""

import itertools
from datetime import datetime

import numpy as np
import ppigrf
import pygeomag
import pytest

from torquer.base.conventions import FIELD_RADIUS_M
from torquer.compile.when_compiling import plainly
from torquer.environment.earth.harmonics import gradient
from torquer.environment.earth.harmonics_many import LANES, gradient_many
from torquer.environment.field import (
    Gauss,
    Igrf14,
    TiltedDipole,
    Wmm2025,
    at_geodetic,
    coefficients as tables,
)
from torquer.maths.geometry.frames import dcm_ecef_to_ned

RNG = np.random.default_rng(14)
#: At epochs, between them, in leap years, at both ends.
DATES = [1900.0, 1903.7, 1944.5, 1996.25, 1999.99, 2000.0, 2012.123, 2020.0, 2024.5, 2027.9, 2030.0]


def interpreted(kernel):
    """The plain Python behind a kernel (the kernel itself where compilation is off)."""
    return getattr(kernel, "py_func", kernel)


def sphere(n, low=FIELD_RADIUS_M, high=FIELD_RADIUS_M + 2e6):
    """n points spread over directions and heights [m]."""
    directions = RNG.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return directions * RNG.uniform(low, high, (n, 1))


def same_moment(decimal_year):
    """The instant at which a package that counts days between epochs has our share of each."""
    k = min(int((decimal_year - 1900.0) // 5.0), 25)
    first, last = datetime(1900 + 5 * k, 1, 1), datetime(1905 + 5 * k, 1, 1)
    return first + (last - first) * ((decimal_year - first.year) / 5.0)


def places(n=200):
    """Latitude, longitude [deg], height [km] of n places."""
    lat, lon = RNG.uniform(-89.9, 89.9, n), RNG.uniform(-180.0, 360.0, n)
    return lat, lon, RNG.uniform(0.0, 2000.0, n)


@pytest.mark.parametrize("decimal_year", DATES)
def test_igrf_agrees_with_ppigrf(decimal_year):
    lat, lon, height = places()
    date = same_moment(decimal_year)
    radial, south, east = ppigrf.igrf_gc(6371.2 + height, 90.0 - lat, lon, date)
    theirs = np.stack([-south[0], east[0], -radial[0]], axis=-1)
    ours = 1e9 * at_geodetic(Igrf14(), decimal_year, lat, lon, height, geocentric=True)
    assert np.abs(ours - theirs).max() < 1e-7
    # its geodetic turn is a series that ends at 1e-8 rad
    east, north, up = ppigrf.igrf(lon, lat, height, date)
    ours = 1e9 * at_geodetic(Igrf14(), decimal_year, lat, lon, height)
    assert np.abs(ours - np.stack([north[0], east[0], -up[0]], axis=-1)).max() < 1e-3


@pytest.mark.parametrize("decimal_year", DATES)
def test_igrf_agrees_with_chaosmagpy_at_geocentric_places(decimal_year):
    chaosmagpy = pytest.importorskip("chaosmagpy")
    model = chaosmagpy.chaos.BaseModel.from_shc(tables.FOLDER / "IGRF14.shc", leap_year=False)
    lat, lon, height = places()
    days = (decimal_year - 2000.0) * 365.25
    # the spline ends exactly at its last epoch, where rounding must not carry it outside
    days = np.clip(days, model.breaks[0], model.breaks[-1])
    radial, south, east = model.synth_values(days, 6371.2 + height, 90.0 - lat, lon)
    ours = 1e9 * at_geodetic(Igrf14(), decimal_year, lat, lon, height, geocentric=True)
    assert np.abs(ours - np.stack([-south, east, -radial], axis=-1)).max() < 1e-7


def by_pygeomag(year, lat, lon, height):
    """North, east, down [nT] of WMM2025 by pygeomag."""
    other = pygeomag.GeoMag(coefficients_file="wmm/WMM_2025.COF")
    b = other.calculate(glat=lat, glon=lon, alt=height, time=year)
    return np.array([b.x, b.y, b.z])


def test_wmm_agrees_with_pygeomag():
    for lat, lon, height in np.array(places(100)).T:
        year = RNG.uniform(2025.0, 2030.0)
        ours = 1e9 * at_geodetic(Wmm2025(), year, lat, lon, height)
        assert np.abs(ours - by_pygeomag(year, lat, lon, height)).max() < 1e-5


# NOAA/NCEI, test values of WMM2025 (public domain): year, km, lat, lon, X, Y, Z [nT].
WMM_FINE = """
2025.0 28 89 -121 -255.388723 -1482.460628 56194.288771
2025.0 65 43 93 24299.852822 210.517066 50037.923998
2025.0 51 -33 109 21737.778822 -2090.274098 -52710.003920
2025.0 48 80 -96 1875.982280 -1079.269389 55623.044051
2025.0 54 82 87 1324.336929 1883.428620 56740.772059
2025.0 18 0 21 29274.811882 659.800118 -14316.722540
2025.5 6 -36 -137 23781.930678 8786.698927 -32577.518648
2025.5 8 -66 17 15201.438652 -9925.501123 -30881.123197
2026.0 74 -57 3 13268.119649 -5498.179626 -23576.062921
2026.0 62 -14 99 33437.828630 -835.919473 -33100.922253
2026.5 14 0 80 39431.415992 -2133.456168 -12188.838466
2027.0 37 -66 -5 16390.771268 -5079.626554 -28608.243575
2027.5 73 -72 95 -2912.418045 -12984.118939 -55399.217725
"""
WMM_COARSE = """
2025.0 0 80 0 6521.6 145.9 54791.5
2025.0 0 0 120 39677.8 -109.6 -10580.2
2025.0 0 -80 240 6117.5 15751.9 -52022.5
2025.0 100 80 0 6216.0 92.4 52598.8
2025.0 100 0 120 37688.6 -96.2 -10152.1
2025.0 100 -80 240 5907.6 14780.3 -49540.7
2027.5 0 80 0 6500.8 294.5 54869.4
2027.5 0 0 120 39701.6 -167.4 -10381.8
2027.5 0 -80 240 6200.7 15730.3 -51783.7
2027.5 100 80 0 6196.7 233.8 52670.5
2027.5 100 0 120 37711.5 -148.7 -9969.8
2027.5 100 -80 240 5984.0 14760.1 -49317.7
"""


def published_rows(table):
    """(year, lat, lon, height), B of our model and B as published, both in nT."""
    for line in table.split("\n")[1:-1]:
        year, height, lat, lon, *published = (float(word) for word in line.split())
        b = 1e9 * at_geodetic(Wmm2025(), year, lat, lon, height)
        yield (year, lat, lon, height), b, np.array(published)


def test_wmm_gives_the_published_test_values():
    for place, b, published in published_rows(WMM_COARSE):
        assert np.abs(b - published).max() <= 0.05 * (1.0 + 1e-9), place


def test_wmm_gives_the_published_fine_values():
    """East to the last digit; north as far as the published values themselves are right.

    Their north component (and, turned by the ellipsoid's slope, down) is off by up to
    4.5e-4 nT away from the equator; pygeomag and this package agree there to 2e-6 nT.
    """
    for place, b, published in published_rows(WMM_FINE):
        north, east, down = np.abs(b - published)
        assert east <= 0.5e-6 * (1.0 + 1e-3), place
        assert north < 5e-4 and down < 2e-6, place
        assert np.abs(b - by_pygeomag(*place)).max() < 2e-6, place
    worst = np.max([np.abs(b - published) for _, b, published in published_rows(WMM_FINE)], axis=0)
    assert worst == pytest.approx([4.5e-4, 5e-7, 1.3e-6], rel=0.05)  # as the errata have it


def jacobian(model, r, step=2e3):
    """dB_i/dx_j by central differences of fourth order."""
    packed = model.prepare(2026.0)
    columns = []
    for axis in np.eye(3) * step:
        b = [model.b_earth_fixed(packed, r + k * axis) for k in (-2, -1, 1, 2)]
        columns.append((b[0] - 8.0 * b[1] + 8.0 * b[2] - b[3]) / (12.0 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("model", [Igrf14(), Igrf14(degree=1), Igrf14(degree=6), Wmm2025()])
def test_field_has_no_divergence_and_no_curl(model):
    slopes = jacobian(model, np.vstack([sphere(100), [[0.0, 0.0, 6.8e6], [0.0, 0.0, -6.8e6]]]))
    size = np.abs(slopes).max()
    assert np.abs(np.trace(slopes, axis1=1, axis2=2)).max() < 1e-10 * size
    assert np.abs(slopes - slopes.transpose(0, 2, 1)).max() < 1e-10 * size


def test_poles_are_ordinary_points():
    model = Igrf14()
    packed = model.prepare(2025.0)
    for z in (6.8e6, -6.8e6):
        at = model.b_earth_fixed(packed, [[0.0, 0.0, z]])
        turned = np.arange(0.0, 6.28, 0.5)
        near = np.stack([np.cos(turned), np.sin(turned), z + 0.0 * turned], axis=-1)
        assert np.isfinite(at).all()
        # one metre aside the field differs by about |B| m / r, whichever way one steps
        assert np.abs(model.b_earth_fixed(packed, near) - at).max() < 1e-10


def test_first_degree_is_the_tilted_dipole():
    r = sphere(300, FIELD_RADIUS_M, 5e7)
    for kind, year in (("igrf14", 1987.4), ("igrf14", 2026.1), ("wmm2025", 2026.1)):
        gauss, dipole = Gauss(kind=kind, degree=1), TiltedDipole(source=kind)
        b = gauss.b_earth_fixed(gauss.prepare(year), r)
        other = dipole.b_earth_fixed(dipole.prepare(year), r)
        error = np.linalg.norm(b - other, axis=1) / np.linalg.norm(other, axis=1)
        assert error.max() < 1e-12


def test_truncations_approach_the_whole_field():
    r = sphere(50)
    whole = Igrf14().b_earth_fixed(Igrf14().prepare(2025.0), r)
    errors = []
    for degree in (1, 2, 4, 8, 12, 13):
        model = Igrf14(degree=degree)
        errors.append(np.abs(model.b_earth_fixed(model.prepare(2025.0), r) - whole).max())
    assert all(later < earlier for earlier, later in itertools.pairwise(errors))
    assert errors[-1] == 0.0 and errors[0] > 1e-6


@pytest.mark.parametrize("degree", [1, 2, 5, 12, 13])
def test_many_points_are_the_single_points(degree):
    packed = Igrf14(degree=degree).prepare(2023.0)
    for count in (0, 1, LANES - 1, LANES, LANES + 1, 3 * LANES + 5):
        r = sphere(count)
        out = np.full((count, 3), np.nan)
        gradient_many(packed, r, out)
        for row, b in zip(r, out, strict=True):
            assert b == pytest.approx(gradient(packed, tuple(row)), rel=1e-12, abs=1e-18), count
        gradient_many(packed, r, r)
        assert np.array_equal(r, out), count


def test_many_points_have_the_same_bits_in_plain_python():
    packed, r = Igrf14().prepare(2023.0), sphere(LANES + 5)
    out, plain = np.empty_like(r), np.empty_like(r)
    gradient_many(packed, r, out)
    with plainly():
        gradient_many(packed, r, plain)
    assert out.tobytes() == plain.tobytes()


def test_compiled_equals_interpreted():
    packed = Igrf14().prepare(2023.0)
    r, out = sphere(3), np.empty((3, 3))
    interpreted(gradient_many)(packed, r, out)
    for row, b in zip(r, out, strict=True):
        point = tuple(float(x) for x in row)
        compiled = gradient(packed, point)
        assert interpreted(gradient)(packed, point) == pytest.approx(compiled, rel=1e-13)
        assert b == pytest.approx(compiled, rel=1e-12)


def test_coefficients_are_linear_between_epochs_and_by_secular_variation_after():
    g2020, h2020 = tables.schmidt_coefficients("igrf14", 2020.0)
    g2025, h2025 = tables.schmidt_coefficients("igrf14", 2025.0)
    assert g2025[1, 0] == pytest.approx(-29350.0e-9, rel=1e-15)
    assert h2025[1, 1] == pytest.approx(4545.5e-9, rel=1e-15)
    g, h = tables.schmidt_coefficients("igrf14", 2022.0)
    assert g == pytest.approx(0.6 * g2020 + 0.4 * g2025, rel=1e-14)
    assert h == pytest.approx(0.6 * h2020 + 0.4 * h2025, rel=1e-14)
    # (2030 - 2025 columns) / 5 = 12.6 nT a year
    later, _ = tables.schmidt_coefficients("igrf14", 2027.0)
    assert (later - g2025)[1, 0] == pytest.approx(2 * 12.6e-9, rel=1e-9)
    wmm, _ = tables.schmidt_coefficients("wmm2025", 2026.5)
    assert wmm[1, 0] == pytest.approx((-29351.8 + 1.5 * 12.0) * 1e-9, rel=1e-14)


def test_igrf_stops_at_degree_ten_before_2000():
    for year, reached in ((1960.0, 10), (1995.0, 10), (2000.0, 13)):
        g, h = tables.schmidt_coefficients("igrf14", year)
        assert g.shape == (14, 14)
        assert np.flatnonzero(np.abs(g).sum(axis=1) + np.abs(h).sum(axis=1))[-1] == reached


def test_inertial_field_turns_with_the_frame():
    model, r = Igrf14(), sphere(150)
    packed = model.prepare(2025.0)
    dcm = dcm_ecef_to_ned(RNG.uniform(-1.5, 1.5, 150), RNG.uniform(-3.0, 3.0, 150))
    b = model.b_inertial(packed, r, None, dcm)
    expected = model.b_earth_fixed(packed, np.einsum("nij,nj->ni", dcm, r))
    assert np.einsum("nij,nj->ni", dcm, b) == pytest.approx(expected, rel=1e-12, abs=1e-17)


@pytest.mark.parametrize(
    ("model", "year", "line"),
    [
        (
            Igrf14(),
            2031.2,
            "field model igrf14: date must lie within 1900.0..2030.0; received 2031.2",
        ),
        (
            Igrf14(),
            1899.9,
            "field model igrf14: date must lie within 1900.0..2030.0; received 1899.9",
        ),
        (
            Wmm2025(),
            2024.99,
            "field model wmm2025: date must lie within 2025.0..2030.0; received 2024.99",
        ),
        (
            TiltedDipole(source="wmm2025"),
            2020.0,
            "field model wmm2025: date must lie within 2025.0..2030.0; received 2020.0",
        ),
        (
            Igrf14(extrapolate=True),
            float("nan"),
            "field model igrf14: date must lie within 1900.0..2030.0; received nan",
        ),
    ],
)
def test_date_outside_validity_is_one_clear_line(model, year, line):
    with pytest.raises(ValueError) as error:
        model.prepare(year)
    assert str(error.value) == line


def test_extrapolation_warns_and_goes_on_by_secular_variation():
    with pytest.warns(UserWarning, match=r"received 2031.2: extrapolated"):
        g, _ = tables.schmidt_coefficients("igrf14", 2031.2, extrapolate=True)
    assert g[1, 0] == pytest.approx((-29350.0 + 6.2 * 12.6) * 1e-9, rel=1e-12)
    with pytest.warns(UserWarning, match="received 1890"):
        Igrf14(extrapolate=True).prepare(1890.0)


def test_degree_and_shapes_are_checked():
    with pytest.raises(ValueError, match=r"degree: must lie within 1..12 for wmm2025; received 13"):
        Wmm2025(degree=13)
    with pytest.raises(ValueError, match=r"degree: must lie within 1..13 for igrf14; received 0"):
        Gauss(kind="igrf14", degree=0)
    model = Igrf14()
    packed = model.prepare(2025.0)
    with pytest.raises(ValueError, match=r"r_ecef: must have shape \(n, 3\); received shape \(3,"):
        model.b_earth_fixed(packed, [1.0, 2.0, 3.0])
    line = r"dcm_inertial_to_ecef: must have shape \(2, 3, 3\); received shape \(1, 3, 3\)"
    with pytest.raises(ValueError, match=line):
        model.b_inertial(packed, sphere(2), None, np.eye(3)[None])
