"""What a scenario's author should know before the run: not errors, but likely surprises."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.assess import assess
from torquer.analysis.notes.assumption_notes import assumption_notes
from torquer.analysis.notes.bdot_notes import bdot_notes
from torquer.analysis.notes.device_notes import device_notes
from torquer.analysis.notes.disturbance_notes import disturbance_notes
from torquer.analysis.notes.filter_notes import filter_notes
from torquer.analysis.notes.gyro_notes import gyro_notes
from torquer.analysis.notes.magnet_notes import magnet_notes
from torquer.analysis.notes.mode_notes import mode_notes
from torquer.analysis.notes.orbit_notes import orbit_notes
from torquer.analysis.notes.reach_notes import reach_notes
from torquer.analysis.notes.sampling_notes import sampling_notes
from torquer.analysis.notes.slip_notes import slip_notes
from torquer.analysis.notes.spin_notes import spin_notes
from torquer.analysis.notes.tracking_notes import tracking_notes
from torquer.analysis.notes.trim_notes import trim_notes
from torquer.analysis.notes.wheel_notes import wheel_notes
from torquer.scenario.resolution import (
    QUIET_DAMPING,
    lost_amplitude,
    speeds_at_start,
    step_that_keeps,
)
from torquer.scenario.spec import Scenario


def write_notes(scenario: Scenario) -> list[str]:
    """Notes, one line each; no note is an error, and none looks beyond the run."""
    return [*assess(_CHECKS, scenario)]


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


_CHECKS = {
    "numbers in another unit": slip_notes,
    "what devices say of themselves": device_notes,
    "what the actuators reach": reach_notes,
    "the laws that brake by the field": bdot_notes,
    "how fast the laws can brake": sampling_notes,
    "the law magneto_gyro": gyro_notes,
    "the laws about a spin axis": spin_notes,
    "the law dipole_trim": trim_notes,
    "the law wheel_tracking": tracking_notes,
    "the steps of the run": _step_notes,
    "the orbit": orbit_notes,
    "the wheels": wheel_notes,
    "the disturbances": disturbance_notes,
    "the hysteresis rods": magnet_notes,
    "the modes": mode_notes,
    "the filters": filter_notes,
    "what is assumed on board": assumption_notes,
}
