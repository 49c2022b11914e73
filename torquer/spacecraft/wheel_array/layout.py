"""Layouts: axes and limits of the wheels, with presets of the usual kinds."""

import functools
import math
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from torquer.base import validate
from torquer.base.spec import Spec, Vector
from torquer.maths.geometry.vec3 import as_vector
from torquer.spacecraft.wheel_array.planes import find_rank

Limit = Annotated[float, Field(gt=0.0)]
#: Limits of an array: least, greatest, and greatest ratio. Beyond, their cubes leave the range of
#: floats, and weak wheels vanish in the rounding of strong ones.
LEAST, MOST, MOST_UNEQUAL = 1e-12, 1e12, 1e6
#: Wheels of an array at most.
MOST_WHEELS = 12


def checked_axes(value: tuple[tuple[float, ...], ...]):
    """Unit axes as tuples; ValueError for fewer than three or all in one plane."""
    return _checked(np.array(value, dtype=np.float64).tobytes())


@functools.lru_cache(64)  # members of a campaign have the same ones; zeros differ by their signs
def _checked(numbers: bytes) -> tuple:
    rows = validate.unit_rows("axes", np.frombuffer(numbers).reshape(-1, 3))
    if find_rank(rows) < 3:
        raise ValueError(
            f"axes: must hold three that do not lie in one plane; received {rows.tolist()}"
        )
    return tuple(as_vector(row) for row in rows)


class WheelArray(Spec):
    """Reaction wheels: 3 to 12 axes in the body frame (normalised), and their limits.

    `momentum_limit_n_m_s`, `torque_limit_n_m`: one number or one per wheel; the torque limit may
    be left out. `lost`: numbers, from 0, of the wheels that do not work.
    """

    axes: Annotated[
        tuple[Vector, ...],
        Field(min_length=3, max_length=MOST_WHEELS),
        AfterValidator(checked_axes),
    ]
    momentum_limit_n_m_s: Limit | tuple[Limit, ...]
    torque_limit_n_m: Limit | tuple[Limit, ...] | None = None
    lost: tuple[int, ...] = ()

    @model_validator(mode="after")
    def _one_per_wheel(self):
        for key in ("momentum_limit_n_m_s", "torque_limit_n_m"):
            value = getattr(self, key)
            if isinstance(value, tuple) and len(value) != self.count:
                raise ValueError(
                    f"{key}: must be one number or one per wheel ({self.count}); "
                    f"received {len(value)}"
                )
            if value is not None:
                _check_sizes(key, np.atleast_1d(value))
        if len(set(self.lost)) < len(self.lost) or not set(self.lost) <= set(range(self.count)):
            raise ValueError(
                f"lost: must be different wheel numbers from 0 to {self.count - 1}; "
                f"received {self.lost}"
            )
        return self

    @property
    def count(self) -> int:
        """Number of wheels, lost ones included."""
        return len(self.axes)

    def _working(self, limit) -> np.ndarray:
        limits = np.full(self.count, limit, dtype=np.float64)
        limits[list(self.lost)] = 0.0
        return limits

    def momentum_limits(self) -> np.ndarray:
        """Greatest momentum of each wheel [N m s], (n,); zero for lost wheels."""
        return self._working(self.momentum_limit_n_m_s)

    def torque_limits(self) -> np.ndarray:
        """Greatest torque of each wheel [N m], (n,); zero for lost wheels. ValueError if unset."""
        if self.torque_limit_n_m is None:
            raise ValueError("torque_limit_n_m: must be given for torques; received None")
        return self._working(self.torque_limit_n_m)

    def without(self, *wheels: int) -> "WheelArray":
        """The array after the further loss of these wheels."""
        return self._changed(lost=tuple(sorted({*self.lost, *wheels})))

    def turned(self, rotation) -> "WheelArray":
        """The array mounted with another attitude: (3, 3) matrix, array to body frame."""
        matrix = validate.rotation_matrix("rotation", rotation)
        return self._changed(axes=tuple(map(as_vector, np.array(self.axes) @ matrix.T)))

    def _changed(self, **changes) -> "WheelArray":
        return type(self)(**{**self.model_dump(), **changes})


def _check_sizes(key: str, limits) -> None:
    equal = limits.max() <= MOST_UNEQUAL * limits.min()
    if not equal or limits.min() < LEAST or limits.max() > MOST:
        raise ValueError(
            f"{key}: must be from {LEAST:g} to {MOST:g} and within a factor of {MOST_UNEQUAL:g} "
            f"of one another; received {limits.tolist()}"
        )


def total_momentum(axes, wheel_momenta) -> np.ndarray:
    """Sum of the wheels' momenta as a vector [N m s]; axes (n, 3), momenta (..., n).

    Source: WHEEL (1.1), WHEEL (5.1).
    """
    # (not by BLAS, whose rounding depends on the number of rows)
    return np.einsum("...n,nk->...k", np.asarray(wheel_momenta), np.asarray(axes))


def four_sided_pyramid(alpha_deg: float, beta_deg: float) -> np.ndarray:
    """Axes (4, 3) along the side edges of a four-sided pyramid whose height is along x1.

    alpha: from the height to each edge; beta: from x3 to the edges' projections on x2 x3.
    Source: WHEEL (1.3), with half-extents d1 = cos(alpha), d2 = sin(alpha) sin(beta), d3.
    """
    alpha, beta = math.radians(alpha_deg), math.radians(beta_deg)
    d1 = math.cos(alpha)
    d2, d3 = math.sin(alpha) * math.sin(beta), math.sin(alpha) * math.cos(beta)
    return np.array([[d1, d2, d3], [d1, d2, -d3], [d1, -d2, -d3], [d1, -d2, d3]])


def regular_pyramid(count: int, gamma_deg: float) -> np.ndarray:
    """Axes (n, 3) along the side edges of a regular pyramid whose height is along x1.

    gamma: from the height to each edge; wheel k = 1..n stands at k 360/n deg from x2 to x3.
    Source: WHEEL (1.4), which has n = 6.
    """
    gamma, turn = math.radians(gamma_deg), 2.0 * math.pi * np.arange(1, count + 1) / count
    across = math.sin(gamma) * np.array([np.cos(turn), np.sin(turn)])
    return np.column_stack([np.full(count, math.cos(gamma)), *across])


def orthogonal() -> np.ndarray:
    """Three axes along the body's."""
    return np.eye(3)


def orthogonal_and_skew() -> np.ndarray:
    """Three axes along the body's and a fourth at equal angles to them."""
    return np.vstack([np.eye(3), np.full(3, 1.0 / math.sqrt(3.0))])


def icosahedral() -> np.ndarray:
    """Six axes through the vertices of an icosahedron: nearly isotropic."""
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    one = np.array([[0.0, 1.0, golden], [0.0, -1.0, golden]]) / math.hypot(1.0, golden)
    return np.vstack([np.roll(one, shift, axis=1) for shift in range(3)])
