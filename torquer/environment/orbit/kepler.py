"""Keplerian orbit: two-body motion in J, given by its elements at the start of the run."""

import math
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.maths.geometry import euler
from torquer.maths.geometry.vec3 import mat_vec

TWO_PI = 2.0 * math.pi
#: Radius of the Earth's Hill sphere [km]: no orbit about the Earth is stable beyond it.
FARTHEST_KM = 1.5e6


@kernel
def eccentric_anomaly(mean_anomaly, eccentricity):
    """Root E [rad] of Kepler's equation E - e sin E = M, for any M [rad] and 0 <= e < 1.

    On [0, pi] the left-hand side is convex, so Newton's method from an upper bound converges to the
    root monotonically. The bounds: E <= M + e; E <= M/(1 - e); and E <= (pi^2 M)^(1/3), because
    E - sin E lies above E^3/pi^2 there. The descent ends when rounding stops it.
    """
    if eccentricity == 0.0:
        return mean_anomaly
    turns = math.floor(mean_anomaly / TWO_PI + 0.5)
    reduced = mean_anomaly - turns * TWO_PI
    m, third = min(abs(reduced), math.pi), 1.0 / 3.0
    anomaly = min(m + eccentricity, m / (1.0 - eccentricity), math.pi)
    anomaly = max(min(anomaly, (math.pi * math.pi * m) ** third), m)
    for _ in range(60):
        residual = anomaly - eccentricity * math.sin(anomaly) - m
        lower = anomaly - residual / (1.0 - eccentricity * math.cos(anomaly))
        if not lower < anomaly:
            break
        anomaly = lower
    return turns * TWO_PI + math.copysign(anomaly, reduced)


@kernel
def mean_from_true(true_anomaly, eccentricity):
    """Mean anomaly [rad] of a true anomaly [rad], in (-pi, pi]."""
    root = math.sqrt((1.0 - eccentricity) * (1.0 + eccentricity))
    anomaly = math.atan2(root * math.sin(true_anomaly), eccentricity + math.cos(true_anomaly))
    return anomaly - eccentricity * math.sin(anomaly)


@kernel
def perifocal_state(mean_anomaly, semi_major_axis_m, eccentricity, rate):
    """Position [m] and velocity [m/s] in the orbit plane: axis 1 to perigee, 3 the normal."""
    anomaly = eccentric_anomaly(mean_anomaly, eccentricity)
    c, s = math.cos(anomaly), math.sin(anomaly)
    semi_minor = semi_major_axis_m * math.sqrt((1.0 - eccentricity) * (1.0 + eccentricity))
    anomaly_rate = rate / (1.0 - eccentricity * c)
    r = (semi_major_axis_m * (c - eccentricity), semi_minor * s, 0.0)
    v = (-semi_major_axis_m * s * anomaly_rate, semi_minor * c * anomaly_rate, 0.0)
    return r, v


@kernel
def _fill_states(t_s, mean_anomaly, semi_major_axis_m, eccentricity, rate, dcm, r_out, v_out):
    for row in range(t_s.shape[0]):
        r, v = perifocal_state(
            mean_anomaly + rate * t_s[row], semi_major_axis_m, eccentricity, rate
        )
        r_out[row, 0], r_out[row, 1], r_out[row, 2] = mat_vec(dcm, r)
        v_out[row, 0], v_out[row, 1], v_out[row, 2] = mat_vec(dcm, v)


def mean_motion(semi_major_axis_m: float) -> float:
    """Orbital rate [rad/s] of a semi-major axis [m]."""
    return math.sqrt(MU_EARTH_M3_S2 / semi_major_axis_m**3)


def check_farthest(apogee_m: float) -> None:
    """Raise `ValueError` for an apogee [m] beyond the Earth's Hill sphere."""
    if not apogee_m <= 1e3 * FARTHEST_KM:
        raise ValueError(
            f"orbit: must stay within {FARTHEST_KM:.9g} km of the Earth's centre, its Hill sphere; "
            f"received one that goes out to {1e-3 * apogee_m:.6g} km"
        )


def states(t_s, semi_major_axis_m, eccentricity, angles_deg, mean_anomaly_rad) -> tuple:
    """Positions [n, 3] m and velocities [n, 3] m/s in J at times `t_s` [n].

    `angles_deg` are node, inclination and argument of perigee: the plane's 3-1-3 turns.
    """
    t_s = np.ascontiguousarray(np.atleast_1d(t_s), dtype=np.float64)
    node, inclination, perigee = (math.radians(angle) for angle in angles_deg)
    dcm = euler.dcm((2, 0, 2), (node, inclination, perigee))
    r, v = np.empty((t_s.size, 3)), np.empty((t_s.size, 3))
    rate = mean_motion(semi_major_axis_m)
    _fill_states(
        t_s, float(mean_anomaly_rad), float(semi_major_axis_m), float(eccentricity), rate, dcm, r, v
    )
    return r, v


class Extent(NamedTuple):
    """Where an orbit lies: radii of perigee and apogee [m], inclination to the equator [rad]."""

    perigee_m: float
    apogee_m: float
    inclination_rad: float


