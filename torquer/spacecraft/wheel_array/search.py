"""Numerical search for layouts: any layout with free angles, any measure of it, any demand.

A *layout* is a function from parameters (p,) to axes (n, 3). A *measure* is a function from axes,
and from others near them, to smooth pieces (m,): numbers of which the greatest, with the axes near
themselves, is to be least. (Near others, pieces may be of what is worst there.)
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.spacecraft.wheel_array.demand import (
    Ellipsoid,
    momentum_pieces,
    norm_pieces,
    share_pieces,
)
from torquer.spacecraft.wheel_array.faces import volume
from torquer.spacecraft.wheel_array.minimise import HUGE, TOLERANCE, least_greatest


class Found(NamedTuple):
    """The best parameters that were found, the axes (n, 3) there, and the measure.

    `residual`: residual of the optimality conditions, 0 where all of them hold.
    """

    parameters: np.ndarray
    axes: np.ndarray
    measure: float
    residual: float

    @property
    def is_optimal(self) -> bool:
        """Whether the conditions of a local optimum hold; the global optimum is not proven."""
        return self.residual <= TOLERANCE


def least_norm(demand) -> Callable:
    """Measure: greatest norm of the wheels' momenta [N m s] under least squares."""
    return lambda axes, near: norm_pieces(axes, demand, near)


def least_peak(demand, momentum_limit_n_m_s=1.0) -> Callable:
    """Measure: greatest share of its limit that a wheel needs under minimax.

    With the limit left out it is the greatest momentum [N m s]. One number or one per wheel.
    """
    limit = np.asarray(momentum_limit_n_m_s, dtype=np.float64).reshape(-1, 1)
    return lambda axes, near: share_pieces(limit * axes, demand)


def least_squares_peak(demand) -> Callable:
    """Measure: greatest momentum [N m s] of a wheel under least squares."""
    return lambda axes, near: momentum_pieces(axes, demand)


def greatest_worst_rate(inertia_kg_m2, momentum_limit_n_m_s=1.0) -> Callable:
    """Measure: inverse [s/rad] of the rate that is reached about every axis."""
    tensor = validate.inertia_tensor("inertia_kg_m2", inertia_kg_m2)
    return least_peak(Ellipsoid(tensor), momentum_limit_n_m_s)


def free_axes(parameters) -> np.ndarray:
    """Layout: all axes free; polar angle and azimuth [deg] of one after the other."""
    polar, azimuth = np.radians(np.reshape(parameters, (-1, 2))).T
    across = np.sin(polar)
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), np.cos(polar)])


def find_layout(
    layout: Callable, measure: Callable, lower, upper, starts: int = 16, seed: int = 0
) -> Found:
    """The layout with the least measure between bounds on its parameters.

    From each of `starts` random points down to a local optimum of the minimax problem; the best of
    them, the first one of equals. That it is the global optimum is not proven, but the conditions
    of a local one are checked: `Found.residual`. Of many equally good parameters the choice may
    depend on the processor; the measure does not. Deterministic for a seed.
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if lower.ndim != 1 or lower.shape != upper.shape or not np.all(lower < upper):
        raise ValueError(
            "lower, upper: must have equal lengths, each lower bound below its upper one; "
            f"received {lower.tolist()}, {upper.tolist()}"
        )

    def axes_of(parts):
        return np.asarray(layout(lower + parts * (upper - lower)), dtype=np.float64)

    def pieces(parts, near):
        return measure(axes_of(parts), axes_of(near))

    points = np.random.default_rng(seed).uniform(size=(starts, len(lower)))
    best = least_greatest(pieces, points)
    if best.value >= HUGE:
        raise ValueError("layout: must span space at some of the points; received planes or lines")
    parameters = lower + best.parts * (upper - lower)
    return Found(parameters, np.asarray(layout(parameters)), best.value, best.residual)


def greatest_volume(count: int, starts: int = 100, seed: int = 0) -> Found:
    """Axes (n, 3) with the greatest volume of the envelope of equal wheels, all directions free.

    The volume is a sum of |a . c| in each axis a: convex, so that turning one axis after the
    other along its gradient always enlarges it. The best end of many random starts, at which
    `Found.residual` is by how much an axis still turns. Found, not proven: for three to five
    wheels every start ends at a regular pyramid with edges at 54.7 deg from the height; for six
    to eight the best is none (six: the axes of an icosahedron, 2.6 % more). From eight on one or
    two starts in a hundred end at the best of 300, and the best of 100 may be 0.4 % below it.
    `parameters` are those of `free_axes`.
    """
    random = np.random.default_rng(seed)
    ends = [_enlarge(random.normal(size=(count, 3))) for _ in range(starts)]
    volumes = np.array([volume(end) for end in ends])
    axes = ends[np.argmax(volumes >= volumes.max() * (1.0 - 1e-9))]  # the first of equals
    polar = np.degrees(np.arccos(axes[:, 2]))
    azimuth = np.degrees(np.arctan2(axes[:, 1], axes[:, 0]))
    parameters, turned = np.column_stack([polar, azimuth]).ravel(), _turn(axes)
    return Found(parameters, axes, volume(axes), float(np.abs(turned - axes).max()))


def _enlarge(axes, most: int = 1000) -> np.ndarray:
    """Axes turned one after the other until the volume grows no more."""
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    for _ in range(most):
        before = axes.copy()
        for k in range(len(axes)):
            axes[k] = _gradient(axes, k)
        if np.abs(axes - before).max() < 1e-14:
            break
    return axes


def _turn(axes) -> np.ndarray:
    """Each axis turned along its gradient, the others as they are: the axes, at an optimum."""
    return np.array([_gradient(axes, k) for k in range(len(axes))])


def _gradient(axes, k: int) -> np.ndarray:
    """Direction in which the volume grows most with axis k."""
    rest = np.delete(axes, k, axis=0)
    i, j = np.triu_indices(len(rest), 1)
    normals = np.cross(rest[i], rest[j])
    gradient = np.sign(normals @ axes[k]) @ normals
    return gradient / np.linalg.norm(gradient)
