"""Averaged motion under preliminary reorientation 2, target along the cone axis Z3."""

import math

from torquer.compile.engine import kernel
from torquer.theory.slow.evolution.model import Evolution, Slow
from torquer.theory.slow.evolution.nutation_damping import spin_integral
from torquer.theory.slow.evolution.spin_up import small_parameter


@kernel
def preliminary_2_rates(slow, case):
    """Derivatives by u, for the law with L/|L|. Source: MAG (3.5.2)."""
    p = case.moments[0]
    sr, cr = math.sin(slow.rho), math.cos(slow.rho)
    s, c = math.sin(slow.theta), math.cos(slow.theta)
    pull = p * cr - 0.5 * (2.0 * p + (1.0 - 3.0 * p) * sr * sr)
    turn = -p * (1.0 - 0.5 * s * s) * sr + 0.5 * (3.0 * p - 1.0) * sr * cr * s * s
    return Slow(
        case.eps * s * s * pull, case.eps * turn / slow.l, 0.0, case.eps * s * c * pull / slow.l
    )


def _reach(length, case):
    """`reach` of a torque proportional to the difference of two unit vectors."""
    return 2.0 / length


PRELIMINARY_2 = Evolution(
    "preliminary_2",
    preliminary_2_rates,
    small_parameter,
    {"spin": spin_integral},
    cone_target=True,
    reach=_reach,
)
