"""Soft iron: what the field magnetises in the body, and how the field turns it."""

from typing import NamedTuple

from torquer.base.spec import Spec, Vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import as_vector, cross


class IronSet(NamedTuple):
    """Induced dipole by the field along each body axis [A m^2/T] for kernels; `is_on`: 1, or 0."""

    is_on: float
    dipole_by_field: tuple


NO_SOFT_IRON = IronSet(0.0, (0.0, 0.0, 0.0))


@inlined
def soft_iron_torque(iron, local_body, omega_body):
    """Torque [N m, body] (K B) x B: it turns the easy axis to the line of the field."""
    if iron.is_on == 0.0:
        return (0.0, 0.0, 0.0)
    b, k = local_body.b_t, iron.dipole_by_field
    return cross((k[0] * b[0], k[1] * b[1], k[2] * b[2]), b)


class SoftIron(Spec):
    """Torque of the dipole that the field induces in soft iron."""

    dipole_by_field_a_m2_per_t: Vector
    """Induced dipole by the field along each body axis."""

    def pack(self, parts) -> IronSet:
        """Constants for kernels; the body's `parts` do not matter."""
        return IronSet(1.0, as_vector(self.dipole_by_field_a_m2_per_t))
