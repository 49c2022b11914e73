"""The interface of all atmosphere models: density at Earth-fixed positions and given times."""

from datetime import datetime
from typing import ClassVar

import numpy as np

from torquer.base import validate
from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.environment.earth.atmosphere.air import density, height_m
from torquer.environment.earth.rotation_table import day_of_year_at, rotation_at, rotation_table
from torquer.maths.geometry.vec3 import mat_vec


@kernel
def _heights(r, out):
    for i in range(out.size):
        out[i] = height_m((r[i, 0], r[i, 1], r[i, 2]))


@kernel
def _densities(air, rotation, t, r, out):
    for i in range(out.size):
        dcm, sun = rotation_at(rotation, t[i])
        day = day_of_year_at(rotation, t[i])
        out[i] = density(air, (r[i, 0], r[i, 1], r[i, 2]), mat_vec(dcm, sun), day)


def heights_km(r_ecef_m) -> np.ndarray:
    """Heights above the ellipsoid WGS84 [n] km of Earth-fixed positions [n, 3] m."""
    r = np.ascontiguousarray(np.atleast_2d(r_ecef_m), dtype=np.float64)
    out = np.empty(len(r))
    _heights(r, out)
    return 1e-3 * out


class Atmosphere(Spec):
    """A model of the density, valid between two heights [km].

    One that compiles has `pack() -> Air`; another gives `_densities` of its own.
    """

    kind: str
    heights_km: ClassVar[tuple[float, float]]

    def check_heights(self, t_s: np.ndarray, r_ecef_m: np.ndarray) -> None:
        """Raise `ValueError` for the first position outside the model's heights."""
        lowest, highest = self.heights_km
        h = heights_km(r_ecef_m)
        outside = np.flatnonzero(~((h >= lowest) & (h <= highest)))
        if outside.size:
            row = int(outside[0])
            raise ValueError(
                f"atmosphere {self.kind}: height must lie within {lowest:g}..{highest:g} km; "
                f"received {h[row]:.6g} km at t = {t_s[row]:.6g} s"
            )

    def density(self, t_s, start_utc: str | datetime, r_ecef_m, dut1_s: float = 0.0) -> np.ndarray:
        """Density [n] kg/m^3 at times [n] s after the start, at Earth-fixed positions [n, 3] m.

        `dut1_s` is UT1 - UTC at the start. ValueError outside the model's heights.
        """
        t_s, r = self._checked(t_s, r_ecef_m)
        return self._densities(t_s, start_utc, r, dut1_s)

    def _checked(self, t_s, r_ecef_m) -> tuple[np.ndarray, np.ndarray]:
        r = np.ascontiguousarray(np.atleast_2d(validate.finite("r_ecef_m", r_ecef_m)))
        if r.ndim != 2 or r.shape[1] != 3:
            raise ValueError(f"r_ecef_m: must have shape [n, 3]; received {list(r.shape)}")
        t_s = np.ascontiguousarray(np.broadcast_to(validate.finite("t_s", t_s), len(r)))
        self.check_heights(t_s, r)
        return t_s, r

    def _densities(self, t_s, start_utc, r, dut1_s) -> np.ndarray:
        span_s = float(t_s.min()), float(t_s.max())
        rotation = rotation_table(start_utc, *span_s, "precise", dut1_s)
        out = np.empty(t_s.size)
        _densities(self.pack(), rotation, t_s, r, out)
        return out
