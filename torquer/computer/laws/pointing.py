"""What laws that hold an attitude share: reference frame, wanted attitude, deviation from it.

The reference frame is the orbital one (X of `torquer.base.conventions`) or the inertial one; the
wanted attitude is that of the body to it. Among the parameters of such a law are `orbital`, 1 for
an orbital reference, and `q_wanted`, the wanted attitude to it.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field

from torquer.base.spec import Inertia, Vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.informed import PLACE
from torquer.computer.laws.held import Attitude
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry import euler
from torquer.maths.geometry.frames import dcm_orbital_to_inertial
from torquer.maths.geometry.quaternion import conjugate, from_dcm, multiply, rotate_inverse
from torquer.maths.geometry.vec3 import cross, dot, norm, scale, sub


@inlined
def reference_motion(inputs, orbital):
    """(Attitude of the reference frame to the inertial one, its rate in the inertial frame).

    The orbital frame's rate is that of a two-body orbit, (r x v)/r^2: what other forces add to
    it, about the radius vector, is left out.
    """
    if orbital == 0.0:
        return (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    r, v = inputs.ephemeris.r_inertial_m, inputs.ephemeris.v_inertial_m_s
    return from_dcm(dcm_orbital_to_inertial(r, v)), scale(1.0 / dot(r, r), cross(r, v))


@inlined
def reference_acceleration(inputs, orbital):
    """Angular acceleration [rad/s^2] of the reference frame, inertial, on a two-body orbit.

    As r x v does not change, it is -2 (r.v)/r^2 times the frame's rate.
    """
    if orbital == 0.0:
        return (0.0, 0.0, 0.0)
    r, v = inputs.ephemeris.r_inertial_m, inputs.ephemeris.v_inertial_m_s
    square = dot(r, r)
    return scale(-2.0 * dot(r, v) / (square * square), cross(r, v))


@inlined
def deviation(inputs, q_wanted, q_reference, turning):
    """(Quaternion from the wanted attitude to the body, rate relative to the reference [rad/s]).

    Both in body axes; `q_reference` and `turning` as `reference_motion` gives them.
    """
    q = inputs.estimate.q_body_to_inertial
    error = multiply(conjugate(multiply(q_reference, q_wanted)), q)
    return error, sub(inputs.estimate.omega_body_rad_s, rotate_inverse(q, turning))


class _Attitude(NamedTuple):
    q_body_to_inertial: tuple
    omega_body_rad_s: tuple


class _Place(NamedTuple):
    r_inertial_m: tuple
    v_inertial_m_s: tuple


class _Known(NamedTuple):
    estimate: _Attitude
    ephemeris: _Place


@kernel
def to_orbital_frame(q, omega, r, v):
    """Quaternion (body to orbital frame) and rate relative to that frame (body axes) [rad/s].

    Then the magnitudes of the rate and of the quaternion's vector part. `q`: body to inertial
    frame; `omega`: absolute rate, body axes [rad/s]; `r`, `v`: inertial.
    """
    known = _Known(_Attitude(q, omega), _Place(r, v))
    upright = (0.0, 0.0, 0.0, 1.0)
    to_orbital, relative = deviation(known, upright, *reference_motion(known, 1.0))
    size = norm((to_orbital[0], to_orbital[1], to_orbital[2]))
    return to_orbital, relative, norm(relative), size


@inlined
def short_way(error):
    """Vector part of a quaternion or of its negative (the same attitude), whichever turns less.

    e sin(a/2) for the turn by a about e, 0 <= a <= 180 deg: half the turn vector where small.
    """
    sign = -1.0 if error[3] < 0.0 else 1.0
    return scale(sign, (error[0], error[1], error[2]))


#: Longer than any e sin(a/2): no limit.
NO_LIMIT = 2.0


@inlined
def limit(half_turn, most):
    """e sin(a/2), or where that is longer than `most` a vector of this length along it."""
    size = norm(half_turn)
    return scale(most / size, half_turn) if size > most else half_turn


def most_half_turn(greatest_rate_deg_s: float | None, damper_to_spring_s: float) -> float:
    """Length of e sin(a/2) at which the spring balances the damper at the greatest rate.

    `damper_to_spring_s`: gain of the rate over gain of e sin(a/2).
    """
    if greatest_rate_deg_s is None:
        return NO_LIMIT
    return min(math.radians(greatest_rate_deg_s) * damper_to_spring_s, NO_LIMIT)


class HeldAttitude(LawSpec):
    """A law that holds an attitude."""

    reference: Literal["orbital", "inertial"] = "orbital"
    """Frame to which the wanted attitude is relative."""
    euler_deg: Vector = (0.0, 0.0, 0.0)
    """Wanted attitude of the body relative to the reference frame, as Euler angles."""
    sequence: Annotated[str, AfterValidator(euler.known_sequence)] = "321"
    """Axes of the Euler angles in order: any of the 12 intrinsic sequences."""

    #: What the law needs besides the motion to be held.
    always_needs: ClassVar[frozenset[str]] = frozenset({"magnetometer"})

    @property
    def orbital(self) -> bool:
        """Whether the reference is the orbital frame: then the law needs the ephemeris."""
        return self.reference == "orbital"

    @property
    def needs(self) -> frozenset[str]:
        """Attitude and rate; for an orbital reference the ephemeris; what it always needs."""
        motion = self.always_needs | {"attitude", "rate"}
        return motion | PLACE if self.orbital else motion

    def q_wanted(self) -> tuple[float, float, float, float]:
        """Wanted attitude of the body to the reference frame."""
        x, y, z, w = euler.to_quaternion(self.sequence, np.radians(self.euler_deg))
        return (float(x), float(y), float(z), float(w))

    def held(self) -> Attitude:
        """The wanted attitude to the reference frame."""
        return Attitude(self.orbital, self.q_wanted())


class HeldByWheels(HeldAttitude):
    """A law of wheels that holds an attitude."""

    answers: ClassVar = "torque"
    always_needs: ClassVar = frozenset({"tachometers"})
    inertia_kg_m2: Inertia
    """Inertia of the body with its wheels, as the law knows it: three moments or 3x3."""
    greatest_rate_deg_s: Annotated[float, Field(gt=0.0)] | None = None
    """Greatest rate of a large turn, relative to the reference: the spring is limited to what the
    damper balances at this rate; left out: no limit.
    """
