"""B-cross: brake the rate across the field by gyro and magnetometer, at any strength of the field.

m = k/|B| (omega x b), b = B/|B|, has the torque -k (omega - b (b.omega)), so omega.M =
-k |omega x b|^2 is never above 0: without other torques, and with coils that are not at their
limit, the energy of rotation falls until omega lies along the field, which then turns away.

How fast it turns away sets the gain that is best: a higher one leaves omega along the field and
waits. G. Avanzini, F. Giulietti, "Magnetic detumbling of a rigid spacecraft", Journal of Guidance,
Control, and Dynamics 35 (2012) 1326-1334, propose

    k = 2 n (1 + sin xi) J_min

with the orbital rate n, the orbit's inclination xi to the plane of the geomagnetic equator and the
least moment of inertia J_min.

Valid for a gyro without bias to speak of: a bias is braked as if it were a rate, and the body is
left turning by it. At low xi the field hardly turns, and what lies along it stays. k/J must be low
against the rate of control steps.
"""

import math
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from torquer.compile.engine import kernel
from torquer.computer.laws.bdot_normalised import Brake
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.vec3 import cross, dot, scale

_OF_ORBIT = ("least_inertia_kg_m2", "orbit_rate_deg_s", "field_inclination_deg")


def bcross_gain(least_inertia_kg_m2: float, orbit_rate_rad_s: float, inclination_rad: float):
    """The gain k = 2 n (1 + sin xi) J_min [N m s] of Avanzini and Giulietti."""
    return 2.0 * orbit_rate_rad_s * (1.0 + math.sin(inclination_rad)) * least_inertia_kg_m2


@kernel
def bcross(inputs, parameters, memory):
    """m = k/|B|^2 (omega x B); without a field no dipole."""
    b = inputs.b_body_t
    square = dot(b, b)
    if square == 0.0:
        return (0.0, 0.0, 0.0)
    return scale(parameters.gain / square, cross(inputs.estimate.omega_body_rad_s, b))


class Bcross(LawSpec):
    """B-cross from gyro and magnetometer; its gain, or what the gain of Avanzini and Giulietti
    follows from."""

    kind: Literal["bcross"] = "bcross"
    kernel: ClassVar = bcross
    needs: ClassVar = frozenset({"magnetometer", "rate"})
    gain_n_m_s: float | None = Field(default=None, gt=0.0)
    """Gain k: the torque across the field per unit of rate. It is given, or the next three keys
    are, from which it follows as 2 n (1 + sin xi) J_min.
    """
    least_inertia_kg_m2: float | None = Field(default=None, gt=0.0)
    """Least principal moment of inertia J_min."""
    orbit_rate_deg_s: float | None = Field(default=None, gt=0.0)
    """Orbital rate n: 360 deg over the period."""
    field_inclination_deg: float | None = Field(default=None, ge=0.0, le=180.0)
    """Inclination xi of the orbit to the plane of the geomagnetic equator."""

    @model_validator(mode="after")
    def _one_gain(self):
        given = [key for key in _OF_ORBIT if getattr(self, key) is not None]
        whole = len(given) == len(_OF_ORBIT)
        if (self.gain_n_m_s is None) != whole or (given and not whole):
            received = ([] if self.gain_n_m_s is None else ["gain_n_m_s"]) + given
            raise ValueError(
                f"gain_n_m_s: must be given, or {', '.join(_OF_ORBIT)} together; received "
                f"{' and '.join(received) or 'none'}"
            )
        return self

    def parameters(self) -> Brake:
        """The gain."""
        if self.gain_n_m_s is not None:
            return Brake(self.gain_n_m_s)
        rate, inclination = map(math.radians, (self.orbit_rate_deg_s, self.field_inclination_deg))
        return Brake(bcross_gain(self.least_inertia_kg_m2, rate, inclination))