class Orbit(Spec):
    """What all orbits share; `frame`: that of their `state`."""

    frame: ClassVar[str] = "J"
    #: Interval between known positions [s] that are interpolated; None for an orbit in closed form.
    step_s: ClassVar[float | None] = None

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean orbital rate [rad/s]."""
        raise NotImplementedError

    def extent(self, start_utc=None) -> Extent | None:
        """Perigee, apogee and inclination at the start; None of a place that orbits nothing."""
        raise NotImplementedError

    def check_span(self, start_utc, *times_s: float) -> None:
        """ValueError for times [s] after the start at which the orbit is not known well enough."""

    @property
    def period_s(self) -> float:
        """Time of a revolution [s]."""
        return TWO_PI / self.rate_rad_s()


class Kepler(Orbit):
    """Two-body orbit: size and shape by axis and eccentricity or by its two altitudes."""

    kind: Literal["kepler"] = "kepler"
    semi_major_axis_km: float | None = Field(default=None, gt=0.0)
    """Semi-major axis; given with `eccentricity`."""
    eccentricity: float | None = Field(default=None, ge=0.0, lt=1.0)
    """Eccentricity; given with `semi_major_axis_km`."""
    perigee_altitude_km: float | None = None
    """Altitude of the perigee above the equatorial radius; given with `apogee_altitude_km`."""
    apogee_altitude_km: float | None = None
    """Altitude of the apogee above the equatorial radius; given with `perigee_altitude_km`."""
    inclination_deg: float = Field(ge=0.0, le=180.0)
    """Inclination to the equator."""
    raan_deg: float = 0.0
    """Right ascension of the ascending node."""
    argument_of_perigee_deg: float = 0.0
    """Argument of perigee."""
    mean_anomaly_deg: float | None = None
    """Mean anomaly at the start of the run; 0 if neither anomaly is given."""
    true_anomaly_deg: float | None = None
    """True anomaly at the start of the run, in place of the mean one."""

    @model_validator(mode="after")
    def _check(self):
        elements = (self.semi_major_axis_km, self.eccentricity)
        altitudes = (self.perigee_altitude_km, self.apogee_altitude_km)
        given = [key for key in _SHAPE_KEYS if getattr(self, key) is not None]
        by_elements = None not in elements and altitudes == (None, None)
        by_altitudes = None not in altitudes and elements == (None, None)
        if not (by_elements or by_altitudes):
            raise ValueError(
                "orbit: must have semi_major_axis_km and eccentricity, or perigee_altitude_km and "
                f"apogee_altitude_km; received {', '.join(given) or 'none of them'}"
            )
        if self.mean_anomaly_deg is not None and self.true_anomaly_deg is not None:
            raise ValueError("orbit: must have mean_anomaly_deg or true_anomaly_deg; received both")
        if by_altitudes and self.apogee_altitude_km < self.perigee_altitude_km:
            raise ValueError(
                "apogee_altitude_km: must not be below the perigee's altitude of "
                f"{self.perigee_altitude_km:.9g} km; received {self.apogee_altitude_km:.9g}"
            )
        near, far = self._ends
        if not near > EARTH_RADIUS_M:
            raise ValueError(
                "orbit: the perigee must lie above the Earth's equatorial radius; received a "
                f"perigee altitude of {1e-3 * (near - EARTH_RADIUS_M):.6g} km"
            )
        check_farthest(far)
        return self

    @property
    def _ends(self) -> tuple[float, float]:
        """Radii of perigee and apogee [m]."""
        if self.perigee_altitude_km is None:
            axis, eccentricity = self.shape
            return axis * (1.0 - eccentricity), axis * (1.0 + eccentricity)
        altitudes = (self.perigee_altitude_km, self.apogee_altitude_km)
        return tuple(EARTH_RADIUS_M + altitude * 1e3 for altitude in altitudes)

    @property
    def shape(self) -> tuple[float, float]:
        """Semi-major axis [m] and eccentricity."""
        if self.perigee_altitude_km is None:
            return self.semi_major_axis_km * 1e3, self.eccentricity
        near, far = self._ends
        return 0.5 * (near + far), (far - near) / (far + near)

    @property
    def mean_anomaly_rad(self) -> float:
        """Mean anomaly at the start of the run [rad]."""
        if self.true_anomaly_deg is not None:
            return mean_from_true(math.radians(self.true_anomaly_deg), self.shape[1])
        return math.radians(self.mean_anomaly_deg or 0.0)

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean motion [rad/s]; it does not depend on the date."""
        return mean_motion(self.shape[0])

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination, the same at any date."""
        return Extent(*self._ends, math.radians(self.inclination_deg))

    def state(self, t_s, start_utc=None, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s in J at times [n] s, at any date."""
        angles = (self.raan_deg, self.inclination_deg, self.argument_of_perigee_deg)
        return states(t_s, *self.shape, angles, self.mean_anomaly_rad)


_SHAPE_KEYS = ("semi_major_axis_km", "eccentricity", "perigee_altitude_km", "apogee_altitude_km")
