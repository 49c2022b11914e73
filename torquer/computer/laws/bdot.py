"""B-dot: take rotational energy out with the field that turns past the body.

MAG ch. 2. The torque of m = k (omega x B) is -k (B^2 omega - B (B.omega)): it brakes the rate
normal to the field. In slow motion B-dot brakes the rate relative to the field, not to
inertial space: the satellite ends up turning with the field, at about twice the orbital rate.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.compile.engine import inlined, kernel
from torquer.computer.informed import MODEL_FIELD
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import cross, put_vector, read_vector, scale, sub

_ZERO = (0.0, 0.0, 0.0)
#: An interval of readings this many times the shortest so far is a gap: the law has rested in a
#: mode, or its sensor was silent. (Readings that keep another step than the control come at
#: intervals that differ by up to a factor of 2.)
GAP = 2.5
#: A gap makes the shortest interval so many times longer. A stamp that is off by part of it makes
#: one that is too short, after which all intervals would be gaps for ever.
_LET_GO = 10.0
#: Memory of laws that take the difference of two readings: whether there was one, its time and
#: field, the dipole asked for since, and the shortest interval of readings (0: none yet).
PREVIOUS_READING = {
    "has_reading": 0.0, "t_s": 0.0, "b_body_t": _ZERO, "dipole_a_m2": _ZERO,
    "shortest_s": 0.0,
}  # fmt: skip


class Gain(NamedTuple):
    """`gain`: k [A m^2 s/T]."""

    gain: float


@inlined
def shortest_with(shortest_s, interval_s):
    """The shortest interval [s] so far (0: none yet), with one more; see `GAP` and `_LET_GO`."""
    if shortest_s == 0.0 or interval_s < shortest_s:
        return interval_s
    return shortest_s if interval_s <= GAP * shortest_s else min(interval_s, _LET_GO * shortest_s)


@kernel
def bdot_rate(inputs, parameters, memory):
    """m = k (omega x B) from gyro and magnetometer. Source: MAG (2.1.3)."""
    return scale(parameters.gain, cross(inputs.estimate.omega_body_rad_s, inputs.b_body_t))


@kernel
def bdot_derivative(inputs, parameters, memory):
    """m = -k dB/dt, the field's rate in the body read directly. Source: MAG (2.1.1)."""
    return scale(-parameters.gain, inputs.b_rate_body_t_s)


@kernel
def bdot_difference(inputs, parameters, memory):
    """m = -k (B - B_before) / (t - t_before): dB/dt from two readings; a constant bias cancels.

    Between two readings the last dipole is asked for again; after a gap there is none until the
    second reading. Memory: see `PREVIOUS_READING`.
    """
    b, t_s = inputs.b_body_t, inputs.read_at.magnetometer_s
    m, interval_s = read_vector(memory.dipole_a_m2), t_s - memory.t_s
    if memory.has_reading == 0.0 or interval_s > 0.0:
        m = (0.0, 0.0, 0.0)
        if memory.has_reading == 1.0:
            if memory.shortest_s == 0.0 or interval_s <= GAP * memory.shortest_s:
                difference = sub(b, read_vector(memory.b_body_t))
                m = scale(-parameters.gain / interval_s, difference)
            memory.shortest_s = shortest_with(memory.shortest_s, interval_s)
        memory.has_reading, memory.t_s = 1.0, t_s
        put_vector(memory.b_body_t, b)
        put_vector(memory.dipole_a_m2, m)
    return m


@kernel
def bdot_model(inputs, parameters, memory):
    """m = -k dB/dt, from the field model on board, the attitude and the gyro; no magnetometer.

    dB/dt in the body is that of the model, turned to the body, less omega x B.
    """
    q, omega = inputs.estimate.q_body_to_inertial, inputs.estimate.omega_body_rad_s
    turning = rotate_inverse(q, inputs.ephemeris.b_rate_inertial_t_s)
    b = rotate_inverse(q, inputs.ephemeris.b_inertial_t)
    return scale(-parameters.gain, sub(turning, cross(omega, b)))


class _Bdot(LawSpec):
    """B-dot; the gain k in A m^2 s/T (the same as N m s/T^2)."""

    gain_a_m2_s_per_t: float = Field(gt=0.0)
    """Gain k of m = -k dB/dt; A m^2 s/T is the same as N m s/T^2."""

    def parameters(self) -> Gain:
        """The gain."""
        return Gain(self.gain_a_m2_s_per_t)


class Bdot(_Bdot):
    """On-board B-dot: finite difference of two magnetometer readings."""

    kind: Literal["bdot"] = "bdot"
    kernel: ClassVar = bdot_difference
    memory: ClassVar = PREVIOUS_READING
    needs: ClassVar = frozenset({"magnetometer"})


class BdotRate(_Bdot):
    """B-dot from gyro and magnetometer."""

    kind: Literal["bdot_rate"] = "bdot_rate"
    kernel: ClassVar = bdot_rate
    needs: ClassVar = frozenset({"magnetometer", "rate"})


class BdotDerivative(_Bdot):
    """B-dot from a direct reading of the field's rate of change (search coil)."""

    kind: Literal["bdot_derivative"] = "bdot_derivative"
    kernel: ClassVar = bdot_derivative
    needs: ClassVar = frozenset({"search_coil"})


class BdotModel(_Bdot):
    """B-dot from the field model on board, attitude sensor and gyro."""

    kind: Literal["bdot_model"] = "bdot_model"
    kernel: ClassVar = bdot_model
    needs: ClassVar = MODEL_FIELD | {"attitude", "rate"}
