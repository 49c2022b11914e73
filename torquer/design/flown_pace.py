"""How well a formula's time agrees with the flights of a design."""

import math

import numpy as np

from torquer.campaign.statistics import quantile
from torquer.theory.averaged.conditions import FLOWN
from torquer.theory.validity import Doubt, Limit, judge

#: Half of the releases, over the mean by a formula.
PACE = Limit(
    "time of half of the releases, over the formula's", 0.5, 2.0,
    why="the formula is the mean of a simpler motion: go by the flights",
    of="time by theory, beside the flights of a design",
    shown="the flights themselves, beside which it is printed",
)  # fmt: skip


#: A formula's time is that of all releases.
NEVER = Limit("releases flown that do not arrive", most=0.0, why="theory promises all of them")


def is_confirmed(settled_s: np.ndarray, theory_s: float) -> bool:
    """Whether all releases arrive, half of them in the time [s] of the formula within a quarter.

    Then it holds, although a condition may not be met.
    """
    all_do = bool(np.isfinite(settled_s).all())
    return all_do and theory_s > 0.0 and FLOWN.holds(quantile(settled_s, 0.5) / theory_s)


def doubts_by_flights(
    settled_s: np.ndarray, theory_s: float, goal: str, pace: Limit = PACE
) -> tuple[Doubt, ...]:
    """A doubt where releases do not arrive, or half of them in another time [s] than by theory.

    `settled_s`: their times [s], infinite where one does not; `goal`: what they are to do; `pace`:
    bounds of the time flown over the formula's.
    """
    if never := int(np.count_nonzero(np.isinf(settled_s))):
        words = f"{never} of {len(settled_s)} releases do not {goal}"
        return (Doubt(NEVER, float(never), words),)
    half_s = quantile(settled_s, 0.5)
    return judge((pace, half_s / theory_s if theory_s > 0.0 else math.inf)).doubts
