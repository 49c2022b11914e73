"""The Moon as seen from an Earth satellite, good to a third of a degree.

Low-precision series of the Astronomical Almanac (section D, 'Low-precision formulae for geocentric
coordinates of the Moon'), in the mean equator and equinox of date: enough for what it blinds.
"""

from datetime import datetime

import erfa
import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.time import julian_dates
from torquer.environment.earth.rotation import check_mode

_J2000 = 2451545.0
#: Amplitude [deg], phase [deg] and rate [deg a century] of sines in ecliptic longitude and
#: latitude, of cosines in the parallax.
_LONGITUDE = np.array(
    [
        (6.29, 135.0, 477198.87),
        (-1.27, 259.3, -413335.36),
        (0.66, 235.7, 890534.22),
        (0.21, 269.9, 954397.74),
        (-0.19, 357.5, 35999.05),
        (-0.11, 186.5, 966404.03),
    ]
)
_LATITUDE = np.array(
    [
        (5.13, 93.3, 483202.02),
        (0.28, 228.2, 960400.89),
        (-0.28, 318.3, 6003.15),
        (-0.17, 217.6, -407332.21),
    ]
)
_PARALLAX = np.array(
    [
        (0.0518, 135.0, 477198.87),
        (0.0095, 259.3, -413335.36),
        (0.0078, 235.7, 890534.22),
        (0.0028, 269.9, 954397.74),
    ]
)


def moon_position(t_s, start_utc: str | datetime, mode: str = "precise") -> np.ndarray:
    """Position of the Moon from the Earth's centre [n, 3] m, at times [n] s, in J.

    J is GCRF (mode "precise") or the frame of date TEME ("sidereal"), of which the mean equinox of
    the series is 0.005 deg off at most. The direction is good to 0.4 deg for 1900-2100.
    """
    check_mode(mode)
    _, (day, fraction) = julian_dates(start_utc, np.atleast_1d(t_s))
    of_date = _mean_of_date(((day - _J2000) + fraction) / 36525.0)
    if mode == "sidereal":
        return of_date
    to_date = erfa.pmat06(day, fraction)
    return np.einsum("nji,nj->ni", to_date, of_date)


def _mean_of_date(centuries) -> np.ndarray:
    """Position [n, 3] m in the mean equator and equinox of date, at centuries [n] from J2000."""
    longitude = 218.32 + 481267.881 * centuries + _sum(np.sin, _LONGITUDE, centuries)
    latitude = _sum(np.sin, _LATITUDE, centuries)
    parallax = 0.9508 + _sum(np.cos, _PARALLAX, centuries)
    obliquity = np.radians(23.439 - 0.0130 * centuries)
    along, above = np.radians(longitude), np.radians(latitude)
    x = np.cos(above) * np.cos(along)
    y, z = np.cos(above) * np.sin(along), np.sin(above)
    c, s = np.cos(obliquity), np.sin(obliquity)
    distance = EARTH_RADIUS_M / np.sin(np.radians(parallax))
    return distance[:, None] * np.stack([x, c * y - s * z, s * y + c * z], axis=1)


def _sum(wave, terms, centuries) -> np.ndarray:
    """Sum of periodic terms [n] deg."""
    amplitude, phase, rate = terms.T
    return wave(np.radians(phase + rate * centuries[:, None])) @ amplitude
