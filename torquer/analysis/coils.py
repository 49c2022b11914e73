"""What a set of coils can do together."""

import numpy as np

from torquer.spacecraft.coils import Coils


def coil_reach(coils: Coils) -> np.ndarray:
    """Greatest dipole [A m^2] that the coils together can make along each body axis [3]."""
    limits = np.broadcast_to(coils.limit_a_m2, len(coils.axes))
    return np.abs(np.array(coils.axes)).T @ limits
