"""What a station sees of a satellite: direction, distance, and the times at which it is in sight.

Straight lines at one instant: refraction (half a degree at the horizon, which lengthens a pass by
some seconds) and the time that light takes (some milliseconds) are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_RATE_RAD_S, MU_EARTH_M3_S2
from torquer.maths.geometry.frames import dcm_ecef_to_ned, ecef_from_geodetic

if TYPE_CHECKING:
    from torquer.environment.along_orbit import OrbitEnvironment
    from torquer.ground.stations import GroundStation

#: Parts of a revolution, at the rate that it has in perigee, at which a station looks; and how many
#: times as often where its horizon is not level.
_LOOKS, _FINER = 180, 30
#: Width at which the search for an extremum or a crossing ends [s].
_WIDTH_S = 1e-5
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


class Look(NamedTuple):
    """Satellite as seen from a station [n each]: azimuth from north by east and elevation [rad],
    distance [m] and its rate [m/s], which is positive where the satellite recedes."""

    azimuth_rad: np.ndarray
    elevation_rad: np.ndarray
    range_m: np.ndarray
    range_rate_m_s: np.ndarray


def station_ecef(station: GroundStation) -> np.ndarray:
    """Earth-fixed position [3] m of a station."""
    lat, lon = np.radians([station.latitude_deg, station.longitude_deg])
    return ecef_from_geodetic(lat, lon, station.altitude_m)


def look(around: OrbitEnvironment, station: GroundStation, t_s) -> Look:
    """How a station sees a satellite at times [n] s; ValueError where there is no orbit."""
    t_s = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
    r, v = around.state(t_s)
    to_ecef = around.dcm_to_ecef(t_s)
    v = v - np.cross(EARTH_RATE_RAD_S * to_ecef[:, 2, :], r)
    apart = np.einsum("nij,nj->ni", to_ecef, r) - station_ecef(station)
    speed = np.einsum("nij,nj->ni", to_ecef, v)
    distance = np.linalg.norm(apart, axis=1)
    north, east, down = _local(station, apart)
    return Look(
        np.arctan2(east, north) % (2.0 * math.pi),
        np.arctan2(-down, np.hypot(north, east)),
        distance,
        np.einsum("ni,ni->n", apart, speed) / distance,
    )


def sun_elevation(around: OrbitEnvironment, station: GroundStation, t_s) -> np.ndarray:
    """Elevation [n] rad of the Sun's centre above a station's level, without refraction."""
    t_s = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
    sun = np.einsum("nij,nj->ni", around.dcm_to_ecef(t_s), around.sun(t_s))
    north, east, down = _local(station, sun - station_ecef(station))
    return np.arctan2(-down, np.hypot(north, east))


def _local(station: GroundStation, apart: np.ndarray) -> np.ndarray:
    """North, east and down [3, n] of Earth-fixed vectors [n, 3]."""
    lat, lon = np.radians([station.latitude_deg, station.longitude_deg])
    return dcm_ecef_to_ned(lat, lon) @ apart.T


def spans_in_sight(
    around: OrbitEnvironment, station: GroundStation, start_s: float, end_s: float
) -> Iterator[tuple[float, float]]:
    """Times [s] within start to end from which on, and to which, a station sees a satellite.

    One that is in sight at the start or end begins or ends there.
    """
    step_s = _step_s(around)

    def above_least(t_s):
        return look(around, station, t_s).elevation_rad - station.least_rad

    def above_limit(t_s):
        seen = look(around, station, t_s)
        return seen.elevation_rad - station.limit_rad(seen.azimuth_rad)

    for first, last in spans_above(above_least, start_s, end_s, step_s):
        if station.horizon_deg:
            yield from spans_above(above_limit, first, last, step_s / _FINER)
        else:
            yield first, last


def _step_s(around: OrbitEnvironment) -> float:
    """Time between two looks: a part of a revolution at the rate in perigee."""
    extent = around.orbit.extent(around.start)
    if extent is None:
        raise ValueError("orbit: must go around the Earth to have passes; received a bench")
    near, far = extent.perigee_m, max(extent.apogee_m, extent.perigee_m)
    speed = math.sqrt(MU_EARTH_M3_S2 * (2.0 / near - 2.0 / (near + far)))
    return 2.0 * math.pi * near / speed / _LOOKS


def spans_above(
    height: Callable[[np.ndarray], np.ndarray], start_s: float, end_s: float, step_s: float
) -> list[tuple[float, float]]:
    """Spans of time within start to end in which a function [n] of times [n] s is above zero.

    It is sampled at most `step_s` apart, and wherever it turns the turning point itself is
    found: a span however short is missed only where the function turns twice within a step.
    """
    t_s = np.linspace(start_s, end_s, max(3, math.ceil((end_s - start_s) / step_s) + 1))
    t_s, h = _with_extrema(height, t_s, height(t_s))
    inner = crossings(height, t_s, h)[0].tolist()
    edges = [start_s] * bool(h[0] > 0.0) + inner + [end_s] * bool(h[-1] > 0.0)
    return list(zip(edges[::2], edges[1::2], strict=True))


def _with_extrema(height, t_s: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples with the hidden turning points: maxima below zero, minima above it.

    At either end the function may have turned just within.
    """
    sign = np.where(h > 0.0, -1.0, 1.0)
    before, after = np.append(-np.inf, h[:-1]), np.append(h[1:], -np.inf)
    before[0], after[-1] = -sign[0] * np.inf, -sign[-1] * np.inf
    rows = np.flatnonzero((sign * h >= sign * before) & (sign * h >= sign * after))
    if rows.size == 0:
        return t_s, h
    low, high = np.maximum(rows - 1, 0), np.minimum(rows + 1, len(h) - 1)
    found = highest(lambda t: sign[rows] * height(t), t_s[low], t_s[high])
    t_s, h = np.append(t_s, found), np.append(h, height(found))
    order = np.argsort(t_s, kind="stable")
    return t_s[order], h[order]


def highest(height, first_s: np.ndarray, last_s: np.ndarray) -> np.ndarray:
    """Times [n] s of the greatest values between first and last [n], by golden section."""
    low, high = np.array(first_s, dtype=np.float64), np.array(last_s, dtype=np.float64)
    while np.any(high - low > _WIDTH_S):
        inner = _GOLDEN * (high - low)
        left, right = high - inner, low + inner
        is_left = height(left) > height(right)
        low, high = np.where(is_left, low, left), np.where(is_left, right, high)
    return 0.5 * (low + high)


def crossings(height, t_s: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times [n] s at which a sampled function crosses zero, and whether upwards [n]."""
    rows = np.flatnonzero((h[:-1] > 0.0) != (h[1:] > 0.0))
    low, high, rises = t_s[rows], t_s[rows + 1], h[rows + 1] > 0.0
    while np.any(high - low > _WIDTH_S):
        middle = 0.5 * (low + high)
        is_before = (height(middle) > 0.0) != rises
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    return 0.5 * (low + high), rises
