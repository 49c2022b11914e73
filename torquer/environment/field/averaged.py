"""Averaged field (Donohue): constant strength, uniform rotation on a cone. Frames: Z, Y, S, X.

The forms on a circular orbit take the strength `b0_t` [T], the argument of latitude u, the
inclination and the cone's half-angle Theta [rad]. The cone touches the Earth's axis at u = 0
and turns by chi = 2u: FIELD (1.6) with chi0 = 0.
"""

import math
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.environment.field.model import row_vector, rows
from torquer.environment.field.tilted_dipole import M3_IN_KM3
from torquer.maths.geometry.vec3 import add, cross, dot, norm, scale, unit

RULES = ("arithmetic", "integral", "given")


@kernel
def cone_angle(inclination):
    """Half-angle Theta [rad] of the field's cone, 0..pi with the inclination 0..pi.

    The published quotient is 0/0 on a polar orbit; with w^2 = 1 + 3 sin^2 i it is the same as
    tan Theta = tan i (2 + w) / (1 + w), which is not. Source: MAG (1.2.1).
    """
    s = math.sin(inclination)
    w = math.sqrt(1.0 + 3.0 * s * s)
    return math.atan2(s * (2.0 + w), math.cos(inclination) * (1.0 + w))


@kernel
def mean_of_extremes(equatorial_t, inclination):
    """Strength B0 [T]: half the sum of the direct dipole's extremes. Source: FIELD (1.10)."""
    s = math.sin(inclination)
    return 0.5 * equatorial_t * (1.0 + math.sqrt(1.0 + 3.0 * s * s))


@kernel
def mean_over_orbit(equatorial_t, inclination):
    """Strength B0 [T]: the direct dipole's mean over half a revolution. Source: FIELD (1.11).

    The mean, (2/pi) E(-3 sin^2 i), is an ellipse's perimeter over 2 pi: here by the
    arithmetic-geometric mean, whose five steps from axes 1 : 2 reach rounding error.
    """
    s = math.sin(inclination)
    excess = 3.0 * s * s
    a, b, weight = math.sqrt(1.0 + excess), 1.0, 1.0
    total = 1.0 + 0.5 * excess
    for _ in range(5):
        half = 0.5 * (a - b)
        a, b = 0.5 * (a + b), math.sqrt(a * b)
        total -= weight * half * half
        weight *= 2.0
    return equatorial_t * total / a


@kernel
def b_z(b0_t, u, cone):
    """Flux density [T] in Z, whose third axis is the cone's. Source: FIELD (1.9)."""
    s = math.sin(cone)
    return scale(b0_t, (-s * math.sin(2.0 * u), s * math.cos(2.0 * u), math.cos(cone)))


@kernel
def b_y(b0_t, u, cone):
    """Flux density [T] in Y (FIELD, after (1.9))."""
    s, su = math.sin(cone), math.sin(u)
    swinging = -math.sin(2.0 * cone) * su * su
    return scale(b0_t, (-s * math.sin(2.0 * u), swinging, 1.0 - 2.0 * s * s * su * su))


@kernel
def b_s(b0_t, u, inclination, cone):
    """Flux density [T] in S (FIELD, after (1.9))."""
    s, su, ahead = math.sin(cone), math.sin(u), cone - inclination
    swing = 2.0 * s * su * su
    second = math.sin(inclination) - swing * math.cos(ahead)
    third = math.cos(inclination) - swing * math.sin(ahead)
    return scale(b0_t, (-s * math.sin(2.0 * u), second, third))


@kernel
def b_orbital(b0_t, u, inclination, cone):
    """Flux density [T] in X (along the motion, normal, up).

    Source: FIELD (1.8), whose axes are in the order up, along the motion, normal.
    """
    s, si, su, cu = math.sin(cone), math.sin(inclination), math.sin(u), math.cos(u)
    ahead = cone - inclination
    swing = 2.0 * s * su * su
    motion = cu * (si + swing * (1.0 - math.cos(ahead)))
    normal = math.cos(inclination) - swing * math.sin(ahead)
    up = su * (si - 2.0 * s * cu * cu - swing * math.cos(ahead))
    return scale(b0_t, (motion, normal, up))


