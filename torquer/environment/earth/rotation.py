"""Rotation of the Earth: the inertial frame J, TEME and the Earth-fixed frame E.

Two models. "precise": J is GCRF; precession-nutation IAU 2006/2000A, based on the celestial
intermediate origin, and the Earth rotation angle. "sidereal": J is the true equator and mean
equinox of date (TEME, the frame of SGP4); rotation by Greenwich mean sidereal time, IAU 1982. UT1 -
UTC is given at the start (`dut1_s`) and held constant: left at 0, the rotation is up to 0.9 s in
error (13.5 arcsec, 420 m on the equator); it changes by a millisecond or two a day. Polar motion is
neglected in both (below 0.6 arcsec, 20 m at the surface).

Precession-nutation is slow and costly, so it is evaluated on a fixed half-day grid
and interpolated by polynomials of degree 5 (error below 1e-11 rad). The grid is laid in absolute
time: a date has the same matrix, to rounding, in every run.
"""

import functools
import math
from datetime import datetime

import erfa
import numpy as np

from torquer.base.time import julian_dates
from torquer.compile.engine import kernel

#: Models of the Earth's rotation.
MODES = ("precise", "sidereal")
GRID_DAYS = 0.5
NODES = np.arange(-2, 4)
#: Takes six neighbouring grid values to the coefficients of the polynomial through them.
TO_POWERS = np.linalg.inv(np.vander(NODES, increasing=True))


def check_mode(mode: str) -> None:
    """Raise `ValueError` unless the model of the Earth's rotation is known."""
    if mode not in MODES:
        raise ValueError(f"earth rotation: must be one of {', '.join(MODES)}; received {mode!r}")


def interpolate_slow(grid_values, day: float, fraction, *more: float) -> np.ndarray:
    """A slow function of TT at the Julian dates `day + fraction` [n]: [n, ...].

    `grid_values(day, fractions, *more)` evaluates the function where it is costly, on the half-day
    grid around the dates; what it gave for the last 32 grids is kept. Polynomials of degree 5
    through six neighbours.
    """
    place = np.atleast_1d(fraction) / GRID_DAYS
    cell = np.floor(place).astype(np.int64)
    first = cell.min() + NODES[0]
    values = _on_grid(grid_values, day, int(first), int(cell.max() + NODES[-1] + 1), *more)
    table = values.reshape(len(values), -1)
    out = np.empty((place.size, table.shape[1]))
    for here in np.unique(cell):
        rows = cell == here
        begin = here + NODES[0] - first
        coefficients = TO_POWERS @ table[begin : begin + NODES.size]
        out[rows] = np.vander(place[rows] - here, NODES.size, increasing=True) @ coefficients
    return out.reshape(place.size, *values.shape[1:])


@functools.lru_cache(maxsize=32)
def _on_grid(grid_values, day, first, end, *more) -> np.ndarray:
    return grid_values(day, np.arange(first, end) * GRID_DAYS, *more)


def dcm_inertial_to_ecef(
    t_s, start_utc: str | datetime, mode: str = "precise", dut1_s: float = 0.0
) -> np.ndarray:
    """J to E [n, 3, 3] at times [n] s after the start; J is GCRF ("precise") or TEME ("sidereal").

    `dut1_s` is UT1 - UTC at the start of the run.
    """
    check_mode(mode)
    ut1, tt = julian_dates(start_utc, np.atleast_1d(t_s), dut1_s)
    if mode == "sidereal":
        return _turned_z(erfa.gmst82(*ut1), np.eye(3)[None])
    return _turned_z(erfa.era00(*ut1), interpolate_slow(erfa.c2i06a, *tt))


def teme_to_gcrf(t_s, start_utc: str | datetime, dut1_s: float = 0.0) -> np.ndarray:
    """TEME to GCRF [n, 3, 3] at times [n] s after the start.

    TEME is tied to the Earth by the IAU 1982 sidereal time, and the Earth to GCRF by IAU
    2006/2000A: a position in TEME then has one Earth-fixed place under both models of rotation.
    (The older chain, IAU 1976/1980 with the equation of the equinoxes, lacks the observed
    corrections of the pole and would be off by some 0.1 arcsec.)
    """
    ut1, tt = julian_dates(start_utc, np.atleast_1d(t_s), dut1_s)
    return np.swapaxes(_gcrf_to_teme(ut1, interpolate_slow(erfa.c2i06a, *tt)), -1, -2)


def gcrf_to_teme_on_grid(ut1_minus_tt_days: float, day: float, fraction) -> np.ndarray:
    """GCRF to TEME [n, 3, 3] at the TT dates `day + fraction`, each evaluated: slow."""
    ut1 = (day, fraction + ut1_minus_tt_days)
    return _gcrf_to_teme(ut1, erfa.c2i06a(day, fraction))


def _gcrf_to_teme(ut1: tuple, gcrf_to_intermediate: np.ndarray) -> np.ndarray:
    # both frames share the equator: they differ by the right ascension of the origin
    return _turned_z(erfa.era00(*ut1) - erfa.gmst82(*ut1), gcrf_to_intermediate)


def _turned_z(angle: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Matrices m [n or 1, 3, 3], then a rotation of the axes by the angles [n] about axis 3."""
    out = np.empty((np.size(angle), 3, 3))
    _fill_turned_z(np.ascontiguousarray(angle), np.ascontiguousarray(m), out)
    return out


@kernel
def _fill_turned_z(angle, m, out):
    for i in range(angle.size):
        c, s = math.cos(angle[i]), math.sin(angle[i])
        k = min(i, m.shape[0] - 1)
        for j in range(3):
            out[i, 0, j] = c * m[k, 0, j] + s * m[k, 1, j]
            out[i, 1, j] = c * m[k, 1, j] - s * m[k, 0, j]
            out[i, 2, j] = m[k, 2, j]
