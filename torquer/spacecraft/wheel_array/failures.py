"""Capability after the loss of wheels, and what the pseudo-inverse leaves unused."""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection

from torquer.spacecraft.wheel_array.envelope import momentum_envelope, torque_envelope
from torquer.spacecraft.wheel_array.layout import WheelArray
from torquer.spacecraft.wheel_array.planes import span
from torquer.spacecraft.wheel_array.rates import rate_about, worst_case


class FailureCase(NamedTuple):
    """An array after a loss of wheels; volumes relative to the intact array.

    Rates and accelerations are about principal axes (by ascending inertia) and the worst axis;
    accelerations are None without torque limits.
    """

    lost: tuple[int, ...]
    rank: int
    volume: float
    inner_radius_n_m_s: float
    rates_rad_s: tuple[float, float, float]
    worst_rate_rad_s: float
    accelerations_rad_s2: tuple[float, float, float] | None
    worst_acceleration_rad_s2: float | None


def failure_table(array: WheelArray, inertia_kg_m2, most: int = 2) -> list[FailureCase]:
    """The array as it is, then after every loss of one wheel, two, and so on up to `most`."""
    working = [k for k in range(array.count) if k not in array.lost]
    whole = momentum_envelope(array).volume
    return [
        _case(array.without(*lost), lost, inertia_kg_m2, whole)
        for number in range(min(most, len(working)) + 1)
        for lost in combinations(working, number)
    ]


def _case(array, lost, inertia, whole) -> FailureCase:
    envelope = momentum_envelope(array)
    rates, worst = _rates(envelope, inertia)
    accelerations = worst_acceleration = None
    if array.torque_limit_n_m is not None:
        accelerations, worst_acceleration = _rates(torque_envelope(array), inertia)
    part = envelope.volume / whole if whole > 0.0 else 0.0
    return FailureCase(
        lost, envelope.rank, part, envelope.inner_radius, rates, worst,
        accelerations, worst_acceleration,
    )  # fmt: skip


def _rates(envelope, inertia):
    inertia = np.asarray(inertia, dtype=np.float64)
    inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
    principal = np.linalg.eigh(inertia)[1].T
    rates = tuple(float(rate) for rate in rate_about(envelope, inertia, principal))
    return rates, worst_case(envelope, inertia).rate


def least_squares_half_spaces(array: WheelArray) -> np.ndarray:
    """Rows (m, 3) of the set that least squares reaches with no wheel beyond its limit.

    The set is where all |row . H| <= 1: for n wheels up to 2 n faces, inside the envelope. Where
    the working axes have no authority, rows are so long that only H = 0 is inside.
    """
    limits = array.momentum_limits()
    works = limits > 0.0
    axes = np.array(array.axes)[works].reshape(-1, 3)
    held, rest = span(axes, limits[works])
    rows = np.linalg.pinv(held @ axes.T) @ held / limits[works, None]
    return np.vstack([rows, 1e300 * rest])


class LeastSquaresComparison(NamedTuple):
    """What least squares reaches, relative to what the array (and minimax) reaches."""

    volume: float
    inner_radius: float
    least_extent: float
    """In the worst direction."""
    direction: np.ndarray
    """That direction."""


def least_squares_against_minimax(array: WheelArray) -> LeastSquaresComparison:
    """How much of the envelope least squares leaves unused. ValueError for a flat envelope."""
    envelope = momentum_envelope(array)
    if envelope.rank < 3:
        raise ValueError(f"array: must span three dimensions; received rank {envelope.rank}")
    rows = least_squares_half_spaces(array)
    planes = np.vstack([np.column_stack([side * rows, -np.ones(len(rows))]) for side in (1, -1)])
    hull = ConvexHull(HalfspaceIntersection(planes, np.zeros(3)).intersections)
    # extents along h are 1/max|row . h|: the ratio is least at a vertex of the envelope
    shares = np.abs(envelope.vertices @ rows.T).max(axis=1)
    worst = envelope.vertices[np.argmax(shares)]
    radius = 1.0 / np.linalg.norm(rows, axis=1).max()
    return LeastSquaresComparison(
        hull.volume / envelope.volume,
        float(radius / envelope.inner_radius),
        float(1.0 / shares.max()),
        worst / np.linalg.norm(worst),
    )