@kernel
def cos_to_direct_dipole(u, inclination):
    """Cosine of the angle between averaged and direct-dipole vectors if Theta = i.

    Exact on equatorial and polar orbits; in between Theta exceeds i by up to 10 deg, and the
    vectors themselves have to be compared. Source: FIELD (1.12).
    """
    up = math.sin(inclination) * math.sin(u)
    return (1.0 + up * up) / math.sqrt(1.0 + 3.0 * up * up)


class Cone(NamedTuple):
    """Averaged field as the kernels take it: mu_e [T m^3], index of the rule for B0, given B0."""

    mu_t_m3: float
    rule: int
    b0_t: float


@kernel
def mean_strength(field, radius_m, inclination):
    """B0 [T] by the rule of the field, for an orbit of this radius and inclination."""
    if field.rule == 2:
        return field.b0_t
    equatorial_t = field.mu_t_m3 / (radius_m * radius_m * radius_m)
    if field.rule == 1:
        return mean_over_orbit(equatorial_t, inclination)
    return mean_of_extremes(equatorial_t, inclination)


@kernel
def ascending_node(h):
    """Unit vector to the ascending node of an orbit with normal h; axis 1 if it is equatorial."""
    if abs(h[0]) + abs(h[1]) <= 1e-100 * abs(h[2]):  # the squares of less would be zero
        return (1.0, 0.0, 0.0)
    return unit((-h[1], h[0], 0.0))


@kernel
def argument_of_latitude(r, h):
    """Angle [rad] from the ascending node of an orbit with normal h to the radius vector; from
    axis 1 if it is equatorial."""
    node = ascending_node(h)
    return math.atan2(dot(r, cross(h, node)), dot(r, node) * norm(h))


@kernel
def b_inertial(field, r, v):
    """Flux density [T] in the inertial frame, on the osculating plane of r [m] and v."""
    h = cross(r, v)
    node, u = ascending_node(h), argument_of_latitude(r, h)
    inclination = math.atan2(math.sqrt(h[0] * h[0] + h[1] * h[1]), h[2])
    b = b_y(mean_strength(field, norm(r), inclination), u, cone_angle(inclination))
    across = scale(b[1], (-node[1], node[0], 0.0))
    return add(add(scale(b[0], node), across), (0.0, 0.0, b[2]))


@kernel
def b_inertial_many(field, r, v, out):
    """`b_inertial` at the rows of `r` and `v`, into `out`."""
    for i in range(r.shape[0]):
        b = b_inertial(field, row_vector(r, i), row_vector(v, i))
        out[i, 0], out[i, 1], out[i, 2] = b


class Averaged(Spec):
    """Averaged field.

    It is defined along an orbit only, without an Earth-fixed form; it does not depend on the date.
    """

    kind: Literal["averaged"] = "averaged"
    mu_e_t_km3: float = Field(7.812e6, gt=0.0)
    """Strength mu_e of the dipole."""
    b0: Literal["arithmetic", "integral"] | float = "arithmetic"
    """Field strength B0: 'arithmetic' (mean of the extremes over the orbit), 'integral' (mean over
    the orbit) or a number in tesla.
    """

    @field_validator("b0", mode="before")
    @classmethod
    def _rule_or_strength(cls, value):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if value in RULES[:2] or (number and 0.0 < value < math.inf):
            return value
        raise ValueError(
            f"b0: must be 'arithmetic', 'integral' or a positive number (T); received {value!r}"
        )

    def prepare(self, decimal_year: float) -> Cone:
        """The field as the kernels take it."""
        mu_t_m3 = self.mu_e_t_km3 * M3_IN_KM3
        if isinstance(self.b0, str):
            return Cone(mu_t_m3, RULES.index(self.b0), 0.0)
        return Cone(mu_t_m3, RULES.index("given"), self.b0)

    def b_inertial(self, packed, r_inertial, v_inertial, dcm_inertial_to_ecef) -> np.ndarray:
        """Flux density [T] in the inertial frame, its third axis taken as the Earth's."""
        r_inertial = rows("r_inertial", r_inertial, 3)
        out = np.empty_like(r_inertial)
        v_inertial = rows("v_inertial", v_inertial, 3, count=len(out))
        b_inertial_many(packed, r_inertial, v_inertial, out)
        return out
