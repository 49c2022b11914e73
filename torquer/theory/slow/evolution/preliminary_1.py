"""Averaged motion under preliminary reorientation 1, target along the cone axis Z3."""

import math

import numpy as np

from torquer.compile.engine import kernel
from torquer.theory.slow.evolution.model import Evolution, Slow
from torquer.theory.slow.evolution.nutation_damping import spin_integral
from torquer.theory.slow.evolution.spin_up import small_parameter


@kernel
def preliminary_1_rates(slow, case):
    """Derivatives by u. Source: MAG (3.4.3)."""
    pull = case.eps * case.moments[0]
    s, c, cr = math.sin(slow.theta), math.cos(slow.theta), math.cos(slow.rho)
    return Slow(
        pull * cr * s * s,
        -pull * (1.0 - 0.5 * s * s) * math.sin(slow.rho) / slow.l,
        0.0,
        pull * s * c * cr / slow.l,
    )


def path_integral(slow, case):
    """1/4 ln(1 + tan^2 theta) - ln tan theta - ln sin rho (MAG 3.4, no number)."""
    log_secant = -np.log(np.abs(np.cos(slow.theta)))
    log_tan = np.log(np.abs(np.tan(slow.theta)))
    return 0.5 * log_secant - log_tan - np.log(np.abs(np.sin(slow.rho)))


PRELIMINARY_1 = Evolution(
    "preliminary_1",
    preliminary_1_rates,
    small_parameter,
    {"spin": spin_integral, "path": path_integral},
    cone_target=True,
)
