"""Orbits and stations for tests of passes, and a slow twin of the search: a look every second."""

from datetime import UTC, datetime

import numpy as np

from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import Kepler, Sgp4
from torquer.ground import sight
from torquer.ground.stations import GroundStation

#: Elements of Chibis-M, and their epoch.
CHIBIS = (
    "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
    "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
)
START = datetime(2012, 2, 28, tzinfo=UTC)
START_MS = round(START.timestamp() * 1e3)
HOUR_MS = 3_600_000
TARUSA = GroundStation(latitude_deg=54.73, longitude_deg=37.18, altitude_m=180.0)


def chibis():
    """Chibis-M with the usual models of Earth and Sun."""
    return OrbitEnvironment(Environment(), Sgp4(tle=CHIBIS), START)


def kepler(axis_km, eccentricity, inclination_deg, **keys):
    """A satellite that keeps to an ellipse."""
    orbit = Kepler(
        kind="kepler",
        semi_major_axis_km=axis_km,
        eccentricity=eccentricity,
        inclination_deg=inclination_deg,
        **keys,
    )
    return OrbitEnvironment(Environment(), orbit, START)


def sampled(around, station, end_s, step_s=1.0):
    """Times [s] and whether the satellite is in sight, by looking again and again."""
    t_s = np.arange(0.0, end_s, step_s)
    seen = sight.look(around, station, t_s)
    return t_s, seen.elevation_rad > station.limit_rad(seen.azimuth_rad)
