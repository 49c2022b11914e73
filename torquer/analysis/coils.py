"""Capability of a coil set."""

import numpy as np

from torquer.spacecraft.actuators.coils import Coils


def coil_reach(coils: Coils) -> np.ndarray:
    """Largest dipole [A m^2] of the coil set along each body axis [3]."""
    limits = np.broadcast_to(coils.limit_a_m2, len(coils.axes))
    return np.abs(np.array(coils.axes)).T @ limits
