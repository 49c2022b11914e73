"""What a position and a velocity say of an orbit."""

import math

import numpy as np

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.environment.orbit.kepler import Extent, mean_motion


def semi_major_axis(r, v) -> float:
    """Osculating semi-major axis [m] of a state; not positive beyond escape."""
    r, v = np.ravel(r), np.ravel(v)
    with np.errstate(over="ignore"):  # far beyond escape
        return float(1.0 / (2.0 / np.linalg.norm(r) - v @ v / MU_EARTH_M3_S2))


def extent_of(r, v) -> Extent:
    """Perigee, apogee and inclination of the osculating orbit, in inertial axes."""
    axis, normal = semi_major_axis(r, v), np.cross(r, v)
    parameter = normal @ normal / MU_EARTH_M3_S2  # a (1 - e^2)
    eccentricity = math.sqrt(max(0.0, 1.0 - parameter / axis))
    tilt = math.atan2(math.hypot(normal[0], normal[1]), normal[2])
    return Extent(axis * (1.0 - eccentricity), axis * (1.0 + eccentricity), tilt)


def mean_rate(r, v) -> float:
    """Mean orbital rate [rad/s] of states (n, 3): over the first revolution of them."""
    axes = np.array([semi_major_axis(*each) for each in zip(r, v, strict=True)])
    return mean_motion(float(np.mean(axes)))
