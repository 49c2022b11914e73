"""Three-axis attitude by magnetorquers alone: damping and a restoring torque across the field.

MAG ch. 4. The torque of m = k (w x B) + k_a (S x B) is that of a damper and a spring, less its
part along the field, which no coil can make: the field must turn for three axes to be held.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from torquer.control.law import Law
from torquer.engine import kernel
from torquer.geometry import euler
from torquer.geometry.frames import dcm_orbital_to_inertial
from torquer.geometry.quaternion import conjugate, from_dcm, multiply, rotate_inverse
from torquer.geometry.vec3 import add, cross, dot, scale, sub
from torquer.spec import Spec, Vector


@kernel
def reference_motion(measured, orbital):
    """(Attitude of the reference frame to the inertial one, its rate in the inertial frame)."""
    if orbital == 0.0:
        return (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    r, v = measured.r_inertial_m, measured.v_inertial_m_s
    return from_dcm(dcm_orbital_to_inertial(r, v)), scale(1.0 / dot(r, r), cross(r, v))


@kernel
def three_axis(measured, parameters, memory):
    """m = -k B x w - k_a B x S, w the rate relative to the reference. Source: MAG (4.1.5).

    S = (d23 - d32, d31 - d13, d12 - d21), D = direction cosines from the wanted attitude to the
    body: 2 x the turn vector where it is small. Parameters: k, k_a, 1 for an orbital reference,
    wanted attitude to the reference (quaternion).
    """
    p = parameters
    q_reference, turning = reference_motion(measured, p[2])
    wanted = multiply(q_reference, (p[3], p[4], p[5], p[6]))
    error = multiply(conjugate(wanted), measured.q_body_to_inertial)
    s = scale(4.0 * error[3], (error[0], error[1], error[2]))
    turning_body = rotate_inverse(measured.q_body_to_inertial, turning)
    omega = sub(measured.omega_body_rad_s, turning_body)
    return cross(add(scale(p[0], omega), scale(p[1], s)), measured.b_body_t)


class ThreeAxis(Spec):
    """Three-axis attitude relative to a reference frame.

    `rate_gain_n_m_s_per_t2`: k; `angle_gain_n_m_per_t2`: k_a. `reference`: 'orbital' or
    'inertial'; `euler_deg` with its `sequence`: the wanted attitude of the body relative to it.
    """

    kind: Literal["three_axis"] = "three_axis"
    rate_gain_n_m_s_per_t2: float = Field(gt=0.0)
    angle_gain_n_m_per_t2: float = Field(ge=0.0)
    reference: Literal["orbital", "inertial"] = "orbital"
    euler_deg: Vector = (0.0, 0.0, 0.0)
    sequence: Annotated[str, AfterValidator(euler.known_sequence)] = "321"

    def law(self) -> Law:
        """The law with these gains and this attitude."""
        orbital = self.reference == "orbital"
        q = euler.to_quaternion(self.sequence, np.radians(self.euler_deg))
        gains = {"rate_gain": self.rate_gain_n_m_s_per_t2, "angle_gain": self.angle_gain_n_m_per_t2}
        attitude = {f"q_{c}": float(x) for c, x in zip("xyzw", q, strict=True)}
        parameters = {**gains, "orbital": float(orbital), **attitude}
        return Law(self.kind, three_axis, parameters, navigates=orbital)
