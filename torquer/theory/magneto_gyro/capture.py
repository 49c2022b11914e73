"""Gains of stage 1: filters by the tip-off rate, K and N by the exact model.

Stage 1 must let go of the attitude that is turned by 180 deg about pitch, too. There the field in
the orbit's plane is opposite to the calculated one, so that the loop is that of -K: where the
gravity gradient holds the satellite against it, some releases end upside down.
"""

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.theory.magneto_gyro.craft import BRAKED, GyroCraft
from torquer.theory.magneto_gyro.own_dipole import TURNED_1, turned_in_stage_1
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.periodic.floquet import degree_of_stability, multipliers, transitions
from torquer.theory.periodic.periodic_systems import PeriodicSystem
from torquer.theory.validity import Limit

#: Gains tried, in units of the satellite, and the filters' damping ratio. Greater gains saturate
#: the coils and pass more noise on; they are tried where these do not hold the satellite.
ANGLE_GAINS, RATE_GAINS = (2.0, 4.0, 6.0, 9.0), (2.0, 3.0, 4.0, 6.0)
GREATER_ANGLE_GAINS = (9.0, 13.0, 20.0, 30.0, 45.0, 70.0, 100.0)
GREATER_RATE_GAINS = (9.0, 13.0, 20.0, 30.0, 50.0, 80.0)
DAMPING = 0.7
#: Degree at which no greater gains are tried: usual gains reach 0.6.
_ENOUGH = 0.5
#: Frequency of the filters over the least that brakes the tip-off rate.
_RESERVE = 1.5
UPSIDE_DOWN = Limit(
    "degree of stage 1 upside down [nu0]", most=0.0,
    why="the gravity gradient holds some releases upside down",
    of="design magneto-gyro: time to point",
    shown="a 3U with K of 2 to 6 (degrees of 0.05 to 0.7): 2 of 6 releases end 170 to 180 deg off, "
    "none of 10 with K of 9 or more",
)  # fmt: skip


class Stage1Design(NamedTuple):
    """Gains K/(J nu0^2), N/(J nu0), frequency of the filters [rad/s], Floquet degree per 1/nu0.

    `upside_down`: the degree when turned by 180 deg about pitch, which must not be positive;
    `turned_rad`: the angle by which the satellite's own dipole turns it.
    """

    angle_gain: float
    rate_gain: float
    filter_rate_rad_s: float
    degree: float
    upside_down: float = -math.inf
    turned_rad: float = 0.0

    @property
    def holds(self) -> bool:
        """Whether it is stable, as wanted alone, and little turned by the dipole."""
        little = TURNED_1.holds(math.degrees(self.turned_rad))
        return self.degree > 0.0 and UPSIDE_DOWN.holds(self.upside_down) and little

    @property
    def ends(self) -> dict[str, str]:
        """Gains that end the grid from which they come, by key: beyond nothing was tried."""
        usual = self.angle_gain <= ANGLE_GAINS[-1] and self.rate_gain <= RATE_GAINS[-1]
        angles, rates = (
            (ANGLE_GAINS, RATE_GAINS) if usual else (GREATER_ANGLE_GAINS, GREATER_RATE_GAINS)
        )
        grids = {"capture_angle_gain": (self.angle_gain, angles),
                 "capture_rate_gain": (self.rate_gain, rates)}  # fmt: skip
        words = {
            key: {grid[0]: "the least tried", grid[-1]: "the greatest tried"}.get(gain, "")
            for key, (gain, grid) in grids.items()
        }
        return {key: each for key, each in words.items() if each}


def filter_rate_for(tip_off_rad_s: float) -> float:
    """Frequency of the filters [rad/s] that brakes a tip-off rate, with a reserve."""
    return _RESERVE * tip_off_rad_s / BRAKED


def design_stage_1(
    craft: GyroCraft,
    filter_rate_rad_s: float,
    normals: tuple[float, ...] = (0.0,),
    own_dipole: tuple[float, float, float] = (0.0, 0.0, 0.0),
    most_angle_gain: float = math.inf,
) -> Stage1Design:
    """The gains of a grid with the greatest degree, the least of the fields designed for.

    `normals`: parts of the field along the orbit normal, over A. `own_dipole`: the satellite's own,
    in the orbital axes, in units of J nu0^2/A. The least of greater gains, up to
    `most_angle_gain`, with which it is stable enough are taken only where the usual ones let the
    satellite be held upside down or be turned by its dipole; the usual ones again if the greater do
    not help. The degree is negative if none is stable: the wheel
    is too weak.
    """
    dipole = np.array(own_dipole)
    greater = [gain for gain in GREATER_ANGLE_GAINS if gain <= most_angle_gain]
    grids = [(ANGLE_GAINS, RATE_GAINS), *(((gain,), GREATER_RATE_GAINS) for gain in greater)]
    usual: list[Stage1Design] = []
    held: list[Stage1Design] = []
    for gains in grids:
        made = sorted(_designs(craft, filter_rate_rad_s, normals, gains), key=_rank, reverse=True)
        usual = usual or made
        turned = (_turned(craft, each, normals, dipole) for each in made)
        held += itertools.islice((each for each in turned if each.holds), 1)
        if held and (gains is grids[0] or max(held, key=_rank).degree > _ENOUGH):
            break
    return max(held, key=_rank) if held else _turned(craft, usual[0], normals, dipole)


def _rank(each: Stage1Design) -> tuple[bool, float]:
    """Designs that let go upside down first, and of these the one with the greatest degree."""
    return UPSIDE_DOWN.holds(each.upside_down), each.degree


def _designs(craft, filter_rate_rad_s, normals, gains) -> Iterator[Stage1Design]:
    """The designs of a grid."""
    tried = np.array(list(itertools.product(*gains)))
    up = _degrees(craft, filter_rate_rad_s, normals, tried).min(axis=1)
    down = _degrees(craft, filter_rate_rad_s, normals, tried * (-1.0, 1.0)).max(axis=1)
    for i, (gain, rate) in enumerate(tried.tolist()):
        yield Stage1Design(gain, rate, filter_rate_rad_s, float(up[i]), float(down[i]))


def _degrees(craft, filter_rate_rad_s, normals, tried) -> np.ndarray:
    """Floquet degrees `[gains, normals]`; minus infinity where a loop grows beyond numbers."""
    points = np.array([(*gains, normal) for gains in tried for normal in normals])
    values = dict(zip(("angle_gain", "rate_gain", "normal"), points.T, strict=True))
    found = transitions(_loop(craft, filter_rate_rad_s), values, tolerance=1e-6)
    degrees = degree_of_stability(multipliers(found.matrices), 2.0 * math.pi)
    return np.nan_to_num(degrees, nan=-math.inf).reshape(len(tried), -1)


def _loop(craft: GyroCraft, filter_rate_rad_s: float, **values: float) -> PeriodicSystem:
    return STAGE_1.with_parameters(
        **craft.satellite()._asdict(), damping=DAMPING,
        frequency=filter_rate_rad_s / craft.orbital_rate_rad_s, **values,
    )  # fmt: skip


def _turned(craft, found: Stage1Design, normals, dipole: np.ndarray) -> Stage1Design:
    """The design with the angle by which a dipole turns it."""
    if not found.degree > 0.0:
        return found
    gains = {"angle_gain": found.angle_gain, "rate_gain": found.rate_gain, "normal": normals[0]}
    loop = _loop(craft, found.filter_rate_rad_s, **gains)
    return found._replace(turned_rad=turned_in_stage_1(loop, dipole, normals[0]))
