"""Gravity-gradient torque on a rigid body, for any inertia tensor and any orbit."""

import numpy as np

from torquer.conventions import MU_EARTH_M3_S2
from torquer.engine import inlined
from torquer.geometry.vec3 import cross, sym_vec


@inlined
def gravity_gradient_torque(inertia, gravity_gradient_body):
    """Torque [N m] in the body: 3 mu/r^3 e x J e, e the unit radius vector.

    `inertia` [kg m^2] as `sym_vec` takes it; `gravity_gradient_body`: e sqrt(3 mu/r^3) in the body
    [1/s], sqrt(3) omega0 e on a circular orbit. Source: WHEEL (6.2).
    """
    return cross(gravity_gradient_body, sym_vec(inertia, gravity_gradient_body))


def gravity_gradient_vector(r_m: np.ndarray) -> np.ndarray:
    """Radius vectors [n, 3] with the length sqrt(3 mu/r^3) [1/s]: all that the torque needs."""
    square = np.einsum("ni,ni->n", r_m, r_m)
    scale = np.sqrt(3.0 * MU_EARTH_M3_S2) / (square * np.sqrt(np.sqrt(square)))  # of r^(5/2)
    return scale[:, None] * r_m
