"""What a scenario's author should know before the run: not errors, but likely surprises."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.bdot_notes import bdot_notes
from torquer.analysis.notes.disturbance_notes import disturbance_notes
from torquer.analysis.notes.filter_notes import filter_notes
from torquer.analysis.notes.gyro_notes import gyro_notes
from torquer.analysis.notes.mode_notes import mode_notes
from torquer.analysis.notes.slip_notes import slip_notes
from torquer.analysis.notes.wheel_notes import wheel_notes
from torquer.environment.orbit.numerical import tle_epoch
from torquer.environment.orbit.sgp4 import Sgp4
from torquer.scenario.resolution import (
    QUIET_DAMPING,
    lost_amplitude,
    speeds_at_start,
    step_that_keeps,
)
from torquer.scenario.spec import Scenario

#: Age of two-line elements [days] from which the satellite's place is hardly theirs any more.
_OLD_DAYS = 14.0


def write_notes(scenario: Scenario) -> list[str]:
    """Notes, one line each."""
    return [
        *slip_notes(scenario),
        *bdot_notes(scenario),
        *gyro_notes(scenario),
        *_step_notes(scenario),
        *_orbit_notes(scenario),
        *wheel_notes(scenario),
        *disturbance_notes(scenario),
        *mode_notes(scenario),
        *filter_notes(scenario),
    ]


def _orbit_notes(scenario: Scenario) -> Iterator[str]:
    orbit = scenario.orbit
    elements = orbit if isinstance(orbit, Sgp4) else getattr(orbit, "start", None)
    if not isinstance(elements, Sgp4):
        return
    age_days = (scenario.start - tle_epoch(elements)).total_seconds() / 86400.0
    if abs(age_days) >= _OLD_DAYS:
        side = "after" if age_days > 0.0 else "before"
        yield (
            f"the start is {abs(age_days):.0f} days {side} the epoch of the two-line elements: "
            "their error grows by some kilometres a day"
        )


def _step_notes(scenario: Scenario) -> Iterator[str]:
    rate = math.radians(float(np.linalg.norm(scenario.initial.rate_deg_s)))
    turn, integrator = rate * scenario.grid_s, scenario.simulation.integrator
    if integrator == "splitting":
        yield from _gyrostat_notes(scenario, turn)
    elif integrator == "rk4" and turn < 0.5:
        yield from _nutation_notes(scenario)
    elif integrator == "rk4":
        yield (
            f"the body rotates by {math.degrees(turn):.0f} deg within one step of "
            f"{scenario.grid_s:g} s: take shorter steps, or adaptive ones (no step_s)"
        )


def _nutation_notes(scenario: Scenario) -> Iterator[str]:
    """Numerical damping by RK4, if the nutation stays as it is at the start."""
    step_s = scenario.grid_s
    duration_s = scenario.steps() * step_s
    speed = speeds_at_start(scenario.spacecraft, scenario.initial).nutation
    lost = lost_amplitude(speed, step_s, duration_s)
    if lost >= QUIET_DAMPING:
        enough = step_that_keeps(QUIET_DAMPING, speed, duration_s)
        yield (
            f"RK4 with a step of {step_s:g} s damps a nutation of {math.degrees(speed):.3g} deg/s "
            f"numerically, by {100.0 * lost:.3g} % of its amplitude in this run: take steps of "
            f"{enough:.2g} s or less, or adaptive ones (no step_s)"
        )


def _gyrostat_notes(scenario: Scenario, turn: float) -> Iterator[str]:
    body = scenario.spacecraft.body
    wheels = float(np.linalg.norm(body.wheel_momentum_n_m_s))
    swing = wheels / float(body.principal()[0][0]) * scenario.grid_s
    if turn * swing >= 0.01:
        yield (
            f"with wheels the splitting is of order 2 only: their {wheels:g} N m s rotate the rate "
            f"by {math.degrees(swing):.3g} deg within one step of {scenario.grid_s:g} s, "
            f"the body rotates by {math.degrees(turn):.3g} deg; take shorter steps, or adaptive "
            "ones (no step_s)"
        )
