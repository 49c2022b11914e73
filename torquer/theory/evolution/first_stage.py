"""Averaged motion in the first stage of a scheme: a preliminary reorientation and nutation damping.

Averages add up: the joint motion is the sum of both. The damping is `DAMPING` times as strong
as the reorientation, whose small parameter is that of the case.
"""

from torquer.engine import kernel
from torquer.theory.evolution.model import Evolution, Slow
from torquer.theory.evolution.nutation_damping import nutation_damping_rates
from torquer.theory.evolution.preliminary_1 import preliminary_1_rates
from torquer.theory.evolution.preliminary_2 import preliminary_2_rates
from torquer.theory.evolution.spin_up import small_parameter

DAMPING = 3.0


@kernel
def _joined(one, other):
    """Sum of two averaged motions, the second, damping, `DAMPING` times as strong."""
    return Slow(
        one.l + DAMPING * other.l,
        one.rho + DAMPING * other.rho,
        one.sigma + DAMPING * other.sigma,
        one.theta + DAMPING * other.theta,
    )


@kernel
def damping_alone(slow, case):
    """Nutation damping of the joint stages, without a reorientation."""
    return _joined(Slow(0.0, 0.0, 0.0, 0.0), nutation_damping_rates(slow, case))


@kernel
def with_preliminary_1(slow, case):
    """First preliminary reorientation with nutation damping."""
    return _joined(preliminary_1_rates(slow, case), nutation_damping_rates(slow, case))


@kernel
def with_preliminary_2(slow, case):
    """Second preliminary reorientation with nutation damping."""
    return _joined(preliminary_2_rates(slow, case), nutation_damping_rates(slow, case))


FIRST_STAGES = {
    "preliminary 1 + damping": Evolution("with_preliminary_1", with_preliminary_1, small_parameter),
    "preliminary 2 + damping": Evolution("with_preliminary_2", with_preliminary_2, small_parameter),
    "damping alone": Evolution("damping_alone", damping_alone, small_parameter),
}
