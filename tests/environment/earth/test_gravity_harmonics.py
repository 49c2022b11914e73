"""Gravity harmonics: the gradient of their potential, a naive twin, J2's closed form, the poles."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.special import assoc_legendre_p_all

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.environment.earth import gravity
from torquer.maths.geometry.vec3 import add

PLACE = (4.1e6, -3.2e6, 4.7e6)
WHOLE = gravity.pack(gravity.MAX_DEGREE)


def potential(x, y, z, degree, order):
    """The textbook sum in polar coordinates, with 40 digits."""
    c_bar, s_bar = gravity.egm2008()
    r, lon = mpmath.sqrt(x * x + y * y + z * z), mpmath.atan2(y, x)
    total = 1 / r
    for n in range(2, degree + 1):
        for m in range(min(n, order) + 1):
            ratio = mpmath.factorial(n - m) / mpmath.factorial(n + m)
            norm = mpmath.sqrt((2 if m else 1) * (2 * n + 1) * ratio) * (-1) ** m
            wave = c_bar[n, m] * mpmath.cos(m * lon) + s_bar[n, m] * mpmath.sin(m * lon)
            shape = norm * mpmath.legenp(n, m, z / r).real
            total += (gravity.REFERENCE_RADIUS_M / r) ** n * shape * wave / r
    return MU_EARTH_M3_S2 * total


def acceleration(harmonics, r_ecef_m):
    """All of gravity, the way an integrated orbit adds it up."""
    return add(gravity.central(r_ecef_m), gravity.beyond_central(harmonics, r_ecef_m))


@pytest.mark.parametrize(("degree", "order"), [(2, 2), (8, 3), (10, 10)])
def test_acceleration_is_the_gradient_of_the_potential(degree, order):
    found = acceleration(gravity.pack(degree, order), PLACE)
    with mpmath.workdps(40):
        h = mpmath.mpf("1e-3")
        for axis in range(3):
            ahead, back = ([mpmath.mpf(v) for v in PLACE] for _ in range(2))
            ahead[axis] += h
            back[axis] -= h
            slope = (potential(*ahead, degree, order) - potential(*back, degree, order)) / (2 * h)
            assert abs(found[axis] - float(slope)) < 2e-15


def naive(r, degree):
    """Beyond the central part, by spherical components from SciPy's Legendre functions."""
    c_bar, s_bar = gravity.egm2008()
    radius, lon = np.linalg.norm(r), math.atan2(r[1], r[0])
    sin_lat = r[2] / radius
    cos_lat = math.hypot(r[0], r[1]) / radius
    p, dp = assoc_legendre_p_all(degree, degree, sin_lat, diff_n=1)
    up = north = east = 0.0
    for n in range(2, degree + 1):
        size = MU_EARTH_M3_S2 / radius**2 * (gravity.REFERENCE_RADIUS_M / radius) ** n
        for m in range(n + 1):
            norm = math.sqrt((2 if m else 1) * (2 * n + 1) * math.factorial(n - m))
            norm *= (-1) ** m / math.sqrt(math.factorial(n + m))
            c, s = c_bar[n, m], s_bar[n, m]
            even = c * math.cos(m * lon) + s * math.sin(m * lon)
            odd = m * (s * math.cos(m * lon) - c * math.sin(m * lon))
            up -= (n + 1) * size * norm * p[n, m] * even
            north += size * norm * dp[n, m] * cos_lat * even
            east += size * norm * p[n, m] * odd / cos_lat
    axis = np.array([math.cos(lon), math.sin(lon), 0.0])
    side = np.array([-math.sin(lon), math.cos(lon), 0.0])
    z = np.array([0.0, 0.0, 1.0])
    return (
        up * (cos_lat * axis + sin_lat * z) + north * (cos_lat * z - sin_lat * axis) + east * side
    )


