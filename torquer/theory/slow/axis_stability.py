"""Whether a spin about an axis of a body is stable: about the intermediate one nutation grows."""

import math

import numpy as np

from torquer.theory.validity import Limit

STABLE_AXIS = Limit(
    "growth of nutation about the intermediate axis per radian of the orbit", most=0.01,
    why="the axis must have the greatest or the least moment: about the intermediate one nutation "
    "grows by itself", of="laws about a spin axis", refuses=True,
    shown="moments 1, 2, 1.5: nutation grows from 14 to 82 deg in 20 revolutions",
)  # fmt: skip


def nutation_growth(inertia, rate_rad_s, orbital_rate_rad_s: float) -> float:
    """Rate at which nutation about the third axis grows, per radian of the orbit; 0: it does not.

    By Euler's equations linear about a spin around an intermediate axis. `inertia` [kg m^2]: rows.
    """
    tensor = np.asarray(inertia)
    low, high = np.linalg.eigvalsh(tensor[:2, :2])
    axial = float(tensor[2, 2])
    inner = (axial - low) * (high - axial) / (low * high)
    return abs(float(rate_rad_s[2])) * math.sqrt(max(inner, 0.0)) / orbital_rate_rad_s
