"""First preliminary reorientation: the spin axis goes to the plane of field and target.

MAG 3.4. For a satellite in any rotation, usually together with nutation damping, which it needs:
alone it lets the nutation grow. One coil, about the spin axis: the spin is not touched.
"""

from typing import ClassVar, Literal

from pydantic import Field

from torquer.compile.engine import kernel
from torquer.computer.laws.spin_axis import Pointed, one_coil, target_body
from torquer.maths.geometry.vec3 import cross, dot


@kernel
def preliminary_1(inputs, parameters, memory):
    """m = k (l_f . (e3 x B)) e3, l_f the unit vector to the target. Source: MAG (3.4.1)."""
    p, direction = parameters, target_body(inputs, parameters)
    return one_coil(p, p.gain * dot(direction, cross(p.axis, inputs.b_body_t)))


class Preliminary1(Pointed):
    """First preliminary reorientation; the gain in A m^2/T (the same as N m/T^2)."""

    kind: Literal["preliminary_1"] = "preliminary_1"
    gain_a_m2_per_t: float | None = Field(default=None, gt=0.0)
    """Gain of the law; A m^2/T is the same as N m/T^2. Either it or `relay_dipole_a_m2` is given.
    """
    gain_key: ClassVar = "gain_a_m2_per_t"
    kernel: ClassVar = preliminary_1
