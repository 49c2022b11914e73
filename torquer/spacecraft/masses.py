"""Masses of which a body is made: their mass, centre of mass and inertia tensor.

A tensor is that of mechanics, J = sum m (r.r E - r r^T): the elements off its diagonal are *minus*
the products of inertia, J_xy = -sum m x y.
"""

from collections.abc import Iterable
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Inertia, Spec, Vector, by_kind, unit_vector

_Length = Annotated[float, Field(gt=0.0)]
_Edge = Annotated[float, Field(ge=0.0)]


class _Mass(Spec):
    """What all masses have."""

    mass_kg: float = Field(gt=0.0)
    """Mass of the part."""
    centre_m: Vector = (0.0, 0.0, 0.0)
    """Its centre of mass in body axes, from any origin that all parts share."""


class _Turned(_Mass):
    """A mass with an axis."""

    axis: unit_vector("axis")
    """Axis of a cylinder or normal of a plate in the body, of any length."""


class BoxMass(_Mass):
    """Box of uniform density, its edges along the body axes.

    An edge of no length makes it a plate, two a rod, three a point.
    """

    kind: Literal["box"] = "box"
    size_m: tuple[_Edge, _Edge, _Edge]
    """Lengths of its edges along the body axes."""

    def own_inertia(self) -> np.ndarray:
        """Tensor (3, 3) about its centre [kg m^2]."""
        return _box(self.mass_kg, self.size_m, np.eye(3))


class CylinderMass(_Turned):
    """Solid cylinder of uniform density."""

    kind: Literal["cylinder"] = "cylinder"
    radius_m: _Length
    """Radius."""
    length_m: _Length
    """Length."""

    def own_inertia(self) -> np.ndarray:
        """Tensor (3, 3) about its centre [kg m^2]."""
        along = 0.5 * self.mass_kg * self.radius_m**2
        across = self.mass_kg * (3.0 * self.radius_m**2 + self.length_m**2) / 12.0
        return across * np.eye(3) + (along - across) * np.outer(self.axis, self.axis)


class PlateMass(_Turned):
    """Thin rectangular plate of uniform density, such as a solar panel."""

    kind: Literal["plate"] = "plate"
    size_m: tuple[_Length, _Length]
    """Lengths of its edges."""
    edge: unit_vector("edge")
    """Direction of the first edge in the body, of any length, across `axis`."""

    @model_validator(mode="after")
    def _edge_is_across(self):
        if abs(float(np.dot(self.edge, self.axis))) > 1e-6:
            raise ValueError(
                f"edge: must be at right angles to axis; received {list(self.edge)} with "
                f"{list(self.axis)}"
            )
        return self

    def own_inertia(self) -> np.ndarray:
        """Tensor (3, 3) about its centre [kg m^2]."""
        edges = np.array([self.edge, np.cross(self.axis, self.edge), self.axis])
        return _box(self.mass_kg, (*self.size_m, 0.0), edges)


class SphereMass(_Mass):
    """Solid sphere of uniform density."""

    kind: Literal["sphere"] = "sphere"
    radius_m: _Length
    """Radius."""

    def own_inertia(self) -> np.ndarray:
        """Tensor (3, 3) about its centre [kg m^2]."""
        return 0.4 * self.mass_kg * self.radius_m**2 * np.eye(3)


class KnownMass(_Mass):
    """A part whose tensor is known, say from a CAD program."""

    kind: Literal["tensor"] = "tensor"
    inertia_kg_m2: Inertia
    """Its tensor about its own centre of mass, in body axes: three moments or 3x3; off the diagonal
    minus the products of inertia."""

    def own_inertia(self) -> np.ndarray:
        """Tensor (3, 3) about its centre [kg m^2]."""
        return np.array(self.inertia_kg_m2)


_Masses = BoxMass | CylinderMass | PlateMass | SphereMass | KnownMass

#: Every part with a mass by its `kind`.
MASSES = by_kind(_Masses)

#: Any part with a mass, discriminated by `kind`.
AnyMass = Annotated[_Masses, Field(discriminator="kind")]


def _box(mass: float, size, edges: np.ndarray) -> np.ndarray:
    """Tensor of a box with edges of these lengths along the rows of a rotation."""
    squares = np.array(size) ** 2
    return edges.T @ np.diag(mass / 12.0 * (squares.sum() - squares)) @ edges


class MassProperties(NamedTuple):
    """Mass [kg], centre of mass [m] from the origin of the parts, tensor about it [kg m^2]."""

    mass_kg: float
    centre_m: np.ndarray
    inertia: np.ndarray


def mass_properties(parts: Iterable[AnyMass]) -> MassProperties:
    """Mass properties of a body made of parts; each is moved by the theorem of Steiner."""
    parts = tuple(parts)
    masses = np.array([part.mass_kg for part in parts])
    places = np.array([part.centre_m for part in parts])
    centre = masses @ places / masses.sum()
    inertia = np.zeros((3, 3))
    for part, arm in zip(parts, places - centre, strict=True):
        moved = arm @ arm * np.eye(3) - np.outer(arm, arm)
        inertia += part.own_inertia() + part.mass_kg * moved
    return MassProperties(float(masses.sum()), centre, 0.5 * (inertia + inertia.T))
