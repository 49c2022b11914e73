"""Averaged motion under nutation damping, m = k ((omega x B).e3) e3, in the averaged field (Z)."""

import math

import numpy as np

from torquer.compile.engine import kernel
from torquer.theory.slow.evolution.model import Evolution, Slow, rate_reach
from torquer.theory.validity import THETA, within


def small_parameter(gain, spinner):
    """eps = k B0^2/(omega0 A)."""
    return gain * spinner.strength_t**2 / (spinner.orbital_rate_rad_s * spinner.transverse_kg_m2)


@kernel
def nutation_damping_rates(slow, case):
    """Derivatives by u. Source: MAG (3.1.3)."""
    p = case.moments[0]
    sr, cr = math.sin(slow.rho), math.cos(slow.rho)
    s, c = math.sin(slow.theta), math.cos(slow.theta)
    across = 2.0 * p + (1.0 - 3.0 * p) * sr * sr
    half = 0.5 * case.eps
    return Slow(
        -half * slow.l * across * s * s,
        half * (3.0 * p - 1.0) * sr * cr * s * s,
        0.0,
        -half * across * s * c,
    )


def spin_integral(slow, case):
    """l cos theta: the spin about the axis, which a coil along it cannot change (MAG 3.1)."""
    return slow.l * np.cos(slow.theta)


def path_integral(slow, case):
    """2p ln tan rho - (3p - 1) (1/2 ln(1 + tan^2 rho) + ln cos theta) (MAG 3.1, no number)."""
    p = case.moments[0]
    log_tan = np.log(np.abs(np.tan(slow.rho)))
    log_secant = -np.log(np.abs(np.cos(slow.rho)))
    log_cos = np.log(np.abs(np.cos(slow.theta)))
    return 2.0 * p * log_tan - (3.0 * p - 1.0) * (log_secant + log_cos)


def special_case(u, case, theta0, across=False):
    """(l, theta) from l = 1 with the momentum on the cone axis, or across it. Source: MAG (3.1.4).

    tan theta falls with exp(-eps p u) on the axis (rho = 0), exp(-eps (1 - p) u / 2) across it.
    """
    p = case.moments[0]
    rate = 0.5 * (1.0 - p) if across else p
    within(THETA, theta0)
    left = np.exp(-case.eps * rate * np.asarray(u)) * np.sin(theta0)
    return np.hypot(np.cos(theta0), left), np.arctan2(left, np.cos(theta0))


NUTATION_DAMPING = Evolution(
    "nutation_damping",
    nutation_damping_rates,
    small_parameter,
    {"spin": spin_integral, "path": path_integral},
    reach=rate_reach,
)
