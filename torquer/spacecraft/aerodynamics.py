"""Force and torque of the air on a body made of parts, in free molecular flow.

The area of a part depends only on the angle between the flow and its axis: a cylinder, a plate, the
face of a box, a sphere. Molecules give up all their momentum (drag coefficient 2, inelastic
impact) or as much as the coefficient says; the force is along the flow. The body rotates slowly
compared with the flow.
"""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from torquer.base import validate
from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.maths.geometry.vec3 import add, cross, dot, norm, scale
from torquer.spacecraft.parts import AnyPart


class Surface(NamedTuple):
    """Parts of a body for kernels; the drag coefficient is within the areas.

    `rows` [n, 10]: area that meets a flow along and against the axis, across it, and from
    anywhere [m^2]; axis; centre from the centre of mass [m].
    """

    rows: np.ndarray


@kernel
def projected_area(row, direction):
    """Area [m^2] of a part across its direction of motion, times half the drag coefficient."""
    axis = (row[4], row[5], row[6])
    along, across = dot(axis, direction), norm(cross(axis, direction))
    return row[0] * max(along, 0.0) + row[1] * max(-along, 0.0) + row[2] * across + row[3]


@kernel
def flow(density_kg_m3, air_velocity_m_s):
    """Input of the kernels below: velocity relative to the air times sqrt(density) [sqrt(Pa)].

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


def _rows(part: AnyPart) -> np.ndarray:
    """Rows of `Surface`."""
    rows = np.array(part.shapes())
    rows[:, :4] *= 0.5 * part.drag_coefficient
    return rows


class Aerodynamics(Spec):
    """The parts of the body exposed to the air, in body axes from the centre of mass."""

    parts: tuple[AnyPart, ...] = Field(min_length=1)
    """Boxes, cylinders, plates and spheres that make up the body; they do not shade each other."""

    def pack(self) -> Surface:
        """Constants for kernels."""
        return Surface(np.concatenate([_rows(part) for part in self.parts]))

    def area_m2(self, direction) -> float:
        """Projected area [m^2] for motion along a direction (body axes, any length)."""
        towards = validate.unit_rows("direction", direction)[0]
        rows = (np.array(row) for part in self.parts for row in part.shapes())
        return float(sum(projected_area(row, tuple(towards)) for row in rows))
