"""S-dot at k B0/L0 held: growth of the scatter over start arguments, and what the rotation does.

v.(l e)/a, the final momentum by (2.18), is constant in the averaged motion, (2.13). Its scatter is
followed along runs with k in proportion to the initial rate: k B0/L0 stays as it is, and what
changes from one rate to another is the rotation over the orbital rate alone.

The torque is linear in the rate and has two factors of the field, so 2u and 4u. In inertial axes
the part of the rate across the momentum turns with two frequencies, that of the precession and the
same less twice that of the nutation. The lower one meets 4 and 2 omega0 last.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipk

from gallery.sdot_runs import (
    AVERAGED,
    CONE,
    FIRST_MOMENTUM,
    MOMENTS,
    ORBIT,
    SUN,
    Run,
    start_arguments,
)
from torquer.simulation.setup.simulate import simulate

COUNT = 24
_P, _Q = 0.5 * math.sin(CONE) ** 2, math.cos(CONE) ** 2
_V = np.array([_P, _P, _Q]) * SUN
#: Direction v/a in inertial axes.
_WEIGHT = np.array(AVERAGED[1]) @ (_V / (_V @ SUN))


@dataclass(frozen=True)
class Passage:
    """Runs from all start arguments, each number a mean over an orbit: scatter (standard deviation)
    of the first integral over the initial momentum; over omega0 the lower frequency of the rate
    across the momentum, median."""

    scatter: np.ndarray
    frequency: np.ndarray

    @property
    def growth(self) -> float:
        """Scatter at the end over that of the first orbit."""
        return float(self.scatter[-1] / self.scatter[0])

    @property
    def grown_at(self) -> float:
        """Frequency over omega0 when half of the growth is done."""
        half = 0.5 * (self.scatter[0] + self.scatter[-1])
        return float(self.frequency[np.argmax(self.scatter > half)])


def passage(gain: float, faster: float) -> Passage:
    """Runs with gain k [A m^2 s] and the text's rates times `faster`."""
    integrals, frequencies = [], []
    for start in start_arguments(COUNT, 180.0):
        result = simulate(Run(gain, start, faster).scenario())
        momentum = result["momentum_inertial"].values
        integrals.append(momentum @ _WEIGHT / (faster * FIRST_MOMENTUM))
        frequencies.append(lower_frequency(momentum, result["omega_body"].values))
    step_s = float(result["time"].values[1])
    integral, frequency = (_over_orbits(x, step_s) for x in (integrals, frequencies))
    return Passage(integral.std(axis=0, ddof=1), np.median(frequency, axis=0) / ORBIT.rate_rad_s())


def _over_orbits(values, step_s: float) -> np.ndarray:
    """Means over an orbit `[start, time]`."""
    records = round(ORBIT.period_s / step_s)
    total = np.cumsum(np.pad(values, ((0, 0), (1, 0))), axis=1)
    return (total[:, records:] - total[:, :-records]) / records


def lower_frequency(momentum, omega_body) -> np.ndarray:
    """Precession less twice the nutation [rad/s]; its mean over a nutation means something."""
    return precession_rate(momentum, omega_body) - 2.0 * nutation_rate(momentum, omega_body)


def precession_rate(momentum, omega_body) -> np.ndarray:
    """Rate [rad/s] at which axis 3 turns about the momentum."""
    across, moments = np.square(omega_body[:, :2]), MOMENTS[:2]
    return np.linalg.norm(momentum, axis=1) * (across @ moments) / (across @ moments**2)


def nutation_rate(momentum, omega_body) -> np.ndarray:
    """Frequency [rad/s] of the free motion of the axis 3 of greatest inertia about the momentum.

    Euler's case with rotation about axis 3: 2 pi over the period of the body-fixed rates.
    """
    least, middle, greatest = MOMENTS
    squared = np.sum(np.square(momentum), axis=1)
    energy_2 = np.square(omega_body) @ MOMENTS
    scale = (greatest - middle) * (squared - energy_2 * least)
    modulus_2 = (middle - least) * (energy_2 * greatest - squared) / scale
    return 0.5 * math.pi / ellipk(modulus_2) * np.sqrt(scale / MOMENTS.prod())
