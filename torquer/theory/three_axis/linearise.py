"""Slopes of the motion and of a law about a reference attitude, from their own kernels.

State x = (theta, w): the small turn [rad] from the wanted attitude to the body, and the rate
relative to the reference over the orbital rate n, both in body axes. Central differences at three
steps, twice extrapolated: thirteen digits for a smooth law.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.inputs import ideal_inputs
from torquer.computer.interface import NO_UNITS_ISOLATED, NONE_ISOLATED, Ephemeris, Estimate
from torquer.computer.laws.pointing import reference_acceleration, reference_motion
from torquer.environment.field.model import row_vector
from torquer.environment.local import LocalEnvironment
from torquer.environment.table import DEGREE
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, rotate_inverse
from torquer.maths.geometry.vec3 import add, add_scaled, cross, put_vector, scale, sub
from torquer.spacecraft.body import motion_rates

_ZERO = (0.0, 0.0, 0.0)
#: Steps of the differences: 2, 1 and 1/2 of it; in radians, and in orbital rates.
_STEP = 0.02


class Reference(NamedTuple):
    """Reference of the law: 1 for the orbital frame; wanted attitude to it; orbital rate n."""

    orbital: float
    q_wanted: tuple
    rate_rad_s: float


class Instants(NamedTuple):
    """Times [s] `[n]`, and along the orbit, inertial, `[n, 3]`: position, velocity, field, its rate
    of change (where the law is to be called), gravity-gradient vector."""

    t_s: np.ndarray
    r_m: np.ndarray
    v_m_s: np.ndarray
    b_t: np.ndarray
    b_rate_t_s: np.ndarray
    gravity: np.ndarray


class Place(NamedTuple):
    """The ephemeris as `control.pointing` reads it."""

    ephemeris: Ephemeris


@inlined
def _place(at, i):
    unknown = (math.nan, math.nan, math.nan)
    b, b_rate = row_vector(at.b_t, i), row_vector(at.b_rate_t_s, i)
    r, v = row_vector(at.r_m, i), row_vector(at.v_m_s, i)
    return Place(Ephemeris(r, v, b, b_rate, unknown, math.nan))


@inlined
def _displace(reference, place, x):
    """Attitude, absolute rate [rad/s] and the reference's rate, in body axes, at a state x."""
    q_reference, turning = reference_motion(place, reference.orbital)
    wanted = multiply(q_reference, reference.q_wanted)
    q = multiply(wanted, from_rotation_vector((x[0], x[1], x[2])))
    carried = rotate_inverse(q, turning)
    return q, add_scaled(carried, reference.rate_rad_s, (x[3], x[4], x[5])), carried


@inlined
def _exact_inputs(at, i, place, q, omega):
    """What a computer with perfect sensors knows; nothing of the Sun."""
    t_s, b = at.t_s[i], rotate_inverse(q, place.ephemeris.b_inertial_t)
    b_rate = rotate_inverse(q, place.ephemeris.b_rate_inertial_t_s)
    b_rate = sub(b_rate, cross(omega, b))
    estimate = Estimate(t_s, q, omega, _ZERO, 0.0, 0.0, NONE_ISOLATED, NO_UNITS_ISOLATED)
    sun = place.ephemeris.sun_inertial
    return ideal_inputs(b, b_rate, omega, sun, q, t_s, estimate, place.ephemeris)


@kernel
def _answer(law, parameters, memory, by_wheels, reference, at, i, x):
    """What the law asks for at a state: a dipole [A m^2], or a torque [N m] of wheels at rest."""
    place = _place(at, i)
    q, omega, _ = _displace(reference, place, x)
    command = law(_exact_inputs(at, i, place, q, omega), parameters, memory)
    return command.torque_n_m if by_wheels else command.dipole_a_m2


@kernel
def _acceleration(rigid, reference, at, i, x):
    """Relative angular acceleration without control, over n^2, at a state."""
    place, n = _place(at, i), reference.rate_rad_s
    q, omega, carried = _displace(reference, place, x)
    local = LocalEnvironment(place.ephemeris.b_inertial_t, row_vector(at.gravity, i), ())
    absolute = motion_rates(rigid, local, _ZERO, Motion(q, omega), ()).omega
    of_reference = rotate_inverse(q, reference_acceleration(place, reference.orbital))
    turned = cross(scale(n, (x[3], x[4], x[5])), carried)
    return scale(1.0 / (n * n), add(sub(absolute, of_reference), turned))


