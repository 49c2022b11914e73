"""How well a formula's time agrees with the flights of a design."""

import math

from torquer.theory.averaged.conditions import FLOWN
from torquer.theory.validity import Doubt, Limit, judge

#: Half of the releases, over the mean by a formula.
PACE = Limit(
    "time of half of the releases, over the formula's", 0.5, 2.0,
    why="the formula is the mean of a simpler motion: go by the flights",
    of="time by theory, beside the flights of a design",
    shown="the flights themselves, beside which it is printed",
)  # fmt: skip


def is_confirmed(half_s: float, theory_s: float) -> bool:
    """Whether half of the releases take the time [s] of the formula, within a quarter.

    Then it holds, although a condition may not be met.
    """
    return FLOWN.holds(half_s / theory_s) if theory_s > 0.0 else False


def doubts_by_flights(half_s: float, theory_s: float) -> tuple[Doubt, ...]:
    """A doubt where half of the releases take another time [s] than the formula says.

    None where the flights have no such time: that they do not arrive is said by another doubt.
    """
    if not math.isfinite(half_s):
        return ()
    return judge((PACE, half_s / theory_s if theory_s > 0.0 else math.inf)).doubts
