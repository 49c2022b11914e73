"""The body: a rigid satellite, or a gyrostat whose wheels keep a fixed momentum."""

import math
from typing import NamedTuple

import numpy as np
from pydantic import Field, model_validator

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

    inertia_kg_m2: Inertia
    """Inertia tensor in body axes: three moments or 3x3."""
    wheel_momentum_n_m_s: Vector = (0.0, 0.0, 0.0)
    """Fixed momentum of a wheel in body axes."""
    mass_kg: float | None = Field(default=None, gt=0.0)
    """Mass, for the record: attitude motion does not depend on it."""

    @model_validator(mode="after")
    def _nutation_can_be_followed(self):
        greatest = math.radians(quantity_range("rate_deg_s").greatest) * float(
            self.principal()[0][0]
        )
        if math.dist(self.wheel_momentum_n_m_s, (0.0, 0.0, 0.0)) > greatest:
            raise ValueError(
                f"wheel_momentum_n_m_s: must be at most {greatest:.3g} N m s for this inertia, or "
                "the body nutates faster than any satellite; received "
                f"{list(self.wheel_momentum_n_m_s)}"
            )
        return self

    def principal(self) -> tuple[np.ndarray, np.ndarray]:
        """Principal moments [kg m^2], ascending, and their axes: the columns of a rotation."""
        moments, axes = np.linalg.eigh(np.array(self.inertia_kg_m2))
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        return moments, axes

    def pack(
        self, aerodynamics: Aerodynamics | None = None, rotors_kg_m2=None, acting: tuple = ()
    ) -> Rigid:
        """Constants of Euler's equations for kernels.

        `rotors_kg_m2`: the part of the inertia (3, 3) that does not resist the body's rotation, as
        it can spin by itself: that of the wheels' rotors about their axes. `acting`: constants of
        disturbance torques.
        """
        inertia, rotors = np.array(self.inertia_kg_m2), rotors_kg_m2
        inverse = np.linalg.inv(inertia if rotors is None else inertia - rotors)
        return Rigid(
            as_symmetric(inertia),
            as_symmetric(inverse),
            as_vector(self.wheel_momentum_n_m_s),
            () if aerodynamics is None else aerodynamics.pack(),
            acting,
        )

    def pack_principal(self) -> Principal:
        """Principal axes for kernels."""
        moments, axes = self.principal()
        return Principal(as_vector(moments), from_dcm(as_matrix(axes)))
