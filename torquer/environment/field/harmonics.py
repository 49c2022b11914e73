"""Field of a sum of spherical harmonics: one point, or many points at a time.

Each Cartesian component of the gradient of a harmonic function is itself harmonic. So the
Gauss coefficients are turned once, at the run's date, into three scalar expansions one degree
higher, one for each component of B in Earth-fixed axes:

  B_c = q sum_m [(sum_n X_nm H_nm) Re w^m + (sum_n Y_nm H_nm) Im w^m],  c = x, y, z,

with R = 6371.2 km, (x, y, z) = R r / r^2, w = x + iy, q = R / r, and H_nm the solid harmonic
q^(n-m) d^m P_n(sin latitude) scaled so that its leading coefficient is one:

  H_mm = 1,  H_m+1,m = z,  H_nm = z H_n-1,m - beta_nm q^2 H_n-2,m.

Nothing divides by the cosine of the latitude: the poles are ordinary points. Degrees are taken
two at a time, so that the recursion steps in place.
"""

import functools
import math
from functools import cache
from typing import NamedTuple

import numpy as np

from torquer.conventions import FIELD_RADIUS_M
from torquer.engine import kernel


class Harmonics(NamedTuple):
    """Expansion of the three components: order m = 0..top, pairs of degrees from n = m.

    A row of `pairs` holds beta of both degrees, then for each of x, y, z the coefficients of
    the cosine part (lower, upper degree) and of the sine part (lower, upper degree), in tesla.
    """

    top: int
    pairs: np.ndarray


@cache
@functools.cache
def _schmidt(degree: int) -> np.ndarray:
    """Factors [n, m] of Schmidt's quasi-normalisation."""
    factors = np.zeros((degree + 1, degree + 1))
    for n in range(1, degree + 1):
        for m in range(n + 1):
            ratio = math.factorial(n - m) / math.factorial(n + m)
            factors[n, m] = math.sqrt((2 if m else 1) * ratio)
    return factors


@kernel
def _component_coefficients(g, h, c):
    """Fill c `[component, cos or sin, n, m]`: B over harmonics, from unnormalised g and h.

    The derivatives of a solid harmonic of degree n are harmonics of degree n + 1.
    """
    for n in range(1, g.shape[0]):
        for m in range(n + 1):
            raised = 0.5 if m else 1.0
            lowered = 0.5 * (n - m + 2) * (n - m + 1)
            for part in range(2):
                even = g[n, m] if part == 0 else h[n, m]
                odd = -h[n, m] if part == 0 else g[n, m]
                c[2, part, n + 1, m] += (n - m + 1) * even
                c[0, part, n + 1, m + 1] += raised * even
                c[1, part, n + 1, m + 1] += raised * odd
                if m > 0:
                    c[0, part, n + 1, m - 1] -= lowered * even
                    c[1, part, n + 1, m - 1] += lowered * odd


