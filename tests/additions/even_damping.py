"""Damping by gyro and magnetometer that does not depend on the strength of the field."""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.compile.engine import kernel
from torquer.computer.laws.law_spec import LawSpec
from torquer.computer.laws.sun_cross import dipole_for
from torquer.maths.geometry.vec3 import scale


class EvenDampingParameters(NamedTuple):
    """Gain k [N m s]."""

    gain: float


@kernel
def even_damping(inputs, parameters, memory):
    """m = k (omega x B)/B^2: the torque is -k omega, less its part along the field."""
    wanted = scale(-parameters.gain, inputs.omega_body_rad_s)
    return dipole_for(wanted, inputs.b_body_t)


class EvenDamping(LawSpec):
    """Damping of the rate, the same wherever the satellite is."""

    kind: Literal["even_damping"] = "even_damping"
    kernel: ClassVar = even_damping
    needs: ClassVar = frozenset({"magnetometer", "rate"})
    gain_n_m_s: float = Field(gt=0.0)
    """Gain k of the law."""

    def parameters(self) -> EvenDampingParameters:
        """The gain."""
        return EvenDampingParameters(self.gain_n_m_s)
