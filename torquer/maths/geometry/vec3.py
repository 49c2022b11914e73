"""Three-vectors as tuples and 3x3 matrices as tuples of rows."""

import math

from torquer.base.columns import number
from torquer.compile.engine import inlined


@inlined
def read_vector(cells):
    """The first three cells of an array as a vector."""
    return (cells[0], cells[1], cells[2])


@inlined
def put_vector(cells, v):
    """Write a vector into the first three cells of an array."""
    cells[0], cells[1], cells[2] = v


@inlined
def put_row(cells, values):
    """Copy numbers [n] into cells [n].

    As `cells[:] = values`, for which Numba compiles text for its error as well: two seconds.
    """
    for i in range(cells.shape[0]):
        cells[i] = values[i]


@inlined
def put_matrix(cells, values):
    """Copy numbers [n, m] into cells [n, m], without the error of `cells[:, :] = values`."""
    for i in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            cells[i, j] = values[i, j]


@inlined
def add(a, b):
    """Sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@inlined
def sub(a, b):
    """Difference a - b of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inlined
def scale(factor, a):
    """Vector times a number."""
    return (factor * a[0], factor * a[1], factor * a[2])


@inlined
def add_scaled(a, factor, b):
    """a + factor b."""
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


@inlined
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a, b):
    """Vector product a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined
def norm(a):
    """Euclidean length."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def doubt_of(a):
    """Zero for a vector of finite numbers, NaN for any other: a sum where a condition costs."""
    return 0.0 * a[0] + 0.0 * a[1] + 0.0 * a[2]


@inlined
def is_finite(a):
    """Whether all three components are finite numbers."""
    return doubt_of(a) == 0.0


@inlined
def turn_between(before, after, interval_s):
    """omega = a/dt (v2 x v1)/|v2 x v1|, a the angle from one direction in the body to the next."""
    normal, along = cross(after, before), dot(after, before)
    sine = norm(normal)
    rate = math.atan2(sine, along) / interval_s
    return scale(rate / sine, normal) if sine > 0.0 else (0.0, 0.0, 0.0)


@inlined
def unit(a):
    """Vector of length one along a (not a number for a zero vector)."""
    return scale(1.0 / norm(a), a)


@inlined
def mat_vec(m, a):
    """Matrix (tuple of three rows) times column vector."""
    return (dot(m[0], a), dot(m[1], a), dot(m[2], a))


@inlined
def mat_t_vec(m, a):
    """Transposed matrix times column vector."""
    return (
        m[0][0] * a[0] + m[1][0] * a[1] + m[2][0] * a[2],
        m[0][1] * a[0] + m[1][1] * a[1] + m[2][1] * a[2],
        m[0][2] * a[0] + m[1][2] * a[1] + m[2][2] * a[2],
    )


@inlined
def sym_vec(s, a):
    """Symmetric matrix, (xx, yy, zz, xy, xz, yz) or a diagonal (xx, yy, zz), times a vector."""
    if len(s) == 3:
        return (s[0] * a[0], s[1] * a[1], s[2] * a[2])
    return (
        s[0] * a[0] + s[3] * a[1] + s[4] * a[2],
        s[3] * a[0] + s[1] * a[1] + s[5] * a[2],
        s[4] * a[0] + s[5] * a[1] + s[2] * a[2],
    )


@inlined
def sym_inverse(s):
    """Inverse of a symmetric matrix (xx, yy, zz, xy, xz, yz), in the same form."""
    xx, yy, zz = s[1] * s[2] - s[5] * s[5], s[0] * s[2] - s[4] * s[4], s[0] * s[1] - s[3] * s[3]
    xy, xz, yz = s[4] * s[5] - s[3] * s[2], s[3] * s[5] - s[4] * s[1], s[3] * s[4] - s[0] * s[5]
    d = 1.0 / (s[0] * xx + s[3] * xy + s[4] * xz)
    return (d * xx, d * yy, d * zz, d * xy, d * xz, d * yz)


@inlined
def solve(m, b):
    """Solution x of the 3x3 system m x = b (Cramer's rule; m given by its rows)."""
    c0 = cross(m[1], m[2])
    c1 = cross(m[2], m[0])
    c2 = cross(m[0], m[1])
    s = 1.0 / dot(m[0], c0)
    return (
        s * (c0[0] * b[0] + c1[0] * b[1] + c2[0] * b[2]),
        s * (c0[1] * b[0] + c1[1] * b[1] + c2[1] * b[2]),
        s * (c0[2] * b[0] + c1[2] * b[1] + c2[2] * b[2]),
    )


def as_vector(values) -> tuple:
    """Three numbers as the tuple that kernels take."""
    x, y, z = map(number, values)
    return (x, y, z)


def as_symmetric(m) -> tuple:
    """A symmetric 3x3 array as the six numbers (xx, yy, zz, xy, xz, yz) that kernels take."""
    return tuple(number(m[i][j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def as_matrix(rows) -> tuple:
    """A 3x3 array as the tuple of row tuples that kernels take."""
    first, second, third = (as_vector(row) for row in rows)
    return (first, second, third)
