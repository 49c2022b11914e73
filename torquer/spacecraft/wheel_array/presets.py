"""Arrays as specified in files: a layout by its kind and angles, or by axes, and limits."""

import functools
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from torquer.base.spec import Spec, Vector, by_kind
from torquer.spacecraft.wheel_array.layout import (
    Limit,
    WheelArray,
    checked_axes,
    four_sided_pyramid,
    icosahedral,
    orthogonal,
    orthogonal_and_skew,
    regular_pyramid,
)

Angle = Annotated[float, Field(gt=0.0, lt=90.0)]


def _axes(value):
    if not 3 <= len(value) <= 12:
        raise ValueError(f"axes: must be 3 to 12; received {len(value)}")
    return checked_axes(value)


class FourSided(Spec):
    """Four-sided pyramid, height along x1: edges at alpha from it, at beta from x3 across it."""

    kind: Literal["four_sided_pyramid"]
    alpha_deg: Angle
    """Angle of the edges from the height."""
    beta_deg: Angle
    """Angle of the edges from x3, across the height."""

    def rows(self) -> np.ndarray:
        """Axes (4, 3)."""
        return four_sided_pyramid(self.alpha_deg, self.beta_deg)


class Regular(Spec):
    """Regular pyramid, height along x1, edges at gamma from it."""

    kind: Literal["regular_pyramid"]
    count: int = Field(ge=3, le=12)
    """Number of wheels."""
    gamma_deg: Angle
    """Angle of the edges from the height."""

    def rows(self) -> np.ndarray:
        """Axes (count, 3)."""
        return regular_pyramid(self.count, self.gamma_deg)


class Orthogonal(Spec):
    """Three axes along the body's."""

    kind: Literal["orthogonal"]

    def rows(self) -> np.ndarray:
        """Axes (3, 3)."""
        return orthogonal()


class OrthogonalAndSkew(Spec):
    """Three axes along the body's and a fourth at equal angles to them."""

    kind: Literal["orthogonal_and_skew"]

    def rows(self) -> np.ndarray:
        """Axes (4, 3)."""
        return orthogonal_and_skew()


class Icosahedral(Spec):
    """Six axes through the vertices of an icosahedron."""

    kind: Literal["icosahedral"]

    def rows(self) -> np.ndarray:
        """Axes (6, 3)."""
        return icosahedral()


class Free(Spec):
    """Any axes, of any length, in the body frame."""

    kind: Literal["axes"]
    axes: Annotated[tuple[Vector, ...], AfterValidator(_axes)]
    """Axes of the wheels in the body, of any length."""

    def rows(self) -> np.ndarray:
        """Axes (n, 3)."""
        return np.array(self.axes)


_Layouts = FourSided | Regular | Orthogonal | OrthogonalAndSkew | Icosahedral | Free

#: Every layout by its `kind`.
LAYOUTS = by_kind(_Layouts)
AnyLayout = Annotated[_Layouts, Field(discriminator="kind")]


class Wheels(Spec):
    """A wheel array: layout, limits, lost wheels."""

    layout: AnyLayout
    """Directions of the wheels' axes."""
    momentum_limit_n_m_s: Limit | tuple[Limit, ...]
    """Greatest momentum, one number or one per wheel."""
    torque_limit_n_m: Limit | tuple[Limit, ...] | None = None
    """Greatest torque, one number or one per wheel; left out: no limit."""
    lost: tuple[int, ...] = ()
    """Numbers, from 0, of wheels that are dead from the start."""

    @model_validator(mode="after")
    def _is_an_array(self):
        self.array()
        return self

    def array(self) -> WheelArray:
        """The array itself."""
        axes = self.layout.rows().tobytes()
        return _array(axes, self.momentum_limit_n_m_s, self.torque_limit_n_m, self.lost)


@functools.lru_cache(64)  # asked for several times in each preparation
def _array(axes: bytes, momentum_limit_n_m_s, torque_limit_n_m, lost: tuple) -> WheelArray:
    return WheelArray(
        axes=tuple(map(tuple, np.frombuffer(axes).reshape(-1, 3).tolist())),
        momentum_limit_n_m_s=momentum_limit_n_m_s,
        torque_limit_n_m=torque_limit_n_m,
        lost=lost,
    )
