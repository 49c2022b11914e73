"""Stage 2 over a whole day: the Earth turns its dipole, and the field's part along the orbit normal
changes from one revolution to the next.

On inclined orbits a loop of one revolution tells as much. Near the equator it does not: the orbit
comes close to the magnetic equator, where the field shows neither roll nor yaw, for part of the day
only. The orbit is circular, the Earth's field that of a tilted dipole: for the satellite of
`examples/magneto_gyro.toml` the degree is 0.252 (0.238 in IGRF-14), and it is stable from 19 deg of
inclination on (from between 19 and 21 deg in IGRF-14, in the linear model as in flight).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M, EARTH_RATE_RAD_S
from torquer.compile.engine import released
from torquer.environment.orbit.kepler import mean_motion
from torquer.theory.magneto_gyro.accuracy import transition_matrices
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.loop import Satellite
from torquer.theory.magneto_gyro.stage_2 import ORDER, stage_2_loop, stage_2_matrix_in_dipole

#: Angle between the axis of the Earth's dipole and that of the Earth: IGRF-14 in 2025.
TILT_RAD = math.atan2(math.hypot(1410.3, 4545.5), 29350.0)
#: Steps of a revolution: at least, and per unit of h + 2, for the nutation of a strong wheel.
_STEPS, _STEPS_PER_STIFFNESS = 90, 9.0
#: Steps after which a product of matrices is scaled.
_SCALED = 50
#: Orbits among which the ends of a range are looked for, and how often each is halved.
INCLINATIONS_DEG = np.linspace(0.0, 180.0, 19)
ALTITUDES_KM = np.geomspace(300.0, 36_000.0, 13)
_HALVINGS = 4


class DayLoop(NamedTuple):
    """A satellite, its wheel and gains in units of the satellite, and the form of stage 2.

    `actual`: another satellite under the same law, in those units; None for the same.
    """

    craft: GyroCraft
    gains: tuple
    form: str = "field"
    actual: Satellite | None = None

    def at(self, altitude_km: float) -> "DayLoop":
        """This satellite with its gains on another orbit: nu0 and h change, the gains do not."""
        c = self.craft
        rate = mean_motion(EARTH_RADIUS_M + 1e3 * altitude_km)
        return self._replace(craft=GyroCraft(c.inertia_kg_m2, c.wheel_n_m_s, rate))


def dipole_field(
    tau: np.ndarray, inclination_rad: float, turn: float, tilt_rad: float = TILT_RAD
) -> np.ndarray:
    """Field in t, w, s `[n, 3]`, over its greatest at the magnetic equator, at tau from the node.

    `turn`: angle by which the Earth turns in 1/nu0, that is its rate over nu0.
    """
    node, i = turn * tau, inclination_rad
    g = (math.sin(tilt_rad) * np.cos(node), math.sin(tilt_rad) * np.sin(node), math.cos(tilt_rad))
    across = math.cos(i) * g[1] + math.sin(i) * g[2]
    normal = -math.sin(i) * g[1] + math.cos(i) * g[2]
    along = -np.sin(tau) * g[0] + np.cos(tau) * across
    up = np.cos(tau) * g[0] + np.sin(tau) * across
    return np.stack([along, normal, -2.0 * up], axis=1)


@released
def _tabulate(parameters, fields, matrices):
    for i in range(len(fields)):
        b = (fields[i, 0], fields[i, 1], fields[i, 2])
        stage_2_matrix_in_dipole(b, parameters, matrices[i])


def degree_over_a_day(loop: DayLoop, inclination_deg: float, tilt_rad: float = TILT_RAD) -> float:
    """Floquet degree per 1/nu0 over the revolutions nearest to a day, after which the field is
    taken to repeat."""
    satellite = loop.craft.satellite() if loop.actual is None else loop.actual
    rate = loop.craft.orbital_rate_rad_s
    revolutions = max(1, round(rate / EARTH_RATE_RAD_S))
    steps = max(_STEPS, math.ceil(_STEPS_PER_STIFFNESS * (loop.craft.stiffness + 2.0)))
    tau = np.linspace(0.0, 2.0 * math.pi * revolutions, 2 * steps * revolutions + 1)
    fields = dipole_field(tau, math.radians(inclination_deg), 1.0 / revolutions, tilt_rad)
    matrices = np.empty((len(tau), ORDER, ORDER))
    system = stage_2_loop(satellite, loop.craft.gyrostat, loop.gains, form=loop.form)
    _tabulate(system.pack(), fields, matrices)
    return decay(transition_matrices(matrices, tau[2])) / tau[2]


def decay(transitions: np.ndarray) -> float:
    """Slowest logarithmic decay per step of a product of transition matrices `[n, k, k]`.

    The product is scaled on the way: that of an unstable loop exceeds the range of floats.
    """
    whole, logarithm = np.eye(transitions.shape[-1]), 0.0
    for number, part in enumerate(transitions):
        whole = part @ whole
        if number % _SCALED == 0:
            size = np.abs(whole).max()
            whole, logarithm = whole / size, logarithm + math.log(size)
    radius = float(np.abs(np.linalg.eigvals(whole)).max())
    return -(math.log(radius) + logarithm) / len(transitions)


class Range(NamedTuple):
    """Ends of a range in which a loop is stable; None where it is beyond what was tried."""

    low: float | None
    high: float | None


def stable_range(degree: Callable[[float], float], at: float, tried: np.ndarray) -> Range:
    """The range about `at`, where the degree is positive, until it first is not.

    `tried`: values at which the degree is looked at; an end between two of them is halved in.
    """
    return Range(
        _end(degree, at, tried[tried < at][::-1].tolist()),
        _end(degree, at, tried[tried > at].tolist()),
    )


def _end(degree: Callable[[float], float], stable: float, others: list[float]) -> float | None:
    for unstable in others:
        if degree(unstable) > 0.0:
            stable = unstable
            continue
        for _ in range(_HALVINGS):
            middle = 0.5 * (stable + unstable)
            stable, unstable = (middle, unstable) if degree(middle) > 0.0 else (stable, middle)
        return stable
    return None


def degree_map(loop: DayLoop, inclinations_deg, altitudes_km) -> np.ndarray:
    """Degrees over a day `[altitude, inclination]` of a satellite with the same gains."""
    return np.array([
        [degree_over_a_day(loop.at(altitude), x) for x in inclinations_deg]
        for altitude in altitudes_km
    ])  # fmt: skip
