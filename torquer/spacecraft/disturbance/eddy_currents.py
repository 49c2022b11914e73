"""Eddy currents in the conducting parts of a body that turns in the field: they brake it."""

from typing import NamedTuple

from torquer.base.spec import Spec, damping_tensor, symmetric_tensor
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import as_symmetric, cross, sym_vec


class EddyTensor(NamedTuple):
    """The magnetic tensor [N m s/T^2] for kernels, as `sym_vec` takes it; `is_on`: 1, or 0."""

    is_on: float
    tensor: tuple


NO_EDDY_CURRENTS = EddyTensor(0.0, (0.0,) * 6)


@inlined
def eddy_current_torque(eddy, local_body, omega_body):
    """Torque [N m, body] of the dipole K (omega x B) that the currents make: K (omega x B) x B.

    It takes energy: omega . M = -(omega x B) . K (omega x B). The field's own change along the
    orbit is neglected. J. Wertz (ed.), 'Spacecraft Attitude Determination and Control' (1978),
    section 17.2; for a thin spherical shell of radius r, thickness d, conductivity s it gives
    K = 2/3 pi s d r^4.
    """
    if eddy.is_on == 0.0:
        return (0.0, 0.0, 0.0)
    b = local_body.b_t
    return cross(sym_vec(eddy.tensor, cross(omega_body, b)), b)


_KEY = "damping_n_m_s_per_t2"


class EddyCurrents(Spec):
    """Torque of eddy currents, K (omega x B) x B."""

    damping_n_m_s_per_t2: damping_tensor(_KEY, "currents")
    """Tensor K: one number, three (about the body axes) or 3x3."""

    def pack(self, parts) -> EddyTensor:
        """Constants for kernels; the body's `parts` do not matter."""
        return EddyTensor(1.0, as_symmetric(symmetric_tensor(_KEY, self.damping_n_m_s_per_t2)))