@inlined
def _along(axis, h):
    return (
        h if axis == 0 else 0.0,
        h if axis == 1 else 0.0,
        h if axis == 2 else 0.0,
        h if axis == 3 else 0.0,
        h if axis == 4 else 0.0,
        h if axis == 5 else 0.0,
    )


@inlined
def _extrapolate(coarse, middle, fine):
    """Slope from those at steps 2h, h, h/2, without their errors of h^2 and h^4; last change."""
    once = scale(1.0 / 3.0, sub(scale(4.0, middle), coarse))
    again = scale(1.0 / 3.0, sub(scale(4.0, fine), middle))
    change = scale(1.0 / 15.0, sub(again, once))
    size = max(abs(change[0]), abs(change[1]), abs(change[2]))
    return add(again, change), size


@kernel
def law_slopes(law, parameters, memory, by_wheels, reference, at, slopes, rest):
    """Fill G `[n, 3, 6]` [A m^2] and the dipole at the wanted attitude `[n, 3]`; last change.

    `by_wheels`: its torque [N m] in place of its dipole.
    """
    worst = 0.0
    for i in range(at.t_s.size):
        own = _answer(law, parameters, memory, by_wheels, reference, at, i, _along(6, 0.0))
        put_vector(rest[i], own)
        for axis in range(6):
            coarse = middle = fine = _ZERO
            for level in range(3):
                h = _STEP * 2.0 ** (1 - level)
                there, back = _along(axis, h), _along(axis, -h)
                up = _answer(law, parameters, memory, by_wheels, reference, at, i, there)
                down = _answer(law, parameters, memory, by_wheels, reference, at, i, back)
                coarse, middle, fine = middle, fine, scale(0.5 / h, sub(up, down))
            slope, change = _extrapolate(coarse, middle, fine)
            worst = max(worst, change)
            for row in range(3):
                slopes[i, row, axis] = slope[row]
    return worst


@kernel
def free_slopes(rigid, reference, at, slopes, rest):
    """Fill A `[n, 3, 6]` and f `[n, 3]` of the motion without control."""
    for i in range(at.t_s.size):
        put_vector(rest[i], _acceleration(rigid, reference, at, i, _along(6, 0.0)))
        for axis in range(6):
            coarse = middle = fine = _ZERO
            for level in range(3):
                h = _STEP * 2.0 ** (1 - level)
                up = _acceleration(rigid, reference, at, i, _along(axis, h))
                down = _acceleration(rigid, reference, at, i, _along(axis, -h))
                coarse, middle, fine = middle, fine, scale(0.5 / h, sub(up, down))
            slope, _ = _extrapolate(coarse, middle, fine)
            for row in range(3):
                slopes[i, row, axis] = slope[row]


@kernel
def wanted_motion(reference, at, attitudes, rates):
    """Attitudes `[n, 4]`, body to inertial, and rates `[n, 3]` [rad/s, body] of a body that is held
    exactly."""
    for i in range(at.t_s.size):
        q, omega, _ = _displace(reference, _place(at, i), _along(6, 0.0))
        attitudes[i, 0], attitudes[i, 1], attitudes[i, 2], attitudes[i, 3] = q
        put_vector(rates[i], omega)


@kernel
def read_table(table, t_s, out):
    """All channels of a table at times [s] `[n]`, into the rows of `out`."""
    c = table.coefficients
    for i in range(t_s.size):
        s = (t_s[i] - table.start_s) * table.per_second
        segment = min(max(int(s), 0), c.shape[0] - 1)
        x = 2.0 * (s - segment) - 1.0
        for channel in range(c.shape[2]):
            out[i, channel] = c[segment, DEGREE, channel]
        for down in range(1, DEGREE + 1):
            for channel in range(c.shape[2]):
                out[i, channel] = out[i, channel] * x + c[segment, DEGREE - down, channel]
