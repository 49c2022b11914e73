"""Averaged second moments <b_i b_j> of the dimensionless field (B over its strength).

An averaged motion under a law quadratic in the field depends on the field through them alone.
Given as (xx, yy, zz, xy, xz, yz) in the frame in which each model is simplest.
"""

import math

from torquer.compile.engine import kernel
from torquer.environment.field.averaged import cone_angle
from torquer.maths.geometry.vec3 import dot, sym_vec
from torquer.theory.slow.orbit_field import (
    AVERAGED,
    DIRECT_DIPOLE,
    TILTED_DIPOLE,
    OrbitField,
)
from torquer.theory.validity import INCLINATION, Limit, within


@kernel
def averaged_moments(inclination):
    """Averaged field, in Z: (p, p, q, 0, 0, 0), p = sin^2(Theta)/2, q = cos^2(Theta)."""
    cone = cone_angle(inclination)
    p = 0.5 * math.sin(cone) ** 2
    return (p, p, 1.0 - 2.0 * p, 0.0, 0.0, 0.0)


@kernel
def direct_dipole_moments(inclination):
    """Direct dipole, in S, in units of (mu_e/r^3)^2; <b2 b3> is negative on prograde orbits."""
    s, c = math.sin(inclination), math.cos(inclination)
    return (1.125 * s * s, 1.375 * s * s, c * c, 0.0, 0.0, -0.5 * s * c)


@kernel
def tilted_dipole_moments(inclination, tilt):
    """Tilted dipole, in Y, in units of (mu_e/r^3)^2, averaged over the Earth's day as well.

    Over the day the dipole's direction k has <k k^T> = (c^2 - s^2/2) z z^T + (s^2/2) 1, c and s
    cosine and sine of the tilt. The field is F k, F = 3 r r^T - 1; z gives the moments D of the
    direct dipole, and <F F> = 1 + 3 <r r^T> = (5 - 3 n n^T)/2, n the orbit normal. So
    <b b^T> = (c^2 - s^2/2) D + (s^2/4) (5 - 3 n n^T).
    """
    c2, s2 = math.cos(tilt) ** 2, math.sin(tilt) ** 2
    si, ci = math.sin(inclination), math.cos(inclination)
    along, across = c2 - 0.5 * s2, 0.25 * s2
    # D in Y: that of S turned by the inclination about the node
    moments = direct_dipole_moments(inclination)
    second, third = (0.0, ci, -si), (0.0, si, ci)
    d_second, d_third = sym_vec(moments, second), sym_vec(moments, third)
    return (
        along * moments[0] + 5.0 * across,
        along * dot(second, d_second) + across * (5.0 - 3.0 * si * si),
        along * dot(third, d_third) + across * (5.0 - 3.0 * ci * ci),
        0.0,
        0.0,
        along * dot(second, d_third) + 3.0 * across * si * ci,
    )


def _check(field: OrbitField) -> None:
    within(Limit("model", AVERAGED, TILTED_DIPOLE), field.model)
    within(Limit("strength_t", 0.0, open=True), field.strength_t)


def closed_moments(field: OrbitField, inclination: float) -> tuple:
    """Second moments of a field model in closed form, in its own frame."""
    _check(field)
    within(INCLINATION, inclination)
    if field.model == AVERAGED:
        return averaged_moments(inclination)
    if field.model == DIRECT_DIPOLE:
        return direct_dipole_moments(inclination)
    return tilted_dipole_moments(inclination, field.tilt)
