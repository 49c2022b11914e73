"""Averaged motion under B-dot, m = k (omega x B). Frames: Z, S or Y, by the field."""

import math

import numpy as np

from torquer.engine import inlined, kernel
from torquer.geometry.vec3 import dot, sym_vec
from torquer.theory.evolution.model import Evolution, Slow


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

    Constant in the averaged field; under spin-up as well, which runs the same path in (l, rho)
    the other way.
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


def sphere(u, case, rho0):
    """(l, rho) of a sphere (A = C) in the averaged field from l = 1. Source: MAG (2.1.11)."""
    p, turn = case.moments[0], case.eps * (3.0 * case.moments[0] - 1.0) * np.asarray(u)
    tan2 = np.tan(rho0) ** 2
    grown = (1.0 + np.exp(2.0 * turn) * tan2) / (1.0 + tan2)
    rho = np.arctan2(np.exp(turn) * np.sin(rho0), np.cos(rho0))
    return np.exp(-2.0 * p * case.eps * np.asarray(u)) * np.sqrt(grown), rho


def even_field(u, case, theta0):
    """(l, theta) from l = 1 where 3p = 1 (i = 45.577 deg). Source: MAG (2.1.12), MAG (2.1.13)."""
    turn = 2.0 / 3.0 * case.eps * (1.0 - case.ratio) * np.asarray(u)
    theta = np.arctan2(np.exp(turn) * np.sin(theta0), np.cos(theta0))
    tan2 = np.tan(theta0) ** 2
    grown = (1.0 + np.exp(2.0 * turn) * tan2) / (1.0 + tan2)
    return np.exp(-2.0 / 3.0 * case.eps * np.asarray(u)) * np.sqrt(grown), theta


BDOT = Evolution(
    "bdot",
    bdot_averaged_field,
    small_parameter,
    {"length": length_integral, "nutation": nutation_integral},
)
BDOT_ANY_FIELD = Evolution("bdot_any_field", bdot_any_field, small_parameter, any_field=True)
