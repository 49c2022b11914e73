"""A body on a spherical air bearing in a laboratory: its weight, friction, and how far it tilts."""

import math
from typing import NamedTuple

from pydantic import Field

from torquer.base.spec import Spec, Vector, unit_vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add_scaled, as_vector, cross, dot, norm, scale

#: Standard acceleration of free fall [m/s^2]; on the ground it differs by less than 0.3 %.
_FALL_M_S2 = 9.80665


class Hung(NamedTuple):
    """Constants of the suspension for kernels.

    `weight_arm_n_m`: centre of mass from the centre of rotation times the weight, body axes;
    `warm_arm_n_m`: what warming up adds to it; `warm_up_per_rad`: 1 over the time constant of that,
    per angle of the Earth's rotation since `start_rad`. `axis`: the bearing's, in the body;
    `least_cosine`: of its greatest tilt.
    """

    weight_arm_n_m: tuple
    warm_arm_n_m: tuple
    warm_up_per_rad: float
    start_rad: float
    viscous_n_m_s: float
    drag_n_m_s2: float
    vertical_n_m: float
    axis: tuple
    least_cosine: float


@inlined
def _vertical(local_body):
    """Unit vector up."""
    up = local_body.gravity_gradient
    return scale(1.0 / norm(up), up)


@inlined
def suspension_torque(hung, local_body, omega_body):
    """Torque about the centre of rotation [N m, body].

    Weight a x (-m g up), with the arm a of the centre of mass, which moves exponentially while the
    body warms up; friction -k w - c |w| w; the bearing's torque about the vertical.
    """
    up = _vertical(local_body)
    cold = math.exp(-hung.warm_up_per_rad * (local_body.orbit_angle[0] - hung.start_rad))
    arm = add_scaled(hung.weight_arm_n_m, 1.0 - cold, hung.warm_arm_n_m)
    torque = add_scaled(cross(up, arm), hung.vertical_n_m, up)
    braking = hung.viscous_n_m_s + hung.drag_n_m_s2 * norm(omega_body)
    return add_scaled(torque, -braking, omega_body)


@inlined
def is_tilted(hung, local_body):
    """Whether the body is tilted beyond the bearing's limit."""
    return dot(hung.axis, _vertical(local_body)) < hung.least_cosine


class Suspension(Spec):
    """A body on a spherical air bearing, for orbit.kind 'bench'.

    The inertia of `spacecraft.body` is that about the centre of rotation, and its `mass_kg` gives
    the weight. A run ends where the body tilts beyond `tilt_limit_deg`: on the bench it strikes the
    ring, and what follows depends on a contact that no model here describes. The friction is that
    of the rate in inertial space, which the Earth's rotation changes by 0.004 deg/s.
    """

    centre_of_mass_m: Vector = (0.0, 0.0, 0.0)
    """Centre of mass from the centre of rotation, in body axes. Below it (negative along `axis`)
    the body is a pendulum; above it, it falls over."""
    warm_up_shift_m: Vector = (0.0, 0.0, 0.0)
    """By how much the centre of mass moves while the devices warm up."""
    warm_up_s: float = Field(default=600.0, gt=0.0)
    """Time constant of the warming up, which begins at the start of the run."""
    viscous_n_m_s: float = Field(default=0.0, ge=0.0)
    """Torque of viscous friction, in the bearing and at the platform, per rate [N m s]."""
    air_drag_n_m_s2: float = Field(default=0.0, ge=0.0)
    """Torque of the air on what protrudes, per square of the rate [N m s^2]."""
    vertical_torque_n_m: float = 0.0
    """Torque about the vertical, of the air that leaves an imperfect bearing unevenly."""
    axis: unit_vector("axis") = (0.0, 0.0, 1.0)
    """The bearing's axis in the body, of any length; upright, it points up."""
    tilt_limit_deg: float = Field(default=30.0, gt=0.0, le=90.0)
    """Angle of `axis` from the vertical at which the run ends."""

    def pack(self, mass_kg: float, start_rad: float, rate_rad_s: float) -> Hung:
        """Constants for kernels; the place's angle at the start and its rate, as `orbit_angle`."""
        weight = mass_kg * _FALL_M_S2
        return Hung(
            as_vector([weight * x for x in self.centre_of_mass_m]),
            as_vector([weight * x for x in self.warm_up_shift_m]),
            1.0 / (self.warm_up_s * rate_rad_s),
            start_rad,
            self.viscous_n_m_s,
            self.air_drag_n_m_s2,
            self.vertical_torque_n_m,
            self.axis,
            math.cos(math.radians(self.tilt_limit_deg)),
        )
