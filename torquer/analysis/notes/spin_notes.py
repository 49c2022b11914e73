"""Laws about a spin axis whose spin is not stable: nutation about the intermediate axis grows."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.computer.laws.spin_axis import AboutAxis
from torquer.maths.geometry.attitudes import axes_about
from torquer.scenario.spec import Scenario
from torquer.theory.slow.axis_stability import STABLE_AXIS, nutation_growth


def spin_notes(scenario: Scenario) -> list[str]:
    """Notes on the axes that laws spin about, one line each."""
    return [*notes_on_laws(scenario, _CHECKS)]


def _axis_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    if not isinstance(use.law, AboutAxis) or not use.at_start:
        return
    rows = axes_about(np.array(use.law.axis))
    inertia = rows @ np.array(scenario.spacecraft.body.inertia) @ rows.T
    orbital_rate = scenario.orbit.rate_rad_s(scenario.start)
    growth = nutation_growth(inertia, rows @ scenario.motion_at_start()[4:], orbital_rate)
    if growth > STABLE_AXIS.most and growth * orbital_rate * scenario.length_s > math.log(2.0):
        moments = ", ".join(f"{inertia[k, k]:g}" for k in range(3))
        yield (
            f"{use.name} spins about the axis of the intermediate moment ({moments} kg m^2, "
            f"spin axis last): nutation about it grows by itself, e-fold in "
            f"{1.0 / (growth * orbital_rate):.3g} s"
        )


_CHECKS = {"the axis of the spin": _axis_notes}
