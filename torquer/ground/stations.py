"""Ground stations: where they stand, and how high a satellite must be for them to see it.

[stations.tarusa]
latitude_deg = 54.73
longitude_deg = 37.18
altitude_m = 180.0
lowest_elevation_deg = 5.0
horizon_deg = [[0.0, 3.0], [120.0, 12.0], [180.0, 3.0]]    # azimuth, elevation
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec

_Azimuth = Annotated[float, Field(ge=0.0, lt=360.0)]
_Elevation = Annotated[float, Field(ge=-10.0, lt=90.0)]
_TURN = 360.0


class GroundStation(Spec):
    """A station on the ellipsoid WGS84; what it sees, it sees in straight lines."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    """Geodetic latitude."""
    longitude_deg: float = Field(ge=-180.0, le=360.0)
    """Longitude to the east."""
    altitude_m: float = Field(default=0.0, ge=-500.0, le=10_000.0)
    """Height above the ellipsoid."""
    lowest_elevation_deg: _Elevation = 0.0
    """Elevation above which it receives."""
    horizon_deg: tuple[tuple[_Azimuth, _Elevation], ...] = ()
    """What stands around it: pairs of azimuth (from north by east) and elevation, straight
    between them and from the last one to the first.
    """

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        azimuths = [azimuth for azimuth, _ in self.horizon_deg]
        for before, after in pairwise(azimuths):
            if not before < after:
                raise ValueError(
                    f"horizon_deg: must have azimuths that increase; received {after:g} after "
                    f"{before:g}"
                )
        return self

    @property
    def least_rad(self) -> float:
        """The lowest elevation at which it receives in any direction [rad]."""
        horizon = [elevation for _, elevation in self.horizon_deg]
        return np.radians(max(self.lowest_elevation_deg, min(horizon, default=-90.0)))

    def limit_rad(self, azimuth_rad) -> np.ndarray:
        """The elevation [n] above which it receives at azimuths [n], rad."""
        azimuth = np.degrees(np.asarray(azimuth_rad, dtype=np.float64)) % _TURN
        if not self.horizon_deg:
            return np.full(azimuth.shape, self.least_rad)
        known, elevations = zip(*self.horizon_deg, strict=True)
        horizon = np.interp(azimuth, known, elevations, period=_TURN)
        return np.radians(np.maximum(horizon, self.lowest_elevation_deg))
