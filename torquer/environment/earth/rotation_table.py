"""The Earth's rotation and the Sun's direction, tabulated for compiled code.

What `earth.rotation` and `environment.sun` give for arrays of times, kernels read
here at one time, in the same frames and with the same two models of rotation.

The celestial pole's X and Y, the locator s, the lag of the sidereal angle, and the Sun's direction
are slow: polynomials of degree 5 on a half-day grid laid in absolute time (error below 1e-11 rad).
From X, Y and s comes a matrix that is orthogonal to rounding.
"""

import math
from datetime import datetime
from typing import NamedTuple

import erfa
import numpy as np

from torquer.base.time import DAY_S, day_of_year, julian_dates, parse_utc
from torquer.compile.engine import kernel
from torquer.environment.earth.apparent_sun import apparent_sun_gcrf
from torquer.environment.earth.rotation import (
    GRID_DAYS,
    NODES,
    TO_POWERS,
    check_mode,
    gcrf_to_teme_on_grid,
)
from torquer.maths.geometry.vec3 import add_scaled, scale

_GRID_S = GRID_DAYS * DAY_S
_TWO_PI = 2.0 * math.pi
#: Rate of the Earth rotation angle [rad/s of UT1].
ERA_RATE_RAD_S = _TWO_PI * 1.00273781191135448 / DAY_S
_X, _Y, _S, _LAG, _SUN = 0, 1, 2, 3, 4
_CHANNELS = 7


class RotationTable(NamedTuple):
    """The Earth's rotation from one start on, for kernels.

    `midnight_s`: from the midnight before the start to the start; `angle`: Earth rotation angle
    at the start [rad]; `first`: number of the first cell; `cells` [cell, power, channel];
    `day`: day of the year at the start, 1.0 = 1 January 00:00 UTC; `year`.
    """

    midnight_s: float
    angle: float
    first: int
    cells: np.ndarray
    day: float
    year: int


def _slow(mode: str, day: float, ut1_minus_tt: float, tt: np.ndarray) -> np.ndarray:
    """The slow channels [n, 7] at TT dates `day + tt` [n]."""
    out = np.zeros((tt.size, _CHANNELS))
    sun = apparent_sun_gcrf(day, tt)
    sun /= np.linalg.norm(sun, axis=1, keepdims=True)
    if mode == "precise":
        out[:, _X], out[:, _Y], out[:, _S] = erfa.xys06a(day, tt)
    else:
        sun = np.einsum("nij,nj->ni", gcrf_to_teme_on_grid(ut1_minus_tt, day, tt), sun)
        lag = erfa.gmst82(day, tt + ut1_minus_tt) - erfa.era00(day, tt + ut1_minus_tt)
        out[:, _LAG] = np.unwrap((lag + math.pi) % _TWO_PI - math.pi)
    out[:, _SUN:] = sun
    return out


def rotation_table(
    start_utc: str | datetime, first_s: float, last_s: float, mode: str, dut1_s: float = 0.0
) -> RotationTable:
    """Table of the Earth's rotation for times first_s..last_s [s] after the start.

    `dut1_s` is UT1 - UTC at the start. Midnights and the grid of the table are those of UTC.
    """
    check_mode(mode)
    start = parse_utc(start_utc)
    (day, utc), (_, tt) = julian_dates(start, np.zeros(1))
    midnight_s = float(utc[0]) * DAY_S
    # a cell more at each end: the last instant must not be read from another cell than it would
    # be in a longer table
    first = math.floor((midnight_s + first_s) / _GRID_S) - 1
    last = math.floor((midnight_s + last_s) / _GRID_S) + 1
    utc_minus_tt, dut1 = float(utc[0] - tt[0]), dut1_s / DAY_S
    points = np.arange(first + NODES[0], last + NODES[-1] + 1) * GRID_DAYS - utc_minus_tt
    values = _slow(mode, day, utc_minus_tt + dut1, points)
    cells = np.stack([TO_POWERS @ values[k : k + 6] for k in range(last - first + 1)])
    angle = float(erfa.era00(day, utc[0] + dut1))
    in_year = start.timetuple().tm_yday + midnight_s / DAY_S
    return RotationTable(midnight_s, angle, first, cells, in_year, start.year)


@kernel
def _slow_at(rotation, t):
    """The seven slow channels at a time [s]."""
    place = (rotation.midnight_s + t) / _GRID_S
    cell = math.floor(place)
    u = place - cell
    c = rotation.cells[min(max(cell - rotation.first, 0), rotation.cells.shape[0] - 1)]
    x, y, s, lag, i, j, k = c[5, 0], c[5, 1], c[5, 2], c[5, 3], c[5, 4], c[5, 5], c[5, 6]
    for down in range(1, 6):
        p = 5 - down
        x, y, s, lag = x * u + c[p, 0], y * u + c[p, 1], s * u + c[p, 2], lag * u + c[p, 3]
        i, j, k = i * u + c[p, 4], j * u + c[p, 5], k * u + c[p, 6]
    return x, y, s, lag, (i, j, k)


@kernel
def dcm_to_pole(x, y, angle):
    """Rows of the matrix to the frame of the pole (x, y), rotated about it by an angle [rad]."""
    a = 1.0 / (1.0 + math.sqrt(1.0 - x * x - y * y))
    c, s = math.cos(angle), math.sin(angle)
    first, second = (1.0 - a * x * x, -a * x * y, -x), (-a * x * y, 1.0 - a * y * y, -y)
    row_1 = add_scaled(scale(c, first), s, second)
    row_2 = add_scaled(scale(c, second), -s, first)
    return (row_1, row_2, (x, y, 1.0 - a * (x * x + y * y)))


@kernel
def rotation_at(rotation, t):
    """Inertial to Earth-fixed (rows), and the Sun's direction, inertial, at a time [s]."""
    x, y, s, lag, sun = _slow_at(rotation, t)
    return dcm_to_pole(x, y, rotation.angle + ERA_RATE_RAD_S * t + lag - s), sun


@kernel
def day_of_year_at(rotation, t):
    """Number of the day of the year, 1 = 1 January; leap seconds ignored."""
    return day_of_year(rotation.day + t / DAY_S, rotation.year)


def teme_to_gcrf_at(start_utc: str | datetime) -> np.ndarray:
    """TEME to GCRF [3, 3] at one instant; UT1 - UTC would change it by 1e-11 rad at most."""
    (day, ut1), (_, tt) = julian_dates(start_utc, np.zeros(1))
    return gcrf_to_teme_on_grid(float(ut1[0] - tt[0]), day, tt)[0].T
