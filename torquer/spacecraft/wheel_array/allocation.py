"""Allocation of a vector to the wheels: least squares, and exact minimax. Kernels.

Both serve momentum [N m s] and torque [N m] alike. `limit` (n,) holds the wheels' limits; a lost
wheel is one with the limit zero, so that a loss changes a single number. The share of
a wheel is its part of its limit. What the working wheels cannot produce at all (two of them have no
authority along the normal of their plane) is left out: the demand's projection is allocated.

Minimax: the greatest share is that of the envelope's face that the demand intersects. Wheels
whose axes are not in the plane of that face carry the full share; what is then left lies in the
plane, and is shared there by the same rule, edge instead of face; what is left of that lies along
one axis. This is the strict minimax solution (of all with the least greatest share, the least
second, and so on): unique for any axes, and continuous in demand and limits.
"""

from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import add_scaled, cross, dot, mat_vec, norm, scale, solve
from torquer.spacecraft.wheel_array.envelope import THIN
from torquer.spacecraft.wheel_array.planes import SAME, authority, face_rows, span_axes

#: Fraction of the sum of all loads that may be missing by rounding.
CLOSE = 1e-13


class WheelSet(NamedTuple):
    """Geometry of an array for kernels: n axes, F planes of pairs of them."""

    axes: np.ndarray
    """(n, 3) unit axes in the body frame."""
    faces: np.ndarray
    """(F, 3 + n): unit normal of a face, and normal . axis of each wheel, 0 in the plane."""


def wheel_set(array) -> WheelSet:
    """The geometry of a `WheelArray`, once for all its failures."""
    axes = np.array(array.axes)
    return WheelSet(axes, face_rows(axes))


@inlined
def _axis(axes, k):
    return (axes[k, 0], axes[k, 1], axes[k, 2])


@kernel
def least_squares(axes, limit, demand, out):
    """Write the wheels' momenta of least sum of squares into out (n,); return the greatest share.

    Above 1 some wheel is beyond its limit. Equals the pseudo-inverse of the working axes. The
    normal equations are those of components along `authority`, each over its greatest: regular,
    also where the axes nearly lie in a plane or on a line. Source: WHEEL (5.2).
    """
    (first, second, third), (_, two, three) = authority(axes, limit)
    second = scale(1.0 / two, second) if two > 0.0 else second
    third = scale(1.0 / three, third) if three > 0.0 else third
    turn = (first, second, third)
    xx = xy = xz = yz = 0.0
    yy, zz = 1.0 if two == 0.0 else 0.0, 1.0 if three == 0.0 else 0.0
    for k in range(axes.shape[0]):
        if limit[k] > 0.0:
            x, y, z = mat_vec(turn, _axis(axes, k))
            xx, yy, zz = xx + x * x, yy + y * y, zz + z * z
            xy, xz, yz = xy + x * y, xz + x * z, yz + y * z
    xx = xx if xx > 0.0 else 1.0
    y = solve(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), mat_vec(turn, demand))
    greatest = 0.0
    for k in range(axes.shape[0]):
        out[k] = 0.0
        if limit[k] > 0.0:
            out[k] = dot(mat_vec(turn, _axis(axes, k)), y)
            greatest = max(greatest, abs(out[k]) / limit[k])
    return greatest


@inlined
def row_bound(rows, row, limit):
    """Greatest normal . x that the wheels of a row can make."""
    bound = 0.0
    for k in range(limit.shape[0]):
        bound += limit[k] * abs(rows[row, 3 + k])
    return bound


@inlined
def _full(faces, row, limit, demand):
    """How far a demand goes along the normal of a face, with its sign, and the face's bound."""
    return dot(_axis(faces, row), demand), row_bound(faces, row, limit)


@inlined
def _lies_in(faces, row, k):
    """Whether wheel k lies in the plane of a face; row -1 is the plane of all wheels."""
    return row < 0 or faces[row, 3 + k] == 0.0


@inlined
def _full_edge(wheels, limit, row, normal, edge, demand):
    """How far a demand goes across an edge (a wheel's axis) in a face, and the edge's bound."""
    across, bound = cross(normal, _axis(wheels.axes, edge)), 0.0
    for k in range(limit.shape[0]):
        side = abs(dot(across, _axis(wheels.axes, k)))
        if side > SAME and _lies_in(wheels.faces, row, k):
            bound += limit[k] * side
    return dot(across, demand), bound


@kernel
def _load_edge(wheels, limit, row, normal, edge, share, most, demand, out):
    """Give the wheels of a face their shares, those along an edge by what is left for them.

    No share is above `most`, what rounding makes of one. Returns how much of the demand is
    missing then.
    """
    axes = wheels.axes
    share, line, total = min(max(share, -most), most), _axis(axes, edge), 0.0
    across = cross(normal, line)
    for k in range(limit.shape[0]):
        if _lies_in(wheels.faces, row, k):
            side = dot(across, _axis(axes, k))
            if abs(side) > SAME:
                out[k] = share * limit[k] if side > 0.0 else -share * limit[k]
                demand = add_scaled(demand, -out[k], _axis(axes, k))
            else:
                total += limit[k]
    last = dot(line, demand) / total if total > 0.0 else 0.0
    last = min(max(last, -most), most)
    for k in range(limit.shape[0]):
        if _lies_in(wheels.faces, row, k) and abs(dot(across, _axis(axes, k))) <= SAME:
            out[k] = last * limit[k] if dot(line, _axis(axes, k)) > 0.0 else -last * limit[k]
            demand = add_scaled(demand, -out[k], _axis(axes, k))
    return norm(demand)


