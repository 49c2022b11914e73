"""Parts of a body, as exposed to air and sunlight: boxes, cylinders, plates, spheres.

Parts do not shade each other.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.base import validate
from torquer.base.spec import Spec, Vector, by_kind, unit_vector

_Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
_Length = Annotated[float, Field(gt=0.0)]


class _Part(Spec):
    """What all parts have: a centre; how their surface reflects air and sunlight."""

    centre_m: Vector = (0.0, 0.0, 0.0)
    """Centre in body axes, from the centre of mass."""
    drag_coefficient: float = Field(default=2.0, gt=0.0)
    """Drag coefficient; 2 for inelastic impact."""
    specular_reflectivity: _Fraction = 0.0
    """Fraction of sunlight that is reflected as by a mirror."""
    diffuse_reflectivity: _Fraction = 0.0
    """Fraction of sunlight that is reflected in all directions; the rest is absorbed."""

    @model_validator(mode="after")
    def _no_more_light_leaves_than_comes(self):
        if self.specular_reflectivity + self.diffuse_reflectivity > 1.0 + 1e-12:
            raise ValueError(
                f"diffuse_reflectivity: must be at most {1.0 - self.specular_reflectivity:g}, what "
                f"specular_reflectivity leaves; received {self.diffuse_reflectivity:g}"
            )
        return self

    def shapes(self) -> list[list[float]]:
        """A row for each surface: areas [m^2] along, against, across its axis, and from anywhere;
        axis; centre [m].
        """
        axis = getattr(self, "axis", (0.0, 0.0, 1.0))
        return [[*self.areas_m2(), *axis, *self.centre_m]]


class _Directed(_Part):
    """A part with an axis, of any length when given."""

    axis: unit_vector("axis")
    """Axis of a cylinder or normal of a plate in the body, of any length."""


class Cylinder(_Directed):
    """Closed cylinder; `centre_m` is the middle of its axis."""

    kind: Literal["cylinder"] = "cylinder"
    radius_m: float = Field(gt=0.0)
    """Radius."""
    length_m: float = Field(gt=0.0)
    """Length."""

    def areas_m2(self) -> tuple[float, float, float, float]:
        """Areas along, against, across the axis, and from anywhere."""
        end = np.pi * self.radius_m**2
        return (end, end, 2.0 * self.radius_m * self.length_m, 0.0)


class Plate(_Directed):
    """Flat plate. Panels have two sides; the faces of a box have one each."""

    kind: Literal["plate"] = "plate"
    area_m2: float = Field(gt=0.0)
    """Area of one side."""
    one_sided: bool = False
    """Whether the plate has only the face from which the normal points."""

    def areas_m2(self) -> tuple[float, float, float, float]:
        """Areas along, against, across the axis, and from anywhere."""
        return (self.area_m2, 0.0 if self.one_sided else self.area_m2, 0.0, 0.0)


class Sphere(_Part):
    """Sphere."""

    kind: Literal["sphere"] = "sphere"
    radius_m: float = Field(gt=0.0)
    """Radius."""

    def areas_m2(self) -> tuple[float, float, float, float]:
        """Areas along, against, across the axis, and from anywhere."""
        return (0.0, 0.0, 0.0, np.pi * self.radius_m**2)


class Box(_Part):
    """Box with its edges along the body axes: six plates."""

    kind: Literal["box"] = "box"
    size_m: tuple[_Length, _Length, _Length]
    """Lengths of its edges along the body axes."""

    def shapes(self) -> list[list[float]]:
        """The rows of its faces."""
        return [row for face in box(self.size_m, self.centre_m) for row in face.shapes()]


_Parts = Box | Cylinder | Plate | Sphere

#: Every part by its `kind`.
PARTS = by_kind(_Parts)

#: Any part, discriminated by `kind`.
AnyPart = Annotated[_Parts, Field(discriminator="kind")]


def box(size_m: Vector, centre_m: Vector = (0.0, 0.0, 0.0)) -> tuple[Plate, ...]:
    """The six faces of a box with its edges along the body axes."""
    sides = validate.finite("size_m", size_m, (3,))
    if not np.all(sides > 0.0):
        raise ValueError(f"size_m: must be positive; received {sides.tolist()}")
    faces = []
    for k in range(3):
        for sign in (1.0, -1.0):
            axis = sign * np.eye(3)[k]
            middle = np.asarray(centre_m) + 0.5 * sides[k] * axis
            area = float(np.prod(sides) / sides[k])
            faces.append(
                Plate(axis=tuple(axis), area_m2=area, one_sided=True, centre_m=tuple(middle))
            )
    return tuple(faces)
