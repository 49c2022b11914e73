"""Numeric search for layouts: any layout with free angles, any measure of it, any demand.

A *layout* is a function from parameters (p,) to axes (n, 3); a *measure* one from axes to the
number that is to be least.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from torquer.wheel_array.demand import (
    Ellipsoid,
    greatest_momentum,
    greatest_norm,
    greatest_share_of,
)
from torquer.wheel_array.envelope import volume


class Found(NamedTuple):
    """The best parameters that were found, the axes (n, 3) there, and the measure."""

    parameters: np.ndarray
    axes: np.ndarray
    measure: float


def least_norm(demand) -> Callable:
    """Measure: greatest norm of the wheels' momenta [N m s] under least squares."""
    return lambda axes: greatest_norm(axes, demand)


def least_peak(demand, momentum_limit_n_m_s=1.0) -> Callable:
    """Measure: greatest share of its limit that a wheel needs under minimax.

    With the limit left out it is the greatest momentum [N m s]. One number or one per wheel.
    """
    limit = np.asarray(momentum_limit_n_m_s, dtype=np.float64).reshape(-1, 1)
    return lambda axes: greatest_share_of(limit * axes, demand)


def least_squares_peak(demand) -> Callable:
    """Measure: greatest momentum [N m s] of a wheel under least squares."""
    return lambda axes: greatest_momentum(axes, demand)


def greatest_worst_rate(inertia_kg_m2, momentum_limit_n_m_s=1.0) -> Callable:
    """Measure: inverse of the rate [s/rad] that is reached about every axis."""
    return least_peak(Ellipsoid(inertia_kg_m2), momentum_limit_n_m_s)


def free_axes(parameters) -> np.ndarray:
    """Layout: all axes free; polar angle and azimuth [deg] of one after the other."""
    polar, azimuth = np.radians(np.reshape(parameters, (-1, 2))).T
    across = np.sin(polar)
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), np.cos(polar)])


def search(
    layout: Callable, measure: Callable, lower, upper, starts: int = 16, seed: int = 0
) -> Found:
    """The layout with the least measure between bounds on its parameters.

    From each of `starts` random points a gradient descent, from the best end a simplex search,
    which kinks do not stop. Deterministic for a seed; the best that was found, no proof.
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if lower.ndim != 1 or lower.shape != upper.shape or not np.all(lower < upper):
        raise ValueError(
            "lower, upper: must be as many, each lower one below its upper one; "
            f"received {lower.tolist()}, {upper.tolist()}"
        )

    def score(parameters):
        axes = np.asarray(layout(parameters))
        if np.linalg.svd(axes, compute_uv=False)[2] < 1e-6:
            return 1e300  # all in one plane
        return measure(axes)

    bounds = list(zip(lower, upper, strict=True))
    points = np.random.default_rng(seed).uniform(lower, upper, size=(starts, len(lower)))
    ends = [minimize(score, point, method="L-BFGS-B", bounds=bounds) for point in points]
    best = min(ends, key=lambda end: end.fun)
    for _ in range(3):  # a fresh simplex goes on where an old one has grown flat
        options = {"xatol": 1e-9, "fatol": 1e-14 * best.fun, "adaptive": True, "maxiter": 4000}
        best = minimize(score, best.x, method="Nelder-Mead", bounds=bounds, options=options)
    return Found(best.x, np.asarray(layout(best.x)), float(best.fun))


def greatest_volume(count: int, starts: int = 100, seed: int = 0) -> Found:
    """Axes (n, 3) with the greatest volume of the envelope of equal wheels, all directions free.

    The volume is a sum of |a . c| in each axis a: convex, so that turning one axis after the
    other along its gradient always enlarges it. The best end of many random starts. Up to five
    wheels it is a regular pyramid with edges at 54.7 deg from the height; from six wheels on it
    is none (six: the axes of an icosahedron, 2.6 % more). `parameters` are those of `free_axes`.
    """
    random = np.random.default_rng(seed)
    ends = [_enlarged(random.normal(size=(count, 3))) for _ in range(starts)]
    axes = max(ends, key=volume)
    polar = np.degrees(np.arccos(axes[:, 2]))
    azimuth = np.degrees(np.arctan2(axes[:, 1], axes[:, 0]))
    return Found(np.column_stack([polar, azimuth]).ravel(), axes, volume(axes))


def _enlarged(axes, most: int = 1000) -> np.ndarray:
    """Axes turned one after the other until the volume grows no more."""
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    others = np.array([np.delete(np.arange(len(axes)), k) for k in range(len(axes))])
    i, j = np.triu_indices(len(axes) - 1, 1)
    for _ in range(most):
        before = axes.copy()
        for k, rest in enumerate(others):
            normals = np.cross(axes[rest[i]], axes[rest[j]])
            gradient = np.sign(normals @ axes[k]) @ normals
            axes[k] = gradient / np.linalg.norm(gradient)
        if np.abs(axes - before).max() < 1e-14:
            break
    return axes
