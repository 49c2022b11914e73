"""The Earth's rotation and the Sun in short series, for kernels of on-board computers.

`earth.rotation` and `environment.sun` sum a thousand terms for arrays of times;
here are the largest alone, at one time. From 1990 to 2060 axes are within 0.2 arcsec of theirs, the
Sun within 0.01 deg, its distance within 1e-4 of itself.

Pole: polynomials of N. Capitaine, P. T. Wallace, 'Concise CIO based precession-nutation
formulations' (2008), with the greatest terms of their series. Sun: J. Meeus, 'Astronomical
Algorithms' (1998), chapter 25. Sidereal time: IAU 1982.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import ASTRONOMICAL_UNIT_M
from torquer.base.time import DAY_S
from torquer.compile.engine import kernel
from torquer.environment.earth.rotation_table import dcm_to_pole
from torquer.maths.geometry.vec3 import mat_t_vec

#: Noon of 1 January 2000 as a Julian date, and days of a Julian century.
J2000_DAY = 2451545.0
CENTURY_DAYS = 36525.0
_TURN = 2.0 * math.pi
_ARCSEC = math.pi / 648000.0
_DEGREE = math.pi / 180.0
#: Turns of the Earth at J2000, and those of a day of UT1 beyond one.
_ERA_TURNS, _ERA_EXCESS = 0.7790572732640, 0.00273781191135448
#: Greenwich mean sidereal time less the Earth rotation angle: at J2000 and its rate [turns, 1/day].
_LAG_TURNS = 67310.54841 / DAY_S - _ERA_TURNS
_LAG_RATE = 8640184.812866 / (CENTURY_DAYS * DAY_S) - _ERA_EXCESS


class EarthNow(NamedTuple):
    """Matrices (rows) from inertial to Earth-fixed axes and from inertial axes to TEME; Sun [m]."""

    to_ecef: tuple
    to_teme: tuple
    sun: tuple


@kernel
def _pole(t, node, sun, moon, anomaly):
    """X and Y of the celestial pole [rad] at Julian centuries t of TT; angles as in `earth_at`."""
    x = -0.016617 + t * (2004.191898 - t * (0.4297829 + 0.19861834 * t))
    x += -6.844318 * math.sin(node) + 0.205833 * t * math.cos(node)
    x += -0.523908 * math.sin(2.0 * sun) - 0.090552 * math.sin(2.0 * moon)
    x += 0.082169 * math.sin(2.0 * node) + 0.058707 * math.sin(anomaly)
    y = -0.006951 - t * (0.025896 + t * (22.4072747 - 0.00190059 * t))
    y += 9.205236 * math.cos(node) + 0.153042 * t * math.sin(node)
    y += 0.573033 * math.cos(2.0 * sun) + 0.097847 * math.cos(2.0 * moon)
    y += -0.089618 * math.cos(2.0 * node)
    return _ARCSEC * x, _ARCSEC * y


@kernel
def _sun_teme(t, node, mean, anomaly):
    """Apparent Sun [m] in TEME at Julian centuries t of TT, for its mean longitude and anomaly."""
    eccentricity = 0.016708634 - 0.000042037 * t
    centre = (1.914602 - 0.004817 * t) * math.sin(anomaly)
    centre += (0.019993 - 0.000101 * t) * math.sin(2.0 * anomaly)
    centre += 0.000289 * math.sin(3.0 * anomaly)
    true = anomaly + _DEGREE * centre
    distance = 1.000001018 * (1.0 - eccentricity * eccentricity)
    distance /= 1.0 + eccentricity * math.cos(true)
    turned = _ARCSEC * (-17.206424 * math.sin(node) - 1.317091 * math.sin(2.0 * mean))
    longitude = mean + _DEGREE * centre + turned - _ARCSEC * 20.4955 / distance
    tilt = 84381.406 - 46.836769 * t + 9.205233 * math.cos(node) + 0.573034 * math.cos(2.0 * mean)
    tilt *= _ARCSEC
    away = distance * ASTRONOMICAL_UNIT_M
    x, across = away * math.cos(longitude), away * math.sin(longitude)
    y, z = across * math.cos(tilt), across * math.sin(tilt)
    lag = turned * math.cos(tilt)  # of the mean equinox behind the true one
    return (x + lag * y, y - lag * x, z)


@kernel
def earth_at(ut1_days, tt_minus_ut1_s, is_precise):
    """The Earth's rotation and the Sun at days of UT1 since `J2000_DAY`.

    Inertial axes are GCRF where `is_precise`, else those of TEME, as in `earth.rotation`.
    """
    t = (ut1_days + tt_minus_ut1_s / DAY_S) / CENTURY_DAYS
    node = _DEGREE * (125.04455501 - 1934.136261 * t)
    mean = _DEGREE * (280.46646 + t * (36000.76983 + 0.0003032 * t))
    moon = _DEGREE * (218.3164477 + 481267.88123 * t)
    anomaly = _DEGREE * (357.52911 + t * (35999.05029 - 0.0001537 * t))
    sun = _sun_teme(t, node, mean, anomaly)
    u = ut1_days / CENTURY_DAYS
    lag = _LAG_TURNS + _LAG_RATE * ut1_days + u * u * (0.093104 - 6.2e-6 * u) / DAY_S
    turns = np.fmod(ut1_days, 1.0) + _ERA_TURNS + _ERA_EXCESS * ut1_days
    if not is_precise:
        to_ecef = dcm_to_pole(0.0, 0.0, _TURN * (turns + lag))
        return EarthNow(to_ecef, dcm_to_pole(0.0, 0.0, 0.0), sun)
    x, y = _pole(t, node, mean, moon, anomaly)
    origin = 0.5 * x * y  # minus the locator s
    to_teme = dcm_to_pole(x, y, origin - _TURN * lag)
    return EarthNow(dcm_to_pole(x, y, _TURN * turns + origin), to_teme, mat_t_vec(to_teme, sun))
