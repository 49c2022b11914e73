"""Field of a sum of spherical harmonics: Gauss coefficients as solid harmonics."""

import math
from functools import cache

import numpy as np

from torquer.base.conventions import FIELD_RADIUS_M
from torquer.environment.earth import harmonics
from torquer.environment.earth.harmonics import Harmonics


@cache
def _schmidt(degree: int) -> np.ndarray:
    """Factors [n, m] of Schmidt's quasi-normalisation."""
    factors = np.zeros((degree + 1, degree + 1))
    for n in range(1, degree + 1):
        for m in range(n + 1):
            ratio = math.factorial(n - m) / math.factorial(n + m)
            factors[n, m] = math.sqrt((2 if m else 1) * ratio)
    return factors


def pack(g: np.ndarray, h: np.ndarray) -> Harmonics:
    """Expansion of B from Schmidt quasi-normalised g and h `[n, m]`, in tesla.

    B = -grad V, V = R sum (R/r)^(n+1) (g cos m lambda + h sin m lambda) P_nm, R = 6371.2 km.
    """
    factors = _schmidt(g.shape[0] - 1)
    return harmonics.pack(g * factors, h * factors, FIELD_RADIUS_M, -1.0)
