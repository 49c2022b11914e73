"""IGRF-14 and WMM2025: the main field as a sum of spherical harmonics. Frame: Earth-fixed."""

import math
from functools import cache
from typing import ClassVar, Literal

import numpy as np
from pydantic import model_validator

from torquer.base.conventions import FIELD_RADIUS_M
from torquer.compile.engine import kernel
from torquer.environment.earth import harmonics
from torquer.environment.earth.harmonics import Harmonics
from torquer.environment.earth.harmonics_many import gradient_many
from torquer.environment.field.coefficients import (
    max_degree,
    schmidt_coefficients,
    schmidt_rates,
)
from torquer.environment.field.model import FixedInEarth, row_matrix, row_vector
from torquer.maths.geometry.vec3 import mat_t_vec, mat_vec


@cache
def _schmidt(degree: int) -> np.ndarray:
    """Factors [n, m] of Schmidt's quasi-normalisation."""
    factors = np.zeros((degree + 1, degree + 1))
    for n in range(1, degree + 1):
        for m in range(n + 1):
            ratio = math.factorial(n - m) / math.factorial(n + m)
            factors[n, m] = math.sqrt((2 if m else 1) * ratio)
    return factors


def pack(g: np.ndarray, h: np.ndarray) -> Harmonics:
    """Expansion of B from Schmidt quasi-normalised g and h `[n, m]`, in tesla.

    B = -grad V, V = R sum (R/r)^(n+1) (g cos m lambda + h sin m lambda) P_nm, R = 6371.2 km.
    """
    factors = _schmidt(g.shape[0] - 1)
    return harmonics.pack(g * factors, h * factors, FIELD_RADIUS_M, -1.0)


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


class Gauss(FixedInEarth):
    """The main field by its Gauss coefficients."""

    kind: Literal["igrf14", "wmm2025"] = "igrf14"
    in_earth: ClassVar = gradient_many
    in_space: ClassVar = b_inertial_many
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


class Igrf14(Gauss):
    """International Geomagnetic Reference Field, 14th generation: 1900-2030, to degree 13."""

    kind: Literal["igrf14"] = "igrf14"


class Wmm2025(Gauss):
    """World Magnetic Model 2025: 2025-2030, to degree 12."""

    kind: Literal["wmm2025"] = "wmm2025"
