"""Three-axis attitude by magnetorquers alone, with gain matrices that follow the orbit.

The torque of m = (K w + K_a S) x B is that of -(K w + K_a S), less its part along the field. K and
K_a are trigonometric series in the argument of latitude. Constant ones are output feedback, of
which `three_axis` has the multiples of the identity; the periodic linear-quadratic regulator is of
this form (`torquer.theory.three_axis.periodic_lqr`).
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from torquer.base.spec import Vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import AnyNumbers, OnOff, UnitNumbers
from torquer.computer.informed import PLACE
from torquer.computer.laws.pointing import HeldAttitude, deviation, reference_motion
from torquer.environment.field.averaged import argument_of_latitude
from torquer.maths.geometry.vec3 import add, add_scaled, cross, mat_vec, scale

Matrix = tuple[Vector, Vector, Vector]
#: A constant matrix, then those of cos u, sin u, cos 2u, sin 2u, ...
Series = Annotated[tuple[Matrix, ...], Field(min_length=1)]


class PeriodicGainsParameters(NamedTuple):
    """Series of K and of K_a, 1 for an orbital reference, wanted attitude to the reference."""

    rate_gains: AnyNumbers
    angle_gains: AnyNumbers
    orbital: OnOff
    q_wanted: UnitNumbers


@inlined
def _at(series, u, x):
    """A matrix series at u times a vector."""
    total = mat_vec(series[0], x)
    for k in range(1, len(series)):
        harmonic = 0.5 * (k + 1) if k % 2 == 1 else 0.5 * k
        part = math.cos(harmonic * u) if k % 2 == 1 else math.sin(harmonic * u)
        total = add_scaled(total, part, mat_vec(series[k], x))
    return total


@kernel
def periodic_gains(inputs, parameters, memory):
    """m = (K(u) w + K_a(u) S) x B, w the rate relative to the reference, S as in `three_axis`."""
    p = parameters
    q_reference, turning = reference_motion(inputs, p.orbital)
    error, omega = deviation(inputs, p.q_wanted, q_reference, turning)
    s = scale(4.0 * error[3], (error[0], error[1], error[2]))
    r, v = inputs.ephemeris.r_inertial_m, inputs.ephemeris.v_inertial_m_s
    u = argument_of_latitude(r, cross(r, v))
    return cross(add(_at(p.rate_gains, u, omega), _at(p.angle_gains, u, s)), inputs.b_body_t)


class PeriodicGains(HeldAttitude):
    """Three-axis attitude relative to a reference frame, by gains that follow the orbit."""

    kind: Literal["periodic_gains"] = "periodic_gains"
    kernel: ClassVar = periodic_gains
    needs: ClassVar = PLACE | {"magnetometer", "attitude", "rate"}
    rate_gains_n_m_s_per_t2: Series
    """Rate gains K, a list of 3x3 matrices in body axes: the constant one, then those of cos u, sin
    u, cos 2u, sin 2u, ... with the argument of latitude u.
    """
    angle_gains_n_m_per_t2: Series
    """Angle gains K_a, as many matrices as the rate gains."""

    @model_validator(mode="after")
    def _whole_harmonics(self):
        rates, angles = len(self.rate_gains_n_m_s_per_t2), len(self.angle_gains_n_m_per_t2)
        if rates != angles or rates % 2 == 0:
            raise ValueError(
                "angle_gains_n_m_per_t2: must have as many matrices as rate_gains_n_m_s_per_t2, an "
                f"odd number (a constant one, then pairs); received {angles} and {rates}"
            )
        return self

    def parameters(self) -> PeriodicGainsParameters:
        """Gains and wanted attitude."""
        gains = self.rate_gains_n_m_s_per_t2, self.angle_gains_n_m_per_t2
        return PeriodicGainsParameters(*gains, float(self.orbital), self.q_wanted())
