"""Elements of an orbit on board at the start of a scenario: numbers that the ground may send up."""

import functools
import math

import numpy as np
from sgp4.api import Satrec

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.time import DAY_S, julian_dates
from torquer.computer.on_board_environment import ELEMENTS
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.orbit import Circular, Kepler, Numerical, Sgp4
from torquer.environment.orbit.fitted_elements import fitted_elements, osculating_elements
from torquer.environment.orbit.kepler import TWO_PI
from torquer.environment.orbit.near_earth import DEEP_SPACE_MIN
from torquer.environment.orbit.secular import EARTH_J2, drifting_positions
from torquer.environment.orbit.sgp4 import leap_seconds_since_epoch

#: A drifting Kepler orbit is fitted to the day before the start, at so many instants.
_INSTANTS = 289
#: Units in which its elements are fitted.
_SCALES = np.array([1e2, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4])


def find_elements(kind: str, own: OrbitEnvironment) -> np.ndarray:
    """Elements (one row of `ELEMENTS[kind]`) of an orbit at its start.

    ValueError of one line for an orbit that has none of this kind.
    """
    out = np.zeros(1, ELEMENTS[kind])
    for name, value in (_clock(own) | _OF_KIND[kind](own)).items():
        out[name] = value
    return out


def _clock(own: OrbitEnvironment) -> dict[str, float]:
    (day, utc), (_, tt) = julian_dates(own.start, 0.0)
    return {
        "start_day": day, "start_fraction": float(utc),
        "ut1_minus_utc_s": own.environment.ut1_minus_utc_s,
        "tt_minus_utc_s": round(DAY_S * float(tt - utc), 6),
    }  # fmt: skip


def _at_start(own: OrbitEnvironment) -> dict[str, float]:
    (day, utc), _ = julian_dates(own.start, 0.0)
    return {"epoch_day": day, "epoch_fraction": float(utc)}


def _kepler(own: OrbitEnvironment) -> dict[str, float]:
    orbit = own.orbit
    if isinstance(orbit, Circular):
        axis, eccentricity, perigee = orbit.radius_m, 0.0, 0.0
        anomaly = orbit.argument_of_latitude_deg
    elif isinstance(orbit, Kepler):
        axis, eccentricity = orbit.shape
        perigee, anomaly = orbit.argument_of_perigee_deg, math.degrees(orbit.mean_anomaly_rad)
    else:
        return _at_start(own) | _fit(own)
    return _at_start(own) | {
        "semi_major_axis_m": axis, "eccentricity": eccentricity,
        "inclination_deg": orbit.inclination_deg, "raan_deg": orbit.raan_deg,
        "argument_of_perigee_deg": perigee, "mean_anomaly_deg": anomaly, "j2": 0.0,
    }  # fmt: skip


@functools.lru_cache(maxsize=4)
def _fit(own: OrbitEnvironment) -> dict[str, float]:
    """Elements that drift by J2, fitted to the day before the start."""
    from scipy.optimize import least_squares

    t_s = np.linspace(-DAY_S, 0.0, _INSTANTS)
    r, v = own.state(t_s)
    motion, *rest, _ = osculating_elements(r[-1], v[-1])
    first = np.array([(MU_EARTH_M3_S2 / (motion / 60.0) ** 2) ** (1.0 / 3.0), *rest])

    def off_km(x):
        found = drifting_positions(_row(first + _SCALES * x), t_s)
        return 1e-3 * np.ravel(found - r)

    found = least_squares(off_km, np.zeros(6), method="lm")
    return _name_elements(first + _SCALES * found.x)


def _name_elements(x: np.ndarray) -> dict[str, float]:
    """Elements by name of: axis [m], e cos, e sin of the perigee, inclination, node, latitude."""
    axis, ex, ey, inclination, node, latitude = x.tolist()
    perigee = math.atan2(ey, ex)
    return {
        "semi_major_axis_m": axis, "eccentricity": math.hypot(ex, ey),
        "inclination_deg": math.degrees(inclination), "raan_deg": math.degrees(node % TWO_PI),
        "argument_of_perigee_deg": math.degrees(perigee % TWO_PI),
        "mean_anomaly_deg": math.degrees((latitude - perigee) % TWO_PI), "j2": EARTH_J2,
    }  # fmt: skip


def _row(x: np.ndarray) -> np.ndarray:
    out = np.zeros(1, ELEMENTS["kepler"])
    for name, value in _name_elements(x).items():
        out[name] = value
    return out


def _sgp4(own: OrbitEnvironment) -> dict[str, float]:
    orbit = own.orbit
    if isinstance(orbit, Numerical):
        orbit = fitted_elements(orbit, own.start, 0.0, own.environment.ut1_minus_utc_s)
    if not isinstance(orbit, Sgp4):
        raise ValueError(
            "ephemeris: must be 'given' or 'kepler' unless orbit, or control.ephemeris.orbit, is "
            f"of kind sgp4 or numerical; received 'sgp4' with kind {orbit.kind}"
        )
    elements = elements_from_tle(orbit)
    # days from the epoch to the start: SGP4 on board knows no leap seconds either
    leap_s = leap_seconds_since_epoch(Satrec.twoline2rv(*orbit.tle), own.start)
    return elements | {"epoch_fraction": elements["epoch_fraction"] - leap_s / DAY_S}


def elements_from_tle(orbit: Sgp4) -> dict[str, float]:
    """Numbers of two-line elements under the names that the computer on board has for them."""
    satellite, line = Satrec.twoline2rv(*orbit.tle), orbit.tle[1]
    period_min = TWO_PI / satellite.no
    if not period_min < DEEP_SPACE_MIN:
        raise ValueError(
            f"ephemeris: must be 'given' or 'kepler' for periods from {DEEP_SPACE_MIN:g} min on, "
            f"which SGP4 on board does not have; received 'sgp4' with one of {period_min:.4g} min"
        )
    return {
        "epoch_day": satellite.jdsatepoch, "epoch_fraction": satellite.jdsatepochF,
        "mean_motion_rev_day": float(line[52:63]), "eccentricity": float(f"0.{line[26:33]}"),
        "inclination_deg": float(line[8:16]), "raan_deg": float(line[17:25]),
        "argument_of_perigee_deg": float(line[34:42]), "mean_anomaly_deg": float(line[43:51]),
        "drag_term": _drag_term(orbit.tle[0][53:61]),
    }  # fmt: skip


def _drag_term(text: str) -> float:
    """The number of columns 54-61: a sign, five digits behind the point, an exponent."""
    return float(f"{text[0]}0.{text[1:6].replace(' ', '0')}e{text[6:]}".strip())


_OF_KIND = {"given": lambda own: {}, "kepler": _kepler, "sgp4": _sgp4}
