"""Momentum-biased satellite: one law for a pitch wheel and the coils.

The wheel's momentum along the orbit normal stiffens roll and yaw; the pitch angle is held by the
wheel's torque. The coils damp the nutation by the field's change along the pitch axis, as B-dot
takes it from two readings, and bring the wheel's momentum back to its bias. The pitch integral
rests across a gap between two calls, through which the law did not hold the pitch.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import unit_vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import AnyNumber, NotNegative, Positive, UnitNumbers
from torquer.computer.informed import has_field
from torquer.computer.interface import Command
from torquer.computer.laws.bdot import (
    GAP,
    PREVIOUS_READING,
    Gain,
    bdot_difference,
    shortest_with,
)
from torquer.computer.laws.pointing import HeldAttitude, deviation, reference_motion, short_way
from torquer.maths.geometry.vec3 import add_scaled, cross, dot, is_finite, scale

#: Memory: integral of the pitch angle, whether there was a call, its time, and the shortest
#: interval between two calls (0: none yet); that of B-dot, last: a record that begins as another
#: does is a kind of it to Numba, which warns.
_MEMORY = {
    "pitch_integral_rad_s": 0.0, "has_call": 0.0, "called_s": 0.0, "shortest_call_s": 0.0,
    **PREVIOUS_READING,
}  # fmt: skip


class BiasMomentumParameters(NamedTuple):
    """Pitch axis in the body, wanted attitude to the orbital frame, bias h_0 [N m s], gains.

    `stiffness` [N m], `damping` [N m s], `integral` [N m/s] of the pitch loop; `nutation`
    [A m^2 s/T]; `unloading` [1/s].
    """

    axis: UnitNumbers
    q_wanted: UnitNumbers
    bias: AnyNumber
    stiffness: Positive
    damping: Positive
    integral: NotNegative
    nutation: float
    unloading: float


@inlined
def _integrate(pitch, t_s, memory):
    """Add the pitch angle's integral since the last call; nothing across a gap."""
    interval_s = t_s - memory.called_s
    if interval_s <= GAP * memory.shortest_call_s:
        memory.pitch_integral_rad_s += pitch * interval_s
    if memory.has_call == 1.0:
        memory.shortest_call_s = shortest_with(memory.shortest_call_s, interval_s)
    memory.has_call, memory.called_s = 1.0, t_s


@inlined
def _dipole(inputs, p, memory):
    """The dipole for nutation and for the wheel's momentum; none without a reading of the field."""
    b, h, axis, excess = inputs.b_body_t, inputs.wheel_momentum_body_n_m_s, p.axis, 0.0
    if is_finite(h):
        excess = dot(h, axis) - p.bias
        memory.momentum_error_n_m_s = excess
    if not has_field(inputs):
        return (0.0, 0.0, 0.0)
    dipole = scale(dot(bdot_difference(inputs, Gain(p.nutation), memory), axis), axis)
    across = cross(b, axis)
    square = dot(across, across)
    if square > 0.0:
        dipole = add_scaled(dipole, -p.unloading * excess / square, across)
    return dipole


@kernel
def bias_momentum(inputs, parameters, memory):
    """Wheel torque on pitch, dipole for nutation and for the wheel's momentum.

    T = -(s a + d a' + i int a dt) e along the pitch axis e, a the pitch angle;
    m = -n (dB/dt . e) e - u (h - h_0) (B x e)/|B x e|^2, whose second part makes the torque
    -u (h - h_0) about e. Where B lies along e it is left out. dB/dt is that of `bdot_difference`.
    The pitch is held also while the magnetometer or the tachometers read no number.
    """
    p, axis = parameters, parameters.axis
    q_reference, turning = reference_motion(inputs, 1.0)
    error, omega = deviation(inputs, p.q_wanted, q_reference, turning)
    pitch = 2.0 * dot(short_way(error), axis)
    dipole = _dipole(inputs, p, memory)
    _integrate(pitch, inputs.t_s, memory)
    memory.pitch_rad = pitch
    torque = p.stiffness * pitch + p.damping * dot(omega, axis)
    torque += p.integral * memory.pitch_integral_rad_s
    return Command(dipole, scale(-torque, axis))


class BiasMomentum(HeldAttitude):
    """Momentum-biased satellite: pitch by a wheel, roll and yaw by its momentum and the coils."""

    kind: Literal["bias_momentum"] = "bias_momentum"
    kernel: ClassVar = bias_momentum
    memory: ClassVar = _MEMORY
    log: ClassVar = {"pitch_rad": "rad", "momentum_error_n_m_s": "N m s"}
    answers: ClassVar = "command"
    momentum_key: ClassVar = "bias_momentum_n_m_s"
    momentum_axis_key: ClassVar = "pitch_axis"
    always_needs: ClassVar = frozenset({"magnetometer", "tachometers"})
    bears: ClassVar = frozenset({"magnetometer", "tachometers"})
    reference: Literal["orbital"] = "orbital"
    """Reference frame of the wanted attitude."""
    pitch_axis: unit_vector("pitch_axis") = (0.0, 1.0, 0.0)
    """Axis of the wheel in the body, of any length; along the orbit normal in the wanted attitude.
    """
    bias_momentum_n_m_s: float
    """Momentum of the wheel along the pitch axis, which keeps it along the orbit normal."""
    pitch_inertia_kg_m2: float = Field(gt=0.0)
    """Moment of inertia about the pitch axis, as the law knows it."""
    bandwidth_rad_s: float = Field(gt=0.0)
    """Natural frequency of the pitch loop."""
    damping_ratio: float = Field(default=1.0, gt=0.0)
    """Damping ratio of the pitch loop."""
    integral_time_s: float | None = Field(default=None, gt=0.0)
    """Integral time of the pitch loop; left out: no integral."""
    nutation_gain_a_m2_s_per_t: float = Field(ge=0.0)
    """Gain of nutation damping by the coil along the pitch axis."""
    unloading_gain_per_s: float = Field(ge=0.0)
    """Rate at which the coils bring the wheel's momentum back to the bias."""

    def parameters(self) -> BiasMomentumParameters:
        """Wheel's axis, wanted attitude, gains."""
        stiffness = self.pitch_inertia_kg_m2 * self.bandwidth_rad_s**2
        time_s = self.integral_time_s
        return BiasMomentumParameters(
            axis=self.pitch_axis,
            q_wanted=self.q_wanted(),
            bias=self.bias_momentum_n_m_s,
            stiffness=stiffness,
            damping=2.0 * self.damping_ratio * self.pitch_inertia_kg_m2 * self.bandwidth_rad_s,
            integral=0.0 if time_s is None else stiffness / time_s,
            nutation=self.nutation_gain_a_m2_s_per_t,
            unloading=self.unloading_gain_per_s,
        )
