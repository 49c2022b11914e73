"""How fast a satellite can rotate with its wheels alone: rates from momentum, and accelerations.

The satellite turns about a fixed axis, its total momentum is zero. The relation of rates
[rad/s] to the momentum envelope is that of accelerations [rad/s^2] to the torque envelope.
"""

from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.spacecraft.wheel_array.demand import Ellipsoid, greatest_share
from torquer.spacecraft.wheel_array.envelope import Envelope


class WorstCase(NamedTuple):
    """The rate [rad/s] that is reached about every axis, and the axis (3,) that limits it."""

    rate: float
    axis: np.ndarray


def required_momenta(inertia_kg_m2, rate: float) -> Ellipsoid:
    """Momenta needed for that rate about any axis: the ellipsoid I e rate.

    Source: WHEEL (2.1).
    """
    return Ellipsoid(rate * validate.inertia_tensor("inertia_kg_m2", inertia_kg_m2))


def semi_axes(inertia_kg_m2, rate: float, limit: float) -> np.ndarray:
    """Semi-axes of the required ellipsoid in units of a wheel's limit, ascending by inertia.

    Source: WHEEL (4.1).
    """
    return np.linalg.eigvalsh(required_momenta(inertia_kg_m2, rate).matrix) / limit


def rate_about(envelope: Envelope, inertia_kg_m2, axes) -> np.ndarray:
    """Greatest rate about each of the axes (..., 3), any lengths: extent along I e over |I e|.

    Source: WHEEL (3.1), for any axis.
    """
    unit = validate.unit_rows("axes", np.reshape(axes, (-1, 3))).reshape(np.shape(axes))
    momenta = unit @ validate.inertia_tensor("inertia_kg_m2", inertia_kg_m2)
    return envelope.extent(momenta) / np.linalg.norm(momenta, axis=-1)


def worst_case(envelope: Envelope, inertia_kg_m2) -> WorstCase:
    """Greatest rate whose ellipsoid is inside the envelope: min of bound / |I n| over the faces."""
    unit = required_momenta(inertia_kg_m2, 1.0)
    normals, bounds = envelope.half_spaces
    along = normals @ unit.matrix
    worst = along[np.argmax(np.linalg.norm(along, axis=1) / np.maximum(bounds, 1e-300))]
    return WorstCase(1.0 / greatest_share(envelope, unit), worst / np.linalg.norm(worst))
