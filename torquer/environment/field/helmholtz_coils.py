"""The constant field of the coils of a test bench. Frame: east, north, up at the place."""

from typing import Literal

import numpy as np

from torquer.base.spec import Spec, Vector
from torquer.environment.field.model import rows


def east_north_up(r_ecef) -> np.ndarray:
    """Axes east, north and up as rows [n, 3, 3] at Earth-fixed positions [n, 3], off the poles."""
    up = r_ecef / np.linalg.norm(r_ecef, axis=1, keepdims=True)
    east = np.cross([0.0, 0.0, 1.0], up)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    return np.stack([east, np.cross(up, east), up], axis=1)


class HelmholtzCoils(Spec):
    """The field of three pairs of coils around a test bench, constant in the laboratory's axes.

    It takes the place of the Earth's field, which the coils are set to cancel.
    """

    kind: Literal["helmholtz_coils"] = "helmholtz_coils"
    b_nt: Vector = (0.0, 1e5, 0.0)
    """Flux density to the east, to the north and up; left out: 1e5 nT to the north, the strength of
    the bench of Chibis-M (MAG, section 5.2)."""

    def prepare(self, decimal_year: float) -> tuple:
        """Flux density [T] to the east, to the north and up, at any date."""
        return tuple(1e-9 * b for b in self.b_nt)

    def b_earth_fixed(self, packed: tuple, r_ecef) -> np.ndarray:
        """Flux density [T] in Earth-fixed axes at `[n, 3]` points [m], off the Earth's axis."""
        return np.einsum("nij,i->nj", east_north_up(rows("r_ecef", r_ecef, 3)), packed)

    def b_inertial(self, packed, r_inertial, v_inertial, dcm_inertial_to_ecef) -> np.ndarray:
        """Flux density [T] in the inertial frame J."""
        r_inertial = rows("r_inertial", r_inertial, 3)
        dcm = rows("dcm_inertial_to_ecef", dcm_inertial_to_ecef, 3, 3, count=len(r_inertial))
        b = self.b_earth_fixed(packed, np.einsum("nij,nj->ni", dcm, r_inertial))
        return np.einsum("nji,nj->ni", dcm, b)
