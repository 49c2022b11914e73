"""Sharing a vector between the wheels: least squares, and exact minimax. Kernels.

Both serve momentum [N m s] and torque [N m] alike. `limit` (n,) holds the wheels' limits; a lost
wheel is one with the limit zero, so that a loss changes one number and nothing else. The share of
a wheel is its part of its limit. What the working wheels cannot make at all (two of them have no
hold on the normal of their plane) is left out: the demand's projection is shared.

Minimax: the greatest share is that of the envelope's face which the demand points at. Wheels
whose axes are not in the plane of that face carry the full share; what is then left lies in the
plane, and is shared there by the same rule, edge instead of face; what is left of that lies along
one axis. This is the strict minimax solution (of all with the least greatest share, the least
second, and so on): unique for any axes, and continuous in demand and limits.
"""

from typing import NamedTuple

import numpy as np

from torquer.engine import inlined, kernel
from torquer.geometry.vec3 import add_scaled, cross, dot, scale, solve
from torquer.wheel_array.envelope import THIN
from torquer.wheel_array.planes import planes_of

#: Determinant over the cube of the trace, below which axes are taken to span only a plane.
SINGULAR = 1e-14


class WheelSet(NamedTuple):
    """Geometry of an array for kernels: n axes, F faces, and the edges of each face in a row."""

    axes: np.ndarray
    """(n, 3) unit axes in the body frame."""
    faces: np.ndarray
    """(F, 3 + n): unit normal of a face, and normal . axis of each wheel, 0 in the plane."""
    edges: np.ndarray
    """(E, 3 + n): the same in the plane of a face: normal of an edge, and normal . axis."""
    lines: np.ndarray
    """(E, 3 + n): direction of the edge, and +-1 for each wheel along it, 0 for others."""
    first_edge: np.ndarray
    """(F + 1,): number of each face's first edge."""


def wheel_set(array) -> WheelSet:
    """The geometry of a `WheelArray`, once for all its failures."""
    axes = np.array(array.axes)
    faces, edges, lines, first_edge = [], [], [], [0]
    for plane in planes_of(axes):
        inside = np.isin(np.arange(len(axes)), plane.members)
        faces.append(np.concatenate([plane.normal, np.where(inside, 0.0, axes @ plane.normal)]))
        for k in plane.members:
            parallel = inside & (np.abs(axes @ np.cross(plane.normal, axes[k])) < 1e-9)
            if np.argmax(parallel) == k:
                normal = np.cross(plane.normal, axes[k])
                along = np.where(parallel, np.sign(axes @ axes[k]), 0.0)
                across = np.where(inside & ~parallel, axes @ normal, 0.0)
                edges.append(np.concatenate([normal, across]))
                lines.append(np.concatenate([axes[k], along]))
        first_edge.append(len(edges))
    return WheelSet(
        axes, np.array(faces), np.array(edges), np.array(lines), np.array(first_edge, dtype=int)
    )


