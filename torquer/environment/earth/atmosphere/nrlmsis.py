"""NRLMSIS 2.1 through the package pymsis, with all indices given: nothing is downloaded."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from torquer.base.time import utc_at
from torquer.environment.earth.atmosphere.air import Air
from torquer.environment.earth.atmosphere.model import Atmosphere
from torquer.maths.geometry.frames import geodetic_from_ecef


class Nrlmsis(Atmosphere):
    """NRLMSIS with fixed indices; pymsis must be installed: `pip install "torquer[nrlmsis]"`.

    It cannot be called from compiled code, so not where the orbit is integrated.
    """

    kind: Literal["nrlmsis"] = "nrlmsis"
    f107: float = Field(ge=50.0, le=500.0)
    """Solar index F10.7 of the day before."""
    f81: float | None = Field(default=None, ge=50.0, le=500.0)
    """Mean of F10.7 over the 81 days around; left out: f107."""
    ap: float = Field(ge=0.0, le=400.0)
    """Daily geomagnetic index Ap."""
    version: Literal["00", "2.0", "2.1"] = "2.1"
    """Version of the model."""
    heights_km: ClassVar = (0.0, 2000.0)

    def _densities(self, t_s, start_utc, r, dut1_s) -> np.ndarray:
        pymsis = _package()
        latitude, longitude, height_m = geodetic_from_ecef(r)
        n = t_s.size
        f81 = self.f107 if self.f81 is None else self.f81
        out = pymsis.calculate(
            utc_at(start_utc, t_s),
            np.degrees(longitude),
            np.degrees(latitude),
            height_m / 1e3,
            np.full(n, self.f107),
            np.full(n, f81),
            np.full((n, 7), self.ap),
            version=0 if self.version == "00" else self.version,
        )
        return out.reshape(n, -1)[:, 0].astype(np.float64)

    def pack(self) -> Air:
        """No constants: this model is not compiled (ValueError)."""
        raise ValueError(NOT_COMPILED)


NOT_COMPILED = (
    "atmosphere: must be one that compiles (gost, exponential) where the orbit is integrated; "
    "received nrlmsis, which is an external package"
)


def _package():
    try:
        import pymsis
    except ImportError:
        raise ValueError(
            'atmosphere nrlmsis: must have the package pymsis (pip install "torquer[nrlmsis]"); '
            "received no such package"
        ) from None
    return pymsis
