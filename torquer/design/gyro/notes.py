"""What the user of a magneto-gyroscopic design should know: wheel, orbit, coils, flights."""

import math

import numpy as np

from torquer.analysis.causes import AIR
from torquer.analysis.counter_tests import groups_of
from torquer.design.failure import RUNS
from torquer.design.gyro.answer import GyroDesign
from torquer.design.gyro.flown_scenario import EXACT_DEG, steps_of

#: Orbits of braking and turning beyond which the coils are called weak.
_LONG = 20.0
#: Degree over a day below which an orbit is called near to the limit.
_NEAR = 0.1


def notes_on(made: GyroDesign) -> list[str]:
    """What the user should know."""
    flown = made.flights.notes if made.flights else ()
    own = *_on_wheel(made), *_on_orbit(made), *_on_coils(made), *_on_search(made), *_on_air(made)
    return [*flown, *made.case.notes, *own]


def _on_air(made: GyroDesign) -> list[str]:
    """What turns the satellite and is no part of the errors."""
    if AIR not in groups_of(made.case.scenario):
        return []
    return ["errors by cause, and the time by theory, are without air and light"]


def _on_search(made: GyroDesign) -> list[str]:
    """Gains of stage 1 that end those tried; flights too long to look for what would work."""
    of_stage_1 = made.first.ends.items()
    ends = [f"stage 1: its {key} of {made.law[key]:g} is {what}" for key, what in of_stage_1]
    if made.failure is None or made.failure.flown.runs >= RUNS:
        return ends
    return [
        *ends,
        f"a flight takes {steps_of(made.scenario):.2g} steps: causes were flown with "
        f"{made.failure.flown.runs} starts, and no satellite that would point was looked for",
    ]


def _on_wheel(made: GyroDesign) -> list[str]:
    better, found = made.better, []
    if made.second.degree < 0.9 * made.request.degree:
        found.append(f"the degree wanted, {made.request.degree:g}, was not reached")
    if better is not None and better.least > min(made.first.degree, made.second.degree):
        found.append(
            f"a wheel of {better.wheel_n_m_s:.4g} N m s has h = {better.stiffness:g} and degrees "
            f"of {better.first:.3f} (stage 1) and {better.second:.3f} (stage 2)"
        )
    return found


def _on_orbit(made: GyroDesign) -> list[str]:
    """Differences with which it is unstable; an orbit near the limit."""
    unstable = [name for name, degree in made.margins.items() if degree <= 0.0]
    found = [f"stage 2 is unstable with {' and with '.join(unstable)}"] if unstable else []
    if made.day_degree >= min(_NEAR, 0.5 * made.second.degree):
        return found
    return [
        *found,
        f"an inclination of {made.case.inclination_deg:.4g} deg is near the limit: over a day the "
        f"degree is {made.day_degree:.3f}",
    ]


def _on_coils(made: GyroDesign) -> list[str]:
    """Where the coils are too weak, and what they would need."""
    case, found = made.case, []
    coils, period_s = case.coils, case.scenario.orbit.period_s
    limit = float(coils.limits_a_m2().min())
    slow = (made.time.braking_s + made.time.turning_s) / period_s
    if slow > _LONG:
        found.append(
            f"the coils are weak: with {limit:g} A m^2 they take {slow:.3g} orbits to brake the "
            f"satellite and turn the wheel; {_LONG:g} orbits need about "
            f"{limit * slow / _LONG:.3g} A m^2"
        )
    residual = float(np.linalg.norm(coils.residual_dipole_a_m2))
    if residual > 0.5 * limit:
        found.append(
            f"the satellite's own dipole of {residual:.3g} A m^2, which the coils are to "
            f"compensate, is more than half of their limit of {limit:g} A m^2"
        )
    g, unit = made.second.gains, case.craft.torque_unit / case.along.strength_t
    per_rad = unit * max(math.hypot(g.n1, g.n3), abs(g.n2))
    if math.radians(EXACT_DEG) * per_rad > limit:
        found.append(
            f"{EXACT_DEG:g} deg of error saturates the coils in stage 2: it asks for "
            f"{math.radians(EXACT_DEG) * per_rad:.3g} A m^2, they have {limit:g}"
        )
    return found
