"""The field of pairs of square coils, by the law of Biot and Savart.

A pair lies in planes normal to axis 3, its centre at the origin; one turn with 1 A each, in the
same sense. The law of a straight conductor, of ends a and b as seen from the point, is

    B = (mu0 I/4 pi) (a x b) (|a| + |b|)/(|a| |b| (|a| |b| + a.b)).
"""

import numpy as np
from scipy.optimize import brentq

from torquer.base.conventions import MU_0_H_M

_CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def conductor_field(first, last, points) -> np.ndarray:
    """Flux density [T] `[n, 3]` at points [m] of a straight conductor with 1 A."""
    a, b = np.asarray(first) - points, np.asarray(last) - points
    length_a, length_b = (np.linalg.norm(x, axis=1) for x in (a, b))
    product = length_a * length_b
    scale = (length_a + length_b) / (product * (product + np.sum(a * b, axis=1)))
    return MU_0_H_M / (4.0 * np.pi) * np.cross(a, b) * scale[:, None]


def pair_field(side_m: float, apart_m: float, points) -> np.ndarray:
    """Flux density [T] `[n, 3]` of a pair of squares of a side, so far apart."""
    points = np.atleast_2d(points)
    field = np.zeros(points.shape)
    for height in (-0.5 * apart_m, 0.5 * apart_m):
        corners = [(0.5 * side_m * x, 0.5 * side_m * y, height) for x, y in _CORNERS]
        for first, last in zip(corners, corners[1:] + corners[:1], strict=True):
            field += conductor_field(first, last, points)
    return field


def flattest_ratio() -> float:
    """Distance over side at which the field's second derivative along the axis vanishes."""
    step = 1e-3

    def curvature(ratio):
        along = [[0.0, 0.0, z] for z in (-step, 0.0, step)]
        low, middle, high = pair_field(1.0, ratio, along)[:, 2]
        return (low - 2.0 * middle + high) / (middle * step**2)

    return float(brentq(curvature, 0.3, 0.9))


def off_uniform(side_m: float, apart_m: float, points) -> np.ndarray:
    """Difference of the field from that in the centre, over it, at points."""
    centre = pair_field(side_m, apart_m, [[0.0, 0.0, 0.0]])[0]
    return np.linalg.norm(pair_field(side_m, apart_m, points) - centre, axis=1) / centre[2]
