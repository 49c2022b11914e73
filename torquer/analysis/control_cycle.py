"""Where records fall in the control cycle: on a sampling instant, or while the coils act."""

import numpy as np

from torquer.scenario.spec import Scenario
from torquer.simulation.loop.timetable import CONTROL
from torquer.simulation.setup.prepare import timetable_for


def fresh_rows(scenario: Scenario, t_s) -> np.ndarray:
    """Rows recorded at a sampling instant: only there does the reading belong to the time.

    Between samples the record holds the last reading, which is out of date for a rotating body.
    So it is in the last row, which is written before the sensors are read again.
    """
    control, step_s = scenario.control, scenario.grid_s
    measure, sample = round(control.measure_s / step_s), round(control.sample_s / step_s)
    phase = _phase(scenario, t_s)
    fresh = (phase <= measure) & (phase % sample == 0)
    return np.flatnonzero(fresh[:-1])


def acting_rows(scenario: Scenario, t_s) -> np.ndarray:
    """Rows recorded while the coils act.

    The last row is not one of them: it is written before the coils are switched on.
    """
    measure = round(scenario.control.measure_s / scenario.grid_s)
    return np.flatnonzero(_phase(scenario, t_s)[:-1] >= measure)


def control_times(scenario: Scenario) -> np.ndarray:
    """Instants (k,) [s] of the control steps of a run."""
    control, step_s = scenario.control, scenario.grid_s
    measure, sample = round(control.measure_s / step_s), round(control.sample_s / step_s)
    cycle = round(control.cycle_s / step_s)
    within = np.arange(0, measure + 1, sample)
    first = np.arange(0, scenario.steps() + 1, cycle)
    steps = np.sort(np.add.outer(first, within).ravel())
    return steps[steps <= scenario.steps()] * step_s


def control_steps(scenario: Scenario, until_s: float) -> np.ndarray:
    """Numbers (k,) of the steps of the time grid at which the computer works, up to a time [s].

    Also those while the coils act, which `control_times` leaves out.
    """
    table = timetable_for(scenario, frozenset())
    within = table.rows["step"][table.rows["actions"] & CONTROL > 0]
    last = round(until_s / scenario.grid_s)
    steps = np.add.outer(np.arange(0, last + 1, table.cycle_steps), within).ravel()
    return steps[steps <= last]


def _phase(scenario: Scenario, t_s) -> np.ndarray:
    """Steps since the start of the control cycle."""
    step_s = scenario.grid_s
    steps = np.round(np.asarray(t_s) / step_s).astype(np.int64)
    return steps % round(scenario.control.cycle_s / step_s)
