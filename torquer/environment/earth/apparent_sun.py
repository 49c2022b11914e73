"""Where the Sun appears from the Earth's centre. Frame: GCRF."""

import erfa
import numpy as np

from torquer.base.conventions import ASTRONOMICAL_UNIT_M

LIGHT_SPEED_M_S = 299792458.0


def apparent_sun_gcrf(day, fraction) -> np.ndarray:
    """Apparent Sun [n, 3] m in GCRF at the TT dates `day + fraction`, each evaluated: slow.

    Light time and aberration together: where the Sun stood, from where the Earth stood, when the
    light left (exact to first order in v/c).
    """
    heliocentric, _ = erfa.epv00(day, fraction)
    position = -heliocentric["p"] * ASTRONOMICAL_UNIT_M
    velocity = -heliocentric["v"] * (ASTRONOMICAL_UNIT_M / erfa.DAYSEC)
    light_time = np.linalg.norm(position, axis=-1, keepdims=True) / LIGHT_SPEED_M_S
    return position - velocity * light_time
