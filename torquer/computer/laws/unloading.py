"""Unloading of wheels by coils: the field takes away the momentum that the wheels have gathered.

The coils brake the wheels' momentum as B-dot brakes the body: across the field only, which must
turn for all of it to go. The wheels' own law takes the coils' torque on, and so sheds momentum.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Vector
from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import MomentumNumbers
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.vec3 import cross, dot, norm, scale, sub


class UnloadingParameters(NamedTuple):
    """k [1/s], dead band [N m s], h_0 [N m s, body]."""

    gain: float
    dead_band: float
    wanted_momentum: MomentumNumbers


@kernel
def unloading(inputs, parameters, memory):
    """m = -(k/B^2) B x (h - h_0) [A m^2]: its torque is -k times what of h - h_0 is across B.

    h the wheels' momentum. No field, or h - h_0 below the dead band: no dipole.
    """
    p, b = parameters, inputs.b_body_t
    excess = sub(inputs.wheel_momentum_body_n_m_s, p.wanted_momentum)
    square = dot(b, b)
    if square == 0.0 or norm(excess) < p.dead_band:
        return (0.0, 0.0, 0.0)
    return scale(-p.gain / square, cross(b, excess))


class Unloading(LawSpec):
    """Unloading of wheels by coils (momentum dumping, desaturation)."""

    kind: Literal["unloading"] = "unloading"
    kernel: ClassVar = unloading
    needs: ClassVar = frozenset({"magnetometer", "tachometers"})
    momentum_key: ClassVar = "wanted_momentum_n_m_s"
    gain_per_s: float = Field(gt=0.0)
    """Gain k: the momentum across the field decays as exp(-k t)."""
    wanted_momentum_n_m_s: Vector = (0.0, 0.0, 0.0)
    """Momentum that the wheels are to keep, in body axes."""
    dead_band_n_m_s: float = Field(default=0.0, ge=0.0)
    """The coils are off while the wheels' momentum is closer than this to the wanted one."""

    def parameters(self) -> UnloadingParameters:
        """Gain, dead band, wanted momentum."""
        wanted = self.wanted_momentum_n_m_s
        return UnloadingParameters(self.gain_per_s, self.dead_band_n_m_s, wanted)
