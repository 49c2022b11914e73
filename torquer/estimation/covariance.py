"""Covariance matrices of filters: 3x3 blocks, and the measurement update that all filters share.

A covariance of n states is kept as n * n cells, row by row, symmetric to the bit. The first three
states are the attitude error a in body axes [rad]: q_true = q_estimated exp(a).
"""

import math
from typing import NamedTuple

from torquer.engine import inlined
from torquer.geometry.frames import mat_mul, transpose
from torquer.geometry.quaternion import conjugate, to_dcm
from torquer.geometry.vec3 import add, add_scaled, cross, dot, scale, sub, unit

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Measurement(NamedTuple):
    """A vector measurement as a filter takes it: z, H, R.

    `innovation`: measured less predicted; `attitude`: three rows of H for the attitude error;
    `other`: those for three more states from place `at` on (0: none); `variance`: of each
    component; `count`: 2 or 3 components.
    """

    innovation: tuple
    attitude: tuple
    other: tuple
    at: int
    variance: float
    count: int


class Whitened(NamedTuple):
    """What a measurement update found: normalised innovation squared, whether it was accepted.

    `innovation`: independent standard normal numbers in a consistent filter, as many as the
    measurement has components; not numbers beyond them.
    """

    nis: float
    accepted: bool
    innovation: tuple


@inlined
def skew(v):
    """Matrix of the vector product: skew(v) u = v x u."""
    return ((0.0, -v[2], v[1]), (v[2], 0.0, -v[0]), (-v[1], v[0], 0.0))


@inlined
def mat_add(m, factor, n):
    """m + factor n."""
    return (
        add_scaled(m[0], factor, n[0]),
        add_scaled(m[1], factor, n[1]),
        add_scaled(m[2], factor, n[2]),
    )


@inlined
def mat_scale(factor, m):
    """A matrix times a number."""
    return (scale(factor, m[0]), scale(factor, m[1]), scale(factor, m[2]))


@inlined
def outer(a, b):
    """a b^T."""
    return (scale(a[0], b), scale(a[1], b), scale(a[2], b))


@inlined
def block(p, n, row, column):
    """The 3x3 block from a row and a column on."""
    k = n * row + column
    return (
        (p[k], p[k + 1], p[k + 2]),
        (p[k + n], p[k + n + 1], p[k + n + 2]),
        (p[k + 2 * n], p[k + 2 * n + 1], p[k + 2 * n + 2]),
    )


@inlined
def put_block(p, n, row, column, m):
    """Write a block above the diagonal, and its transpose below."""
    for i in range(3):
        for j in range(3):
            p[n * (row + i) + column + j] = m[i][j]
            p[n * (column + j) + row + i] = m[i][j]


@inlined
def put_symmetric(p, n, at, m):
    """Write a block of the diagonal from the upper half of a matrix."""
    for i in range(3):
        for j in range(i, 3):
            p[n * (at + i) + at + j] = p[n * (at + j) + at + i] = m[i][j]


@inlined
def put_uncorrelated(p, n, at, m):
    """Give three states a covariance of their own, without correlation to the others."""
    for i in range(3):
        for j in range(n):
            p[n * (at + i) + j] = p[n * j + at + i] = 0.0
    put_symmetric(p, n, at, m)


@inlined
def turn_attitude(p, n, turn):
    """Refer the attitude error to body axes that have been turned (a quaternion).

    After a correction: what is known of directions stays with the stars. Left in the old axes, a
    turn that no reading tells would seem to be told by the next one. A. Barrau, S. Bonnabel, 'The
    invariant extended Kalman filter as a stable observer' (2017).
    """
    r = to_dcm(conjugate(turn))
    aa = mat_mul(mat_mul(r, block(p, n, 0, 0)), transpose(r))
    put_symmetric(p, n, 0, aa)
    for c in range(3, n, 3):
        put_block(p, n, 0, c, mat_mul(r, block(p, n, 0, c)))


@inlined
def variance_of(p, n, at):
    """Mean variance of three states."""
    k = (n + 1) * at
    return (p[k] + p[k + n + 1] + p[k + 2 * n + 2]) / 3.0


@inlined
def row_of_gain(p, k, m, row):
    """An element of P H^T, for the state whose row of P begins in cell k."""
    h = m.attitude[row]
    g = p[k] * h[0] + p[k + 1] * h[1] + p[k + 2] * h[2]
    if m.at > 0:
        o, k = m.other[row], k + m.at
        g += p[k] * o[0] + p[k + 1] * o[1] + p[k + 2] * o[2]
    return g


