"""Circular orbit in J, the case of most of the theory."""

import math
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.environment.orbit.kepler import FARTHEST_KM, Extent, Orbit, mean_motion, states


class Circular(Orbit):
    """Circular two-body orbit. The altitude is above the equatorial radius, 6378.137 km."""

    kind: Literal["circular"] = "circular"
    altitude_km: float | None = Field(default=None, gt=0.0, le=FARTHEST_KM)
    """Altitude above the equatorial radius. Either it or `radius_km` is given."""
    radius_km: float | None = Field(default=None, gt=EARTH_RADIUS_M / 1e3, le=FARTHEST_KM)
    """Radius of the orbit. Either it or `altitude_km` is given."""
    inclination_deg: float = Field(ge=0.0, le=180.0)
    """Inclination to the equator."""
    raan_deg: float = 0.0
    """Right ascension of the ascending node."""
    argument_of_latitude_deg: float = 0.0
    """Argument of latitude at the start of the run."""

    @model_validator(mode="after")
    def _check(self):
        if (self.altitude_km is None) == (self.radius_km is None):
            received = "none of them" if self.altitude_km is None else "both"
            raise ValueError(f"orbit: must have altitude_km or radius_km; received {received}")
        return self

    @property
    def radius_m(self) -> float:
        """Radius of the orbit [m]."""
        if self.radius_km is not None:
            return self.radius_km * 1e3
        return EARTH_RADIUS_M + self.altitude_km * 1e3

    def rate_rad_s(self, start_utc=None) -> float:
        """Orbital rate omega0 [rad/s]; it does not depend on the date."""
        return mean_motion(self.radius_m)

    def extent(self, start_utc=None) -> Extent:
        """Radius, twice, and inclination, the same at any date."""
        return Extent(self.radius_m, self.radius_m, math.radians(self.inclination_deg))

    def state(self, t_s, start_utc=None, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s in J at times [n] s, at any date."""
        angles = (self.raan_deg, self.inclination_deg, 0.0)
        start = math.radians(self.argument_of_latitude_deg)
        return states(t_s, self.radius_m, 0.0, angles, start)
