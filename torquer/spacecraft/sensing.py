"""What three-axis sensors share: mounting errors, range and resolution."""

import math

import numpy as np

from torquer.engine import kernel
from torquer.geometry.quaternion import from_rotation_vector, to_dcm
from torquer.geometry.vec3 import as_matrix


@kernel
def through_electronics(value, limit, resolution):
    """Reading of each axis: clipped at the range, rounded to the resolution (0: none)."""
    x, y, z = value
    x, y, z = min(max(x, -limit), limit), min(max(y, -limit), limit), min(max(z, -limit), limit)
    if resolution > 0.0:
        x = resolution * math.floor(x / resolution + 0.5)
        y = resolution * math.floor(y / resolution + 0.5)
        z = resolution * math.floor(z / resolution + 0.5)
    return (x, y, z)


def mounting_matrix(scale_error, misalignment_deg) -> tuple:
    """Matrix from body components to the sensor's channels: scale errors after a small turn."""
    turn = np.array(to_dcm(from_rotation_vector(tuple(np.radians(misalignment_deg)))))
    return as_matrix(np.diag(1.0 + np.array(scale_error)) @ turn.T)