@functools.cache
def _recursion(top: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    """Of order m, for the degrees m..top: factors of the recursion, and leading coefficients."""
    n = np.arange(m, top + 1)
    leading = [math.prod(range(1, 2 * k, 2)) / math.factorial(k - m) for k in n.tolist()]
    return ((n - 1) ** 2 - m * m) / (4 * (n - 1) ** 2 - 1), np.array(leading)


def _column(c: np.ndarray, m: int) -> np.ndarray:
    """Rows of `pairs` of order m; an odd last degree gets a partner of zeros."""
    top = c.shape[2] - 1
    count = top + 1 - m
    rows = np.zeros((2 * ((top - m) // 2 + 1), 7))
    rows[:count, 0], leading = _recursion(top, m)
    rows[:count, 1:] = leading[:, None] * c[:, :, m:, m].reshape(6, count).T
    return rows.reshape(-1, 2, 7).transpose(0, 2, 1).reshape(-1, 14)


def pack(g: np.ndarray, h: np.ndarray) -> Harmonics:
    """Expansion of B from Schmidt quasi-normalised g and h `[n, m]`, in tesla."""
    degree = g.shape[0] - 1
    top = degree + 1
    c = np.zeros((3, 2, top + 1, top + 1))
    _component_coefficients(g * _schmidt(degree), h * _schmidt(degree), c)
    return Harmonics(top, np.concatenate([_column(c, m) for m in range(top + 1)]))


@kernel
def b_earth_fixed(harmonics, r_ecef_m):
    """Induction [T] in Earth-fixed axes at a point [m].

    B = -grad V, V = R sum (R/r)^(n+1) (g cos m lambda + h sin m lambda) P_nm, summed as
    this file's head says.
    """
    top, c = harmonics
    inverse = FIELD_RADIUS_M / (
        r_ecef_m[0] * r_ecef_m[0] + r_ecef_m[1] * r_ecef_m[1] + r_ecef_m[2] * r_ecef_m[2]
    )
    x, y, z = r_ecef_m[0] * inverse, r_ecef_m[1] * inverse, r_ecef_m[2] * inverse
    q2 = FIELD_RADIUS_M * inverse
    re, im = 1.0, 0.0
    bx, by, bz = 0.0, 0.0, 0.0
    k = 0
    for m in range(top + 1):
        h0, h1 = 1.0, z
        xc, xs = c[k, 2] + c[k, 3] * z, c[k, 4] + c[k, 5] * z
        yc, ys = c[k, 6] + c[k, 7] * z, c[k, 8] + c[k, 9] * z
        zc, zs = c[k, 10] + c[k, 11] * z, c[k, 12] + c[k, 13] * z
        k += 1
        for _ in range((top - m) // 2):
            h0 = z * h1 - c[k, 0] * q2 * h0
            h1 = z * h0 - c[k, 1] * q2 * h1
            xc, xs = xc + (c[k, 2] * h0 + c[k, 3] * h1), xs + (c[k, 4] * h0 + c[k, 5] * h1)
            yc, ys = yc + (c[k, 6] * h0 + c[k, 7] * h1), ys + (c[k, 8] * h0 + c[k, 9] * h1)
            zc, zs = zc + (c[k, 10] * h0 + c[k, 11] * h1), zs + (c[k, 12] * h0 + c[k, 13] * h1)
            k += 1
        bx, by, bz = bx + (xc * re + xs * im), by + (yc * re + ys * im), bz + (zc * re + zs * im)
        re, im = x * re - y * im, x * im + y * re
    q = math.sqrt(q2)
    return (q * bx, q * by, q * bz)


# Many points: the same sums with the points innermost, so that the compiler works on several
# at once (three times faster). The scratch array is flat, its rows at constant offsets, because
# only then can the compiler see that they do not overlap.
LANES = 64
X, Y, Z, Q2, RE, IM, BX, BY, BZ, H0, H1, XC, XS, YC, YS, ZC, ZS = range(0, 17 * LANES, LANES)
SCRATCH = 17 * LANES


@kernel
def _load(r, first, count, w):
    """Start a block: scaled inverse coordinates of `count` points, sums at zero."""
    for j in range(count):
        x, y, z = r[first + j, 0], r[first + j, 1], r[first + j, 2]
        inverse = FIELD_RADIUS_M / (x * x + y * y + z * z)
        w[X + j], w[Y + j], w[Z + j] = x * inverse, y * inverse, z * inverse
        w[Q2 + j] = FIELD_RADIUS_M * inverse
        w[RE + j], w[IM + j] = 1.0, 0.0
        w[BX + j], w[BY + j], w[BZ + j] = 0.0, 0.0, 0.0


@kernel
def _begin_order(c, k, w):
    """The two lowest degrees of an order."""
    x0, x1, x2, x3 = c[k, 2], c[k, 3], c[k, 4], c[k, 5]
    y0, y1, y2, y3 = c[k, 6], c[k, 7], c[k, 8], c[k, 9]
    z0, z1, z2, z3 = c[k, 10], c[k, 11], c[k, 12], c[k, 13]
    for j in range(LANES):
        z = w[Z + j]
        w[H0 + j], w[H1 + j] = 1.0, z
        w[XC + j], w[XS + j] = x0 + x1 * z, x2 + x3 * z
        w[YC + j], w[YS + j] = y0 + y1 * z, y2 + y3 * z
        w[ZC + j], w[ZS + j] = z0 + z1 * z, z2 + z3 * z


@kernel
def _next_degrees(c, k, w):
    """Two degrees further up the order."""
    beta0, beta1 = c[k, 0], c[k, 1]
    x0, x1, x2, x3 = c[k, 2], c[k, 3], c[k, 4], c[k, 5]
    y0, y1, y2, y3 = c[k, 6], c[k, 7], c[k, 8], c[k, 9]
    z0, z1, z2, z3 = c[k, 10], c[k, 11], c[k, 12], c[k, 13]
    for j in range(LANES):
        h0 = w[Z + j] * w[H1 + j] - beta0 * w[Q2 + j] * w[H0 + j]
        h1 = w[Z + j] * h0 - beta1 * w[Q2 + j] * w[H1 + j]
        w[H0 + j], w[H1 + j] = h0, h1
        w[XC + j] += x0 * h0 + x1 * h1
        w[XS + j] += x2 * h0 + x3 * h1
        w[YC + j] += y0 * h0 + y1 * h1
        w[YS + j] += y2 * h0 + y3 * h1
        w[ZC + j] += z0 * h0 + z1 * h1
        w[ZS + j] += z2 * h0 + z3 * h1


@kernel
def _end_order(w):
    """Add the order's sums to B and turn to the next order."""
    for j in range(LANES):
        re, im = w[RE + j], w[IM + j]
        w[BX + j] += w[XC + j] * re + w[XS + j] * im
        w[BY + j] += w[YC + j] * re + w[YS + j] * im
        w[BZ + j] += w[ZC + j] * re + w[ZS + j] * im
        w[RE + j] = w[X + j] * re - w[Y + j] * im
        w[IM + j] = w[X + j] * im + w[Y + j] * re


@kernel
def _sum_block(harmonics, w):
    """All orders and degrees at the points of one block."""
    top, c = harmonics
    k = 0
    for m in range(top + 1):
        _begin_order(c, k, w)
        k += 1
        for _ in range((top - m) // 2):
            _next_degrees(c, k, w)
            k += 1
        _end_order(w)


@kernel
def b_earth_fixed_many(harmonics, r, out):
    """As `b_earth_fixed` at the rows of `r[n, 3]`, into `out[n, 3]` (which may be `r` itself)."""
    w = np.zeros(SCRATCH)
    for first in range(0, r.shape[0], LANES):
        count = min(LANES, r.shape[0] - first)
        _load(r, first, count, w)
        _sum_block(harmonics, w)
        for j in range(count):
            q = math.sqrt(w[Q2 + j])
            out[first + j, 0] = q * w[BX + j]
            out[first + j, 1] = q * w[BY + j]
            out[first + j, 2] = q * w[BZ + j]
