"""Causes of a design's error or time, each as the change of a scenario that removes it.

A counter-test flies the same starts without one of them. What a cause costs is what goes with it.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from torquer.scenario.change import found_at, with_values
from torquer.scenario.explain import ScenarioError
from torquer.scenario.spec import Scenario

#: Control step [s] that counts as continuous control.
_QUICK_S = 1.0
#: Has to fit a control step.
_STEP, _SAMPLE = "simulation.step_s", "control.sample_s"


class Cause(NamedTuple):
    """A cause by name; without it the keys in `sizes` are 0, and those in `replaced` as stated.

    The sizes are numbers or vectors, of which a part is a smaller cause of the same kind.
    `is_counted_on`: a law is designed with it in mind, and may be worse without it.
    """

    name: str
    sizes: tuple[str, ...] = ()
    replaced: Mapping[str, Any] = {}
    is_counted_on: bool = False


DIPOLE, NOISE, BIAS = "residual dipole", "noise", "bias"
CAUSES = (
    Cause("gravity gradient", replaced={"environment.gravity_gradient": False},
          is_counted_on=True),
    Cause(DIPOLE, ("spacecraft.coils.residual_dipole_a_m2",
                   "disturbance.residual_dipole.constant_a_m2",
                   "disturbance.residual_dipole.amplitude_a_m2")),
    Cause("air and light", replaced={"spacecraft.aerodynamics": None,
                                     "disturbance.solar_pressure": None}),
    Cause("held torque", ("disturbance.constant_torque_n_m", "disturbance.random_torque_n_m")),
    Cause(NOISE, ("spacecraft.magnetometer.noise_nt", "spacecraft.gyro.noise_deg_s",
                  "spacecraft.attitude_sensor.noise_deg",
                  "spacecraft.attitude_sensor.boresight_noise_deg")),
    Cause(BIAS, ("spacecraft.magnetometer.bias_nt", "spacecraft.gyro.bias_deg_s",
                 "spacecraft.attitude_sensor.error_deg")),
    Cause("models on board", replaced={"control.ephemeris": {}}),
    Cause("sampling and lag", ("spacecraft.coils.lag_s",),
          {"control.measure_s": 0.0, "control.actuate_s": None, _SAMPLE: _QUICK_S},
          is_counted_on=True),
)  # fmt: skip
BY_NAME = {cause.name: cause for cause in CAUSES}


def lessened(scenario: Scenario, cause: Cause, factor: float) -> Scenario:
    """The scenario with that part of a cause's sizes; at 0 without the cause, if it can be."""
    known = {key: found_at(scenario, key) for key in cause.sizes}
    values = {key: _scaled(value, factor) for key, value in known.items() if _is_there(value)}
    if factor == 0.0:
        values |= {
            key: value for key, value in cause.replaced.items() if _differs(scenario, key, value)
        }
    step_s = found_at(scenario, _STEP)
    if _SAMPLE in values and step_s:
        values[_STEP] = _QUICK_S / math.ceil(_QUICK_S / step_s)
    try:
        return with_values(scenario, values) if values else scenario
    except ScenarioError:  # what else the scenario has does not fit: the cause stays
        return scenario


def _scaled(value, factor: float):
    if isinstance(value, list | tuple):
        return [_scaled(each, factor) for each in value]
    return factor * value


def _is_there(value) -> bool:
    """Whether a number, or any of a vector, is not 0."""
    return any(map(_is_there, value)) if isinstance(value, list | tuple) else bool(value)


def _differs(scenario: Scenario, key: str, value) -> bool:
    """Whether putting a value at a key removes anything; a control step only gets shorter."""
    now = found_at(scenario, key)
    if now is None or (key == _SAMPLE and now <= value):
        return False
    if isinstance(value, Mapping):
        return bool(scenario.control.ephemeris != type(scenario.control.ephemeris)())
    return bool(now != value)


def undisturbed(scenario: Scenario) -> Scenario:
    """The scenario without any of the causes but those that a law is designed with."""
    for cause in CAUSES:
        scenario = scenario if cause.is_counted_on else lessened(scenario, cause, 0.0)
    return scenario
