"""The body: a rigid satellite, or a gyrostat whose wheels keep a fixed momentum."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from torquer.base import validate
from torquer.base.columns import stacked, unstacked
from torquer.base.spec import Inertia, Spec, Vector
from torquer.base.validate import quantity_range
from torquer.compile.engine import inlined
from torquer.environment.earth.gravity import gravity_gradient_torque
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import derivative, from_dcm, rotate_inverse
from torquer.maths.geometry.vec3 import (
    add,
    as_matrix,
    as_symmetric,
    as_vector,
    cross,
    sub,
    sym_vec,
)
from torquer.spacecraft.aerodynamics import Aerodynamics, Surface, aerodynamic_force_and_torque
from torquer.spacecraft.disturbance.acting import with_acting
from torquer.spacecraft.masses import AnyMass, BoxMass, mass_properties

_Length = Annotated[float, Field(gt=0.0)]
#: Keys of which one set gives the inertia.
_SOURCES = (("inertia_kg_m2",), ("box_m", "mass_kg"), ("parts",))


class Rigid(NamedTuple):
    """Constants of the body for kernels; symmetric matrices as `sym_vec` takes them.

    `surface`: parts exposed to the air; `acting`: constants of
    `torquer.spacecraft.disturbance.TORQUES`; () where there is none.
    """

    inertia: tuple
    inverse_inertia: tuple
    wheel_momentum: tuple
    surface: Surface | tuple = ()
    acting: tuple = ()


class Principal(NamedTuple):
    """Principal moments of inertia [kg m^2], ascending, and the attitude of their axes."""

    moments: tuple
    q_principal_to_body: tuple


@inlined
def _with_air(torque, surface, flow, q):
    if len(flow) == 0:
        return torque
    if len(surface) == 0:  # the air is known for another torque
        return torque
    _, drag = aerodynamic_force_and_torque(surface, rotate_inverse(q, flow))
    return add(torque, drag)


@inlined
def torque_body(rigid, local, dipole_body_a_m2, motion, held):
    """Torque [N m] in the body: dipole times field, gravity gradient, air, other disturbances.

    `held`: any further torque, () for none.
    """
    q = motion.q
    control = cross(dipole_body_a_m2, rotate_inverse(q, local.b_t))
    gravity_gradient_body = rotate_inverse(q, local.gravity_gradient)
    torque = add(control, gravity_gradient_torque(rigid.inertia, gravity_gradient_body))
    torque = _with_air(torque, rigid.surface, local.flow, q)
    torque = with_acting(torque, rigid.acting, local, q, motion.omega)
    if len(held) == 0:
        return torque
    return add(torque, held)


@inlined
def momentum_body(rigid, omega):
    """Angular momentum [N m s] of body and wheels, in the body: J omega + h."""
    return add(sym_vec(rigid.inertia, omega), rigid.wheel_momentum)


@inlined
def motion_rates(rigid, local, dipole_body_a_m2, motion, held):
    """Euler's equations and kinematics: J omega' + omega x (J omega + h) = M.

    `held`: torque [N m, body] that neither motion nor place changes, () for none.
    """
    gyroscopic = cross(motion.omega, momentum_body(rigid, motion.omega))
    torque = sub(torque_body(rigid, local, dipole_body_a_m2, motion, held), gyroscopic)
    return Motion(derivative(motion.q, motion.omega), sym_vec(rigid.inverse_inertia, torque))


class Body(Spec):
    """Inertia, mass and fixed wheel momentum of the body."""

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": list(keys)} for keys in _SOURCES]}
    )

    inertia_kg_m2: Inertia | None = None
    """Inertia tensor in body axes about the centre of mass: three moments or 3x3. The elements off
    the diagonal are minus the products of inertia: J_xy = -sum m x y. Many CAD programs print the
    sum itself; with Pxy = 0.002 kg m^2 the tensor has -0.002. Left out: from `box_m` or `parts`."""
    wheel_momentum_n_m_s: Vector = (0.0, 0.0, 0.0)
    """Fixed momentum of a wheel in body axes."""
    mass_kg: float | None = Field(default=None, gt=0.0)
    """Mass: attitude motion depends on it only through an inertia from `box_m`. Left out: not
    known, or that of `parts`."""
    box_m: tuple[_Length, _Length, _Length] | None = None
    """Edges along the body axes of a box of uniform density, whose inertia with `mass_kg` is the
    body's, in place of `inertia_kg_m2`."""
    parts: tuple[AnyMass, ...] = ()
    """Masses of which the body is made, in place of `inertia_kg_m2`: their centre of mass is that
    of the body, and the inertia is about it."""

    @model_validator(mode="after")
    def _inertia_has_one_source(self):
        given = [keys[0] for keys in _SOURCES if getattr(self, keys[0])]
        if len(given) != 1:
            received = " and ".join(given) or "none of them"
            raise ValueError(
                "inertia_kg_m2: either it, or box_m with mass_kg, or parts must be given; received "
                f"{received}"
            )
        if self.box_m and self.mass_kg is None:
            raise ValueError("mass_kg: must be given with box_m, for the inertia; received none")
        if self.parts and self.mass_kg is not None:
            raise ValueError(
                f"mass_kg: must be left out with parts, whose sum it is; received {self.mass_kg:g}"
            )
        if self.inertia_kg_m2 is None:  # else it has been checked
            validate.inertia_tensor(given[0], np.array(self.inertia))
        return self

    @model_validator(mode="after")
    def _nutation_can_be_followed(self):
        least = unstacked(self.principal()[0][..., 0], 0)
        greatest = math.radians(quantity_range("rate_deg_s").greatest) * least
        if math.dist(self.wheel_momentum_n_m_s, (0.0, 0.0, 0.0)) > greatest:
            raise ValueError(
                f"wheel_momentum_n_m_s: must be at most {greatest:.3g} N m s for this inertia, or "
                "the body nutates faster than any satellite; received "
                f"{list(self.wheel_momentum_n_m_s)}"
            )
        return self

    @property
    def inertia(self) -> tuple[Vector, Vector, Vector]:
        """Inertia tensor [kg m^2], given or that of the box or the parts."""
        if self.inertia_kg_m2 is not None:
            return self.inertia_kg_m2
        return tuple(map(tuple, mass_properties(self._masses()).inertia.tolist()))

    def keys_with_inertia(self, inertia) -> dict:
        """Keys to change for another tensor (3, 3): it takes the place of a box or parts."""
        keys = {"inertia_kg_m2": np.asarray(inertia).tolist()}
        if self.inertia_kg_m2 is not None:
            return keys
        return keys | {"box_m": None, "parts": (), "mass_kg": self.total_mass_kg()}

    def _masses(self) -> tuple[AnyMass, ...]:
        """The parts, or the box as the only one; () for neither."""
        box = self.box_m
        return self.parts if box is None else (BoxMass(mass_kg=self.mass_kg, size_m=box),)

    def total_mass_kg(self) -> float | None:
        """Mass, also of parts; None if it is not known."""
        return mass_properties(self.parts).mass_kg if self.parts else self.mass_kg

    def centre_of_mass_m(self) -> np.ndarray:
        """Centre of mass [3], from the origin of `parts`; zeros for a body without."""
        return mass_properties(self.parts).centre_m if self.parts else np.zeros(3)

    def principal(self) -> tuple[np.ndarray, np.ndarray]:
        """Principal moments [kg m^2], ascending, and their axes: the columns of a rotation."""
        moments, axes = np.linalg.eigh(stacked(self.inertia))
        axes[..., 2] = np.cross(axes[..., 0], axes[..., 1])
        return moments, axes

    def pack(
        self, aerodynamics: Aerodynamics | None = None, rotors_kg_m2=None, acting: tuple = ()
    ) -> Rigid:
        """Constants of Euler's equations for kernels.

        `rotors_kg_m2`: the part of the inertia (3, 3) that does not resist the body's rotation, as
        it can spin by itself: that of the wheels' rotors about their axes. `acting`: constants of
        disturbance torques.
        """
        inertia, rotors = stacked(self.inertia), rotors_kg_m2
        inverse = np.linalg.inv(inertia if rotors is None else inertia - rotors)
        return Rigid(
            as_symmetric(unstacked(inertia, 2)),
            as_symmetric(unstacked(inverse, 2)),
            as_vector(self.wheel_momentum_n_m_s),
            () if aerodynamics is None else aerodynamics.pack(),
            acting,
        )

    def pack_principal(self) -> Principal:
        """Principal axes for kernels."""
        moments, axes = self.principal()
        return Principal(as_vector(moments), from_dcm(as_matrix(axes)))
