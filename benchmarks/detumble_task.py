"""The task that every rival runs: detumbling by B-dot over ten revolutions.

A rigid body on a circular orbit that starts at the ascending node, on the inertial x axis;
IGRF field frozen at one date in the Earth-fixed frame, which turns about z by
theta0 + omega_E t (sidereal); gravity gradient; on-board B-dot at 1 Hz with saturated
coils, the dipole held over the second. State: quaternion (x, y, z, w), body to inertial, then
the body rate [rad/s].
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MU_M3_S2 = 3.986004415e14
EARTH_RATE_RAD_S = 7.292115855306589e-5
FIELD_RADIUS_M = 6371200.0
DEGREE = 13
YEAR = 2012.17
COEFFICIENTS = Path(__file__).parents[1] / "torquer/environment/coefficients/IGRF14.shc"


@dataclass(frozen=True)
class Task:
    """Numbers of the task; SI, angles in rad."""

    moments: tuple = (1.0255, 1.5393, 1.8172)
    radius_m: float = 6850e3
    inclination_rad: float = math.radians(51.7)
    theta0_rad: float = 0.0
    gain: float = 1e6  # A m^2 s/T
    dipole_max: float = 3.2  # A m^2, each axis
    rate_rad_s: float = math.radians(10.0)  # each axis
    revolutions: float = 10.0

    @property
    def orbit_rate_rad_s(self) -> float:
        """Angular rate of the circular orbit."""
        return math.sqrt(MU_M3_S2 / self.radius_m**3)

    @property
    def n_steps(self) -> int:
        """Whole seconds of the run."""
        return round(self.revolutions * 2.0 * math.pi / self.orbit_rate_rad_s)

    @property
    def initial_state(self) -> np.ndarray:
        """Identity attitude, the same rate on each axis."""
        return np.array([0.0, 0.0, 0.0, 1.0] + 3 * [self.rate_rad_s])


def read_coefficients(path=COEFFICIENTS, year: float = YEAR):
    """Gauss coefficients g[n, m], h[n, m] [nT] of an .shc file, linear between its epochs."""
    with open(path) as file:
        rows = [line.split() for line in file if not line.startswith("#")]
    epochs = np.array(rows[1], dtype=float)
    g, h = np.zeros((DEGREE + 1, DEGREE + 1)), np.zeros((DEGREE + 1, DEGREE + 1))
    for n, m, *values in rows[2:]:
        table = g if int(m) >= 0 else h
        table[int(n), abs(int(m))] = np.interp(year, epochs, np.array(values, dtype=float))
    return g, h


def write_coefficients(path, g, h):
    """The text file that the C++ program reads: lines `n m g h` [nT]."""
    with open(path, "w") as file:
        for n in range(1, DEGREE + 1):
            for m in range(n + 1):
                file.write(f"{n} {m} {float(g[n, m])!r} {float(h[n, m])!r}\n")
