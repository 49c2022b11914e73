"""Tilted dipole: the first three Gauss terms, rotating with the Earth. Frame: Earth-fixed."""

import math
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from torquer.base.conventions import FIELD_RADIUS_M
from torquer.compile.engine import kernel
from torquer.environment.field.coefficients import schmidt_coefficients, schmidt_rates
from torquer.environment.field.model import FixedInEarth, row_matrix, row_vector
from torquer.maths.geometry.vec3 import add_scaled, dot, mat_t_vec, scale

M3_IN_KM3 = 1e9


@kernel
def b_dipole(moment, r):
    """Flux density [T] at r [m] of a dipole at the origin, in the axes of both.

    `moment` = mu_e k [T m^3], k the dipole's direction. Source: FIELD (1.1).
    """
    r2 = dot(r, r)
    along = add_scaled(scale(-r2, moment), 3.0 * dot(moment, r), r)
    return scale(1.0 / (r2 * r2 * math.sqrt(r2)), along)


@kernel
def b_dipole_many(moment, r, out):
    """`b_dipole` at the rows of `r`, into `out`."""
    for i in range(r.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = b_dipole(moment, row_vector(r, i))


@kernel
def b_turning_many(moment_ecef, r_inertial, dcm_inertial_to_ecef, out):
    """Field in the inertial frame of a dipole fixed in the Earth, into `out`."""
    for i in range(r_inertial.shape[0]):
        moment = mat_t_vec(row_matrix(dcm_inertial_to_ecef, i), moment_ecef)
        out[i, 0], out[i, 1], out[i, 2] = b_dipole(moment, row_vector(r_inertial, i))


def _moment(g, h) -> tuple:
    """Dipole vector [T m^3] in Earth-fixed axes of the terms of degree 1 [T]."""
    return tuple(FIELD_RADIUS_M**3 * float(c) for c in (g[1, 1], h[1, 1], g[1, 0]))


class TiltedDipole(FixedInEarth):
    """Dipole at the Earth's centre: of `source` at the date, or given by three numbers.

    FIELD's lambda2, which counts from -Y2, is longitude + 90 deg - (longitude of Y1).
    """

    kind: Literal["tilted_dipole"] = "tilted_dipole"
    in_earth: ClassVar = b_dipole_many
    in_space: ClassVar = b_turning_many
    source: Literal["igrf14", "wmm2025"] = "igrf14"
    """Model of whose first-degree coefficients the dipole is made."""
    extrapolate: bool = False
    """Whether a date outside the source's validity is a warning rather than an error."""
    held_at_year: float | None = None
    """Decimal year at which the coefficients are held whatever the date; left out: they follow the
    date.
    """
    mu_e_t_km3: float | None = Field(None, gt=0.0)
    """Strength mu_e of the dipole, in place of the source's."""
    tilt_deg: float | None = Field(None, ge=0.0, le=180.0)
    """Angle of the dipole's direction to the Earth's axis (north): 168.3 in FIELD, 168 deg 26' in
    MAG.
    """
    longitude_deg: float | None = None
    """East longitude of the dipole's direction."""

    @model_validator(mode="after")
    def _all_or_none(self):
        names = ("mu_e_t_km3", "tilt_deg", "longitude_deg")
        given = [name for name in names if getattr(self, name) is not None]
        if given and len(given) < len(names):
            raise ValueError(
                f"{', '.join(names)}: must be given together or not at all; "
                f"received {', '.join(given)}"
            )
        if given and self.held_at_year is not None:
            raise ValueError(
                f"held_at_year: must be left out with {', '.join(names)}, which have no date; "
                f"received {self.held_at_year:g}"
            )
        return self

    def prepare(self, decimal_year: float) -> tuple:
        """Dipole vector mu_e k [T m^3] in Earth-fixed axes; the date counts only for `source`."""
        if self.mu_e_t_km3 is None:
            year = decimal_year if self.held_at_year is None else self.held_at_year
            return _moment(*schmidt_coefficients(self.source, year, self.extrapolate))
        tilt, longitude = math.radians(self.tilt_deg), math.radians(self.longitude_deg)
        across = math.sin(tilt)
        k = (across * math.cos(longitude), across * math.sin(longitude), math.cos(tilt))
        return tuple(self.mu_e_t_km3 * M3_IN_KM3 * c for c in k)

    def prepare_rate(self, piece: int) -> tuple:
        """Rate of the dipole vector [T m^3/yr] between one epoch of `source` and the next."""
        return _moment(*schmidt_rates(self.source, piece))
