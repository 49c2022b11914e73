"""SGP4 for orbits of less than 225 minutes as kernels, for on-board computers. Frame: TEME.

As published by D. A. Vallado, P. Crawford, R. Hujsak, T. S. Kelso, 'Revisiting Spacetrack Report
#3' (2006), with the constants of WGS 72; the simulation takes the package `sgp4`. Inside, lengths
are in `RADIUS_KM`, times in minutes.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import kernel
from torquer.maths.geometry.vec3 import add_scaled, scale

RADIUS_KM, _MU_KM3_S2 = 6378.135, 398600.8
_J2, _J3, _J4 = 0.001082616, -0.00000253881, -0.00000165597
_J3_OVER_J2 = _J3 / _J2
#: Rate [1/min] of a circular orbit at one radius.
_RATE = 60.0 / math.sqrt(RADIUS_KM * RADIUS_KM * RADIUS_KM / _MU_KM3_S2)
_TURN, _DEGREE = 2.0 * math.pi, math.pi / 180.0
#: Period [min] from which on the Moon and the Sun matter: SDP4, not here.
DEEP_SPACE_MIN = 225.0
#: Altitudes [km] of the fitted density of the air.
_AIR_FROM_KM, _AIR_TO_KM = 78.0, 120.0


class Mean(NamedTuple):
    """Elements at the epoch and what does not change after it: motion, shape, angles, drag."""

    motion: float
    eccentricity: float
    inclination: float
    node: float
    perigee: float
    anomaly: float
    drag: float
    axis: float
    s: float
    c: float


class Rates(NamedTuple):
    """Rates of the angles [rad/min], and the growth of the node's [rad/min^2] by drag."""

    anomaly: float
    perigee: float
    node: float
    node_by_drag: float


class Drag(NamedTuple):
    """Coefficients of drag: C1, C4, C5 of the theory, and eta; `far`: perigee above 220 km."""

    c1: float
    c4: float
    c5: float
    eta: float
    perigee: float
    anomaly: float
    tsi: float
    s4: float
    far: bool


@kernel
def cube_root(x):
    """Cube root of a number from 1e-9 to 1e9, by Newton from above: no library has other bits."""
    y = max(x, 1.0)
    for _ in range(100):
        lower = y - (y - x / (y * y)) / 3.0
        if not lower < y:
            break
        y = lower
    return y


@kernel
def _semi_major_axis(motion):
    """Semi-major axis of a mean motion [rad/min]."""
    ratio = _RATE / motion
    return cube_root(ratio * ratio)


@kernel
def mean_elements(elements):
    """Elements of SGP4: the mean motion of Kozai made that of Brouwer.

    `elements`: numbers of a two-line set under their names, in its units.
    """
    turns = elements.mean_motion_rev_day
    motion, e = turns * (_TURN / 1440.0), elements.eccentricity
    inclination = _DEGREE * elements.inclination_deg
    s, c = math.sin(inclination), math.cos(inclination)
    across = 1.0 - e * e
    first = _semi_major_axis(motion)
    d1 = 0.75 * _J2 * (3.0 * c * c - 1.0) / (math.sqrt(across) * across)
    d = d1 / (first * first)
    second = first * (1.0 - d * d - d * (1.0 / 3.0 + 134.0 * d * d / 81.0))
    motion /= 1.0 + d1 / (second * second)
    return Mean(
        motion, e, inclination, _DEGREE * elements.raan_deg,
        _DEGREE * elements.argument_of_perigee_deg, _DEGREE * elements.mean_anomaly_deg,
        elements.drag_term, _semi_major_axis(motion), s, c,
    )  # fmt: skip


@kernel
def _air(perigee):
    """Lower edge s of the fitted density of the air and (q - s)^4, for a radius of the perigee."""
    height = (perigee - 1.0) * RADIUS_KM
    edge = _AIR_FROM_KM
    if height < 98.0:
        edge = 20.0
    elif height < 156.0:
        edge = height - 78.0
    q = (_AIR_TO_KM - edge) / RADIUS_KM
    return edge / RADIUS_KM + 1.0, q * q * q * q


