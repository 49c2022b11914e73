"""A geomagnetic field by a function of the user's own."""

from typing import Literal

import numpy as np

from torquer.base.time import decimal_years, utc_of_year
from torquer.base.user_code import UserCode
from torquer.environment.field.model import rows

#: No field around a satellite, nor within coils around a bench, is greater; that of the Earth is
#: below 7e-5 T.
_GREATEST_T = 1.0


class UserField(UserCode):
    """A field of your own: a function `(r_ecef_m, years, **parameters)` in a Python file.

    It gets Earth-fixed positions (n, 3) in metres and decimal years (n,) and returns the flux
    density (n, 3) in tesla, in the same axes. It is called for many points at once and tabulated:
    it need not be fast, but smooth.
    """

    kind: Literal["user"]
    place = "environment.field"
    takes = 2
    returns = "a function (r_ecef_m, years) that returns flux densities (n, 3) T"

    def prepare(self, decimal_year: float) -> tuple:
        """The date."""
        return (decimal_year,)

    def b_earth_fixed(self, packed: tuple, r_ecef) -> np.ndarray:
        """Flux density [T] in Earth-fixed axes at `[n, 3]` points [m]."""
        r_ecef = rows("r_ecef", r_ecef, 3)
        return self._at(r_ecef, np.broadcast_to(packed[0], len(r_ecef)))

    def b_inertial(self, packed, r_inertial, v_inertial, dcm_inertial_to_ecef) -> np.ndarray:
        """Flux density [T] in the inertial frame; the velocities are not used."""
        r = rows("r_inertial", r_inertial, 3)
        dcm = rows("dcm_inertial_to_ecef", dcm_inertial_to_ecef, 3, 3, count=len(r))
        b = self.b_earth_fixed(packed, np.einsum("nij,nj->ni", dcm, r))
        return np.einsum("nji,nj->ni", dcm, b)

    def prepare_along(self, start_utc, t_s) -> tuple:
        """The dates at times (n,) [s] after the start."""
        return (decimal_years(start_utc, t_s),)

    def where(self, r_ecef, years) -> str:
        """Place and instant of the first row."""
        return f"at {[round(x) for x in r_ecef[0].tolist()]} m, {utc_of_year(years[0])}"

    def _at(self, r_ecef, years) -> np.ndarray:
        found = self.numbers(self.call(r_ecef.copy(), years.copy()))
        if found.shape != r_ecef.shape:
            raise self.refusal(f"shape {found.shape} for n = {len(r_ecef)}")
        if not np.isfinite(found).all():
            row = np.flatnonzero(~np.isfinite(found).all(axis=1))[0]
            where = self.where(r_ecef[row:], years[row:])
            raise self.refusal(f"{found[row].tolist()} {where}", ", finite")
        if not (np.abs(found) < _GREATEST_T).all():
            row = np.flatnonzero(~(np.abs(found) < _GREATEST_T).all(axis=1))[0]
            received = f"{found[row].tolist()} (in nT?) {self.where(r_ecef[row:], years[row:])}"
            raise self.refusal(received, f" below {_GREATEST_T:g} T")
        return found
