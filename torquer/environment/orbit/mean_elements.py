"""Mean elements for SGP4 with all their digits, as Orbit Mean-Elements Messages of CCSDS have them.

Two lines hold four decimals of a degree, which are 6 m in low orbits.
"""

import math
from datetime import datetime, timedelta
from typing import NamedTuple

import numpy as np
from sgp4.api import WGS72, Satrec

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.time import DAY_S, julian_dates
from torquer.environment.orbit.kepler import TWO_PI, Extent
from torquer.environment.orbit.sgp4 import propagate

#: SGP4 counts days from here.
_FIRST_EPOCH = datetime(1949, 12, 31)


class MeanElements(NamedTuple):
    """Elements of SGP4 at an epoch (UTC), in degrees, revolutions a day and 1/Earth radius."""

    epoch: datetime
    mean_motion_rev_day: float
    eccentricity: float
    inclination_deg: float
    raan_deg: float
    argument_of_perigee_deg: float
    mean_anomaly_deg: float
    drag_term: float

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean motion [rad/s] at the epoch."""
        return self.mean_motion_rev_day * TWO_PI / DAY_S

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination of the mean elements."""
        axis = (MU_EARTH_M3_S2 / self.rate_rad_s() ** 2) ** (1.0 / 3.0)
        ends = (axis * (1.0 - self.eccentricity), axis * (1.0 + self.eccentricity))
        return Extent(*ends, math.radians(self.inclination_deg))

    def state(self, t_s, start_utc, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s in TEME at times [n] s after the start."""
        return propagate(self.satellite(), self.extent(), t_s, start_utc)

    def satellite(self) -> Satrec:
        """SGP4's satellite."""
        satellite = Satrec()
        day = (self.epoch.replace(tzinfo=None) - _FIRST_EPOCH) / timedelta(days=1)
        angles = (self.argument_of_perigee_deg, self.inclination_deg, self.mean_anomaly_deg)
        perigee, tilt, anomaly = map(math.radians, angles)
        satellite.sgp4init(
            WGS72, "i", 0, day, self.drag_term, 0.0, 0.0, self.eccentricity, perigee % TWO_PI,
            tilt, anomaly % TWO_PI, self.mean_motion_rev_day / 1440.0 * TWO_PI,
            math.radians(self.raan_deg) % TWO_PI,
        )  # fmt: skip
        # a day since 1949 has no more than a quarter of a microsecond, which are 2 mm
        (whole, fraction), _ = julian_dates(self.epoch, 0.0)
        satellite.jdsatepoch, satellite.jdsatepochF = whole, float(fraction)
        return satellite
