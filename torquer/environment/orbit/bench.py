"""A test bench: a place that rests on the Earth, with the interface of an orbit."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from torquer.base.conventions import EARTH_RADIUS_M, EARTH_RATE_RAD_S
from torquer.environment.earth.rotation import dcm_inertial_to_ecef
from torquer.environment.orbit.kepler import Orbit


class Bench(Orbit):
    """A laboratory that rotates with the Earth, for a body on a bearing (`disturbance.suspension`).

    The Earth is a sphere here: the radius vector is the vertical, within 0.2 deg of a plumb line.
    The orbital frame is that of the laboratory: axis 1 to the east, 2 to the north, 3 up. As
    everywhere, the rate relative to it leaves out its rotation about the radius vector, here
    0.0042 deg/s times the sine of the latitude.
    """

    kind: Literal["bench"] = "bench"
    frame: ClassVar = "GCRF"
    latitude_deg: float = Field(ge=-89.0, le=89.0)
    """Latitude, geocentric."""
    longitude_deg: float = 0.0
    """Longitude to the east; it matters for a field model of the Earth only."""

    def rate_rad_s(self, start_utc=None) -> float:
        """Rate of the Earth's rotation [rad/s]."""
        return EARTH_RATE_RAD_S

    def extent(self, start_utc=None) -> None:
        """None: a bench rests."""
        return None

    def state(self, t_s, start_utc, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s in GCRF at times [n] s after the start."""
        lat, lon = np.radians(self.latitude_deg), np.radians(self.longitude_deg)
        up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
        dcm = dcm_inertial_to_ecef(t_s, start_utc, "precise", dut1_s)
        r = EARTH_RADIUS_M * np.einsum("nji,j->ni", dcm, up)
        return r, np.cross(EARTH_RATE_RAD_S * dcm[:, 2, :], r)
