"""Directions in which axes have authority, and the planes of pairs: normals of a zonotope's faces.

Nearly degenerate axes are not forced to be degenerate. A normal in excess of those of the faces
does no harm, as its half-space contains the zonotope, too; a missing one does. So every pair of
axes has its normal, unless an existing normal is perpendicular to both to rounding.
"""

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import add_scaled, cross, dot, norm, scale

#: Axes that leave a line or a plane by less than this [rad] have no authority outside it.
FLAT = 1e-9
#: Component of an axis along a normal, or of another across it, that is rounding.
SAME = 1e-14


@kernel
def authority(axes, limit):
    """Orthonormal directions in which the working unit axes (n, 3) have authority, and how much.

    The first along an axis, the second in the plane with the axis farthest from that line, the
    third across it. How much: greatest component of an axis; 0 (and a zero vector) below `FLAT`.
    """
    none = (0.0, 0.0, 0.0)
    first, second, third, sizes = none, none, none, none
    for k in range(axes.shape[0]):
        if limit[k] > 0.0:
            first, sizes = (axes[k, 0], axes[k, 1], axes[k, 2]), (1.0, 0.0, 0.0)
            break
    most = FLAT
    for k in range(axes.shape[0]):
        axis = (axes[k, 0], axes[k, 1], axes[k, 2])
        across = add_scaled(axis, -dot(first, axis), first)
        if limit[k] > 0.0 and norm(across) > most:
            most, second = norm(across), across
            sizes = (1.0, most, 0.0)
    if sizes[1] == 0.0:
        return (first, second, third), sizes
    second = add_scaled(second, -dot(first, second), first)  # again: the rest of the rounding
    second = scale(1.0 / norm(second), second)
    normal, most = cross(first, second), FLAT
    for k in range(axes.shape[0]):
        size = abs(dot(normal, (axes[k, 0], axes[k, 1], axes[k, 2])))
        if limit[k] > 0.0 and size > most:
            most, third = size, normal
            sizes = (1.0, sizes[1], most)
    return (first, second, third), sizes


@inlined
def span_axes(held, vector):
    """Projection of a vector on the directions of an `authority`."""
    (first, second, _), sizes = held
    if sizes[2] > 0.0:
        return vector
    part = scale(dot(first, vector), first)
    return add_scaled(part, dot(second, vector), second)


def span(axes, lengths) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal directions (r, 3) that unit axes (n, 3) span, and those (3 - r, 3) they do not.

    Axes of length zero are left out.
    """
    axes = np.ascontiguousarray(axes, dtype=np.float64).reshape(-1, 3)
    frame, sizes = authority(axes, np.asarray(lengths, dtype=np.float64))
    held = np.array(frame)[np.array(sizes) > 0.0]
    return held, np.linalg.svd(np.vstack([held, np.zeros((3, 3))]))[2][len(held) :]


def find_rank(axes) -> int:
    """Dimension that unit axes (n, 3) span: 0 to 3."""
    return len(span(axes, np.ones(len(axes)))[0])


def pair_normals(axes) -> np.ndarray:
    """Unit normals (p, 3) to all pairs of axes (n, 3), unit; zero for two on the same line.

    Perpendicular to both axes to rounding, however close they are: the second one's part across the
    first is taken from their difference.
    """
    axes = np.asarray(axes, dtype=np.float64)
    i, j = np.triu_indices(len(axes), 1)
    first, other = axes[i], axes[j] * np.where(_dot(axes[i], axes[j]) < 0.0, -1.0, 1.0)[:, None]
    across = _across(first, _across(first, other - first))
    size = np.linalg.norm(across, axis=1)
    normals = np.cross(first, across / np.where(size > SAME, size, np.inf)[:, None])
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 0.5)


def face_rows(axes) -> np.ndarray:
    """Rows (F, 3 + n) of the planes of pairs: unit normal, and normal . axis, 0 in the plane.

    Larger faces first. What lies in a plane to rounding is in it; a plane whose axes are all in
    another's is left out.
    """
    axes = np.asarray(axes, dtype=np.float64)
    normals = pair_normals(axes)
    normals = normals[np.any(normals != 0.0, axis=1)]
    sides = normals @ axes.T
    inside = np.abs(sides) <= SAME
    order = np.argsort(-inside.sum(axis=1), kind="stable")
    kept: list[int] = []
    for row in order:
        if not any(np.all(inside[other] >= inside[row]) for other in kept):
            kept.append(row)
    return np.hstack([normals, np.where(inside, 0.0, sides)])[kept]


def _dot(a, b) -> np.ndarray:
    return np.einsum("pi,pi->p", a, b)


def _across(axis, vector) -> np.ndarray:
    return vector - _dot(axis, vector)[:, None] * axis