@kernel
def drag_coefficients(m):
    """Coefficients of drag of mean elements."""
    e, theta = m.eccentricity, m.c * m.c
    s4, q4 = _air(m.axis * (1.0 - e))
    tsi, across = 1.0 / (m.axis - s4), 1.0 - e * e
    eta = m.axis * e * tsi
    eta2, e_eta = eta * eta, e * eta
    psi = math.fabs(1.0 - eta2)
    coefficient = q4 * tsi * tsi * tsi * tsi
    outer = coefficient / (psi * psi * psi * math.sqrt(psi))
    slant, wide = 3.0 * theta - 1.0, 1.0 - theta
    c2 = m.axis * (1.0 + 1.5 * eta2 + e_eta * (4.0 + eta2))
    c2 += 0.375 * _J2 * tsi / psi * slant * (8.0 + 3.0 * eta2 * (8.0 + eta2))
    c1 = m.drag * outer * m.motion * c2
    by_j2 = -3.0 * slant * (1.0 - 2.0 * e_eta + eta2 * (1.5 - 0.5 * e_eta))
    by_j2 += 0.75 * wide * (2.0 * eta2 - e_eta * (1.0 + eta2)) * math.cos(2.0 * m.perigee)
    c4 = eta * (2.0 + 0.5 * eta2) + e * (0.5 + 2.0 * eta2) - _J2 * tsi / (m.axis * psi) * by_j2
    c4 *= 2.0 * m.motion * outer * m.axis * across
    c5 = 2.0 * outer * m.axis * across * (1.0 + 2.75 * (eta2 + e_eta) + e_eta * eta2)
    perigee, anomaly = 0.0, 0.0
    if e > 1.0e-4:
        c3 = -2.0 * coefficient * tsi * _J3_OVER_J2 * m.motion * m.s / e
        perigee = m.drag * c3 * math.cos(m.perigee)
        anomaly = -2.0 / 3.0 * coefficient * m.drag / e_eta
    is_far = m.axis * (1.0 - e) >= 220.0 / RADIUS_KM + 1.0
    return Drag(c1, c4, c5, eta, perigee, anomaly, tsi, s4, is_far)


@kernel
def zonal_rates(m, c1):
    """Rates of the angles by the Earth's zonal harmonics."""
    theta = m.c * m.c
    theta2 = theta * theta
    across = 1.0 - m.eccentricity * m.eccentricity
    p = m.axis * across
    k = 1.0 / (p * p)
    k1 = 1.5 * _J2 * k * m.motion
    k2 = 0.5 * k1 * _J2 * k
    k3 = -0.46875 * _J4 * k * k * m.motion
    root = math.sqrt(across)
    anomaly = m.motion + 0.5 * k1 * root * (3.0 * theta - 1.0)
    anomaly += 0.0625 * k2 * root * (13.0 - 78.0 * theta + 137.0 * theta2)
    perigee = -0.5 * k1 * (1.0 - 5.0 * theta)
    perigee += 0.0625 * k2 * (7.0 - 114.0 * theta + 395.0 * theta2)
    perigee += k3 * (3.0 - 36.0 * theta + 49.0 * theta2)
    node = -k1 * m.c
    further = 0.5 * k2 * (4.0 - 19.0 * theta) + 2.0 * k3 * (3.0 - 7.0 * theta)
    return Rates(anomaly, perigee, node + further * m.c, 3.5 * across * node * c1)


class Now(NamedTuple):
    """Mean elements at a time: axis, eccentricity, angles [rad]."""

    axis: float
    eccentricity: float
    node: float
    perigee: float
    anomaly: float


@kernel
def _by_drag(m, d, mean, t):
    """Factor of the axis's root, loss of eccentricity, gain of longitude, of the anomaly [rad]."""
    axis, longitude = 1.0 - d.c1 * t, 1.5 * d.c1 * t * t
    loss, anomaly = m.drag * d.c4 * t, 0.0
    if d.far:
        now, then = 1.0 + d.eta * math.cos(mean), 1.0 + d.eta * math.cos(m.anomaly)
        anomaly = d.perigee * t + d.anomaly * (now * now * now - then * then * then)
        c1, t3 = d.c1 * d.c1, t * t * t
        d2 = 4.0 * m.axis * d.tsi * c1
        k = d2 * d.tsi * d.c1 / 3.0
        d3 = (17.0 * m.axis + d.s4) * k
        d4 = 0.5 * k * m.axis * d.tsi * (221.0 * m.axis + 31.0 * d.s4) * d.c1
        axis -= d2 * t * t + d3 * t3 + d4 * t3 * t
        loss += m.drag * d.c5 * (math.sin(mean + anomaly) - math.sin(m.anomaly))
        l4 = 0.25 * (3.0 * d3 + d.c1 * (12.0 * d2 + 10.0 * c1))
        l5 = 3.0 * d4 + 12.0 * d.c1 * d3 + 6.0 * d2 * d2 + 15.0 * c1 * (2.0 * d2 + c1)
        longitude += (d2 + 2.0 * c1) * t3 + t3 * t * (l4 + 0.2 * t * l5)
    return axis, loss, longitude, anomaly


