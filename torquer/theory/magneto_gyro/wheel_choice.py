"""Which wheel? Degrees of both stages over the stiffness h that a wheel gives the satellite."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from torquer.theory.magneto_gyro.capture import DAMPING, Stage1Design, design_stage_1
from torquer.theory.magneto_gyro.comparison import stage_2_degrees
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Weights, design_stage_2, stage_2_gains
from torquer.theory.periodic.floquet import degree_of_stability, multipliers, transitions

#: Stiffness of the wheels that are tried for a better one, and loops of each of the two searches.
TRIED, _EVALUATIONS = (2.5, 3.0, 3.5, 4.0, 5.0, 6.5), 40
#: That of weaker ones, where the wheel is stronger than all of these.
WEAKER = (40.0, 20.0, 10.0, TRIED[-1])
#: Part of the wanted degree with which a wheel is good enough.
_ENOUGH = 0.95


class OverStiffness(NamedTuple):
    """Degrees per 1/nu0 over h `[n]`: exact of stage 1, exact and by the frozen model of stage 2;
    not a number where there are no gains."""

    stiffness: np.ndarray
    first: np.ndarray
    second: np.ndarray
    frozen: np.ndarray


def over_stiffness(
    craft: GyroCraft,
    first: Stage1Design,
    weights: Stage2Weights,
    stiffness,
    normal: float = 0.0,
    form: str = "field",
) -> OverStiffness:
    """Degrees with other wheels. Stage 1 keeps its gains; those of stage 2 are made for each wheel,
    with the same weights."""
    h = np.asarray(stiffness, dtype=np.float64)
    crafts = [craft.with_wheel(craft.wheel_at(x)) for x in h]
    second = stage_2_degrees(
        crafts, lambda known: stage_2_gains(known, weights), normal=normal, form=form
    )
    return OverStiffness(h, _stage_1_wheel(craft, first, h, normal), second.exact, second.frozen)


def _stage_1_wheel(
    craft: GyroCraft, first: Stage1Design, h: np.ndarray, normal: float
) -> np.ndarray:
    system = STAGE_1.with_parameters(
        **craft.satellite()._asdict(), damping=DAMPING, normal=normal,
        angle_gain=first.angle_gain, rate_gain=first.rate_gain,
        frequency=first.filter_rate_rad_s / craft.orbital_rate_rad_s,
    )  # fmt: skip
    wheels = h + 2.0 - craft.pitch_inertia
    found = transitions(system, {"wheel": wheels}, tolerance=1e-6)
    return np.asarray(degree_of_stability(multipliers(found.matrices), 2.0 * math.pi))


class BetterWheel(NamedTuple):
    """A wheel [N m s], its stiffness h, degrees of both stages that a short search finds."""

    wheel_n_m_s: float
    stiffness: float
    first: float
    second: float

    @property
    def least(self) -> float:
        """The lesser of both degrees."""
        return min(self.first, self.second)


def better_wheel(
    craft: GyroCraft,
    filter_rate_rad_s: float,
    wanted_degree: float,
    normals: Sequence[float] = (0.0,),
    form: str = "field",
) -> BetterWheel | None:
    """The weakest of some stronger wheels with which both stages reach the wanted degree, else the
    best of them; of a wheel that is stronger than all of these the strongest of some weaker ones.

    None if there is none with which both are stable.
    """
    found = []
    stronger = [h for h in TRIED if h > craft.stiffness]
    for h in stronger or [h for h in WEAKER if h < craft.stiffness]:
        other = craft.with_wheel(craft.wheel_at(h))
        first = design_stage_1(other, filter_rate_rad_s, tuple(normals)).degree
        if not first > 0.0:
            continue
        try:
            made = design_stage_2(
                other, normals=normals, form=form, wanted_degree=wanted_degree,
                evaluations=_EVALUATIONS,
            )  # fmt: skip
        except ArithmeticError:
            continue
        found.append(BetterWheel(other.wheel_n_m_s, h, first, made.degree))
        if found[-1].least >= _ENOUGH * wanted_degree:
            break
    return max(found, key=lambda wheel: wheel.least, default=None)
