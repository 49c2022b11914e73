"""Gradient of a sum of solid harmonics at a point, regular at the poles.

Each Cartesian component of the gradient of a harmonic function is itself harmonic. So the
coefficients are converted once into three scalar expansions one degree higher, one for each
component in Earth-fixed axes:

  G_c = q sum_m [(sum_n X_nm H_nm) Re w^m + (sum_n Y_nm H_nm) Im w^m],  c = x, y, z,

with a the reference radius, (x, y, z) = a r / r^2, w = x + iy, q = a / r, and H_nm the solid
harmonic q^(n-m) d^m P_n(sin latitude) scaled so that its leading coefficient is one:

  H_mm = 1,  H_m+1,m = z,  H_nm = z H_n-1,m - beta_nm q^2 H_n-2,m.

No term is divided by the cosine of the latitude: the poles are regular points. Degrees are taken
two at a time, so that the recursion steps in place.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import kernel


class Harmonics(NamedTuple):
    """Expansion of the three components: order m = 0..top_order, pairs of degrees from n = m.

    A row of `pairs` holds beta of both degrees, then for each of x, y, z the coefficients of
    the cosine part (lower, upper degree) and of the sine part (lower, upper degree).
    """

    radius_m: float
    top: int
    top_order: int
    pairs: np.ndarray


@kernel
def _raise(c, s, out):
    """Fill `out` [x y z, cos sin, n, m]: the gradient, from unnormalised c and s [n, m].

    The derivatives of a solid harmonic of degree n are harmonics of degree n + 1.
    """
    for n in range(c.shape[0]):
        for m in range(n + 1):
            raised = 0.5 if m else 1.0
            lowered = 0.5 * (n - m + 2) * (n - m + 1)
            for part in range(2):
                even = c[n, m] if part == 0 else s[n, m]
                odd = -s[n, m] if part == 0 else c[n, m]
                out[2, part, n + 1, m] -= (n - m + 1) * even
                out[0, part, n + 1, m + 1] -= raised * even
                out[1, part, n + 1, m + 1] -= raised * odd
                if m > 0:
                    out[0, part, n + 1, m - 1] += lowered * even
                    out[1, part, n + 1, m - 1] -= lowered * odd


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


def pack(c: np.ndarray, s: np.ndarray, radius_m: float, factor: float) -> Harmonics:
    """Gradient of factor a sum (a/r)^(n+1) (c cos m lambda + s sin m lambda) P_nm.

    c and s [n, m] are not normalised, a is `radius_m`; orders above the last that has a
    coefficient are left out.
    """
    raised = np.zeros((3, 2, c.shape[0] + 1, c.shape[0] + 1))
    _raise(factor * c, factor * s, raised)
    orders = np.flatnonzero(np.any(raised != 0.0, axis=(0, 1, 2)))
    top_order = int(orders[-1]) if orders.size else 0
    pairs = np.concatenate([_column(raised, m) for m in range(top_order + 1)])
    return Harmonics(radius_m, raised.shape[2] - 1, top_order, pairs)


@kernel
def gradient(harmonics, r_m):
    """Gradient in Earth-fixed axes at a point [m]; for the sums see the module."""
    radius, top, top_order = harmonics.radius_m, harmonics.top, harmonics.top_order
    c = harmonics.pairs
    inverse = radius / (r_m[0] * r_m[0] + r_m[1] * r_m[1] + r_m[2] * r_m[2])
    x, y, z = r_m[0] * inverse, r_m[1] * inverse, r_m[2] * inverse
    q2 = radius * inverse
    re, im = 1.0, 0.0
    gx, gy, gz = 0.0, 0.0, 0.0
    k = 0
    for m in range(top_order + 1):
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
        gx, gy, gz = gx + (xc * re + xs * im), gy + (yc * re + ys * im), gz + (zc * re + zs * im)
        re, im = x * re - y * im, x * im + y * re
    q = math.sqrt(q2)
    return (q * gx, q * gy, q * gz)
