"""Two-line elements fitted to an orbit, as those that are published are fitted to observations.

Their error at the epoch is what SGP4 cannot describe of the orbit, half a kilometre in low orbits;
later it grows with the error of the fitted drag. Published elements are worse: observations have
errors, and the density of the air changes.
"""

import functools
import math
from datetime import datetime, timedelta

import numpy as np
from sgp4.api import WGS72, Satrec
from sgp4.exporter import export_tle

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.time import DAY_S
from torquer.environment.earth.rotation import teme_to_gcrf
from torquer.environment.orbit.kepler import TWO_PI
from torquer.environment.orbit.numerical import Numerical
from torquer.environment.orbit.osculating import semi_major_axis
from torquer.environment.orbit.sgp4 import Sgp4

#: The orbit is fitted over so long before the epoch [s], at so many instants. A span of one day
#: leaves the drag so uncertain that the error after a week is 15 times that of a span of three.
_SPAN_S, _INSTANTS = 3.0 * DAY_S, 433
#: Rms distance [m] above which an orbit is not one for SGP4.
_WORST_M = 20e3
#: SGP4 counts days from here.
_FIRST_EPOCH = datetime(1949, 12, 31)
#: Units in which the elements of `osculating_elements` are fitted.
_SCALES = np.array([1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-4])


@functools.lru_cache(maxsize=16)
def fitted_elements(orbit: Numerical, start: datetime, age_days: float, dut1_s: float) -> Sgp4:
    """Elements of an age [days] at the start, fitted to three days of the orbit before their epoch.

    `dut1_s`: UT1 - UTC at the start. ValueError if SGP4 follows these days to worse than 20 km.
    """
    from scipy.optimize import least_squares

    t_s = -age_days * DAY_S + np.linspace(-_SPAN_S, 0.0, _INSTANTS)
    r, v = _in_teme(orbit, start, t_s, dut1_s)
    epoch = start - timedelta(days=age_days)
    first = osculating_elements(r[-1], v[-1])

    def off_km(x):
        satellite = _satellite(epoch, first + _SCALES * x)
        errors, r_km, _ = satellite.sgp4_array(
            np.full(_INSTANTS, satellite.jdsatepoch),
            satellite.jdsatepochF + (t_s - t_s[-1]) / DAY_S,
        )
        return np.ravel(np.where(errors[:, None] == 0, r_km - 1e-3 * r, 1e4))

    found = least_squares(off_km, np.zeros(7), method="lm")
    away_m = 1e3 * math.sqrt(3.0 * np.mean(found.fun**2))
    if not away_m < _WORST_M:
        raise ValueError(
            "control.ephemeris.tle_age_days: must be given with an orbit that SGP4 follows for "
            f"three days to {1e-3 * _WORST_M:g} km; received one {1e-3 * away_m:.3g} km away"
        )
    return Sgp4(tle=export_tle(_satellite(epoch, first + _SCALES * found.x)))


def _in_teme(orbit: Numerical, start, t_s, dut1_s: float) -> tuple[np.ndarray, np.ndarray]:
    r, v = orbit.state(t_s, start, dut1_s)
    if orbit.frame == "TEME":
        return r, v
    turn = teme_to_gcrf(t_s, start, dut1_s)
    return np.einsum("nji,nj->ni", turn, r), np.einsum("nji,nj->ni", turn, v)


def osculating_elements(r: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Osculating elements: mean motion [rad/min], e cos, e sin of the argument of perigee,
    inclination, node, mean argument of latitude [rad], drag term; defined for circular orbits."""
    h = np.cross(r, v)
    node = math.atan2(h[0], -h[1])
    ascending = np.array([math.cos(node), math.sin(node), 0.0])
    across = np.cross(h / np.linalg.norm(h), ascending)
    rate = math.sqrt(MU_EARTH_M3_S2 / semi_major_axis(r, v) ** 3)
    e = np.cross(v, h) / MU_EARTH_M3_S2 - r / np.linalg.norm(r)
    ex, ey = e @ ascending, e @ across
    eccentricity, perigee = math.hypot(ex, ey), math.atan2(ey, ex)
    true = math.atan2(r @ across, r @ ascending) - perigee
    half = math.sqrt((1.0 - eccentricity) / (1.0 + eccentricity)) * math.tan(0.5 * true)
    anomaly = 2.0 * math.atan(half)
    mean = perigee + anomaly - eccentricity * math.sin(anomaly)
    inclination = math.acos(h[2] / np.linalg.norm(h))
    return np.array([60.0 * rate, ex, ey, inclination, node, mean, 0.0])


def _satellite(epoch: datetime, elements: np.ndarray) -> Satrec:
    """SGP4's satellite of the elements of `osculating_elements`."""
    motion, ex, ey, inclination, node, latitude, drag = elements.tolist()
    perigee = math.atan2(ey, ex)
    days = (epoch.replace(tzinfo=None) - _FIRST_EPOCH) / timedelta(days=1)
    satellite = Satrec()
    satellite.sgp4init(
        WGS72, "i", 1, days, drag, 0.0, 0.0, min(math.hypot(ex, ey), 0.99), perigee % TWO_PI,
        inclination, (latitude - perigee) % TWO_PI, motion, node % TWO_PI,
    )  # fmt: skip
    satellite.classification, satellite.intldesg = "U", ""
    satellite.ephtype, satellite.elnum, satellite.revnum = 0, 0, 0
    return satellite
