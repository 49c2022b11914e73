"""Attitude held by wheels: spring and damper on small angles, one bandwidth about every axis.

WHEEL 7 calls its law a trivial proportional-differential one; the formula was lost in print. What
is left says that it has one positive parameter and that this and the orbital rate are given in
1/s. The law here is the one of that kind that gives every axis of any body the same roots.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import (
    AnyNumber,
    InertiaNumbers,
    OnOff,
    Positive,
    UnitNumbers,
)
from torquer.computer.laws.pointing import (
    HeldByWheels,
    deviation,
    limit,
    most_half_turn,
    reference_motion,
    short_way,
)
from torquer.maths.geometry.vec3 import add, as_symmetric, cross, norm, scale, sym_vec


class WheelPdParameters(NamedTuple):
    """kappa, zeta, 1 for an orbital reference, wanted attitude to it (quaternion), J.

    `orbital_rate`: the reference's rate about the orbit normal [rad/s], 0 for that of the orbit at
    the instant. `most`: greatest half of d for the spring.
    """

    bandwidth: float
    damping: float
    orbital: OnOff
    q_wanted: UnitNumbers
    inertia: InertiaNumbers
    orbital_rate: AnyNumber
    most: Positive


@kernel
def wheel_pd(inputs, parameters, memory):
    """Torque on the body M = -J (2 zeta kappa w + kappa^2 d) + omega x h [N m].

    Source: WHEEL (7.2), as read. w the rate relative to the reference, d twice the vector part of
    the turn from the wanted attitude (the turn vector where it is small), h the wheels' momentum:
    in (6.1) their momentum turns with the body of itself, so that the rest of M is what is left
    for the body. Of small errors at rest every axis then has s^2 + 2 zeta kappa s + kappa^2. The
    gyroscopic torque of the body and all others are left to the spring: a constant torque T in
    the body leaves the error d = J^-1 T/kappa^2.
    """
    p = parameters
    q_reference, turning = reference_motion(inputs, p.orbital)
    if p.orbital_rate > 0.0:
        turning = scale(p.orbital_rate / norm(turning), turning)
    error, omega = deviation(inputs, p.q_wanted, q_reference, turning)
    damper = scale(-2.0 * p.damping * p.bandwidth, omega)
    spring = scale(-2.0 * p.bandwidth * p.bandwidth, limit(short_way(error), p.most))
    turned = cross(inputs.estimate.omega_body_rad_s, inputs.wheel_momentum_body_n_m_s)
    return add(sym_vec(p.inertia, add(damper, spring)), turned)


class WheelPd(HeldByWheels):
    """Attitude held by wheels: PD law on small angles."""

    kind: Literal["wheel_pd"] = "wheel_pd"
    kernel: ClassVar = wheel_pd
    bandwidth_rad_s: float = Field(gt=0.0)
    """Natural frequency kappa of the closed loop."""
    damping: float = Field(default=1.0, gt=0.0)
    """Damping ratio zeta; 1 for the shortest time without overshoot."""
    orbital_rate_rad_s: float | None = Field(default=None, gt=0.0)
    """One rate of the orbital frame for all times, as in the published law; left out: the rate at
    the instant. On an eccentric orbit one rate leaves an error of about 2 zeta/kappa times the
    difference of the two.
    """

    @model_validator(mode="after")
    def _rate_of_the_orbital_frame(self):
        if self.orbital_rate_rad_s is not None and not self.orbital:
            raise ValueError(
                "orbital_rate_rad_s: must be left out unless the reference is 'orbital'; "
                f"received {self.orbital_rate_rad_s}"
            )
        return self

    def parameters(self) -> WheelPdParameters:
        """Bandwidth and damping, wanted attitude, inertia, limits."""
        return WheelPdParameters(
            self.bandwidth_rad_s,
            self.damping,
            float(self.orbital),
            self.q_wanted(),
            as_symmetric(self.inertia_kg_m2),
            self.orbital_rate_rad_s or 0.0,
            most_half_turn(self.greatest_rate_deg_s, self.damping / self.bandwidth_rad_s),
        )
