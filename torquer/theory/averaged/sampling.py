"""Sampling of B-dot and nutation damping in a scenario: intervals, holds, ages of readings."""

import math

import numpy as np

from torquer.computer.laws.bdot import Bdot, BdotDerivative, BdotModel
from torquer.computer.laws.bdot_normalised import BdotNormalised
from torquer.computer.laws.nutation_damping import NutationDamping, NutationDampingDerivative
from torquer.scenario.spec import Scenario
from torquer.spacecraft.sensors.attitude_sensor import AttitudeSensor
from torquer.spacecraft.sensors.magnetometer import Magnetometer
from torquer.theory.slow.gains import Sampling

#: Laws that take differences of readings.
DIFFERENCES = (Bdot, BdotNormalised, NutationDamping)


def law_sampling(scenario: Scenario, law) -> Sampling:
    """Times of a law of B-dot's kind in this scenario.

    Where the timing of readings differs from cycle to cycle, the greatest value of each.
    """
    return _sampling(scenario, _sensor(scenario, law), isinstance(law, DIFFERENCES))


def sampling_by_differences(scenario: Scenario) -> Sampling:
    """The same of any law that takes differences of the magnetometer's readings."""
    return _sampling(scenario, scenario.spacecraft.one_of("magnetometer"), True)


def _sampling(
    scenario: Scenario, sensor: Magnetometer | AttitudeSensor | None, by_differences: bool
) -> Sampling:
    control = scenario.control
    difference_s, hold_s, delay_s = control.sample_s, control.sample_s, 0.0
    if sensor is not None and sensor.sample_s is not None:
        difference_s, hold_s, delay_s = _reading_times(scenario, sensor)
    return Sampling(
        difference_s if by_differences else 0.0,
        control.actuate_s or hold_s,
        scenario.spacecraft.coils.lag_s,
        control.measure_s,
        delay_s,
        scenario.spacecraft.coils.short_pulse_s(),
    )


def _sensor(scenario: Scenario, law) -> Magnetometer | AttitudeSensor | None:
    """The sensor whose readings rotate with the body; None for a search coil."""
    if isinstance(law, BdotDerivative | NutationDampingDerivative):
        return None
    craft = scenario.spacecraft
    return (
        craft.one_of("attitude_sensor")
        if isinstance(law, BdotModel)
        else craft.one_of("magnetometer")
    )


def _reading_times(scenario: Scenario, sensor) -> tuple[float, float, float]:
    """Greatest (difference, hold, age) [s] of a sensor's readings when the coils are commanded.

    A law that takes differences gives a new command at the first control step with a new reading.
    """
    control, step_s = scenario.control, scenario.grid_s
    interval, late = round(sensor.sample_s / step_s), round(sensor.delay_s / step_s)
    cycle, sample = round(control.cycle_s / step_s), round(control.sample_s / step_s)
    window = range(0, round(control.measure_s / step_s) + 1, sample)
    begins = range(0, 2 * (math.lcm(cycle, interval) + interval), cycle)
    new: list[tuple[int, int]] = []  # control steps that know a new reading, when it was taken
    for step in (begin + at for begin in begins for at in window):
        taken = (step - late) // interval * interval
        if not new or taken > new[-1][1]:
            new.append((step, taken))
    steps, taken_at = np.array(new).T
    commands = np.array(begins) + window[-1] if control.measure_s > 0.0 else steps
    last = np.searchsorted(steps, commands, side="right") - 1
    differences = (taken_at[last] - taken_at[last - 1])[last > 0]
    ages, holds = commands - taken_at[last], np.diff(steps)
    difference, hold, age = (step_s * float(part.max()) for part in (differences, holds, ages))
    return difference, hold, age
