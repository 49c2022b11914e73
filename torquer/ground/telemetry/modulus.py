"""The strength of the geomagnetic field along an orbit, compared with a magnetometer's.

The strength does not depend on the attitude, so it checks a magnetometer, its units, its clock and
the elements without knowing it. Along an orbit the field is taken from a spline over a grid of
20 s: 1e-3 nT from the model, and as fast for a million stamps as for a thousand.
"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import xarray as xr

from torquer.environment.along_orbit import Environment, OrbitEnvironment

#: Distance of the points of the grid [s], and the degree of the spline through them.
GRID_S, DEGREE = 20.0, 5
#: Seconds beyond the first and last stamp of a stretch: clocks may be wrong by so much.
MARGIN_S = 400.0


def environment_along(data: xr.Dataset, orbit) -> OrbitEnvironment:
    """The environment along an orbit, whose time 0 is the first row of a session."""
    return OrbitEnvironment(Environment(), orbit, session_start(data))


def session_start(data: xr.Dataset) -> datetime:
    """UTC of the first row of a session, to the microsecond."""
    if not data.sizes["time"]:
        raise ValueError("FILE: must hold rows; received none")
    return data["utc"].values[0].astype("datetime64[us]").item().replace(tzinfo=UTC)


def session_middle(data: xr.Dataset) -> datetime:
    """UTC of the middle row of a session: some rows of a clock that was not set do not move it."""
    session_start(data)
    stamp = data["utc"].values[data.sizes["time"] // 2]
    return stamp.astype("datetime64[us]").item().replace(tzinfo=UTC)


class FieldAlong:
    """The field along an orbit at the stamps of a session, by splines over stretches of stamps."""

    def __init__(self, environment: OrbitEnvironment, t_s: np.ndarray):
        self._first, self._splines = [], []
        for low, high in _stretches(t_s):
            count = int(np.ceil((high - low + 2.0 * MARGIN_S) / GRID_S)) + 1
            grid = low - MARGIN_S + GRID_S * np.arange(max(count, 2 * DEGREE))
            r, v = environment.state(grid)
            self._first.append(low)
            self._splines.append(_strength_spline(grid, environment.field(grid, r, v), DEGREE))

    def strength(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Strength [n] T of the field at times [n] s, and its rate of change [n] T/s.

        The times ascend and are at most `MARGIN_S` from the stamps.
        """
        ends = np.searchsorted(t_s, np.array(self._first[1:]) - MARGIN_S)
        pairs = list(zip(self._splines, np.split(t_s, ends), strict=True))
        value, rate = (
            np.concatenate([spline(part, nu=order) for spline, part in pairs]) for order in (0, 1)
        )
        return value, rate


def _strength_spline(t_s, b, degree: int):
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(t_s, np.linalg.norm(b, axis=1), degree)


def _stretches(t_s: np.ndarray) -> list[tuple[float, float]]:
    """First and last time of stretches between which there are long gaps."""
    cuts = np.flatnonzero(np.diff(t_s) > 4.0 * MARGIN_S)
    firsts, lasts = np.append(0, cuts + 1), np.append(cuts, len(t_s) - 1)
    return [(float(t_s[a]), float(t_s[b])) for a, b in zip(firsts, lasts, strict=True)]


class FieldGiven:
    """The field at positions that the telemetry itself holds, which belong to its stamps."""

    def __init__(self, environment: OrbitEnvironment, t_s: np.ndarray, position_j: np.ndarray):
        known = np.isfinite(position_j).all(axis=1)
        if np.sum(known) <= DEGREE:
            raise ValueError("position_j: must be given in more rows; received too few")
        r = np.ascontiguousarray(position_j[known])
        self._spline = _strength_spline(t_s[known], environment.field(t_s[known], r, r), 3)

    def strength(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Strength [n] T of the field at times [n] s, and its rate of change [n] T/s."""
        return self._spline(t_s), self._spline(t_s, nu=1)


def strength_ratio(strength_measured: np.ndarray, strength: np.ndarray) -> float:
    """Median ratio of the measured strength [n] to the model's [n]."""
    with np.errstate(invalid="ignore"):
        return float(np.nanmedian(strength_measured / strength))
