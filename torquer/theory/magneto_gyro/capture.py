"""Gains of stage 1: filters by the tip-off rate, K and N by the exact model."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from torquer.theory.magneto_gyro.craft import BRAKED, GyroCraft
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.periodic.floquet import degree_of_stability, multipliers, transitions

#: Gains tried, in units of the satellite, and the filters' damping ratio. Greater gains saturate
#: the coils and pass more noise on.
ANGLE_GAINS, RATE_GAINS = (2.0, 4.0, 6.0, 9.0), (2.0, 3.0, 4.0, 6.0)
DAMPING = 0.7
#: Frequency of the filters over the least that brakes the tip-off rate.
_RESERVE = 1.5


class Stage1Design(NamedTuple):
    """Gains K/(J nu0^2), N/(J nu0), frequency of the filters [rad/s], Floquet degree per 1/nu0."""

    angle_gain: float
    rate_gain: float
    filter_rate_rad_s: float
    degree: float


def filter_rate_for(tip_off_rad_s: float) -> float:
    """Frequency of the filters [rad/s] that brakes a tip-off rate, with a reserve."""
    return _RESERVE * tip_off_rad_s / BRAKED


def design_stage_1(
    craft: GyroCraft, filter_rate_rad_s: float, normals: tuple[float, ...] = (0.0,)
) -> Stage1Design:
    """The gains of a grid with the greatest degree, the least of the fields designed for.

    `normals`: parts of the field along the orbit normal, over A. The degree is negative if none is
    stable: the wheel is too weak.
    """
    tried = list(itertools.product(ANGLE_GAINS, RATE_GAINS))
    points = [(*gains, normal) for gains in tried for normal in normals]
    columns = np.array(points).T
    system = STAGE_1.with_parameters(
        **craft.satellite()._asdict(), damping=DAMPING,
        frequency=filter_rate_rad_s / craft.orbital_rate_rad_s,
    )  # fmt: skip
    values = dict(zip(("angle_gain", "rate_gain", "normal"), columns, strict=True))
    found = transitions(system, values, tolerance=1e-6)
    degrees = degree_of_stability(multipliers(found.matrices), 2.0 * math.pi)
    least = np.nan_to_num(degrees, nan=-math.inf).reshape(len(tried), -1).min(axis=1)
    best = int(np.argmax(least))
    return Stage1Design(*tried[best], filter_rate_rad_s, float(least[best]))
