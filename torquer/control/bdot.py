"""B-dot: take rotational energy out with the field that turns past the body.

MAG ch. 2. The torque of m = k (omega x B) is -k (B^2 omega - B (B.omega)): it brakes the rate
normal to the field. In slow motion B-dot brakes the rate relative to the field, not to
inertial space: the satellite ends up turning with the field, at about twice the orbital rate.
"""

from typing import ClassVar, Literal

from pydantic import Field

from torquer.control.law import Law
from torquer.engine import kernel
from torquer.geometry.quaternion import rotate_inverse
from torquer.geometry.vec3 import cross, scale, sub
from torquer.spec import Spec


@kernel
def bdot_rate(measured, parameters, memory):
    """m = k (omega x B) from gyro and magnetometer. Source: MAG (2.1.3)."""
    return scale(parameters[0], cross(measured.omega_body_rad_s, measured.b_body_t))


@kernel
def bdot_derivative(measured, parameters, memory):
    """m = -k dB/dt, the field's rate in the body read directly. Source: MAG (2.1.1)."""
    return scale(-parameters[0], measured.b_rate_body_t_s)


@kernel
def bdot_difference(measured, parameters, memory):
    """m = -k (B - B_before) / (t - t_before): dB/dt from two readings; a constant bias cancels.

    Memory: 1 once there is an earlier reading, its time [s], its field [T] (3 cells).
    """
    b = measured.b_body_t
    before = (memory[2], memory[3], memory[4])
    m = (0.0, 0.0, 0.0)
    if memory[0] == 1.0:
        m = scale(-parameters[0] / (measured.t_s - memory[1]), sub(b, before))
    memory[0], memory[1] = 1.0, measured.t_s
    memory[2], memory[3], memory[4] = b
    return m


@kernel
def bdot_model(measured, parameters, memory):
    """m = -k dB/dt, from the field model on board, the attitude and the gyro; no magnetometer.

    dB/dt in the body is that of the model, turned to the body, less omega x B.
    """
    q = measured.q_body_to_inertial
    turning = rotate_inverse(q, measured.b_rate_inertial_t_s)
    b = rotate_inverse(q, measured.b_inertial_t)
    return scale(-parameters[0], sub(turning, cross(measured.omega_body_rad_s, b)))


class _Bdot(Spec):
    """B-dot; the gain k in A m^2 s/T (the same as N m s/T^2)."""

    gain_a_m2_s_per_t: float = Field(gt=0.0)
    kernel: ClassVar
    memory: ClassVar[tuple[float, ...]] = ()
    navigates: ClassVar[bool] = False

    def law(self) -> Law:
        """The law with this gain."""
        kernel = type(self).kernel  # of the class: an instance would bind it as a method
        gain = {"gain": self.gain_a_m2_s_per_t}
        return Law(self.kind, kernel, gain, self.memory, navigates=self.navigates, spec=self)


class Bdot(_Bdot):
    """On-board B-dot: finite difference of two magnetometer readings."""

    kind: Literal["bdot"] = "bdot"
    kernel: ClassVar = bdot_difference
    memory: ClassVar = (0.0,) * 5


class BdotRate(_Bdot):
    """B-dot from gyro and magnetometer."""

    kind: Literal["bdot_rate"] = "bdot_rate"
    kernel: ClassVar = bdot_rate


class BdotDerivative(_Bdot):
    """B-dot from a direct reading of the field's rate of change (search coil)."""

    kind: Literal["bdot_derivative"] = "bdot_derivative"
    kernel: ClassVar = bdot_derivative


class BdotModel(_Bdot):
    """B-dot from the field model on board, attitude sensor and gyro."""

    kind: Literal["bdot_model"] = "bdot_model"
    kernel: ClassVar = bdot_model
    navigates: ClassVar = True
