"""Keplerian orbit whose angles drift by the Earth's flattening, for on-board computers.

The mean elements are those of the epoch; J2 turns node and perigee and changes the mean motion
steadily. What J2 does within a revolution, some 10 km in low orbits, is left out, so is drag.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.compile.engine import kernel, records
from torquer.environment.orbit.kepler import perifocal_state
from torquer.maths.geometry.frames import mat_mul, rot_x, rot_z
from torquer.maths.geometry.vec3 import add, add_scaled, cross, mat_vec, put_vector

#: Second zonal harmonic of the Earth's gravity: EGM2008, not normalised.
EARTH_J2 = 1.08262617e-3
_DEGREE = math.pi / 180.0
#: Mean anomaly [rad] beyond which a double has lost the place on the orbit.
_FARTHEST = 1e9


class Drift(NamedTuple):
    """Rates of the mean anomaly, the argument of perigee and the node [rad/s]."""

    anomaly: float
    perigee: float
    node: float


class MeanElements(NamedTuple):
    """Mean elements at an epoch: axis [m], angles [deg]; `j2` = 0: of two bodies."""

    semi_major_axis_m: float
    eccentricity: float
    inclination_deg: float
    raan_deg: float
    argument_of_perigee_deg: float
    mean_anomaly_deg: float
    j2: float


@kernel
def secular_rates(semi_major_axis_m, eccentricity, inclination, j2):
    """Mean rates [rad/s] of an orbit (Brouwer, first order in J2); j2 = 0: of two bodies."""
    rate = math.sqrt(MU_EARTH_M3_S2 / semi_major_axis_m) / semi_major_axis_m
    across = (1.0 - eccentricity) * (1.0 + eccentricity)
    ratio = EARTH_RADIUS_M / (semi_major_axis_m * across)
    c = math.cos(inclination)
    k = 0.75 * j2 * ratio * ratio * rate
    faster = k * math.sqrt(across) * (3.0 * c * c - 1.0)
    return Drift(rate + faster, k * (5.0 * c * c - 1.0), -2.0 * k * c)


@kernel
def drifting_state(elements, t):
    """Position [m] and velocity [m/s] at t seconds after the epoch of elements (`MeanElements`).

    NaN unless the axis is positive and 0 <= eccentricity < 1.
    """
    nowhere = ((math.nan, math.nan, math.nan), (math.nan, math.nan, math.nan))
    axis, eccentricity = elements.semi_major_axis_m, elements.eccentricity
    if not (axis > 0.0 and 0.0 <= eccentricity < 1.0):
        return nowhere
    inclination = _DEGREE * elements.inclination_deg
    drift = secular_rates(axis, eccentricity, inclination, elements.j2)
    node = _DEGREE * elements.raan_deg + drift.node * t
    perigee = _DEGREE * elements.argument_of_perigee_deg + drift.perigee * t
    anomaly = _DEGREE * elements.mean_anomaly_deg + drift.anomaly * t
    if not math.fabs(anomaly) < _FARTHEST:
        return nowhere
    r, v = perifocal_state(anomaly, axis, eccentricity, drift.anomaly)
    plane = mat_mul(rot_z(node), rot_x(inclination))
    dcm = mat_mul(plane, rot_z(perigee))
    r = mat_vec(dcm, r)
    normal = (plane[0][2], plane[1][2], plane[2][2])
    turning = add_scaled((0.0, 0.0, drift.node), drift.perigee, normal)
    return r, add(mat_vec(dcm, v), cross(turning, r))


@kernel
def _fill(elements, t_s, r_out):
    for k in range(t_s.size):
        r, _ = drifting_state(elements[0], t_s[k])
        put_vector(r_out[k], r)


@kernel
def _fill_states(elements, t_s, r_out, v_out):
    for k in range(t_s.size):
        r, v = drifting_state(elements, t_s[k])
        put_vector(r_out[k], r)
        put_vector(v_out[k], v)


def drifting_states(elements: MeanElements, t_s) -> tuple[np.ndarray, np.ndarray]:
    """Positions [n, 3] m and velocities [n, 3] m/s at times [n] s after the epoch of elements."""
    t_s = np.ascontiguousarray(np.atleast_1d(t_s), dtype=np.float64)
    r, v = np.empty((len(t_s), 3)), np.empty((len(t_s), 3))
    _fill_states(MeanElements(*map(float, elements)), t_s, r, v)
    return r, v


def drifting_positions(elements: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    """Positions [n, 3] m at times [n] s after the epoch of elements (one row)."""
    out = np.empty((len(t_s), 3))
    _fill(records(elements), t_s, out)
    return out
