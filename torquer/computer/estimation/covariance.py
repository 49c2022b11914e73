"""Covariance matrices of filters: states by name, 3x3 blocks, the update by a measurement.

A covariance p (n, n) is symmetric to the bit. A state has three components: three rows and columns
from its first one on. The first state is the attitude error a in body axes [rad]: q_true =
q_estimated exp(a); it is zero between steps, so that `states` (n - 3) holds the others only.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.maths.geometry.frames import mat_mul, transpose
from torquer.maths.geometry.quaternion import conjugate, to_dcm
from torquer.maths.geometry.vec3 import add_scaled, scale

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
#: First row of the attitude error.
ATTITUDE = 0
#: First row of the error of the rate: of the gyro, or of the filter's own rate.
RATE_ERROR = 3


class States(NamedTuple):
    """A number for each state (three components) that filters know, in the covariance's order.

    Units of the components: attitude error and misalignments rad, rates rad/s, dipole A m^2, field
    T, scale factors 1. The last four may be considered only: see `update`.
    """

    attitude: float
    gyro_bias: float = 0.0
    rate: float = 0.0
    residual_dipole: float = 0.0
    magnetometer_bias: float = 0.0
    magnetometer_scale: float = 0.0
    magnetometer_misalignment: float = 0.0
    gyro_scale: float = 0.0
    gyro_misalignment: float = 0.0


#: States that describe how a sensor is made and mounted.
CALIBRATION = States._fields[-4:]


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
def block(p, row, column):
    """The 3x3 block from a row and a column on."""
    return (
        (p[row, column], p[row, column + 1], p[row, column + 2]),
        (p[row + 1, column], p[row + 1, column + 1], p[row + 1, column + 2]),
        (p[row + 2, column], p[row + 2, column + 1], p[row + 2, column + 2]),
    )


@inlined
def put_block(p, row, column, m):
    """Write a block of two states, and its transpose across the diagonal."""
    for i in range(3):
        for j in range(3):
            p[row + i, column + j] = p[column + j, row + i] = m[i][j]


@inlined
def put_variance(p, row, m):
    """Write the block of one state from the upper half of a matrix."""
    for i in range(3):
        for j in range(i, 3):
            p[row + i, row + j] = p[row + j, row + i] = m[i][j]


@inlined
def put_uncorrelated(p, row, variance):
    """Give a state this variance in each component, and no correlation to anything."""
    for i in range(row, row + 3):
        for j in range(p.shape[0]):
            p[i, j] = p[j, i] = 0.0
        p[i, i] = variance


@inlined
def state_slices(prior):
    """First row of each state in the covariance; 0 for one that the filter does not have.

    `prior`: variances at the start; a state without one is not estimated.
    """
    gyro_bias, free = _place(prior.gyro_bias, 3)
    rate, free = _place(prior.rate, free)
    dipole, free = _place(prior.residual_dipole, free)
    bias, free = _place(prior.magnetometer_bias, free)
    scale_b, free = _place(prior.magnetometer_scale, free)
    turn_b, free = _place(prior.magnetometer_misalignment, free)
    scale_w, free = _place(prior.gyro_scale, free)
    turn_w, free = _place(prior.gyro_misalignment, free)
    return States(0, gyro_bias, rate, dipole, bias, scale_b, turn_b, scale_w, turn_w)


@inlined
def _place(variance, free):
    """(First row of a state, 0 for none; the next free row)."""
    if variance > 0.0:
        return free, free + 3
    return 0, free


@inlined
def read_state(states, at):
    """A state beyond the attitude error, by its first row in the covariance; zeros for none."""
    if at == 0:
        return (0.0, 0.0, 0.0)
    return (states[at - 3], states[at - 2], states[at - 1])


@inlined
def put_state(states, at, v):
    """Write a state beyond the attitude error."""
    states[at - 3], states[at - 2], states[at - 1] = v


@inlined
def forget(prior, states, p):
    """All states beyond the attitude error as at the start: zeros, uncorrelated."""
    at = 0
    for variance in prior:
        if variance > 0.0:
            if at > 0:
                put_state(states, at, (0.0, 0.0, 0.0))
                put_uncorrelated(p, at, variance)
            at += 3


@inlined
def make_uncertain(prior, p):
    """Variances of all states beyond the attitude error as at the start; their values stay."""
    at = 0
    for variance in prior:
        if variance > 0.0:
            if at > 0:
                put_uncorrelated(p, at, variance)
            at += 3


@inlined
def turn_attitude(p, turn):
    """Refer the attitude error to body axes that have been turned (a quaternion).

    What is known of directions before a correction refers to the inertial frame. Left in the old
    body axes, a turn about a measured direction, which its readings do not reveal, would seem to be
    measured by the next one. A. Barrau, S. Bonnabel, 'The invariant extended Kalman filter as a
    stable observer' (2017).
    """
    r = to_dcm(conjugate(turn))
    aa = mat_mul(mat_mul(r, block(p, ATTITUDE, ATTITUDE)), transpose(r))
    put_variance(p, ATTITUDE, aa)
    for c in range(3, p.shape[0], 3):
        put_block(p, ATTITUDE, c, mat_mul(r, block(p, ATTITUDE, c)))


@inlined
def mean_variance(p, row):
    """Mean variance of the three components of a state."""
    return (p[row, row] + p[row + 1, row + 1] + p[row + 2, row + 2]) / 3.0


@inlined
def gain_element(p, i, m, row):
    """Element of P H^T for a state's component i and a component of the measurement."""
    h = m.h[row]
    g = p[i, 0] * h[0] + p[i, 1] * h[1] + p[i, 2] * h[2]
    for other in range(len(m.at)):
        k = m.at[other]
        if k > 0:
            h = m.h_other[other][row]
            g += p[i, k] * h[0] + p[i, k + 1] * h[1] + p[i, k + 2] * h[2]
    return g