@kernel
def mean_now(m, t):
    """Mean elements at t minutes after the epoch."""
    d = drag_coefficients(m)
    rates = zonal_rates(m, d.c1)
    mean, perigee = m.anomaly + rates.anomaly * t, m.perigee + rates.perigee * t
    node = m.node + rates.node * t + rates.node_by_drag * t * t
    root, loss, longitude, moved = _by_drag(m, d, mean, t)
    anomaly = mean + moved + m.motion * longitude
    left = max(root, 0.0)  # below 0 it has come down, and the square would grow again
    return Now(m.axis * left * left, m.eccentricity - loss, node, perigee - moved, anomaly)


@kernel
def _eccentric_longitude(u, across, along):
    """Root E of E - along sin E + across cos E = u, with steps of 0.95 at most."""
    found = u
    for _ in range(10):
        s, c = math.sin(found), math.cos(found)
        step = (u - across * c + along * s - found) / (1.0 - c * along - s * across)
        step = min(max(step, -0.95), 0.95)
        found += step
        if not math.fabs(step) >= 1.0e-12:
            break
    return found


@kernel
def _with_periods(m, now):
    """Position [RADIUS_KM] and velocity [RADIUS_KM a minute] of mean elements."""
    e, theta = max(now.eccentricity, 1.0e-6), m.c * m.c
    motion = _RATE / (now.axis * math.sqrt(now.axis))
    k = 1.0 / (now.axis * (1.0 - e * e))
    along = e * math.cos(now.perigee)
    across = e * math.sin(now.perigee) - 0.5 * k * _J3_OVER_J2 * m.s
    near_pole = max(1.0 + m.c, 1.5e-12)
    longitude = now.anomaly + now.perigee
    longitude -= 0.25 * k * _J3_OVER_J2 * m.s * (3.0 + 5.0 * m.c) / near_pole * along
    anomaly = _eccentric_longitude(np.fmod(longitude, _TURN), across, along)
    s, c = math.sin(anomaly), math.cos(anomaly)
    square = along * along + across * across
    p, beta = now.axis * (1.0 - square), math.sqrt(1.0 - square)
    r = now.axis * (1.0 - along * c - across * s)
    turning = (along * s - across * c) / (1.0 + beta)
    su = now.axis / r * (s - across - along * turning)
    cu = now.axis / r * (c - along + across * turning)
    s2, c2 = 2.0 * su * cu, 1.0 - 2.0 * su * su
    j, wide, slant = 0.5 * _J2 / p, 1.0 - theta, 3.0 * theta - 1.0
    j2 = j / p
    u = math.atan2(su, cu) - 0.25 * j2 * (7.0 * theta - 1.0) * s2
    node = now.node + 1.5 * j2 * m.c * s2
    tilt = m.inclination + 1.5 * j2 * m.c * m.s * c2
    up, ahead = _axes(u, node, tilt)
    radial = math.sqrt(now.axis) * (along * s - across * c) / r * _RATE - motion * j * wide * s2
    swift = math.sqrt(p) / r * _RATE + motion * j * (wide * c2 + 1.5 * slant)
    r = r * (1.0 - 1.5 * j2 * beta * slant) + 0.5 * j * wide * c2
    return scale(r, up), add_scaled(scale(radial, up), swift, ahead)


@kernel
def _axes(u, node, tilt):
    """Unit vectors along the radius and across it, in the plane of a node and an inclination."""
    su, cu, sn, cn = math.sin(u), math.cos(u), math.sin(node), math.cos(node)
    x, y, z = -sn * math.cos(tilt), cn * math.cos(tilt), math.sin(tilt)
    up = (x * su + cn * cu, y * su + sn * cu, z * su)
    return up, (x * cu - cn * su, y * cu - sn * su, z * cu)


@kernel
def sgp4_state(elements, t):
    """Position [m] and velocity [m/s] in TEME at t seconds after the epoch of elements.

    `elements`: see `mean_of`. NaN for elements that are not those of an orbit near the Earth (a
    period from 225 min on is SDP4's), and once the satellite has come down.
    """
    nowhere = ((math.nan, math.nan, math.nan), (math.nan, math.nan, math.nan))
    if not (elements.mean_motion_rev_day > 0.0 and 0.0 <= elements.eccentricity < 1.0):
        return nowhere
    m = mean_elements(elements)
    if not _TURN / m.motion < DEEP_SPACE_MIN:
        return nowhere
    now = mean_now(m, t / 60.0)
    if not (now.axis > 0.0 and -0.001 <= now.eccentricity < 1.0):
        return nowhere
    r, v = _with_periods(m, now)
    if r[0] * r[0] + r[1] * r[1] + r[2] * r[2] < 1.0:
        return nowhere
    return scale(1e3 * RADIUS_KM, r), scale(1e3 * RADIUS_KM / 60.0, v)
