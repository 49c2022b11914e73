"""Force and torque of the air on a body made of parts, in free molecular flow.

What a part offers to the flow depends on the angle to its axis alone: a cylinder, a plate, the
face of a box, a sphere. Molecules give up all their momentum (drag coefficient 2, inelastic
impact) or as much as the coefficient says; the force is along the flow. Parts do not shade each
other, and the body turns slowly beside the flow.
"""

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from torquer import validate
from torquer.engine import kernel
from torquer.geometry.vec3 import add, cross, dot, norm, scale
from torquer.spec import Spec, Vector


class Surface(NamedTuple):
    """Parts of a body for kernels; the drag coefficient is within the areas.

    `rows` [n, 10]: area that meets a flow along and against the axis, beside it, and from
    anywhere [m^2]; axis; centre from the centre of mass [m].
    """

    rows: np.ndarray


@kernel
def projected_area(row, direction):
    """Area [m^2], times half the drag coefficient, that a part turns to its motion's direction."""
    axis = (row[4], row[5], row[6])
    along, beside = dot(axis, direction), norm(cross(axis, direction))
    return row[0] * max(along, 0.0) + row[1] * max(-along, 0.0) + row[2] * beside + row[3]


@kernel
def flow(density_kg_m3, air_velocity_m_s):
    """What the kernels below take: velocity relative to the air times sqrt(density) [sqrt(Pa)].

    Like the gravity-gradient vector it is one smooth vector that can be tabulated along an orbit.
    """
    return scale(np.sqrt(density_kg_m3), air_velocity_m_s)


@kernel
def aerodynamic_force_and_torque(surface, flow_body):
    """Force [N] and torque about the centre of mass [N m], both in the body.

    `flow_body`: what `flow` gives, in the body. Each part's force -rho V^2 A v, v the direction
    of motion, acts at its centre: M = -rho V^2 sum A (c x v). Source: WHEEL (6.3), whose
    cylinder and panels have their centres on the first axis.
    """
    speed = norm(flow_body)
    if speed == 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    direction = scale(1.0 / speed, flow_body)
    total, moment = 0.0, (0.0, 0.0, 0.0)
    for part in range(surface.rows.shape[0]):
        row = surface.rows[part]
        area = projected_area(row, direction)
        total += area
        moment = add(moment, scale(area, (row[7], row[8], row[9])))
    pressure = -dot(flow_body, flow_body)
    return scale(pressure * total, direction), scale(pressure, cross(moment, direction))


class _Part(Spec):
    """What all parts have: a centre and a drag coefficient (2: inelastic impact)."""

    centre_m: Vector = (0.0, 0.0, 0.0)
    drag_coefficient: float = Field(default=2.0, gt=0.0)

    def row(self) -> list[float]:
        """Row of `Surface`."""
        axis = getattr(self, "axis", (0.0, 0.0, 1.0))
        areas = [0.5 * self.drag_coefficient * area for area in self.areas_m2()]
        return [*areas, *axis, *self.centre_m]


class _Directed(_Part):
    """A part with an axis, of any length when given."""

    axis: Vector

    @field_validator("axis")
    @classmethod
    def _unit(cls, value):
        return tuple(float(v) for v in validate.unit_rows("axis", [value])[0])


class Cylinder(_Directed):
    """Closed cylinder of a radius and a length; `centre_m` is the middle of its axis."""

    kind: Literal["cylinder"] = "cylinder"
    radius_m: float = Field(gt=0.0)
    length_m: float = Field(gt=0.0)

    def areas_m2(self) -> tuple[float, float, float, float]:
        """Areas along, against, beside the axis, and from anywhere."""
        end = np.pi * self.radius_m**2
        return (end, end, 2.0 * self.radius_m * self.length_m, 0.0)


class Plate(_Directed):
    """Flat plate, `axis` its normal; with `one_sided` only the face that the normal leaves.

    Panels have two sides; the faces of a box have one each.
    """

    kind: Literal["plate"] = "plate"
    area_m2: float = Field(gt=0.0)
    one_sided: bool = False

    def areas_m2(self) -> tuple[float, float, float, float]:
        """Areas along, against, beside the axis, and from anywhere."""
        return (self.area_m2, 0.0 if self.one_sided else self.area_m2, 0.0, 0.0)


class Sphere(_Part):
    """Sphere of a radius."""

    kind: Literal["sphere"] = "sphere"
    radius_m: float = Field(gt=0.0)

    def areas_m2(self) -> tuple[float, float, float, float]:
        """Areas along, against, beside the axis, and from anywhere."""
        return (0.0, 0.0, 0.0, np.pi * self.radius_m**2)


AnyPart = Annotated[Cylinder | Plate | Sphere, Field(discriminator="kind")]


class Aerodynamics(Spec):
    """The body as the air sees it: its parts, in body axes from the centre of mass."""

    parts: tuple[AnyPart, ...] = Field(min_length=1)

    def pack(self) -> Surface:
        """Constants for kernels."""
        return Surface(np.array([part.row() for part in self.parts]))

    def area_m2(self, direction) -> float:
        """Projected area [m^2] for motion along a direction (body axes, any length)."""
        towards = validate.unit_rows("direction", direction)[0]
        plain = (part.model_copy(update={"drag_coefficient": 2.0}) for part in self.parts)
        return float(sum(projected_area(np.array(part.row()), tuple(towards)) for part in plain))


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
