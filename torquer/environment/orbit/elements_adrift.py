"""Two-line elements as mean elements that drift: a Kepler orbit of what the ground sends up."""

import math
from datetime import datetime

from sgp4.api import Satrec

from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.base.time import DAY_S, julian_dates
from torquer.environment.orbit.drifting import Drifting
from torquer.environment.orbit.secular import EARTH_J2, secular_rates
from torquer.environment.orbit.sgp4 import Sgp4, leap_seconds_since_epoch

#: The axis is found by so many steps, each of which leaves a thousandth of the error or less.
_STEPS = 8


def adrift(orbit: Sgp4, start: datetime) -> Drifting:
    """The orbit of mean elements at the start of a run to which two-line elements have drifted.

    Node, perigee and anomaly drift as J2 moves them; periodic terms and drag are left out.
    ValueError for elements whose perigee is within the Earth.
    """
    found = Satrec.twoline2rv(*orbit.tle)
    rate, e, tilt = found.no_kozai / 60.0, found.ecco, found.inclo
    axis = (MU_EARTH_M3_S2 / rate**2) ** (1.0 / 3.0)
    for _ in range(_STEPS):
        axis *= (secular_rates(axis, e, tilt, EARTH_J2).anomaly / rate) ** (2.0 / 3.0)
    drift, since_s = secular_rates(axis, e, tilt, EARTH_J2), _since_epoch_s(found, start)
    return Drifting(
        altitude_km=1e-3 * (axis - EARTH_RADIUS_M),
        eccentricity=e,
        inclination_deg=math.degrees(tilt),
        raan_deg=math.degrees(found.nodeo + drift.node * since_s) % 360.0,
        argument_of_perigee_deg=math.degrees(found.argpo + drift.perigee * since_s) % 360.0,
        mean_anomaly_deg=math.degrees(found.mo + drift.anomaly * since_s) % 360.0,
    )


def _since_epoch_s(found: Satrec, start: datetime) -> float:
    """Seconds from the epoch of elements to the start of a run."""
    (day, fraction), _ = julian_dates(start, 0.0)
    days = (day - found.jdsatepoch) + (float(fraction) - found.jdsatepochF)
    return DAY_S * days + leap_seconds_since_epoch(found, start)