@inlined
def seen_of(gain, first, m, row):
    """h P h^T for a row of H and a column of P H^T."""
    h = m.attitude[row]
    s = h[0] * gain[first] + h[1] * gain[first + 1] + h[2] * gain[first + 2]
    if m.at > 0:
        o, k = m.other[row], first + m.at
        s += o[0] * gain[k] + o[1] * gain[k + 1] + o[2] * gain[k + 2]
    return s


@inlined
def update(p, gain, correction, m, gate):
    """Update a covariance by a measurement, unless `gate` refuses it; see `take_gain`.

    `gain`: 3 n cells to work in; the change of the states goes into `correction` (n).
    """
    n, last = correction.shape[0], m.count - 1
    for i in range(n):
        for row in range(m.count):
            gain[row * n + i] = row_of_gain(p, n * i, m, row)
    s11 = seen_of(gain, 0, m, 0) + m.variance
    s22 = seen_of(gain, n, m, 1) + m.variance
    s33 = seen_of(gain, last * n, m, last) + m.variance
    s12, s13 = seen_of(gain, 0, m, 1), seen_of(gain, 0, m, last)
    s23 = seen_of(gain, n, m, last)
    s = (s11, s22, s33, s12, s13, s23)
    return take_gain(p, gain, correction, m.innovation, s, m.count, gate)


@inlined
def take_gain(p, gain, correction, innovation, s, count, gate):
    """Update by an innovation, its covariance s and that of states and innovation (columns of n).

    Scalar updates one after another, made independent by the factors L D L^T of s: so all of them
    are known, and can be refused, before the covariance is touched. An innovation whose normalised
    square is above `gate` changes nothing. `s`: xx, yy, zz, xy, xz, yz; `count`: 2 or 3 components.
    """
    n = correction.shape[0]
    d1, l21, l31 = s[0], s[3] / s[0], s[4] / s[0]
    d2 = s[1] - l21 * l21 * d1
    l32 = (s[5] - l31 * l21 * d1) / d2
    e1 = innovation[0]
    e2 = innovation[1] - l21 * e1
    nis, d3, e3, w3 = e1 * e1 / d1 + e2 * e2 / d2, 1.0, 0.0, 0.0
    if count == 3:
        d3 = s[2] - l31 * l31 * d1 - l32 * l32 * d2
        e3 = innovation[2] - l31 * e1 - l32 * e2
        w3 = 1.0 / d3
        nis += w3 * e3 * e3
    white = (e1 / math.sqrt(d1), e2 / math.sqrt(d2), e3 / math.sqrt(d3))
    accepted = nis <= gate
    w1, w2 = 1.0 / d1, 1.0 / d2
    for i in range(n):
        correction[i] = 0.0
    if not accepted:
        return Whitened(nis, False, white)
    for i in range(n):
        g1 = gain[i]
        g2 = gain[n + i] - l21 * g1
        gain[n + i] = g2
        correction[i] = g1 * (w1 * e1) + g2 * (w2 * e2)
        if count == 3:
            g3 = gain[2 * n + i] - l31 * g1 - l32 * g2
            gain[2 * n + i] = g3
            correction[i] += g3 * (w3 * e3)
    for i in range(n):
        g1, g2 = w1 * gain[i], w2 * gain[n + i]
        for j in range(i, n):
            taken = g1 * gain[j] + g2 * gain[n + j]
            if count == 3:
                taken += w3 * gain[2 * n + i] * gain[2 * n + j]
            p[n * i + j] -= taken
            p[n * j + i] = p[n * i + j]
    return Whitened(nis, True, white)


@inlined
def frame_across(v):
    """Two vectors of length one across a vector: a right-handed frame with its direction."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    if x <= y and x <= z:
        t = (0.0, v[2], -v[1])
    elif y <= z:
        t = (-v[2], 0.0, v[0])
    else:
        t = (v[1], -v[0], 0.0)
    t = unit(t)
    return t, unit(cross(v, t))


@inlined
def direction_measurement(predicted, measured, variance):
    """Measurement of a direction: two components across the predicted vector.

    Any lengths; `variance`: of each component of `measured`. The component along the prediction
    says nothing of the attitude.
    """
    t, u = frame_across(predicted)
    innovation = (dot(t, measured), dot(u, measured), 0.0)
    rows = (cross(t, predicted), cross(u, predicted), (0.0, 0.0, 0.0))
    return Measurement(innovation, rows, IDENTITY, 0, variance, 2)


@inlined
def biased_measurement(predicted, measured, bias, at, variance):
    """Measurement of a vector by a sensor with a bias, whose states begin at place `at`."""
    expected = add(predicted, bias)
    return Measurement(sub(measured, expected), skew(predicted), IDENTITY, at, variance, 3)
