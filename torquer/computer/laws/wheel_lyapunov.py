"""Attitude held and taken up by wheels from any motion, by a Lyapunov function.

V = 1/2 w.J w + 2 k_a (1 - cos(a/2)), with w the rate relative to the reference and a the angle of
the turn from the wanted attitude. The wheels take on all that would turn the body relative to the
reference, and add a damper and a spring: then dV/dt = -k_w w^2, and V falls until the body rests
in the wanted attitude. (At rest at exactly 180 deg the spring does not pause: it pulls one way.)
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import InertiaNumbers, OnOff, Positive, UnitNumbers
from torquer.computer.informed import PLACE
from torquer.computer.laws.pointing import (
    HeldByWheels,
    deviation,
    limit,
    most_half_turn,
    reference_acceleration,
    reference_motion,
    short_way,
)
from torquer.environment.earth.gravity import gravity_gradient_at, gravity_gradient_torque
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, add_scaled, as_symmetric, cross, sub, sym_vec


@inlined
def known_gravity_torque(inputs, inertia):
    """Gravity-gradient torque [N m] in the body at the position that the computer knows."""
    gravity_gradient = gravity_gradient_at(inputs.ephemeris.r_inertial_m)
    q = inputs.estimate.q_body_to_inertial
    return gravity_gradient_torque(inertia, rotate_inverse(q, gravity_gradient))


@inlined
def carried_torque(inputs, inertia, turning, acceleration, gravity):
    """Torque [N m] by which the body turns as a reference does: w' x (J w' + h) + J dW/dt - M_g.

    Of a reference with this rate and angular acceleration (inertial; rad/s); W is the rate in body
    axes, so that dW/dt = (its acceleration) - w' x W. `gravity`: 1 for M_g, the gravity torque.
    """
    q, omega = inputs.estimate.q_body_to_inertial, inputs.estimate.omega_body_rad_s
    momentum = add(sym_vec(inertia, omega), inputs.wheel_momentum_body_n_m_s)
    speeding = rotate_inverse(q, acceleration)
    speeding = sub(speeding, cross(omega, rotate_inverse(q, turning)))
    m = add(cross(omega, momentum), sym_vec(inertia, speeding))
    return sub(m, known_gravity_torque(inputs, inertia)) if gravity != 0.0 else m


class WheelLyapunovParameters(NamedTuple):
    """k_w, k_a, 1 for an orbital reference, wanted attitude to it (quaternion), J, gravity, most.

    `gravity`: 1 to take on the gravity torque; `most`: greatest e sin(a/2) for the spring.
    """

    rate_gain: float
    angle_gain: float
    orbital: OnOff
    q_wanted: UnitNumbers
    inertia: InertiaNumbers
    gravity: OnOff
    most: Positive


@kernel
def wheel_lyapunov(inputs, parameters, memory):
    """Torque on the body M = w' x (J w' + h) + J dW/dt - M_g - k_w w - k_a e sin(a/2) [N m].

    Its first part is `carried_torque`; w the rate relative to the reference; e sin(a/2) the vector
    part of the turn from the wanted attitude, the short way round, limited in length: V then has
    another function of a that grows with it, and dV/dt stays -k_w w^2.
    """
    p = parameters
    q_reference, turning = reference_motion(inputs, p.orbital)
    error, relative = deviation(inputs, p.q_wanted, q_reference, turning)
    acceleration = reference_acceleration(inputs, p.orbital)
    m = carried_torque(inputs, p.inertia, turning, acceleration, p.gravity)
    half_turn = limit(short_way(error), p.most)
    return add_scaled(add_scaled(m, -p.rate_gain, relative), -p.angle_gain, half_turn)


class WheelLyapunov(HeldByWheels):
    """Attitude acquired from any motion and held by wheels.

    For a natural frequency kappa and a damping ratio zeta of small motion about an axis of moment
    J: k_a = 2 J kappa^2, k_w = 2 zeta kappa J.
    """

    kind: Literal["wheel_lyapunov"] = "wheel_lyapunov"
    kernel: ClassVar = wheel_lyapunov
    rate_gain_n_m_s: float = Field(gt=0.0)
    """Rate gain k_w."""
    angle_gain_n_m: float = Field(gt=0.0)
    """Angle gain k_a, twice the torque per radian of a small rotation."""
    gravity_feedforward: bool | None = None
    """Whether the wheels compensate the gravity-gradient torque at the attitude and position known
    on board; left out: with the orbital reference only.
    """

    @property
    def knows_gravity(self) -> bool:
        """Whether the wheels take on the gravity torque."""
        knows = self.gravity_feedforward
        return self.orbital if knows is None else knows

    @property
    def needs(self) -> frozenset[str]:
        """Attitude and rate; the ephemeris for an orbital reference, or for gravity."""
        return super().needs | PLACE if self.knows_gravity else super().needs

    def parameters(self) -> WheelLyapunovParameters:
        """Gains, wanted attitude, inertia, gravity, limit."""
        return WheelLyapunovParameters(
            self.rate_gain_n_m_s,
            self.angle_gain_n_m,
            float(self.orbital),
            self.q_wanted(),
            as_symmetric(self.inertia_kg_m2),
            float(self.knows_gravity),
            most_half_turn(self.greatest_rate_deg_s, self.rate_gain_n_m_s / self.angle_gain_n_m),
        )