@given(
    st.floats(-1.5, 1.5),
    st.floats(-math.pi, math.pi),
    st.floats(6.4e6, 5e7),
    st.integers(2, gravity.MAX_DEGREE),
)
@settings(max_examples=40, deadline=None)
def test_equals_the_naive_twin(lat, lon, radius, degree):
    r = radius * np.array(
        [math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)]
    )
    found = gravity.beyond_central(gravity.pack(degree), tuple(r))
    assert np.abs(np.array(found) - naive(r, degree)).max() < 1e-15 + 1e-11 * np.linalg.norm(found)


def test_j2_closed_form():
    c_bar, _ = gravity.egm2008()
    x, y, z = PLACE
    r = math.dist(PLACE, (0, 0, 0))
    j2 = -math.sqrt(5.0) * c_bar[2, 0]
    assert j2 == pytest.approx(1.0826e-3, rel=1e-4)
    k = -1.5 * j2 * MU_EARTH_M3_S2 * gravity.REFERENCE_RADIUS_M**2 / r**5
    s = 5.0 * z * z / (r * r)
    expected = (k * x * (1.0 - s), k * y * (1.0 - s), k * z * (3.0 - s))
    assert gravity.beyond_central(gravity.pack(2, 0), PLACE) == pytest.approx(expected, rel=1e-13)


def test_the_poles_are_ordinary_points():
    for z in (6.7e6, -6.7e6):
        there = np.array(acceleration(WHOLE, (0.0, 0.0, z)))
        beside = [acceleration(WHOLE, (a, b, z)) for a, b in ((1, 0), (0, 1), (-1, 0))]
        assert np.all(np.isfinite(there))
        # a metre away gravity differs by its gradient, some 1e-6 1/s^2
        assert np.abs(np.array(beside) - there).max() < 2e-6
        assert there[2] * z < 0.0


def test_laplace_gradient_has_no_divergence():
    h, total = 50.0, 0.0
    for axis in range(3):
        step = h * np.eye(3)[axis]
        up, down = (
            gravity.beyond_central(WHOLE, tuple(np.array(PLACE) + sign * step)) for sign in (1, -1)
        )
        total += (up[axis] - down[axis]) / (2 * h)
    assert abs(total) < 1e-16


def test_degree_zero_is_the_central_pull_alone():
    plain = gravity.pack(0)
    assert gravity.beyond_central(plain, PLACE) == (0.0, 0.0, 0.0)
    assert math.hypot(*acceleration(plain, PLACE)) == pytest.approx(
        MU_EARTH_M3_S2 / math.dist(PLACE, (0, 0, 0)) ** 2, rel=1e-15
    )


def test_shipped_coefficients_are_whole():
    c_bar, s_bar = gravity.egm2008()
    n, m = np.tril_indices(gravity.MAX_DEGREE + 1)
    there = (n >= 2) & (n != 0)
    assert np.all(c_bar[n[there], m[there]] != 0.0)
    assert np.all(s_bar[n[there & (m > 0)], m[there & (m > 0)]] != 0.0)
    assert c_bar[2, 0] == -0.000484165143790815


def test_a_package_of_its_own_agrees():
    heyoka = pytest.importorskip("heyoka")
    x, y, z = heyoka.make_vars("x", "y", "z")
    ours = {"mu": MU_EARTH_M3_S2, "a": gravity.REFERENCE_RADIUS_M}
    theirs = heyoka.cfunc(heyoka.model.egm2008_acc([x, y, z], n=16, m=16, **ours), [x, y, z])
    assert acceleration(gravity.pack(16), PLACE) == pytest.approx(
        theirs(np.array(PLACE)), rel=0.0, abs=5e-15
    )


@pytest.mark.parametrize(
    ("degree", "order", "message"),
    [
        (37, None, "degree: must lie within 0..36; received 37"),
        (-1, None, "degree: must lie within 0..36; received -1"),
        (8, 9, "order: must lie within 0..8, the degree; received 9"),
        (8, -1, "order: must lie within 0..8, the degree; received -1"),
    ],
)
def test_what_is_not_there_is_an_error(degree, order, message):
    with pytest.raises(ValueError, match=message):
        gravity.pack(degree, order)
