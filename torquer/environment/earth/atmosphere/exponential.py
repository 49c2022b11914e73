"""Exponential atmosphere: fast, for cases that need no better density."""

import math
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.environment.earth.atmosphere.air import EXPONENTIAL, NO_GOST, Air
from torquer.environment.earth.atmosphere.model import Atmosphere

#: Height [km] and density [kg/m^3] of moderate activity: CIRA-72 with 500 K and 1000 K, as
#: tabulated by Vallado, Fundamentals of Astrodynamics and Applications, table 8-4.
TABLE = (
    (0, 1.225), (25, 3.899e-2), (30, 1.774e-2), (40, 3.972e-3), (50, 1.057e-3),
    (60, 3.206e-4), (70, 8.770e-5), (80, 1.905e-5), (90, 3.396e-6), (100, 5.297e-7),
    (110, 9.661e-8), (120, 2.438e-8), (130, 8.484e-9), (140, 3.845e-9), (150, 2.070e-9),
    (180, 5.464e-10), (200, 2.789e-10), (250, 7.248e-11), (300, 2.418e-11), (350, 9.518e-12),
    (400, 3.725e-12), (450, 1.585e-12), (500, 6.967e-13), (600, 1.454e-13), (700, 3.614e-14),
    (800, 1.170e-14), (900, 5.245e-15), (1000, 3.019e-15),
)  # fmt: skip
#: Scale height above the last entry [km].
TOP_SCALE_KM = 268.0


class Exponential(Atmosphere):
    """Density that decays exponentially between the heights of a table, continuously.

    Or with one scale height throughout, from its value at one height: then all three keys are
    given. It does not depend on the Sun, season or solar activity.
    """

    kind: Literal["exponential"] = "exponential"
    density_kg_m3: float | None = Field(default=None, gt=0.0)
    """Density at `at_height_km`."""
    at_height_km: float | None = None
    """Height above the ellipsoid at which the density is given."""
    scale_height_km: float | None = Field(default=None, gt=0.0)
    """Scale height, constant throughout."""
    heights_km: ClassVar = (0.0, math.inf)

    @model_validator(mode="after")
    def _all_or_none(self):
        given = [key for key in _OWN if getattr(self, key) is not None]
        if 0 < len(given) < len(_OWN):
            raise ValueError(
                f"atmosphere: must have all or none of {', '.join(_OWN)}; "
                f"received {', '.join(given)}"
            )
        return self

    def pack(self) -> Air:
        """Constants for kernels."""
        return Air(EXPONENTIAL, *self.heights_km, self._layers(), NO_GOST)

    def _layers(self) -> np.ndarray:
        if self.density_kg_m3 is not None:
            row = (self.at_height_km, math.log(self.density_kg_m3), 1.0 / self.scale_height_km)
            return np.array([row])
        h, rho = np.array(TABLE).T
        fall = -np.diff(np.log(rho)) / np.diff(h)
        return np.column_stack([h, np.log(rho), np.append(fall, 1.0 / TOP_SCALE_KM)])


_OWN = ("density_kg_m3", "at_height_km", "scale_height_km")
