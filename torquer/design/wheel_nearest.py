"""The nearest wheel arrays that meet a demand which the given one does not: exact, not flown."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from torquer.spacecraft.wheel_array.layout import WheelArray

#: The limit of the wheels that each demand needs.
LIMITS = {
    "rate": "momentum_limit_n_m_s",
    "momentum": "momentum_limit_n_m_s",
    "acceleration": "torque_limit_n_m",
}
#: A demand met exactly is met, rounding apart.
_ROUNDING = 1.0 + 1e-9


class Change(NamedTuple):
    """A key of the wheels, its value now and the one that meets all demands that need it."""

    key: str
    now: object
    value: object


def greater_limits(wheels, shares: Mapping[str, float]) -> list[Change]:
    """For each limit that is too small the least that is not: the envelope grows with it.

    `shares`: of the envelope by demand; none where a demand is out of reach at any scale.
    """
    found = []
    for key in dict.fromkeys(LIMITS.values()):
        share = max((s for name, s in shares.items() if LIMITS[name] == key), default=0.0)
        if 1.0 < share < math.inf:
            now = getattr(wheels, key)
            value = (np.array(now) * share).tolist()
            found.append(Change(key, now, value))
    return found


def layouts_that_meet(
    array: WheelArray, others: Sequence[tuple[str, str, np.ndarray]], shares_of
) -> list[tuple[str, str]]:
    """Names and angles of layouts of the same wheels that meet all demands.

    `others`: name, angles in words, axes; `shares_of`: shares by demand of an array.
    """
    found = []
    for name, angles, axes in others:
        if name == "given":
            continue
        given = array.model_dump() | {"axes": axes.tolist()}
        turned = WheelArray.model_validate(given)
        if all(share <= _ROUNDING for share in shares_of(turned).values()):
            found.append((name, angles))
    return found
