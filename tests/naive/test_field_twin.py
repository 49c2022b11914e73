"""The fast field sums against the textbook form, written out in spherical coordinates."""

import math

import numpy as np
import pytest
from numpy.polynomial.legendre import Legendre

from torquer.environment.earth.harmonics import gradient
from torquer.environment.field import Gauss
from torquer.environment.field.coefficients import schmidt_coefficients

RADIUS = 6371.2e3


def naive_field(g, h, r_vec):
    """B = -grad V, term by term, with Legendre polynomials as polynomials."""
    x, y, z = r_vec
    r, lon = math.hypot(x, y, z), math.atan2(y, x)
    c = z / r
    s = math.hypot(x, y) / r
    b_r = b_theta = b_lon = 0.0
    for n in range(1, len(g)):
        scale = (RADIUS / r) ** (n + 2)
        for m in range(n + 1):
            norm = math.sqrt((2 if m else 1) * math.factorial(n - m) / math.factorial(n + m))
            slope = Legendre.basis(n).deriv(m)
            p = norm * s**m * slope(c)
            dp = norm * (m * c * s ** (m - 1) * slope(c) - s ** (m + 1) * slope.deriv()(c))
            wave = g[n, m] * math.cos(m * lon) + h[n, m] * math.sin(m * lon)
            slant = m * (h[n, m] * math.cos(m * lon) - g[n, m] * math.sin(m * lon))
            b_r += (n + 1) * scale * wave * p
            b_theta -= scale * wave * dp
            b_lon -= scale * slant * p / s
    cl, sl = math.cos(lon), math.sin(lon)
    return (
        b_r * np.array([s * cl, s * sl, c])
        + b_theta * np.array([c * cl, c * sl, -s])
        + b_lon * np.array([-sl, cl, 0.0])
    )


@pytest.mark.parametrize(
    ("kind", "year", "degree"),
    [
        ("igrf14", 1965.3, 13),
        ("igrf14", 2026.7, 13),
        ("igrf14", 2010.0, 7),
        ("wmm2025", 2028.1, 12),
    ],
)
def test_fast_sums_equal_the_textbook(kind, year, degree):
    g, h = schmidt_coefficients(kind, year)
    g, h = g[: degree + 1, : degree + 1], h[: degree + 1, : degree + 1]
    packed = Gauss(kind=kind, degree=degree).prepare(year)
    for r in np.random.default_rng(degree).normal(size=(20, 3)):
        r *= 6.9e6 / np.linalg.norm(r)
        expected = naive_field(g, h, r)
        error = np.linalg.norm(expected - gradient(packed, tuple(r)))
        assert error < 1e-13 * np.linalg.norm(expected)