@kernel
def _load_plane(wheels, limit, row, normal, most, demand, total, out):
    """Share a demand in the plane of a face among its wheels.

    Returns the greatest share, and how much of the demand is missing. Of edges that are equally
    loaded to rounding it takes the one that leaves least missing.
    """
    best, greatest = -1, 0.0
    for edge in range(limit.shape[0]):
        if limit[edge] > 0.0 and _lies_in(wheels.faces, row, edge):
            along, bound = _full_edge(wheels, limit, row, normal, edge, demand)
            if best < 0:
                best = edge
            if bound > THIN * total and abs(along) > abs(greatest) * bound:
                best, greatest = edge, along / bound
    if best < 0:
        return 0.0, norm(demand)
    missing = _load_edge(wheels, limit, row, normal, best, greatest, most, demand, out)
    close = CLOSE * total * abs(greatest)
    if missing <= close:
        return abs(greatest), missing
    chosen = best
    for edge in range(limit.shape[0]):
        if limit[edge] > 0.0 and edge != best and _lies_in(wheels.faces, row, edge):
            along, bound = _full_edge(wheels, limit, row, normal, edge, demand)
            if bound > THIN * total and abs(along) >= abs(greatest) * bound - close:
                share = along / bound
                other = _load_edge(wheels, limit, row, normal, edge, share, most, demand, out)
                if other < missing:
                    missing, chosen = other, edge
    along, bound = _full_edge(wheels, limit, row, normal, chosen, demand)
    share = along / bound if bound > THIN * total else 0.0
    _load_edge(wheels, limit, row, normal, chosen, share, most, demand, out)
    return abs(greatest), missing


@inlined
def _load_face(wheels, limit, row, share, demand, total, out):
    """Give the wheels outside the plane of a face that share, share the rest in it.

    Returns how much of the demand is missing then.
    """
    for k in range(limit.shape[0]):
        side = wheels.faces[row, 3 + k]
        if side != 0.0:
            out[k] = share * limit[k] if side > 0.0 else -share * limit[k]
            demand = add_scaled(demand, -out[k], _axis(wheels.axes, k))
    normal = _axis(wheels.faces, row)
    return _load_plane(wheels, limit, row, normal, abs(share), demand, total, out)[1]


@kernel
def minimax(wheels, limit, demand, out):
    """Write the momenta with the least greatest share into out (n,); return that share.

    Up to 1 the demand is within reach; above, some wheels are beyond their limits by that factor.
    Of faces that are equally loaded to rounding it takes the one that leaves least missing.
    """
    faces, total, held = wheels.faces, 0.0, authority(wheels.axes, limit)
    demand = span_axes(held, demand)
    for k in range(limit.shape[0]):
        out[k] = 0.0
        total += limit[k]
    if held[1][2] == 0.0:
        normal = cross(held[0][0], held[0][1])
        greatest, _ = _load_plane(wheels, limit, -1, normal, np.inf, demand, total, out)
        return max(greatest, _greatest_share(limit, out))
    best, greatest = 0, 0.0
    for row in range(faces.shape[0]):
        along, bound = _full(faces, row, limit, demand)
        if bound > THIN * total and abs(along) > abs(greatest) * bound:
            best, greatest = row, along / bound
    missing = _load_face(wheels, limit, best, greatest, demand, total, out)
    close, chosen, share = CLOSE * total * abs(greatest), best, greatest
    if missing <= close:
        return abs(greatest)
    for row in range(faces.shape[0]):
        along, bound = _full(faces, row, limit, demand)
        tied = abs(along) >= abs(greatest) * bound - close
        if missing > close and tied and bound > THIN * total and row != best:
            now = abs(greatest) if along > 0.0 else -abs(greatest)
            other = _load_face(wheels, limit, row, now, demand, total, out)
            if other < missing:
                missing, chosen, share = other, row, now
    _load_face(wheels, limit, chosen, share, demand, total, out)
    return abs(greatest)


@inlined
def _greatest_share(limit, out):
    greatest = 0.0
    for k in range(limit.shape[0]):
        if limit[k] > 0.0:
            greatest = max(greatest, abs(out[k]) / limit[k])
    return greatest


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

    Methods: 'minimax', 'least_squares'. Nothing is saturated: a share above 1 is out of reach.
    """
    if method not in ("minimax", "least_squares"):
        raise ValueError(f"method: must be 'minimax' or 'least_squares'; received {method!r}")
    demands = validate.finite("demands", demands)
    if demands.shape[-1:] != (3,):
        raise ValueError(f"demands: must have shape (..., 3); received {demands.shape}")
    rows = np.ascontiguousarray(demands.reshape(-1, 3))
    out, greatest = np.empty((len(rows), array.count)), np.empty(len(rows))
    _share_all(wheel_set(array), array.momentum_limits(), rows, method == "minimax", out, greatest)
    return out.reshape(*demands.shape[:-1], array.count), greatest.reshape(demands.shape[:-1])
