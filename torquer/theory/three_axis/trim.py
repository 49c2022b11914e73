"""Trim of the residual dipole beside a hold by coils: its time constant, and where it works.

The observer of `dipole_trim` is stable with any time constant T, whatever the hold: no condition
ties T to the hold as one would with integral action. Two bounds are left. Its filter, T/16, must be
fast against the field, which turns in the body at about twice the orbital rate n: T = P/4, with the
period P, makes the turn in this time pi/16. And the field must turn at all: in the mean over the
orbit the error about the weakest axis falls as exp(-s t/T), s the least eigenvalue of <1 - b b^T>.
"""

import math
from typing import NamedTuple

from torquer.computer.laws.dipole_trim import FILTERS_IN_TIME, DipoleTrim
from torquer.theory.three_axis.gain_search import DesignTask, least_held
from torquer.theory.validity import Limit, Verdict, judge

#: T over the period, least number of control steps in the filter's time, part of the coils' mean
#: dipole that the trim may use.
_PART_OF_PERIOD, _STEPS, _PART_OF_LIMIT = 0.25, 4.0, 0.5
OBSERVED = Limit(
    "mean of 1 - b b^T about the axis where it is least", least=0.1,
    why="the field hardly turns in the body: the dipole along it is not seen within revolutions",
    of="time of a dipole's trim", shown="the averaged equation of the estimate",
)  # fmt: skip
FILTERED = Limit(
    "turn of the field in the time of the filter [rad]", most=0.4,
    why="control steps are far apart, and the filter that spans them lags behind the field",
    of="time of a dipole's trim", shown="flights: with 0.4 rad a scalar hold is lost at 20 mA m^2",
)  # fmt: skip


class TrimDesign(NamedTuple):
    """The law, the time [s] in which its error about the weakest axis falls to 1/e, the verdict."""

    spec: DipoleTrim
    slowest_s: float
    verdict: Verdict


def design_trim(task: DesignTask) -> TrimDesign:
    """The trim for a hold: T a quarter of a revolution, or more where control steps are far apart.

    It may use half of what the weakest coil gives in the mean.
    """
    sampled = task.sampled
    hold, cycle_s = sampled.hold, sum(sampled.cycle)
    duty, n = sampled.cycle.hold_s / cycle_s, hold.rate_rad_s
    time_s = max(2.0 * math.pi * _PART_OF_PERIOD / n, FILTERS_IN_TIME * _STEPS * cycle_s)
    observed = least_held(sampled.maps.b_body_t)
    spec = DipoleTrim(
        inertia_kg_m2=hold.body.inertia,
        time_constant_s=float(f"{time_s:.3g}"),
        greatest_dipole_a_m2=float(f"{_PART_OF_LIMIT * duty * task.limit_a_m2:.3g}"),
        coil_duty=float(f"{duty:.4g}"),
    )
    turn = 2.0 * n * time_s / FILTERS_IN_TIME
    verdict = judge((OBSERVED, observed), (FILTERED, turn))
    return TrimDesign(spec, time_s / observed if observed > 0.0 else math.inf, verdict)