@inlined
def row_times_gain(gain, column, m, row):
    """Product of a row of H and a column of P H^T, which is a row of `gain`."""
    h = m.h[row]
    s = h[0] * gain[column, 0] + h[1] * gain[column, 1] + h[2] * gain[column, 2]
    for other in range(len(m.at)):
        k = m.at[other]
        if k > 0:
            h = m.h_other[other][row]
            s += h[0] * gain[column, k] + h[1] * gain[column, k + 1] + h[2] * gain[column, k + 2]
    return s


@inlined
def factor_innovation(gain, m):
    """(L, D) of the innovation's covariance H P H^T + R = L D L^T: (l21, l31, l32), (d1, d2, d3).

    For two components d3 is one, l31 and l32 are zero.
    """
    d1 = row_times_gain(gain, 0, m, 0) + m.r
    l21, l31, l32, d3 = row_times_gain(gain, 0, m, 1) / d1, 0.0, 0.0, 1.0
    d2 = row_times_gain(gain, 1, m, 1) + m.r - l21 * l21 * d1
    if m.count == 3:
        l31 = row_times_gain(gain, 0, m, 2) / d1
        l32 = (row_times_gain(gain, 1, m, 2) - l31 * l21 * d1) / d2
        d3 = row_times_gain(gain, 2, m, 2) + m.r - l31 * l31 * d1 - l32 * l32 * d2
    return (l21, l31, l32), (d1, d2, d3)


@inlined
def put_gain(p, gain, m):
    """Write the transpose of P H^T: a row for each component of a measurement.

    Rows by name, not in a loop: a tuple's element by a number that is not known when compiled is a
    jump for every number that it may be.
    """
    for i in range(gain.shape[1]):
        gain[0, i], gain[1, i] = gain_element(p, i, m, 0), gain_element(p, i, m, 1)
        if m.count == 3:
            gain[2, i] = gain_element(p, i, m, 2)


@inlined
def update(p, gain, correction, m, gate, estimated):
    """Update a covariance (n, n) by a `Measurement`, unless its normalised square exceeds `gate`.

    The first `estimated` rows are estimated. The errors of the others are considered: they count in
    the covariance, but are neither corrected nor better known by a reading. S. Schmidt,
    'Application of state-space methods to navigation problems' (1966).

    Returns the square, whether it was accepted, and the whitened innovation: in a consistent filter
    independent standard normal numbers, as many as the measurement has components. `gain`: (3, n)
    to work in; the change of the states goes into `correction` (n). The scalar updates are made
    independent by the factors of the innovation's covariance, so that all of them are known, and
    can be rejected, before anything is changed.
    """
    n = correction.shape[0]
    for i in range(n):
        correction[i] = 0.0
    put_gain(p, gain, m)
    if m.since > 0.0:  # what the error has gained since the reading is not in it
        for row in range(m.count):
            for i in range(3):
                gain[row, i] -= m.since * m.h[row][i]
    lower, d = factor_innovation(gain, m)
    e1 = m.z[0]
    e2 = m.z[1] - lower[0] * e1
    nis, e3 = e1 * e1 / d[0] + e2 * e2 / d[1], 0.0
    if m.count == 3:
        e3 = m.z[2] - lower[1] * e1 - lower[2] * e2
        nis += 1.0 / d[2] * e3 * e3
    accepted = nis <= gate
    if accepted:
        take_gain(p, gain, correction, (e1, e2, e3), lower, d, m.count, estimated)
    white = (e1 / math.sqrt(d[0]), e2 / math.sqrt(d[1]), e3 / math.sqrt(d[2]))
    return nis, accepted, white


@inlined
def take_gain(p, gain, correction, e, lower, d, count, estimated):
    """Apply two or three independent scalar updates to the covariance; add up their corrections."""
    n, w1, w2, w3 = correction.shape[0], 1.0 / d[0], 1.0 / d[1], 1.0 / d[2]
    for i in range(n):
        g1 = gain[0, i]
        g2 = gain[1, i] - lower[0] * g1
        gain[1, i] = g2
        correction[i] = g1 * (w1 * e[0]) + g2 * (w2 * e[1])
        if count == 3:
            g3 = gain[2, i] - lower[1] * g1 - lower[2] * g2
            gain[2, i] = g3
            correction[i] += g3 * (w3 * e[2])
    for i in range(estimated, n):
        correction[i] = 0.0
    for i in range(n):
        for j in range(min(i + 1, estimated)):  # from 0: no place is counted from the end
            taken = w1 * gain[0, j] * gain[0, i] + w2 * gain[1, j] * gain[1, i]
            if count == 3:
                taken += w3 * gain[2, j] * gain[2, i]
            p[j, i] -= taken
            p[i, j] = p[j, i]
