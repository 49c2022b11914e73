"""What three-axis sensors share: mounting errors, range and resolution."""

import numpy as np

from torquer.base.computing import by_scenario
from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import from_rotation_vector, to_dcm
from torquer.maths.geometry.vec3 import as_matrix


@inlined
def _rounded(value, resolution):
    return resolution * np.floor(value / resolution + 0.5)  # math.floor is of 64 bits only


@inlined
def _within(value, limit):
    return min(max(value, -limit), limit)


@inlined
def through_electronics(value, limit, resolution):
    """Reading of each axis: rounded to the resolution (0: not), never beyond the range."""
    x, y, z = value
    if resolution > 0.0:
        x, y, z = _rounded(x, resolution), _rounded(y, resolution), _rounded(z, resolution)
    return (_within(x, limit), _within(y, limit), _within(z, limit))


@by_scenario
def mounting_matrix(scale_error, misalignment_deg) -> tuple:
    """Matrix from body components to the sensor's channels: scale errors after a small turn."""
    turn = np.array(to_dcm(from_rotation_vector(tuple(np.radians(misalignment_deg)))))
    return as_matrix(np.diag(1.0 + np.array(scale_error)) @ turn.T)
