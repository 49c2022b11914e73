"""IGRF-14 and WMM2025: the main field as a sum of spherical harmonics. Frame: Earth-fixed."""

from typing import Literal

import numpy as np
from pydantic import model_validator

from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.environment.earth.harmonics_many import gradient_many
from torquer.environment.field.coefficients import (
    max_degree,
    schmidt_coefficients,
    schmidt_rates,
)
from torquer.environment.field.harmonics import Harmonics, pack
from torquer.environment.field.model import row_matrix, row_vector, rows
from torquer.maths.geometry.vec3 import mat_t_vec, mat_vec


@kernel
def b_inertial_many(harmonics_, r_inertial, dcm_inertial_to_ecef, out):
    """Flux density [T] in the inertial frame at the rows of `r_inertial` [m], into `out`."""
    for i in range(r_inertial.shape[0]):
        r_ecef = mat_vec(row_matrix(dcm_inertial_to_ecef, i), row_vector(r_inertial, i))
        out[i, 0], out[i, 1], out[i, 2] = r_ecef
    gradient_many(harmonics_, out, out)
    for i in range(r_inertial.shape[0]):
        b = mat_t_vec(row_matrix(dcm_inertial_to_ecef, i), row_vector(out, i))
        out[i, 0], out[i, 1], out[i, 2] = b


class Gauss(Spec):
    """The main field by its Gauss coefficients."""

    kind: Literal["igrf14", "wmm2025"] = "igrf14"
    degree: int | None = None
    """Degree at which the series is truncated; left out: the model's own."""
    extrapolate: bool = False
    """Whether a date outside the model's validity is a warning rather than an error."""
    held_at_year: float | None = None
    """Decimal year at which the coefficients are held whatever the date, as on-board software or
    another program may do; left out: they follow the date.
    """

    @model_validator(mode="after")
    def _degree_exists(self):
        top = max_degree(self.kind)
        if self.degree is not None and not 1 <= self.degree <= top:
            raise ValueError(
                f"degree: must lie within 1..{top} for {self.kind}; received {self.degree}"
            )
        return self

    def coefficients(self, decimal_year: float) -> Harmonics:
        """The expansion at a date, as the kernels take it."""
        year = decimal_year if self.held_at_year is None else self.held_at_year
        g, h = schmidt_coefficients(self.kind, year, self.extrapolate)
        size = (self.degree or max_degree(self.kind)) + 1
        return pack(g[:size, :size], h[:size, :size])

    prepare = coefficients

    def prepare_rate(self, piece: int) -> Harmonics:
        """The expansion of dB/dt [T/yr] between one epoch of the source and the next."""
        size = (self.degree or max_degree(self.kind)) + 1
        return pack(*(c[:size, :size] for c in schmidt_rates(self.kind, piece)))

    def b_earth_fixed(self, packed: Harmonics, r_ecef) -> np.ndarray:
        """Flux density [T] in Earth-fixed axes at `[n, 3]` points [m]."""
        r_ecef = rows("r_ecef", r_ecef, 3)
        out = np.empty_like(r_ecef)
        gradient_many(packed, r_ecef, out)
        return out

    def b_inertial(self, packed, r_inertial, v_inertial, dcm_inertial_to_ecef) -> np.ndarray:
        """Flux density [T] in the inertial frame; the velocities are not used."""
        r_inertial = rows("r_inertial", r_inertial, 3)
        out = np.empty_like(r_inertial)
        dcm = rows("dcm_inertial_to_ecef", dcm_inertial_to_ecef, 3, 3, count=len(out))
        b_inertial_many(packed, r_inertial, dcm, out)
        return out


class Igrf14(Gauss):
    """International Geomagnetic Reference Field, 14th generation: 1900-2030, to degree 13."""

    kind: Literal["igrf14"] = "igrf14"


class Wmm2025(Gauss):
    """World Magnetic Model 2025: 2025-2030, to degree 12."""

    kind: Literal["wmm2025"] = "wmm2025"
