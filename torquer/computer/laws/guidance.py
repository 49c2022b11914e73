"""References that a satellite's axes follow, and slews between them within limits.

A *track* is a vector and its first and second derivative in time, all inertial: of a direction to
be followed, and by the same rules of the axes made of two such. So attitude, rate and angular
acceleration of a reference are derivatives of each other to rounding, whatever its directions.

A slew ends at rest relative to the reference, however this moves:

    q = q_reference exp(s e) exp(d u)

s falls from the angle between the two attitudes to 0 about the fixed axis e, from rest to rest; d
takes out the rate relative to the reference with which the slew begins. Both have accelerations
that begin and end at 0, so that the torque of wheels does not jump.
"""

import math
from typing import NamedTuple

from torquer.base.conventions import EARTH_FLATTENING, MU_EARTH_M3_S2
from torquer.compile.engine import inlined
from torquer.environment.earth.rotation_table import ERA_RATE_RAD_S
from torquer.maths.geometry.quaternion import (
    from_dcm,
    from_rotation_vector,
    multiply,
    rotate,
    rotate_inverse,
)
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    cross,
    dot,
    mat_t_vec,
    norm,
    scale,
    sub,
    unit,
)

_ZERO = (0.0, 0.0, 0.0)
#: Square of the sine of the angle between two directions below which they give no attitude.
_PARALLEL = 1e-12
#: Greatest acceleration of a turn from rest to a rate v in a time T, in v/T.
RAMP = 1.5
#: Greatest acceleration of `come_to_rest` from a rate v in a time T, in v/T.
BRAKE = 3.9404
#: Part of the acceleration for the rate at the beginning, where there is one.
BRAKING_SHARE = 0.25


class Steered(NamedTuple):
    """Attitude (body to inertial frame), its rate and angular acceleration (inertial; rad/s)."""

    q: tuple
    omega: tuple
    alpha: tuple


class Slew(NamedTuple):
    """A turn to a reference: `turn` s e at the start [rad], in the reference's axes; `rate` at the
    start [rad/s], relative to the reference, in the axes of the attitude there."""

    turn: tuple
    rate: tuple


@inlined
def unit_track(a):
    """The track of the unit vector along that of a vector."""
    size = norm(a[0])
    u = scale(1.0 / size, a[0])
    growth = dot(u, a[1])
    first = scale(1.0 / size, add_scaled(a[1], -growth, u))
    bend = (dot(a[1], a[1]) + dot(a[0], a[2]) - growth * growth) / size
    second = add_scaled(add_scaled(a[2], -2.0 * growth, first), -bend, u)
    return u, first, scale(1.0 / size, second)


@inlined
def cross_track(a, b):
    """The track of the vector product of two tracks."""
    first = add(cross(a[1], b[0]), cross(a[0], b[1]))
    second = add(cross(a[2], b[0]), cross(a[0], b[2]))
    return cross(a[0], b[0]), first, add_scaled(second, 2.0, cross(a[1], b[1]))


@inlined
def _across(a):
    """A fixed direction well off that of a track."""
    u = a[0]
    least = abs(u[0]) <= abs(u[1]) and abs(u[0]) <= abs(u[2])
    x = 1.0 if least else 0.0
    y = 1.0 if not least and abs(u[1]) <= abs(u[2]) else 0.0
    return (x, y, 1.0 - x - y), _ZERO, _ZERO


@inlined
def steered_by(first, second, q_axes):
    """The attitude that turns one axis of the body along a track and a second one as near as can
    be to another; `q_axes`: the axes made of these two in the body, to the body.

    Two directions along one line leave the turn about it open: it is then that of a fixed one.
    """
    a, b = unit_track(first), unit_track(second)
    normal = cross_track(a, b)
    if dot(normal[0], normal[0]) < _PARALLEL:
        normal = cross_track(a, _across(a))
    z = unit_track(normal)
    y = cross_track(z, a)
    omega = add(add(cross(a[0], a[1]), cross(y[0], y[1])), cross(z[0], z[1]))
    alpha = add(add(cross(a[0], a[2]), cross(y[0], y[2])), cross(z[0], z[2]))
    columns = (
        (a[0][0], y[0][0], z[0][0]),
        (a[0][1], y[0][1], z[0][1]),
        (a[0][2], y[0][2], z[0][2]),
    )
    return Steered(multiply(from_dcm(columns), q_axes), scale(0.5, omega), scale(0.5, alpha))


@inlined
def nadir_track(r, v):
    """To the Earth's centre, on a two-body orbit; r [m] and v [m/s] inertial."""
    return scale(-1.0, r), scale(-1.0, v), scale(MU_EARTH_M3_S2 / (dot(r, r) * norm(r)), r)


@inlined
def velocity_track(r, v):
    """Along the velocity, on a two-body orbit."""
    square = dot(r, r)
    pull = -MU_EARTH_M3_S2 / (square * math.sqrt(square))
    return v, scale(pull, r), scale(pull, add_scaled(v, -3.0 * dot(r, v) / square, r))


