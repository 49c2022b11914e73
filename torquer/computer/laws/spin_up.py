"""Spin-up about the spin axis by the two coils across it.

MAG 3.2. The torque along the axis is k (B^2 - (B.e3)^2), never negative: the spin grows about +e3
until the wanted rate is reached. `axis` turned round spins the other way.
"""

import math
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import unit_vector
from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import NotNegative, UnitNumbers
from torquer.computer.laws.spin_axis import AboutAxis, switch
from torquer.maths.geometry.vec3 import add_scaled, cross, dot, scale


class SpinUpParameters(NamedTuple):
    """Those of `AxisParameters`, rate to reach [rad/s] (0: none), direction of the first coil.

    The second coil is e3 x first.
    """

    gain: NotNegative
    relay: NotNegative
    axis: UnitNumbers
    target_rate: NotNegative
    first_coil: UnitNumbers


@kernel
def spin_up(inputs, parameters, memory):
    """m = -k e3 x B = k (B2, -B1, 0) until omega.e3 is reached. Source: MAG (3.2.1).

    A relay switches each of the two coils alone.
    """
    e3, first = parameters.axis, parameters.first_coil
    if 0.0 < parameters.target_rate <= dot(inputs.estimate.omega_body_rad_s, e3):
        return (0.0, 0.0, 0.0)
    wanted = scale(-parameters.gain, cross(e3, inputs.b_body_t))
    second = cross(e3, first)
    m = scale(switch(parameters, dot(wanted, first)), first)
    return add_scaled(m, switch(parameters, dot(wanted, second)), second)


class SpinUp(AboutAxis):
    """Spin-up; the gain in A m^2/T."""

    kind: Literal["spin_up"] = "spin_up"
    gain_a_m2_per_t: float | None = Field(default=None, gt=0.0)
    """Gain of the law. Either it or `relay_dipole_a_m2` is given."""
    target_rate_deg_s: float | None = Field(default=None, gt=0.0)
    """Rate about the axis at which spin-up stops; left out: never."""
    first_coil: unit_vector("first_coil") | None = None
    """Direction of one of the two coils across the axis, for a relay."""
    gain_key: ClassVar = "gain_a_m2_per_t"
    kernel: ClassVar = spin_up

    @model_validator(mode="after")
    def _first_coil_across(self):
        if self.first_coil is not None and abs(np.dot(self.first_coil, self.axis)) > 1e-9:
            raise ValueError(
                f"first_coil: must be at right angles to the axis {list(self.axis)}; "
                f"received {list(self.first_coil)}"
            )
        return self

    def across(self) -> tuple[float, float, float]:
        """Direction of the first coil; if it is left out the body axis farthest off, squared up."""
        if self.first_coil is not None:
            return self.first_coil
        away = np.eye(3)[np.argmin(np.abs(self.axis))]
        away = away - np.dot(away, self.axis) * np.array(self.axis)
        x, y, z = (away / np.linalg.norm(away)).tolist()
        return (x, y, z)

    @property
    def needs(self) -> frozenset[str]:
        """The magnetometer; the rate, where spin-up stops at one."""
        return frozenset({"magnetometer", *(["rate"] if self.target_rate_deg_s else [])})

    def parameters(self) -> SpinUpParameters:
        """Those of a law with an axis, rate to reach, first coil."""
        rate = math.radians(self.target_rate_deg_s or 0.0)
        return SpinUpParameters(*super().parameters(), rate, self.across())
