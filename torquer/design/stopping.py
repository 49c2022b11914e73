"""When releases of a satellite stop by B-dot in the field along its orbit, without flights."""

import numpy as np

from torquer.scenario.spec import Scenario
from torquer.theory.slow.detumbling import Tumbling
from torquer.theory.slow.turning_field import releases_stop_s

_DAY_S = 86400.0
#: Step of the fields [s]; steps that the mean time by theory has at least; these in all at most.
_STEP_S, _FINE, _MOST = 20.0, 50.0, 40_000
#: Times by theory that are followed.
_TIMES = 6.0


def releases_stop_along_s(
    scenario: Scenario,
    tumbling: Tumbling,
    gain: float,
    from_rad_s: float,
    below_rad_s: float,
    mean_s: float,
) -> np.ndarray:
    """Times [s] of many releases to stop with a gain [A m^2 s/T], at any time of a day.

    Infinite for those that take six times `mean_s`, or a day if that is longer.
    """
    span_s = 2.0 * max(_DAY_S, _TIMES * mean_s) if mean_s < np.inf else 2.0 * _DAY_S
    step_s = max(min(_STEP_S, mean_s / _FINE), span_s / _MOST)
    environment = scenario.orbit_environment()
    times = np.arange(round(span_s / step_s)) * step_s
    fields = environment.field(times, *environment.state(times))
    moments = scenario.spacecraft.body.principal()[0]
    return releases_stop_s(tumbling, gain, fields, step_s, moments, from_rad_s, below_rad_s)