@inlined
def ground_track(to_ecef, t_s, place):
    """A place on the Earth [m, Earth-fixed]; `to_ecef`: inertial to Earth-fixed axes at t = 0.

    The pole is that of t = 0: it moves by 4 m a day on the ground.
    """
    c, s = math.cos(ERA_RATE_RAD_S * t_s), math.sin(ERA_RATE_RAD_S * t_s)
    x, y = c * place[0] - s * place[1], s * place[0] + c * place[1]
    first = (-ERA_RATE_RAD_S * y, ERA_RATE_RAD_S * x, 0.0)
    square = -ERA_RATE_RAD_S * ERA_RATE_RAD_S
    second = (square * x, square * y, 0.0)
    at = mat_t_vec(to_ecef, (x, y, place[2]))
    return at, mat_t_vec(to_ecef, first), mat_t_vec(to_ecef, second)


@inlined
def sine_of_elevation(to_ecef, target, r):
    """Of a satellite at r above the horizon of a place on the Earth, both inertial [m].

    The vertical is that of the ellipsoid at the place's parallel.
    """
    pole = to_ecef[2]
    flat = (1.0 - EARTH_FLATTENING) * (1.0 - EARTH_FLATTENING)
    up = unit(add_scaled(target, (1.0 / flat - 1.0) * dot(target, pole), pole))
    return dot(up, unit(sub(r, target)))


@inlined
def turn_to_rest(angle, rate, acceleration, t):
    """(Angle left, its rate, its acceleration) t seconds into a turn from rest to rest.

    Within the limits: the rate rises as 3x^2 - 2x^3 to its greatest, which is kept where the
    angle is large, and falls so again.
    """
    if angle <= 0.0:
        return 0.0, 0.0, 0.0
    peak = min(rate, math.sqrt(angle * acceleration / RAMP))
    ramp = RAMP * peak / acceleration
    length = ramp + angle / peak
    if t >= length:
        return 0.0, 0.0, 0.0
    begins = t < 0.5 * length
    at = t if begins else length - t
    x = min(at / ramp, 1.0)
    turned = peak * (ramp * x * x * x * (1.0 - 0.5 * x) + max(at - ramp, 0.0))
    speed = peak * x * x * (3.0 - 2.0 * x)
    up = 6.0 * peak / ramp * x * (1.0 - x)
    return (angle - turned, -speed, -up) if begins else (turned, -speed, up)


@inlined
def come_to_rest(rate, acceleration, t):
    """(Angle, its rate, its acceleration) t seconds into a motion that ends where it began.

    It begins with a rate and without acceleration: d = v T x (1 - x)^3 (1 + 3x), x = t/T.
    """
    length = BRAKE * rate / acceleration
    if t >= length:
        return 0.0, 0.0, 0.0
    x = t / length
    y = 1.0 - x
    speed = rate * y * y * (1.0 + x * (2.0 - 15.0 * x))
    return (
        rate * length * x * y * y * y * (1.0 + 3.0 * x),
        speed,
        rate / length * x * y * (60.0 * x - 36.0),
    )


@inlined
def slewing(reference, slew, rate_limit, acceleration_limit, t):
    """(What is steered, angle left [rad]) t seconds into a slew to a reference."""
    angle, speed = norm(slew.turn), norm(slew.rate)
    moves = 1.0 if speed > 0.0 else 0.0
    greatest = max(rate_limit - speed, 0.5 * rate_limit)
    share = BRAKING_SHARE * moves
    s, s_rate, s_up = turn_to_rest(angle, greatest, (1.0 - share) * acceleration_limit, t)
    d, d_rate, d_up = come_to_rest(speed, BRAKING_SHARE * acceleration_limit, t)
    e = scale(1.0 / angle, slew.turn) if angle > 0.0 else _ZERO
    u = scale(1.0 / speed, slew.rate) if speed > 0.0 else _ZERO
    q_turn, q_rest = from_rotation_vector(scale(s, e)), from_rotation_vector(scale(d, u))
    q = multiply(multiply(reference.q, q_turn), q_rest)
    about = rotate_inverse(q_rest, e)
    braking = scale(d_rate, u)
    omega = add_scaled(braking, s_rate, about)
    alpha = add_scaled(add_scaled(scale(d_up, u), s_up, about), -s_rate, cross(braking, about))
    omega, alpha = rotate(q, omega), rotate(q, alpha)
    alpha = add(add(reference.alpha, alpha), cross(reference.omega, omega))
    return Steered(q, add(reference.omega, omega), alpha), s


@inlined
def ahead(steered, interval_s):
    """What is steered an interval [s] later, with a steady angular acceleration."""
    half = scale(0.5 * interval_s, steered.alpha)
    turn = from_rotation_vector(scale(interval_s, add(steered.omega, half)))
    omega = add_scaled(steered.omega, interval_s, steered.alpha)
    return Steered(multiply(turn, steered.q), omega, steered.alpha)
