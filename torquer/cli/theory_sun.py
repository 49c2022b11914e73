"""S-dot in `torquer theory`: limit motions relative to the Sun, final momentum, capture time."""

import math

from torquer.cli.theory_options import AveragedCase
from torquer.theory.equilibria import Equilibrium
from torquer.theory.evolution.model import Slow
from torquer.theory.evolution.sdot import capture_phase, final_momentum, sun_angle

#: Angle to the end of the motion [deg] at which a momentum counts as captured.
_CAPTURED_DEG = 5.0


def described(case: AveragedCase, point: Equilibrium) -> str:
    """An equilibrium in words: relative to the Sun for S-dot, else relative to the cone axis."""
    if case.law != "sdot" or point.rho is None:
        return point.description.replace("third axis", "cone axis")
    there = Slow(1.0, point.rho, point.sigma or 0.0, 0.0)
    side = "towards" if sun_angle(there, case.constants) < 0.5 * math.pi else "away from"
    return f"momentum {side} the Sun, {point.description.partition(', ')[2].rpartition(', ')[2]}"


def sun_data(case: AveragedCase) -> dict | None:
    """Where S-dot brings a momentum of known direction, and when; None for other cases."""
    if case.law != "sdot" or case.rho is None:
        return None
    start, constants = Slow(1.0, case.rho, case.sigma, case.theta), case.constants
    phase = capture_phase(start, constants, math.radians(_CAPTURED_DEG))
    slowest = constants.eps * min(1.0, constants.ratio)
    return {
        "gamma_deg": math.degrees(float(sun_angle(start, constants))),
        "final_momentum": float(final_momentum(start, constants)),
        "captured_deg": _CAPTURED_DEG,
        "revolutions_at_most": phase / (2.0 * math.pi * slowest),
    }


def sun_lines(data: dict | None) -> list[str]:
    """The same in words."""
    if data is None:
        return []
    end = data["final_momentum"]
    side = "towards" if end > 0.0 else "away from"
    turns = f"after at most {data['revolutions_at_most']:.3g} revolutions"
    return [
        f"from {data['gamma_deg']:.1f} deg off the Sun the momentum turns {side} it, within "
        f"{data['captured_deg']:g} deg {turns}; final momentum {abs(end):.4g} L0"
    ]
