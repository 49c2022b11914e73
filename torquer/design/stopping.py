"""When releases of a satellite stop by B-dot in the field along its orbit, without flights."""

import numpy as np

from torquer.design.gain_sweep import GainSweep
from torquer.theory.slow.turning_field import releases_stop_s

_DAY_S = 86400.0
#: Step of the fields [s]; steps that the mean time by theory has at least; these in all at most.
_STEP_S, _FINE, _MOST = 20.0, 50.0, 40_000
#: Times by theory that are followed.
_TIMES = 6.0


def releases_stop_along_s(case: GainSweep, gain: float) -> np.ndarray:
    """Times [s] of many releases to stop with a gain [A m^2 s/T], at any time of a day.

    `case`: as `without_flights` gives it. Infinite for those that take six times the mean of
    `case.theory_s`, or a day if that is longer.
    """
    mean_s = case.theory_s(gain)
    span_s = 2.0 * max(_DAY_S, _TIMES * mean_s) if mean_s < np.inf else 2.0 * _DAY_S
    step_s = max(min(_STEP_S, mean_s / _FINE), span_s / _MOST)
    environment = case.scenario.orbit_environment()
    times = np.arange(round(span_s / step_s)) * step_s
    fields = environment.field(times, *environment.state(times))
    moments = case.scenario.spacecraft.body.principal()[0]
    wanted = case.wanted
    return releases_stop_s(
        case.tumbling, gain, fields, step_s, moments, wanted.tip_off_rad_s, wanted.below_rad_s
    )
