"""The field along a circular orbit in the frame in which the averaged motion is written.

Averaged field in Z, direct dipole in S, tilted dipole in Y, in which each is simplest. The
argument of latitude u is one fast angle; the Earth's day angle, the longitude of the tilted
dipole's direction in Y, is another.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined, kernel
from torquer.environment.field.averaged import b_z
from torquer.environment.field.direct_dipole import b_s
from torquer.environment.field.tilted_dipole import b_dipole
from torquer.maths.geometry.vec3 import add_scaled, dot, scale

AVERAGED, DIRECT_DIPOLE, TILTED_DIPOLE = 0, 1, 2


class OrbitField(NamedTuple):
    """Constants: model, strength [T] (B0, or mu_e/r^3 of a dipole), angles [rad].

    `angle`: Theta of the averaged field, inclination of the dipoles; `tilt`: angle of the tilted
    dipole's direction to the Earth's axis.
    """

    model: int
    strength_t: float
    angle: float
    tilt: float


@inlined
def _orbit_y(u, inclination):
    """Unit radius vector in Y, and its derivative by u."""
    cu, su, ci, si = math.cos(u), math.sin(u), math.cos(inclination), math.sin(inclination)
    return (cu, su * ci, su * si), (-su, cu * ci, cu * si)


@inlined
def _direction(tilt, day):
    """Direction of the tilted dipole in Y, and its derivative by the day angle."""
    s, cd, sd = math.sin(tilt), math.cos(day), math.sin(day)
    return (s * cd, s * sd, math.cos(tilt)), (-s * sd, s * cd, 0.0)


@kernel
def field_at(field, u, day):
    """Flux density [T] at argument of latitude u and day angle [rad]."""
    if field.model == AVERAGED:
        return b_z(field.strength_t, u, field.angle)
    if field.model == DIRECT_DIPOLE:
        return b_s(field.strength_t, u, field.angle)
    r, _ = _orbit_y(u, field.angle)
    k, _ = _direction(field.tilt, day)
    return b_dipole(scale(field.strength_t, k), r)


@inlined
def _dipole_rate(k, k_rate, r, r_rate):
    """Derivative of 3 (k.r) r - k, r of length one."""
    stretch = scale(3.0 * (dot(k, r_rate) + dot(k_rate, r)), r)
    return add_scaled(add_scaled(stretch, 3.0 * dot(k, r), r_rate), -1.0, k_rate)


@kernel
def field_rate(field, u, day, days_per_orbit):
    """Derivative of the flux density by u [T]; the day angle changes by `days_per_orbit` per u."""
    if field.model == AVERAGED:
        across = -2.0 * field.strength_t * math.sin(field.angle)
        return (across * math.cos(2.0 * u), across * math.sin(2.0 * u), 0.0)
    if field.model == DIRECT_DIPOLE:
        k = (0.0, -math.sin(field.angle), -math.cos(field.angle))
        r, r_rate = (math.cos(u), math.sin(u), 0.0), (-math.sin(u), math.cos(u), 0.0)
        return scale(field.strength_t, _dipole_rate(k, (0.0, 0.0, 0.0), r, r_rate))
    k, k_by_day = _direction(field.tilt, day)
    r, r_rate = _orbit_y(u, field.angle)
    rate = _dipole_rate(k, scale(days_per_orbit, k_by_day), r, r_rate)
    return scale(field.strength_t, rate)
