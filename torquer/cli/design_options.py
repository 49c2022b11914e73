"""The case of `torquer design three-axis`, from options or a scenario; one line per mistake."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from torquer.control.law import Law
from torquer.control.pointing import HeldAttitude
from torquer.control.three_axis import ThreeAxis
from torquer.estimation.sensors import SensorReadings
from torquer.geometry.vec3 import scale
from torquer.scenario.load import ScenarioError, load_scenario, scenario_from_data
from torquer.scenario.spec import Scenario
from torquer.theory.three_axis.design import DesignTask
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.response import Noise, Offsets
from torquer.theory.three_axis.sampled import Cycle, SampledHold

#: Options without which there is no satellite.
_NEEDED = ("inertia", "altitude_km", "inclination_deg", "limit_a_m2")
#: Where an option stands in a scenario.
_KEYS = {
    "inertia": "spacecraft.body.inertia_kg_m2", "altitude_km": "orbit.altitude_km",
    "inclination_deg": "orbit.inclination_deg", "limit_a_m2": "spacecraft.coils.limit_a_m2",
    "sample_s": "control.sample_s", "measure_s": "control.measure_s",
    "actuate_s": "control.actuate_s", "field": "environment.field.kind",
    "residual_a_m2": "spacecraft.coils.residual_dipole_a_m2",
    "torque_n_m": "disturbance.constant_torque_n_m",
    "attitude_noise_deg": "spacecraft.attitude_sensor.noise_deg",
    "rate_noise_deg_s": "spacecraft.gyro.noise_deg_s",
    "reference": "control.law.reference", "euler_deg": "control.law.euler_deg",
}  # fmt: skip
#: The start of a satellite that is given by options: the field's date.
_START = "2025-01-01T00:00:00Z"


@dataclass(frozen=True)
class DesignCase:
    """What gains are designed for, in words and for `design_gains`; `notes`: what is left out.

    `own`: a law of the scenario that holds an attitude and to which linear theory applies.
    """

    scenario: Scenario
    task: DesignTask
    notes: tuple[str, ...]
    own: Law | None = None

    @property
    def name(self) -> str:
        """The scenario's own."""
        return self.scenario.name


def case_of(path: Path | None, given: dict, how: tuple) -> DesignCase:
    """The case from either source; `how`: linear range, gain margin, revolutions.

    `ValueError` if both or neither source is given.
    """
    named = {key: value for key, value in given.items() if value is not None}
    if path is not None and named:
        option = _option(next(iter(named)))
        raise ValueError(f"{option}: must not be given with SCENARIO; received both")
    if path is not None:
        found = _case(load_scenario(path), *how)
        return replace(found, own=_own_law(found.scenario.control))
    for key in _NEEDED:
        if key not in named:
            raise ValueError(f"{_option(key)}: must be given (or SCENARIO); received nothing")
    return _case(_scenario_of(named), *how)


def _option(key: str) -> str:
    return f"--{key.replace('_', '-')}"


def _scenario_of(named: dict) -> Scenario:
    """A scenario made from the options; errors name the option."""
    law = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
    data: dict = {
        "name": "design", "start": _START, "orbit": {"kind": "circular"}, "control": {"law": law},
        "initial": {"rate_deg_s": [0.0, 0.0, 0.0]}, "simulation": {"revolutions": 1.0},
    }  # fmt: skip
    for key, value in named.items():
        *tables, last = _KEYS[key].split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[last] = list(value) if isinstance(value, tuple) else value
    try:
        return scenario_from_data(data)
    except ScenarioError as error:
        text = str(error)
        for key, place in _KEYS.items():
            text = text.replace(place, _option(key))
        raise ValueError(text) from None


def _case(scenario: Scenario, linear_range_deg, gain_margin, revolutions) -> DesignCase:
    craft, control = scenario.spacecraft, scenario.control
    if craft.coils is None:
        raise ValueError("spacecraft.coils: must be given for magnetic control; received none")
    held, notes = _attitude(control)
    hold = AttitudeHold.of_scenario(scenario, held.law(), revolutions)
    sensor, gyro, disturbance = craft.attitude_sensor, craft.gyro, scenario.disturbance
    hold_s, torque, random = control.sample_s, (0.0, 0.0, 0.0), 0.0
    if disturbance is not None:
        torque, random = disturbance.constant_torque_n_m, disturbance.random_torque_n_m
        hold_s = disturbance.random_hold_s or hold_s
    noise = Noise(math.radians(sensor.noise_deg), math.radians(gyro.noise_deg_s), random, hold_s)
    degree = math.radians(1.0)
    offsets = Offsets(scale(degree, sensor.error_deg), scale(degree, gyro.bias_deg_s))
    task = DesignTask(
        SampledHold(hold, Cycle.of_control(control), craft.coils.residual_dipole_a_m2),
        float(np.min(craft.coils.limit_a_m2)),
        linear_range_deg, gain_margin, torque, noise, offsets,
    )  # fmt: skip
    return DesignCase(scenario, task, (*notes, *_left_out(scenario)))


def _attitude(control) -> tuple[ThreeAxis, tuple[str, ...]]:
    """The three-axis law for the attitude that a law of the scenario holds."""
    laws = [spec for spec in control.named().laws.values() if isinstance(spec, HeldAttitude)]
    keys = {"rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
    if not laws:
        return ThreeAxis(**keys), (
            "no law holds an attitude: alignment with the orbital frame is assumed",
        )
    held = laws[0].model_dump(include={"reference", "euler_deg", "sequence"})
    return ThreeAxis(**keys, **held), ()


def _own_law(control) -> Law | None:
    """The only law, where it holds an attitude by coils and without memory."""
    laws = [spec.law() for spec in control.named().laws.values()]
    if len(laws) != 1 or not {"orbital", "q_wanted"} <= laws[0].values().keys():
        return None
    return laws[0] if laws[0].answers == "dipole" and not len(laws[0].first_memory()) else None


def _left_out(scenario: Scenario) -> tuple[str, ...]:
    """What the linear theory leaves out."""
    craft, found = scenario.spacecraft, []
    if craft.coils is not None and craft.coils.lag_s > 0.0:
        found.append("the lag of the coils is left out: compare it with the delay margin")
    if not isinstance(scenario.control.estimator, SensorReadings):
        found.append("the noise is that of the sensors, without the estimator")
    if craft.gyro.bias_drift_deg_s_sqrt_s > 0.0:
        found.append("the gyro's bias is taken as constant, without its drift")
    return tuple(found)
