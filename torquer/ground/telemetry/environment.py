"""Where a satellite was at the rows of its telemetry: position, field, Sun and shadow."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.environment.along_orbit import OrbitEnvironment

if TYPE_CHECKING:
    import xarray as xr

#: Seconds over which the field's rate of change is taken.
_APART_S = 1.0


class RowEnvironments(NamedTuple):
    """Environment at n rows, in J: position (n, 3) m and velocity m/s, field T and its rate of
    change along the orbit T/s, unit vector to the Sun from the satellite, visible part of the
    Sun's disc (n,)."""

    r: np.ndarray
    v: np.ndarray
    b: np.ndarray
    b_rate: np.ndarray
    sun: np.ndarray
    sunlit_fraction: np.ndarray


def environments_at_rows(data: xr.Dataset, along: OrbitEnvironment) -> RowEnvironments:
    """Environment at the rows of a session, whose first one is at `along.start`.

    Without an orbit in `along`, positions are those of `position_j`, by splines where a row has
    none.
    """
    t_s = data["time"].values
    if along.orbit is None:
        r, v, b, b_rate = _at_positions(data, along, t_s)
    else:
        r, v = along.state(t_s)
        b = along.field(t_s, r, v)
        before, after = (along.field(t, *along.state(t)) for t in (t_s - _APART_S, t_s + _APART_S))
        b_rate = (after - before) / (2.0 * _APART_S)
    sun = along.sun(t_s) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]
    return RowEnvironments(r, v, b, b_rate, sun, along.sunlit_fraction(t_s, r))


def _at_positions(data, along, t_s):
    from scipy.interpolate import CubicSpline

    given = data["position_j"].values
    there = np.isfinite(given).all(axis=1)
    place = CubicSpline(t_s[there], given[there])
    r, v = place(t_s), place(t_s, 1)
    b = along.field(t_s, r, v)
    return r, v, b, CubicSpline(t_s, b)(t_s, 1)
