"""How far a sampled hold is from instability: gain, delay, inertia."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from torquer.computer.blocks.law import Law
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.sampled import (
    Cycle,
    SampledFamily,
    SampledHold,
    delayed_degree,
    sampled_family,
)
from torquer.theory.three_axis.search import Best, first_crossing, greatest

#: Factors of the dipole that are tried, up and down.
_FACTORS = np.geomspace(1.0, 100.0, 121)
#: Cycles that a command waits, for any delay: twice as many change it by less than the tolerance.
_LATE = 8
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


def find_margins(sampled: SampledHold) -> Margins:
    """Margins of a loop; all NaN if it is not stable."""
    if not is_stable(sampled):
        return Margins(math.nan, math.nan, math.nan, math.nan)
    return Margins(*gain_margins(sampled), delay_margin_s(sampled), inertia_margin(sampled))


def mixed_family(sampled: SampledHold, laws: Sequence[Law]) -> SampledFamily:
    """The loop with a sum of dipoles: its parameters are the factors of the laws.

    The laws hold the attitude of the hold; the factors are called by their places, '0', '1', ...
    """
    tables = [sampled.with_law(law).gains()[0] for law in laws]
    corners = {str(k): (0.0, math.inf) for k in range(len(laws))}
    return SampledFamily(sampled, corners, np.stack([0.0 * tables[0], *tables]))


def degrees_with_margin(family: SampledFamily, values, gain_margin: float) -> np.ndarray:
    """Degrees of stability `[points]`; minus infinity for a stable loop that the dipole times the
    margin, or its square root, makes unstable. The law's dipole is proportional to the `values`."""
    values = np.asarray(values, dtype=np.float64)
    found = family.degrees(values)
    for factor in (gain_margin**0.5, gain_margin):
        stable = np.flatnonzero(found > 0.0)
        lost = ~(family.degrees(factor * values[stable]) > 0.0)
        found[stable[lost]] = -np.inf
    return found


def best_factors(
    family: SampledFamily, low, high, gain_margin: float = 2.0, count: int = 31, spacing=2e-3
) -> Best:
    """Greatest degree of stability over the parameters of a family, with a gain margin.

    `low`, `high`: the box, all above 0, searched in logarithms by grids (`search.greatest`);
    `point` is that of the parameters, `spacing` relative. ArithmeticError if there is none.
    """
    box = np.log(np.asarray(low, dtype=float)), np.log(np.asarray(high, dtype=float))

    def degrees(points):
        return degrees_with_margin(family, np.exp(points), gain_margin)

    found = greatest(degrees, *box, count, spacing)
    if not found.value > 0.0:
        raise ArithmeticError(
            f"search: gains must make the loop stable with a gain margin of {gain_margin:g}; none "
            "of the box do"
        )
    return found._replace(point=np.exp(found.point))


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

    A delay is eight holds and the half of one that holding adds; the window of a cycle without
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
    gains = sampled.gains()  # of the law for the nominal inertia

    def is_stable_within(error: float) -> bool:
        return all(
            SampledFamily(replace(sampled, hold=hold), {}, gains).degrees(_ALONE)[0] > 0.0
            for hold in _corners(sampled, error)
        )

    if is_stable_within(_MOST_INERTIA):
        return _MOST_INERTIA
    return _edge(is_stable_within, 0.0, _MOST_INERTIA, 0.01)


def _corners(sampled: SampledHold, error: float) -> Iterator[AttitudeHold]:
    """The hold with all moments off by that, whatever their signs."""
    moments, axes = sampled.hold.body.principal()
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        trial = moments * (1.0 + error * np.array(signs))
        if 2.0 * trial.max() <= trial.sum():
            yield sampled.hold.with_inertia(axes @ np.diag(trial) @ axes.T)
