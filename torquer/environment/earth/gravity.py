"""Gravity of the Earth: EGM2008 to degree and order 36, and the gravity-gradient torque.

Frames: Earth-fixed for EGM2008; the rest in any one frame.
"""

import math
from functools import cache
from pathlib import Path

import numpy as np

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.compile.engine import inlined, kernel
from torquer.environment.earth import harmonics
from torquer.environment.earth.harmonics import Harmonics
from torquer.maths.geometry.vec3 import cross, dot, scale, sym_vec

FOLDER = Path(__file__).parent / "coefficients"
#: Degree and order to which coefficients are shipped.
MAX_DEGREE = 36
#: Reference radius of EGM2008 [m]; its GM is that of `torquer.base.conventions`.
REFERENCE_RADIUS_M = 6378136.3


@cache
def egm2008() -> tuple[np.ndarray, np.ndarray]:
    """Fully normalised C and S [n, m] of EGM2008 (tide free); C_00 and degree 1 are zero."""
    n, m, *parts = np.loadtxt(FOLDER / "egm2008_degree_36.csv", delimiter=",", skiprows=1).T
    out = np.zeros((2, MAX_DEGREE + 1, MAX_DEGREE + 1))
    out[:, n.astype(int), m.astype(int)] = parts
    return out[0], out[1]


def norms(degree: int) -> np.ndarray:
    """Factors [n, m] from fully normalised to plain coefficients."""
    out = np.zeros((degree + 1, degree + 1))
    for n in range(degree + 1):
        square = 2.0 * n + 1.0
        out[n, 0] = np.sqrt(square)
        for m in range(1, n + 1):
            square /= (n - m + 1.0) * (n + m)
            out[n, m] = np.sqrt(2.0 * square)
    return out


def pack(degree: int, order: int | None = None) -> Harmonics:
    """EGM2008 without its central part, truncated at a degree and an order (default: the degree).

    ValueError unless 0 <= order <= degree <= 36.
    """
    order = degree if order is None else order
    if not 0 <= degree <= MAX_DEGREE:
        raise ValueError(f"degree: must lie within 0..{MAX_DEGREE}; received {degree}")
    if not 0 <= order <= degree:
        raise ValueError(f"order: must lie within 0..{degree}, the degree; received {order}")
    size = degree + 1
    keep = norms(degree) * (np.arange(size) <= order)
    c, s = (part[:size, :size] * keep for part in egm2008())
    factor = MU_EARTH_M3_S2 / REFERENCE_RADIUS_M**2
    return harmonics.pack(c, s, REFERENCE_RADIUS_M, factor)


@kernel
def central(r_m):
    """Acceleration [m/s^2] by the Earth as a point mass, at a position [m], in its frame."""
    r2 = dot(r_m, r_m)
    pull = -MU_EARTH_M3_S2 / (r2 * np.sqrt(r2))
    return (pull * r_m[0], pull * r_m[1], pull * r_m[2])


#: Acceleration [m/s^2] beyond the central one, Earth-fixed, at an Earth-fixed position [m].
beyond_central = harmonics.gradient


@inlined
def gravity_gradient_torque(inertia, gravity_gradient_body):
    """Torque [N m] in the body: 3 mu/r^3 e x J e, e the unit radius vector.

    `inertia` [kg m^2] as `sym_vec` takes it; `gravity_gradient_body`: e sqrt(3 mu/r^3) in the body
    [1/s], sqrt(3) omega0 e on a circular orbit. Source: WHEEL (6.2).
    """
    return cross(gravity_gradient_body, sym_vec(inertia, gravity_gradient_body))


@inlined
def gravity_gradient_at(r_m):
    """Radius vector of length sqrt(3 mu/r^3) [1/s], the argument of the torque, at a position."""
    square = dot(r_m, r_m)
    return scale(math.sqrt(3.0 * MU_EARTH_M3_S2) / (square * math.sqrt(math.sqrt(square))), r_m)


@kernel
def gravity_gradient_vector(r_m):
    """Vectors [n, 3] 1/s of `gravity_gradient_at`, at positions [n, 3] m."""
    out = np.empty_like(r_m)
    for i in range(len(r_m)):
        found = gravity_gradient_at((r_m[i, 0], r_m[i, 1], r_m[i, 2]))
        out[i, 0], out[i, 1], out[i, 2] = found
    return out
