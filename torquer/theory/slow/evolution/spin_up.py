"""Averaged motion under spin-up, m = -k e3 x B, in the averaged field (Z)."""

import math

import numpy as np

from torquer.compile.engine import kernel
from torquer.theory.slow.evolution.bdot import length_integral
from torquer.theory.slow.evolution.model import Evolution, Slow
from torquer.theory.validity import LENGTH, within


def small_parameter(gain, spinner):
    """eps = k B0^2/(omega0 L0)."""
    return gain * spinner.strength_t**2 / (spinner.orbital_rate_rad_s * spinner.momentum_n_m_s)


@kernel
def spin_up_rates(slow, case):
    """Derivatives by u. Source: MAG (3.2.2)."""
    p = case.moments[0]
    sr, cr = math.sin(slow.rho), math.cos(slow.rho)
    s, c = math.sin(slow.theta), math.cos(slow.theta)
    across = 2.0 * p + (1.0 - 3.0 * p) * sr * sr
    return Slow(
        case.eps * across * c,
        case.eps * (1.0 - 3.0 * p) * sr * cr * c / slow.l,
        0.0,
        -0.5 * case.eps * (2.0 - across) * s / slow.l,
    )


def nutation_integral(slow, case):
    """(1 - 3p) ln sin theta + (1 - p) ln tan rho + (3p - 1)/4 ln(1 + tan^2 rho); not in MAG."""
    p = case.moments[0]
    log_tan = np.log(np.abs(np.tan(slow.rho)))
    log_secant = -np.log(np.abs(np.cos(slow.rho)))
    log_sin = np.log(np.abs(np.sin(slow.theta)))
    return (1.0 - 3.0 * p) * (log_sin - 0.5 * log_secant) + (1.0 - p) * log_tan


def special_case(u, case, across=False):
    """l from 1 of a pure spin (theta = 0) along the cone axis, or across it (MAG 3.2, 1 and 2)."""
    p = case.moments[0]
    length = 1.0 + case.eps * (1.0 - p if across else 2.0 * p) * np.asarray(u)
    within(LENGTH, length)
    return length


SPIN_UP = Evolution(
    "spin_up",
    spin_up_rates,
    small_parameter,
    {"length": length_integral, "nutation": nutation_integral},
)
