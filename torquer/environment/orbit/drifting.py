"""Orbit of mean elements that drift under the Earth's flattening; Sun-synchronous by local time."""

import math
from typing import ClassVar, Literal

import erfa
import numpy as np
from pydantic import Field, model_validator

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.time import DAY_S, julian_dates
from torquer.environment.orbit.kepler import FARTHEST_KM, TWO_PI, Extent, Orbit, check_farthest
from torquer.environment.orbit.secular import (
    EARTH_J2,
    MeanElements,
    drifting_states,
    secular_rates,
)

#: Right ascension of the mean Sun of date, its rate [rad/s]: a turn in a tropical year.
_SUN_RAD_S = TWO_PI / (365.2421897 * DAY_S)


class Drifting(Orbit):
    """Orbit whose node and perigee drift as the Earth's flattening, J2, turns them.

    Elements are mean ones, of the true equator and mean equinox of date. What J2 does within a
    revolution, some 10 km in low orbits, is left out, so is drag.
    """

    kind: Literal["drifting"] = "drifting"
    frame: ClassVar = "TEME"
    altitude_km: float = Field(gt=0.0, le=FARTHEST_KM)
    """Mean semi-major axis, less the equatorial radius."""
    eccentricity: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Eccentricity."""
    inclination_deg: float | None = Field(default=None, ge=0.0, le=180.0)
    """Inclination to the equator; left out with `ltan_h`: that of a Sun-synchronous orbit."""
    raan_deg: float | None = None
    """Right ascension of the ascending node at the start; left out: by `ltan_h`, else 0."""
    ltan_h: float | None = Field(default=None, ge=0.0, lt=24.0)
    """Mean local time of the ascending node at the start, in place of `raan_deg`."""
    argument_of_perigee_deg: float = 0.0
    """Argument of perigee at the start."""
    mean_anomaly_deg: float = 0.0
    """Mean anomaly at the start of the run."""

    @model_validator(mode="after")
    def _check(self):
        if self.ltan_h is not None and self.raan_deg is not None:
            raise ValueError("orbit: must have raan_deg or ltan_h; received both")
        if self.ltan_h is None and self.inclination_deg is None:
            raise ValueError("inclination_deg: must be given without ltan_h; received none")
        axis = self.axis_m
        near, far = axis * (1.0 - self.eccentricity), axis * (1.0 + self.eccentricity)
        if not near > EARTH_RADIUS_M:
            raise ValueError(
                "orbit: the perigee must lie above the Earth's equatorial radius; received a "
                f"perigee altitude of {1e-3 * (near - EARTH_RADIUS_M):.6g} km"
            )
        check_farthest(far)
        if self.inclination_deg is None and sun_synchronous_rad(axis, self.eccentricity) is None:
            raise ValueError(
                "inclination_deg: must be given where no orbit is Sun-synchronous; received none "
                f"at an altitude of {self.altitude_km:.6g} km"
            )
        return self

    @property
    def axis_m(self) -> float:
        """Mean semi-major axis [m]."""
        return EARTH_RADIUS_M + 1e3 * self.altitude_km

    @property
    def inclination_rad(self) -> float:
        """Inclination [rad], given or derived."""
        if self.inclination_deg is not None:
            return math.radians(self.inclination_deg)
        return sun_synchronous_rad(self.axis_m, self.eccentricity)

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean rate of the argument of latitude [rad/s]: from node to node."""
        rates = secular_rates(self.axis_m, self.eccentricity, self.inclination_rad, EARTH_J2)
        return rates.anomaly + rates.perigee

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination, the same at any date."""
        axis, e = self.axis_m, self.eccentricity
        return Extent(axis * (1.0 - e), axis * (1.0 + e), self.inclination_rad)

    def local_time_rate(self) -> float:
        """Drift of the mean local time of the node: a share of time, 0 if Sun-synchronous."""
        rates = secular_rates(self.axis_m, self.eccentricity, self.inclination_rad, EARTH_J2)
        return (rates.node - _SUN_RAD_S) * DAY_S / TWO_PI

    def node_deg(self, start_utc) -> float:
        """Right ascension of the ascending node [deg] at the start."""
        if self.ltan_h is None:
            return self.raan_deg or 0.0
        return (mean_sun_deg(start_utc) + 15.0 * (self.ltan_h - 12.0)) % 360.0

    def state(self, t_s, start_utc, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s in TEME at times [n] s after the start."""
        elements = MeanElements(
            self.axis_m,
            self.eccentricity,
            math.degrees(self.inclination_rad),
            self.node_deg(start_utc),
            self.argument_of_perigee_deg,
            self.mean_anomaly_deg,
            EARTH_J2,
        )
        return drifting_states(elements, t_s)


def sun_synchronous_rad(semi_major_axis_m: float, eccentricity: float) -> float | None:
    """Inclination [rad] at which the node follows the mean Sun; None where there is none."""
    # the drift of the node goes as the cosine of the inclination
    over_equator = secular_rates(semi_major_axis_m, eccentricity, 0.0, EARTH_J2)
    cosine = _SUN_RAD_S / over_equator.node
    return math.acos(cosine) if abs(cosine) <= 1.0 else None


def mean_sun_deg(start_utc) -> float:
    """Right ascension [deg] of the mean Sun of date, by which mean local times are reckoned."""
    (day, fraction), _ = julian_dates(start_utc, 0.0)
    sidereal = math.degrees(erfa.gmst82(day, float(fraction)))
    return (sidereal - 360.0 * ((day + float(fraction) + 0.5) % 1.0) + 180.0) % 360.0
