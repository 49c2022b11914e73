"""Whether a limit lies within the motion that remains: then the time to stay below it is chance.

A residual dipole, noise or the field's own turning keep up a motion that does not decay. A limit
within it is crossed again and again, and the last crossing says when the run ended, not how fast
the law works.
"""

from typing import NamedTuple

import numpy as np

#: The greatest value of a revolution over that of the one before, from which on it has not decayed.
_STEADY = 0.7
#: A limit up to this much above the greatest value of the last two revolutions lies within them.
_NEAR = 1.2
#: How often at least a limit is crossed again in a motion that does not decay.
_LEAST = 2


class Residual(NamedTuple):
    """Least and greatest value of a signal in the last two revolutions of its run."""

    low: float
    high: float


def find_residual(t_s, signal, below: float, revolution_s: float) -> Residual | None:
    """The residual motion of a signal (n,) in which a limit lies; None if it does not.

    The limit must have been crossed again twice or more after the signal was first below it, the
    signal must not decay over the last two revolutions, and these must come after that first time.
    """
    under = signal < below
    if not under.any() or np.count_nonzero(under[:-1] & ~under[1:]) < _LEAST:
        return None
    first_s, end_s = t_s[np.argmax(under)], t_s[-1]
    if end_s - first_s < 2.0 * revolution_s:
        return None
    last, before = (
        signal[(t_s >= end_s - (k + 1) * revolution_s) & (t_s <= end_s - k * revolution_s)]
        for k in (0, 1)
    )
    both = np.concatenate([before, last])
    if np.isnan(both).any() or last.max() < _STEADY * before.max():
        return None
    residual = Residual(float(both.min()), float(both.max()))
    return residual if residual.low <= below <= _NEAR * residual.high else None
