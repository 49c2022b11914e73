"""Three-axis attitude by magnetorquers alone: sliding mode for a satellite in gravity's gradient.

Wisniewski, "Sliding mode attitude control for magnetic actuated satellite", IFAC Automatic Control
in Aerospace, Seoul 1998, and his thesis, Aalborg University 1996. On the manifold s = J w + L e = 0
(w the rate relative to the reference, e the vector part of the turn from the wanted attitude) the
error decays of itself. A torque that keeps s and one that takes it out are asked for, and the coils
give what is across the field of them. Here L = kappa J, so that on the manifold w = -kappa e
whatever the body: the angle a falls with da/dt = -kappa sin(a/2).
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia
from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import InertiaNumbers, OnOff, UnitNumbers
from torquer.computer.informed import PLACE
from torquer.computer.laws.pointing import (
    HeldAttitude,
    deviation,
    reference_acceleration,
    reference_motion,
    short_way,
)
from torquer.computer.laws.wheel_lyapunov import known_gravity_torque
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    as_symmetric,
    cross,
    dot,
    scale,
    sub,
    sym_vec,
)


class SlidingModeParameters(NamedTuple):
    """kappa, lambda, 1 for an orbital reference, wanted attitude to it (quaternion), J."""

    manifold_rate: float
    reaching_rate: float
    orbital: OnOff
    q_wanted: UnitNumbers
    inertia: InertiaNumbers


@kernel
def sliding_mode(inputs, parameters, memory):
    """m = (B x M)/B^2, M = w' x J w' - M_g + J (dW/dt - kappa de/dt) - lambda s.

    w' is the absolute rate, W the reference's rate in body axes, M_g gravity's torque,
    de/dt = (e4 w + e x w)/2; under the whole of M ds/dt = -lambda s. Wisniewski's continuous
    reaching law. Without a field no dipole.
    """
    p, j, b = parameters, parameters.inertia, inputs.b_body_t
    square = dot(b, b)
    if square == 0.0:
        return (0.0, 0.0, 0.0)
    q, omega = inputs.estimate.q_body_to_inertial, inputs.estimate.omega_body_rad_s
    q_reference, turning = reference_motion(inputs, p.orbital)
    error, relative = deviation(inputs, p.q_wanted, q_reference, turning)
    e, e4 = short_way(error), abs(error[3])
    kept = rotate_inverse(q, reference_acceleration(inputs, p.orbital))
    kept = sub(kept, cross(omega, rotate_inverse(q, turning)))
    kept = add_scaled(kept, -0.5 * p.manifold_rate, add(scale(e4, relative), cross(e, relative)))
    off = add_scaled(relative, p.manifold_rate, e)
    m = sym_vec(j, add_scaled(kept, -p.reaching_rate, off))
    m = add(m, cross(omega, sym_vec(j, omega)))
    return scale(1.0 / square, cross(b, sub(m, known_gravity_torque(inputs, j))))


class SlidingMode(HeldAttitude):
    """Three-axis attitude by a sliding mode."""

    kind: Literal["sliding_mode"] = "sliding_mode"
    kernel: ClassVar = sliding_mode
    needs: ClassVar = PLACE | {"magnetometer", "attitude", "rate"}
    manifold_rate_rad_s: float = Field(gt=0.0)
    """Rate kappa of the manifold: small errors on it fall with half of it."""
    reaching_rate_per_s: float = Field(gt=0.0)
    """Rate lambda with which the distance from the manifold would fall if coils could make any
    torque.
    """
    inertia_kg_m2: Inertia
    """Inertia of the body as the law knows it: three moments or 3x3."""

    def parameters(self) -> SlidingModeParameters:
        """Rates, wanted attitude, inertia."""
        return SlidingModeParameters(
            self.manifold_rate_rad_s,
            self.reaching_rate_per_s,
            float(self.orbital),
            self.q_wanted(),
            as_symmetric(self.inertia_kg_m2),
        )
