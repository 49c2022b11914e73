"""A density of the air by a function of the user's own."""

import math
from typing import ClassVar, Literal

import numpy as np

from torquer.base.time import decimal_years, utc_of_year
from torquer.base.user_code import UserCode
from torquer.environment.earth.atmosphere.model import Atmosphere

#: From this distance to the Earth's centre [m], 128 km above it at the equator, 150 km at a pole,
#: no air is nearly so dense [kg/m^3]; nor anywhere so dense as the other.
_HIGH_M, _GREATEST_HIGH, _GREATEST = 6.507e6, 1e-6, 2.0


class UserAtmosphere(UserCode, Atmosphere):
    """A density of your own: a function `(r_ecef_m, years, **parameters)` in a Python file.

    It gets Earth-fixed positions (n, 3) in metres and decimal years (n,) and returns the density
    (n,) in kg/m^3. It is called for many points at once and tabulated. Where the orbit is
    integrated (kind 'numerical') it cannot be called.
    """

    kind: Literal["user"]
    place = "environment.atmosphere"
    takes = 2
    returns = "a function (r_ecef_m, years) that returns densities (n,) kg/m^3"
    heights_km: ClassVar = (0.0, math.inf)

    def _densities(self, t_s, start_utc, r, dut1_s) -> np.ndarray:
        found = self.numbers(self.call(r.copy(), decimal_years(start_utc, t_s)))
        if found.shape != (t_s.size,):
            raise self.refusal(f"shape {found.shape} for n = {t_s.size}")
        if not (found >= 0.0).all() or not np.isfinite(found).all():
            row = np.flatnonzero(~((found >= 0.0) & np.isfinite(found)))[0]
            raise self.refusal(f"{found[row]} at t = {t_s[row]:g} s", ", finite and not negative")
        high = np.linalg.norm(r, axis=1) > _HIGH_M
        greatest = np.where(high, _GREATEST_HIGH, _GREATEST)
        if (found > greatest).any():
            row = int(np.flatnonzero(found > greatest)[0])
            place = "130 km or more above the Earth" if high[row] else "near the Earth"
            raise self.refusal(
                f"{found[row]:g} (in kg/km^3?) at t = {t_s[row]:g} s",
                f", at most {greatest[row]:g} {place}",
            )
        return found

    def where(self, r_ecef, years) -> str:
        """Place and instant of the first row."""
        return f"at {[round(x) for x in r_ecef[0].tolist()]} m, {utc_of_year(years[0])}"

    def pack(self):
        """No constants: this model is not compiled (ValueError)."""
        raise ValueError(NOT_COMPILED)


NOT_COMPILED = (
    "atmosphere: must be one that compiles (gost, exponential) where the orbit is integrated; "
    "received a user's function"
)
