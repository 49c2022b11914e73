"""One axis of the body turned to a direction and held there by wheels, from any motion.

V = 1/2 w.J w + 2 k_a (1 - cos(a/2)), with w the rate less the wanted one about the axis, and a the
angle from the axis to the direction. The wheels take on all that would turn the body, pull the axis
to the direction and damp w, or only what of the rate is across the axis: then dV/dt = -k_w w^2 of
what is damped, and V falls until the axis points to the direction. (At rest with the axis exactly
opposite the spring pulls one way.) The direction is taken for fixed: the Sun moves by 1 deg a day.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia, unit_vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import (
    AnyNumber,
    InertiaNumbers,
    OnOff,
    Positive,
    UnitNumbers,
)
from torquer.computer.informed import MODEL_SUN, PLACE
from torquer.computer.laws.law_spec import LawSpec
from torquer.computer.laws.pointing import limit, most_half_turn
from torquer.computer.laws.wheel_lyapunov import known_gravity_torque
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    as_symmetric,
    cross,
    dot,
    norm,
    scale,
    sub,
    sym_vec,
    unit,
)


class WheelOneAxisParameters(NamedTuple):
    """k_w, k_a, axis in the body, 1 for the Sun or else the direction (inertial), spin, J, gravity.

    `damped`: 1 if the rate about the axis is to be `spin` [rad/s], 0 if it is free; `gravity`: 1 to
    take on the gravity torque; `most`: greatest length of e sin(a/2) for the spring.
    """

    rate_gain: float
    angle_gain: float
    axis: UnitNumbers
    sun: OnOff
    target: UnitNumbers
    damped: OnOff
    spin: AnyNumber
    inertia: InertiaNumbers
    gravity: OnOff
    most: Positive


@inlined
def half_turn_between(a, b):
    """e sin(x/2) of the shortest turn, by x about e, that takes one unit vector to another."""
    c, cosine = cross(a, b), dot(a, b)
    if cosine > 0.0:
        return scale(1.0 / math.sqrt(2.0 + 2.0 * cosine), c)
    sine = norm(c)
    if sine == 0.0:  # opposite: any axis across does
        return unit(cross(a, (1.0, 0.0, 0.0) if abs(a[0]) < 0.8 else (0.0, 1.0, 0.0)))
    return scale(math.sqrt(0.5 - 0.5 * cosine) / sine, c)


@kernel
def wheel_one_axis(inputs, parameters, memory):
    """Torque on the body M = w' x (J w' + h) - M_g - k_w w + k_a e sin(a/2) [N m].

    w' is the absolute rate, w what of it is damped, h the wheels' momentum, M_g the gravity
    torque, where it is wanted; the turn by a about e takes the axis to the direction.
    """
    p, place = parameters, inputs.ephemeris
    q, omega = inputs.estimate.q_body_to_inertial, inputs.estimate.omega_body_rad_s
    direction = rotate_inverse(q, place.sun_inertial if p.sun != 0.0 else p.target)
    about = p.spin if p.damped != 0.0 else dot(omega, p.axis)
    momentum = add(sym_vec(p.inertia, omega), inputs.wheel_momentum_body_n_m_s)
    m = cross(omega, momentum)
    if p.gravity != 0.0:
        m = sub(m, known_gravity_torque(inputs, p.inertia))
    m = add_scaled(m, -p.rate_gain, add_scaled(omega, -about, p.axis))
    return add_scaled(m, p.angle_gain, limit(half_turn_between(p.axis, direction), p.most))


class WheelOneAxis(LawSpec):
    """One axis turned to a direction and held there by wheels.

    For a natural frequency kappa and a damping ratio zeta of small motion about an axis of moment
    J: k_a = 2 J kappa^2, k_w = 2 zeta kappa J.
    """

    kind: Literal["wheel_one_axis"] = "wheel_one_axis"
    kernel: ClassVar = wheel_one_axis
    answers: ClassVar = "torque"
    rate_gain_n_m_s: float = Field(gt=0.0)
    """Gain k_w of the rate."""
    angle_gain_n_m: float = Field(gt=0.0)
    """Gain k_a of the angle: twice the torque per radian of a small turn."""
    axis: unit_vector("axis")
    """Axis in the body to be turned to the target."""
    target: Literal["sun"] | unit_vector("target")
    """Direction in the inertial frame, or 'sun', by the ephemeris on board."""
    spin_deg_s: float | None = None
    """Wanted rate about the axis, 0 to stop it; left out: the rotation about the axis is free."""
    greatest_rate_deg_s: Annotated[float, Field(gt=0.0)] | None = None
    """Greatest rate of a large turn: the spring is limited to what the damper balances at this
    rate; left out: no limit.
    """
    inertia_kg_m2: Inertia
    """Inertia of the body with its wheels, as the law knows it: three moments or 3x3."""
    gravity_feedforward: bool = False
    """Whether the wheels take on the gravity torque of the attitude and position known on board."""

    @property
    def needs(self) -> frozenset[str]:
        """Attitude, rate, tachometers; the ephemeris for the Sun, or for gravity."""
        found = frozenset({"attitude", "rate", "tachometers"})
        found |= MODEL_SUN if self.target == "sun" else set()
        return found | PLACE if self.gravity_feedforward else found

    def parameters(self) -> WheelOneAxisParameters:
        """Gains, axis, direction, spin, inertia, gravity, limit."""
        sun = self.target == "sun"
        return WheelOneAxisParameters(
            self.rate_gain_n_m_s,
            self.angle_gain_n_m,
            self.axis,
            float(sun),
            (0.0, 0.0, 0.0) if sun else self.target,
            float(self.spin_deg_s is not None),
            math.radians(self.spin_deg_s or 0.0),
            as_symmetric(self.inertia_kg_m2),
            float(self.gravity_feedforward),
            most_half_turn(self.greatest_rate_deg_s, self.rate_gain_n_m_s / self.angle_gain_n_m),
        )
