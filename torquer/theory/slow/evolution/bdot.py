"""Averaged motion under B-dot, m = k (omega x B). Frames: Z, S or Y, by the field."""

import math

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import dot, sym_vec
from torquer.theory.slow.evolution.model import Evolution, Slow, rate_reach
from torquer.theory.validity import RHO, THETA, Limit, within


def small_parameter(gain, spinner):
    """eps = k B0^2/(omega0 C). Source: MAG (2.1.5), as the unit of torque."""
    return gain * spinner.strength_t**2 / (spinner.orbital_rate_rad_s * spinner.axial_kg_m2)


@inlined
def moments_along_l(moments, rho, sigma):
    """(<b1 b3>, <b2 b3>, <b3 b3>) in L, whose third axis is the angular momentum's."""
    cr, sr, cs, ss = math.cos(rho), math.sin(rho), math.cos(sigma), math.sin(sigma)
    third = sym_vec(moments, (sr * cs, sr * ss, cr))
    first = (cr * cs, cr * ss, -sr)
    return dot(first, third), cs * third[1] - ss * third[0], dot((sr * cs, sr * ss, cr), third)


@kernel
def bdot_any_field(slow, case):
    """Derivatives by u for any field moments: all three field models. Source: MAG (2.1.8)."""
    m = case.moments
    b13, b23, b33 = moments_along_l(m, slow.rho, slow.sigma)
    trace = m[0] + m[1] + m[2]
    c, s = math.cos(slow.theta), math.sin(slow.theta)
    g = c * c + case.ratio * s * s
    return Slow(
        -case.eps * slow.l * (trace - b33) * g,
        case.eps * b13 * g,
        case.eps * b23 * g / math.sin(slow.rho),
        0.5 * case.eps * (1.0 - case.ratio) * (trace + b33) * s * c,
    )


@kernel
def bdot_averaged_field(slow, case):
    """Derivatives by u in the averaged field. Source: MAG (2.1.9), FIELD (2.5)."""
    p = case.moments[0]
    sr, cr = math.sin(slow.rho), math.cos(slow.rho)
    c, s = math.cos(slow.theta), math.sin(slow.theta)
    g = c * c + case.ratio * s * s
    across = 2.0 * p + (1.0 - 3.0 * p) * sr * sr
    return Slow(
        -case.eps * slow.l * across * g,
        case.eps * (3.0 * p - 1.0) * sr * cr * g,
        0.0,
        0.5 * case.eps * (1.0 - case.ratio) * (2.0 - across) * s * c,
    )


def _log_tan(angle):
    return np.log(np.abs(np.tan(angle)))


def length_integral(slow, case):
    """(3p - 1) ln l - (3p - 1)/2 ln(1 + tan^2 rho) + 2p ln tan rho. Source: MAG (2.1.14).

    Constant in the averaged field; under spin-up as well, which follows the same path in (l, rho)
    backwards.
    """
    p = case.moments[0]
    log_secant = -np.log(np.abs(np.cos(slow.rho)))
    return (3.0 * p - 1.0) * (np.log(slow.l) - log_secant) + 2.0 * p * _log_tan(slow.rho)


def nutation_integral(slow, case):
    """Second integral in the averaged field, of rho and theta. Source: MAG (2.1.16).

    lam [(3p - 1)/2 ln(1 + tan^2 rho) + 2 (1 - p) ln tan rho] - (3p - 1)(ln sin theta
    - C/A ln cos theta), lam = (1 - C/A)/2.
    """
    p, lam = case.moments[0], 0.5 * (1.0 - case.ratio)
    log_secant = -np.log(np.abs(np.cos(slow.rho)))
    path = (3.0 * p - 1.0) * log_secant + 2.0 * (1.0 - p) * _log_tan(slow.rho)
    sine, cosine = np.log(np.abs(np.sin(slow.theta))), np.log(np.abs(np.cos(slow.theta)))
    return lam * path - (3.0 * p - 1.0) * (sine - case.ratio * cosine)


#: The closed solutions below are of one C/A, and of one inclination.
_SPHERE = Limit("ratio", 1.0 - 1e-9, 1.0 + 1e-9, "the solution is that of a sphere")
_EVEN = Limit("3p", 1.0 - 1e-9, 1.0 + 1e-9, "the solution is that of an inclination of 45.577 deg")


def _turn(turn, angle):
    """Angle whose tangent has grown by exp(turn), however large."""
    across, along = np.exp(np.minimum(turn, 0.0)), np.exp(-np.maximum(turn, 0.0))
    return np.arctan2(across * np.sin(angle), along * np.cos(angle))


def sphere(u, case, rho0):
    """(l, rho) of a sphere (A = C) in the averaged field from l = 1. Source: MAG (2.1.11)."""
    within(_SPHERE, case.ratio)
    within(RHO, rho0)
    p, s = case.moments[0], case.eps * np.asarray(u)
    along, across = np.exp(-2.0 * p * s) * np.cos(rho0), np.exp((p - 1.0) * s) * np.sin(rho0)
    return np.hypot(along, across), _turn((3.0 * p - 1.0) * s, rho0)


def even_field(u, case, theta0):
    """(l, theta) from l = 1 where 3p = 1 (i = 45.577 deg). Source: MAG (2.1.12), MAG (2.1.13)."""
    within(_EVEN, 3.0 * case.moments[0])
    within(THETA, theta0)
    s = 2.0 / 3.0 * case.eps * np.asarray(u)
    along, across = np.exp(-s) * np.cos(theta0), np.exp(-case.ratio * s) * np.sin(theta0)
    return np.hypot(along, across), _turn((1.0 - case.ratio) * s, theta0)


BDOT = Evolution(
    "bdot",
    bdot_averaged_field,
    small_parameter,
    {"length": length_integral, "nutation": nutation_integral},
    reach=rate_reach,
)
BDOT_ANY_FIELD = Evolution(
    "bdot_any_field", bdot_any_field, small_parameter, any_field=True, reach=rate_reach
)