@kernel
def spanned(axes, limit, demand):
    """The demand as far as the working axes span it, and a regular S = sum g g^T + (normal parts).

    With y the solution of S y = demand, g . y are the least-squares momenta.
    """
    xx = yy = zz = xy = xz = yz = 0.0
    for k in range(axes.shape[0]):
        if limit[k] > 0.0:
            x, y, z = axes[k, 0], axes[k, 1], axes[k, 2]
            xx, yy, zz = xx + x * x, yy + y * y, zz + z * z
            xy, xz, yz = xy + x * y, xz + x * z, yz + y * z
    s = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    trace = xx + yy + zz
    adjugate = (cross(s[1], s[2]), cross(s[2], s[0]), cross(s[0], s[1]))
    if dot(s[0], adjugate[0]) > SINGULAR * trace * trace * trace:
        return demand, s
    if trace == 0.0:
        return (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    minors = adjugate[0][0] + adjugate[1][1] + adjugate[2][2]
    if minors > SINGULAR * trace * trace:  # a plane: adjugate = minors n n^T
        outside = _times(1.0 / minors, adjugate)
    else:  # a line: s = trace g g^T
        outside = _plus(_times(-1.0 / trace, s), 1.0)
    rest = (dot(outside[0], demand), dot(outside[1], demand), dot(outside[2], demand))
    regular = (
        add_scaled(s[0], trace, outside[0]),
        add_scaled(s[1], trace, outside[1]),
        add_scaled(s[2], trace, outside[2]),
    )
    return add_scaled(demand, -1.0, rest), regular


@inlined
def _times(factor, m):
    return (scale(factor, m[0]), scale(factor, m[1]), scale(factor, m[2]))


@inlined
def _plus(m, number):
    (a, b, c), (d, e, f), (g, h, i) = m
    return ((a + number, b, c), (d, e + number, f), (g, h, i + number))


@kernel
def least_squares(axes, limit, demand, out):
    """Write the wheels' momenta of least sum of squares into out (n,); return the greatest share.

    Above 1 some wheel is beyond its limit. Equals the pseudo-inverse of the working axes.
    Source: WHEEL (5.2).
    """
    demand, square = spanned(axes, limit, demand)
    y, greatest = solve(square, demand), 0.0
    for k in range(axes.shape[0]):
        out[k] = 0.0
        if limit[k] > 0.0:
            out[k] = axes[k, 0] * y[0] + axes[k, 1] * y[1] + axes[k, 2] * y[2]
            greatest = max(greatest, abs(out[k]) / limit[k])
    return greatest


@kernel
def bound_of(rows, row, limit):
    """Greatest normal . x that the wheels of a row can make."""
    bound = 0.0
    for k in range(limit.shape[0]):
        bound += limit[k] * abs(rows[row, 3 + k])
    return bound


@kernel
def _fullest(rows, first, last, limit, demand, least):
    """Row with the greatest share of its bound, and that share with the sign of normal . demand."""
    best, share = first, 0.0
    for row in range(first, last):
        along = rows[row, 0] * demand[0] + rows[row, 1] * demand[1] + rows[row, 2] * demand[2]
        bound = bound_of(rows, row, limit)
        if abs(along) > abs(share) * bound and bound > least:
            best, share = row, along / bound
    return best, share


@kernel
def _load(axes, rows, row, limit, share, demand, out):
    """Give the wheels of a row that share of their limits; return what is left of the demand."""
    for k in range(limit.shape[0]):
        side = rows[row, 3 + k]
        if side != 0.0:
            out[k] = share * limit[k] if side > 0.0 else -share * limit[k]
            demand = add_scaled(demand, -out[k], (axes[k, 0], axes[k, 1], axes[k, 2]))
    return demand


@kernel
def minimax(wheels, limit, demand, out):
    """Write the momenta with the least greatest share into out (n,); return that share.

    Up to 1 the demand is within reach; above, some wheels are beyond their limits by that factor.
    """
    demand, _ = spanned(wheels.axes, limit, demand)
    least = 0.0
    for k in range(limit.shape[0]):
        out[k] = 0.0
        least += THIN * limit[k]
    first = wheels.first_edge
    face, greatest = _fullest(wheels.faces, 0, wheels.faces.shape[0], limit, demand, least)
    demand = _load(wheels.axes, wheels.faces, face, limit, greatest, demand, out)
    edge, share = _fullest(wheels.edges, first[face], first[face + 1], limit, demand, least)
    demand = _load(wheels.axes, wheels.edges, edge, limit, share, demand, out)
    edge, share = _fullest(wheels.lines, edge, edge + 1, limit, demand, least)
    _load(wheels.axes, wheels.lines, edge, limit, share, demand, out)
    return abs(greatest)


@kernel
def within_limits(greatest, out):
    """Scale momenta whose greatest share is above 1 back to the limits: the direction is kept."""
    if greatest > 1.0:
        for k in range(out.shape[0]):
            out[k] /= greatest


@kernel
def _share_all(wheels, limit, demands, by_minimax, out, greatest):
    for i in range(demands.shape[0]):
        demand = (demands[i, 0], demands[i, 1], demands[i, 2])
        if by_minimax:
            greatest[i] = minimax(wheels, limit, demand, out[i])
        else:
            greatest[i] = least_squares(wheels.axes, limit, demand, out[i])


def allocate(array, demands, method: str = "minimax") -> tuple[np.ndarray, np.ndarray]:
    """Momenta [N m s] of the wheels (..., n) for demanded vectors (..., 3), and greatest shares.

    Methods: 'minimax', 'least_squares'. Nothing is cut: a share above 1 is out of reach.
    """
    if method not in ("minimax", "least_squares"):
        raise ValueError(f"method: must be 'minimax' or 'least_squares'; received {method!r}")
    demands = np.asarray(demands, dtype=np.float64)
    rows = np.ascontiguousarray(demands.reshape(-1, 3))
    out, greatest = np.empty((len(rows), array.count)), np.empty(len(rows))
    _share_all(wheel_set(array), array.momentum_limits(), rows, method == "minimax", out, greatest)
    return out.reshape(*demands.shape[:-1], array.count), greatest.reshape(demands.shape[:-1])
