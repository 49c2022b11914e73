"""Whether the models of a scenario can be used for its flight, before anything is computed."""

import numpy as np

from torquer.scenario.spec import Scenario


def check_orbit_environment(scenario: Scenario) -> None:
    """ValueError if field, date, orbit or air of a scenario cannot be used.

    The models are evaluated at both ends of the run and along the first orbit.
    """
    end_s = scenario.length_s
    t_s = np.append(np.linspace(0.0, min(end_s, scenario.orbit.period_s), 50), end_s)
    environment = scenario.orbit_environment()
    environment.check_dates(*t_s[[0, -1]])
    environment.sample(t_s)
    believed = scenario.believed_environment()
    believed.check_dates(*t_s[[0, -1]])
    believed.field(t_s, *believed.state(t_s))
    if not scenario.spacecraft.aerodynamics:
        return
    with np.errstate(invalid="ignore"):
        known = np.isfinite(environment.flow(t_s)).all()
    if not known:
        raise ValueError(
            "environment.atmosphere: must have a density of 0 or more along the orbit; received a "
            "negative one (as gost has for f107 far below f81) or one beyond the range of "
            "floating-point numbers"
        )
