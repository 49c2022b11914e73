"""How far a sampled hold is from instability: gain, delay, inertia."""

import itertools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from torquer.theory.three_axis.sampled import (
    Cycle,
    SampledFamily,
    SampledHold,
    delayed_degree,
    sampled_family,
)
from torquer.theory.three_axis.search import first_crossing

#: Factors of the dipole that are tried, up and down.
_FACTORS = np.geomspace(1.0, 100.0, 121)
#: Cycles that a command waits, for any delay.
_LATE = 16
#: Delays that are tried [rad of u], and the greatest.
_DELAYS = np.geomspace(0.1, 2.0 * math.pi, 16)
_MOST_INERTIA = 0.5
_ALONE = np.empty((1, 0))


class Margins(NamedTuple):
    """Margins of a stable loop.

    `least_gain`, `greatest_gain`: factors of the dipole between which it is stable (0 and infinity
    where none was found from 0.01 to 100). `delay_s`: greatest constant delay from reading to
    dipole, the mean of the hold included (infinity if more than a revolution). `inertia`: greatest
    relative error of all principal moments at once, whatever their signs, up to 0.5.
    """

    least_gain: float
    greatest_gain: float
    delay_s: float
    inertia: float


def is_stable(sampled: SampledHold) -> bool:
    """Whether all small motions decay."""
    return bool(sampled_family(sampled).degrees(_ALONE)[0] > 0.0)


def margins_of(sampled: SampledHold) -> Margins:
    """Margins of a loop; all NaN if it is not stable."""
    if not is_stable(sampled):
        return Margins(math.nan, math.nan, math.nan, math.nan)
    return Margins(*gain_margins(sampled), delay_margin_s(sampled), inertia_margin(sampled))


def scaled_family(sampled: SampledHold) -> SampledFamily:
    """The loop with the dipole times a factor, its only parameter."""
    gains = sampled.gains()[0]
    return SampledFamily(sampled, {"factor": (0.0, math.inf)}, np.stack([0.0 * gains, gains]))


def gain_margins(sampled: SampledHold) -> tuple[float, float]:
    """Least and greatest factor of the dipole around 1 with which the loop is stable."""
    scaled = scaled_family(sampled)

    def degrees(factors):
        return scaled.degrees(factors[:, None])

    up = first_crossing(degrees, _FACTORS)
    down = first_crossing(degrees, 1.0 / _FACTORS)
    return (0.0 if math.isnan(down) else down), (math.inf if math.isnan(up) else up)


def delay_margin_s(sampled: SampledHold) -> float:
    """Greatest delay [s] of the continuous loop, to some hundredths.

    A delay is sixteen holds and the half of one that holding adds; the window of a cycle without
    dipole counts by its part.
    """
    hold = sampled.hold
    duty = sampled.cycle.hold_s / sum(sampled.cycle)

    def is_stable_at(delay: float) -> bool:
        length_s = delay / hold.rate_rad_s / (_LATE + 0.5 * duty)
        cycle = Cycle(duty * length_s, (1.0 - duty) * length_s)
        return delayed_degree(replace(sampled, cycle=cycle), _LATE) > 0.0

    low = 0.0
    for high in _DELAYS:
        if not is_stable_at(high):
            return _edge(is_stable_at, low, float(high), 0.02 * high) / hold.rate_rad_s
        low = float(high)
    return math.inf


def _edge(holds, low: float, high: float, tolerance: float) -> float:
    """Where between low and high what holds at low ceases to hold, by bisection; the lower end."""
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def inertia_margin(sampled: SampledHold) -> float:
    """Greatest relative error of the principal moments, all at once, that keeps the loop stable.

    Corners that no body can have (triangle inequality) do not count. To a hundredth.
    """
    if _stable_within(sampled, _MOST_INERTIA):
        return _MOST_INERTIA
    return _edge(lambda error: _stable_within(sampled, error), 0.0, _MOST_INERTIA, 0.01)


def _stable_within(sampled: SampledHold, error: float) -> bool:
    moments, axes = sampled.hold.body.principal()
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        trial = moments * (1.0 + error * np.array(signs))
        if 2.0 * trial.max() > trial.sum():
            continue
        hold = sampled.hold.with_inertia(axes @ np.diag(trial) @ axes.T)
        if not is_stable(replace(sampled, hold=hold)):
            return False
    return True
