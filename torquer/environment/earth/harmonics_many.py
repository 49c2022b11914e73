"""The gradient of solid harmonics at many points: `earth.harmonics`, sixty-four at a time.

The sums are those for one point, with the points innermost, so that the compiler vectorises them
(three times faster). The scratch array is flat, its rows at constant offsets, because only then can
the compiler see that they do not overlap.
"""

import numpy as np

from torquer.compile.engine import kernel, places

LANES = 64
X, Y, Z, Q2, RE, IM, GX, GY, GZ, H0, H1, XC, XS, YC, YS, ZC, ZS = range(0, 17 * LANES, LANES)
SCRATCH = 17 * LANES


@kernel
def _load(radius, r, first, count, w):
    """Start a block: scaled inverse coordinates of `count` points, sums at zero."""
    for j in places(count):
        x, y, z = r[first + j, 0], r[first + j, 1], r[first + j, 2]
        inverse = radius / (x * x + y * y + z * z)
        w[X + j], w[Y + j], w[Z + j] = x * inverse, y * inverse, z * inverse
        w[Q2 + j] = radius * inverse
        w[RE + j], w[IM + j] = 1.0, 0.0
        w[GX + j], w[GY + j], w[GZ + j] = 0.0, 0.0, 0.0


@kernel
def _begin_order(c, k, w):
    """The two lowest degrees of an order."""
    x0, x1, x2, x3 = c[k, 2], c[k, 3], c[k, 4], c[k, 5]
    y0, y1, y2, y3 = c[k, 6], c[k, 7], c[k, 8], c[k, 9]
    z0, z1, z2, z3 = c[k, 10], c[k, 11], c[k, 12], c[k, 13]
    for j in places(LANES):
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
    for j in places(LANES):
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
    """Add the order's sums to the gradient and turn to the next order."""
    for j in places(LANES):
        re, im = w[RE + j], w[IM + j]
        w[GX + j] += w[XC + j] * re + w[XS + j] * im
        w[GY + j] += w[YC + j] * re + w[YS + j] * im
        w[GZ + j] += w[ZC + j] * re + w[ZS + j] * im
        w[RE + j] = w[X + j] * re - w[Y + j] * im
        w[IM + j] = w[X + j] * im + w[Y + j] * re


@kernel
def _sum_block(harmonics, w):
    """All orders and degrees at the points of one block."""
    _, top, top_order, c = harmonics
    k = 0
    for m in range(top_order + 1):
        _begin_order(c, k, w)
        k += 1
        for _ in range((top - m) // 2):
            _next_degrees(c, k, w)
            k += 1
        _end_order(w)


@kernel
def gradient_many(harmonics, r, out):
    """`harmonics.gradient` at the rows of `r[n, 3]`, into `out[n, 3]` (which may be `r` itself)."""
    w = np.zeros(SCRATCH)
    for first in range(0, r.shape[0], LANES):
        count = min(LANES, r.shape[0] - first)
        _load(harmonics.radius_m, r, first, count, w)
        _sum_block(harmonics, w)
        for j in places(count):
            q = np.sqrt(w[Q2 + j])
            out[first + j, 0] = q * w[GX + j]
            out[first + j, 1] = q * w[GY + j]
            out[first + j, 2] = q * w[GZ + j]
