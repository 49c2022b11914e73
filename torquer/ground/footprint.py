"""A satellite over the map: the point below it, what sees it from there, the Sun, coasts."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.ground.passes import seconds_of, times_ms
from torquer.ground.stations import GroundStation
from torquer.maths.geometry.frames import geodetic_from_ecef

if TYPE_CHECKING:
    from torquer.environment.along_orbit import OrbitEnvironment

_COAST = Path(__file__).parent / "coastline.json"
#: Points of a circle, and of a revolution's track; revolutions before and after the present.
_CIRCLE, _TRACK, _BEFORE, _AFTER = 73, 121, 0.5, 1.5


@cache
def coastline() -> tuple[tuple[tuple[float, float], ...], ...]:
    """Rings of land, each of points (longitude, latitude) [deg]."""
    rings = json.loads(_COAST.read_text(encoding="utf-8"))
    return tuple(tuple(zip(ring[::2], ring[1::2], strict=True)) for ring in rings)


def below(around: OrbitEnvironment, t_s) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Geodetic latitude and longitude [n] deg, and height [n] m, of a satellite at times [n] s."""
    t_s = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
    r, _ = around.state(t_s)
    lat, lon, height = geodetic_from_ecef(np.einsum("nij,nj->ni", around.dcm_to_ecef(t_s), r))
    return np.degrees(lat), np.degrees(lon), height


def below_sun(around: OrbitEnvironment, t_s: float) -> tuple[float, float]:
    """Geodetic latitude and longitude [deg] where the Sun is in the zenith."""
    at = np.array([t_s])
    sun = np.einsum("nij,nj->ni", around.dcm_to_ecef(at), around.sun(at))[0]
    # the normal of the ellipsoid, not the radius, points to a body that is far away
    x, y, z = sun / np.linalg.norm(sun)
    return math.degrees(math.asin(z)), math.degrees(math.atan2(y, x))


def reach_rad(height_m: float, elevation_rad: float = 0.0) -> float:
    """Angle at the centre of a spherical Earth within which a satellite is above an elevation."""
    radius = EARTH_RADIUS_M + height_m
    return math.acos(min(EARTH_RADIUS_M * math.cos(elevation_rad) / radius, 1.0)) - elevation_rad


def circle(lat_deg: float, lon_deg: float, angle_rad: float) -> list[tuple[float, float]]:
    """Latitudes and longitudes [deg] of points around a place, at an angle from it."""
    bearing = np.linspace(0.0, 2.0 * math.pi, _CIRCLE)
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    sines = math.sin(lat) * math.cos(angle_rad) + (
        math.cos(lat) * math.sin(angle_rad) * np.cos(bearing)
    )
    lats = np.arcsin(np.clip(sines, -1.0, 1.0))
    east = np.arctan2(
        np.sin(bearing) * math.sin(angle_rad) * math.cos(lat),
        math.cos(angle_rad) - math.sin(lat) * np.sin(lats),
    )
    lons = (np.degrees(lon + east) + 180.0) % 360.0 - 180.0
    return [*zip(np.degrees(lats).tolist(), lons.tolist(), strict=True)]


def map_at(around: OrbitEnvironment, stations: Mapping[str, GroundStation], time_ms: int) -> dict:
    """What a map shows at a time: `at`, `track`, `footprint`, `sun`, `stations`; degrees, km.

    ValueError with one line where there is no orbit.
    """
    t_s = seconds_of(around, time_ms)
    period_s = around.orbit.period_s
    times = np.linspace(t_s - _BEFORE * period_s, t_s + _AFTER * period_s, 2 * _TRACK)
    lat, lon, _ = below(around, times)
    (here_lat,), (here_lon,), (height_m,) = (each.tolist() for each in below(around, t_s))
    r, _ = around.state(np.array([t_s]))
    track = zip(times_ms(around, times).tolist(), lat.tolist(), lon.tolist(), strict=True)
    return {
        "time_ms": time_ms,
        "at": [here_lat, here_lon],
        "height_km": 1e-3 * height_m,
        "sunlit": float(around.sunlit_fraction(np.array([t_s]), r)[0]),
        "track": [[at_ms, round(a, 3), round(b, 3)] for at_ms, a, b in track],
        "footprint": circle(here_lat, here_lon, reach_rad(height_m)),
        "sun": below_sun(around, t_s),
        "stations": [
            {
                "name": name,
                "at": [each.latitude_deg, each.longitude_deg],
                "circle": circle(
                    each.latitude_deg, each.longitude_deg, reach_rad(height_m, each.least_rad)
                ),
            }
            for name, each in stations.items()
        ],
    }
