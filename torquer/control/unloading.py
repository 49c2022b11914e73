"""Unloading of wheels by coils: the field takes away the momentum that the wheels have gathered.

The coils brake the wheels' momentum as B-dot brakes the body: across the field only, which must
turn for all of it to go. The wheels' own law takes the coils' torque on, and so sheds momentum.
"""

from typing import Literal

from pydantic import Field

from torquer.control.law import Law
from torquer.engine import kernel
from torquer.geometry.vec3 import cross, dot, norm, scale, sub
from torquer.spec import Spec, Vector


@kernel
def unloading(measured, parameters, memory):
    """m = -(k/B^2) B x (h - h_0) [A m^2]: its torque is -k times what of h - h_0 is across B.

    h the wheels' momentum. No field, or h - h_0 below the dead band: no dipole.
    Parameters: k, dead band, h_0.
    """
    p, b = parameters, measured.b_body_t
    excess = sub(measured.wheel_momentum_body_n_m_s, (p[2], p[3], p[4]))
    square = dot(b, b)
    if square == 0.0 or norm(excess) < p[1]:
        return (0.0, 0.0, 0.0)
    return scale(-p[0] / square, cross(b, excess))


class Unloading(Spec):
    """Unloading of wheels by coils.

    `gain_per_s`: k, the momentum across the field falls as exp(-k t);
    `wanted_momentum_n_m_s`: what the wheels are to keep, in the body (zero);
    `dead_band_n_m_s`: the coils are off while the wheels' momentum is nearer to it than this.
    """

    kind: Literal["unloading"] = "unloading"
    gain_per_s: float = Field(gt=0.0)
    wanted_momentum_n_m_s: Vector = (0.0, 0.0, 0.0)
    dead_band_n_m_s: float = Field(default=0.0, ge=0.0)

    def law(self) -> Law:
        """The law with this gain."""
        x, y, z = self.wanted_momentum_n_m_s
        gain = {"gain": self.gain_per_s, "dead_band": self.dead_band_n_m_s}
        wanted = {"momentum_x": x, "momentum_y": y, "momentum_z": z}
        return Law(self.kind, unloading, {**gain, **wanted}, spec=self)
