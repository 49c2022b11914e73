"""Changes of a scenario's own values by deviations, which may be any numbers.

Whatever they are, what they lead to is possible: an attitude stays a unit quaternion, an inertia
that of a distribution of mass.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.maths.geometry.quaternion import from_rotation_vector, multiply

#: Elements of a symmetric matrix: xx, yy, zz, xy, xz, yz.
_ROWS, _COLUMNS = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
#: Second moments of mass over the sum of a body's own three: what rounding makes of 0, and what
#: negative ones become.
_ROUNDING, _THINNEST = 1e-13, 1e-6


class Change(NamedTuple):
    """How many deviations it has; the shape of a value, None for any; values [n, ...] of own values
    [n, ...] and deviations [n, k]."""

    numbers: int
    shape: tuple[int, ...] | None
    of: Callable[[np.ndarray, np.ndarray], np.ndarray]


def _sum(own: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    return own + deviations.reshape(own.shape)


def _product(own: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    return own * np.exp(deviations).reshape(-1, *(1,) * (own.ndim - 1))


def _turn(own: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    """Quaternions (body to reference) times rotations, by their vectors in the body [rad]."""
    turned = [
        multiply(tuple(q), from_rotation_vector(tuple(turn)))
        for q, turn in zip(own, deviations, strict=True)
    ]
    return np.array(turned).reshape(own.shape)


def _with_mass(own: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    """Inertias with their elements changed by deviations, as far as a body can have them.

    The second moments of mass, S = tr(J)/2 - J, are not negative: no moment of inertia exceeds the
    sum of the two others. Those that would be become those of a thin body.
    """
    change = np.zeros_like(own)
    change[:, _ROWS, _COLUMNS] = change[:, _COLUMNS, _ROWS] = deviations
    found = own + change
    half = 0.5 * np.trace(found, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    values, vectors = np.linalg.eigh(half - found)
    size = 0.5 * np.trace(own, axis1=1, axis2=2)
    cut = values[:, 0] < -_ROUNDING * size
    kept = np.maximum(values, _THINNEST * size[:, None])[cut]
    mass = vectors[cut] * kept[:, None] @ np.swapaxes(vectors[cut], 1, 2)
    found[cut] = np.sum(kept, axis=1)[:, None, None] * np.eye(3) - mass
    return found


#: Changes by name.
CHANGES = {
    "number": Change(1, (), _sum),
    "vector": Change(3, (3,), _sum),
    "factor": Change(1, None, _product),
    "rotation": Change(3, (4,), _turn),
    "inertia": Change(6, (3, 3), _with_mass),
}
