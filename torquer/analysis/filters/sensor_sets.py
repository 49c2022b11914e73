"""Which sensors are enough: expected accuracy of a scenario's filters and of single sensors."""

from typing import NamedTuple

import numpy as np

from torquer.analysis.filters.linear_covariance import (
    error_95_rad,
    expected_accuracy,
    kalman_filter,
)
from torquer.analysis.filters.observability import Observability, observability
from torquer.analysis.filters.systematic import systematic_error
from torquer.analysis.series import stays_from
from torquer.computer.estimation.filter import MAGNETOMETER_ERRORS, Filter
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.computer.estimation.measurements.table import BY_NAME
from torquer.computer.estimation.sensor_keys import SENSOR_WORDS
from torquer.scenario.spec import Scenario

#: Number of instants of a motion at which the 95th percentile of the errors is computed.
_INSTANTS = 400
#: Length of the windows of observability, as part of a revolution.
_WINDOWS = 20
#: A filter's keys of its sensors.
_MORE_KEYS = {name: tuple(each.keys.model_fields) for name, each in BY_NAME.items()}
_MORE_KEYS["magnetometer"] += MAGNETOMETER_ERRORS
#: Attitude error [deg]; the time until it is reached is reported.
REACHED_DEG = 5.0


class SensorSet(NamedTuple):
    """Expected accuracy of a filter with some sensors.

    `light_deg`, `dark_deg`: 95th percentile of the total attitude error while a Sun sensor sees
    the Sun and while none does, at the worst instant of each after `settled_s`; NaN if there is
    none. `systematic_deg`: the greatest part of it, after that time, which the models on board
    cause and the filter does not state.
    `reached_s`: time after which 95 % of the errors stay below `REACHED_DEG`, NaN if never; None
    with a single direction and no star tracker, where the start is not linear: covariance does
    not tell how long it takes.
    `t_s`, `error_deg`: the 95th percentile over time.
    """

    name: str
    light_deg: float
    dark_deg: float
    systematic_deg: float
    reached_s: float | None
    settled_s: float
    t_s: np.ndarray
    error_deg: np.ndarray
    sun_seen: np.ndarray
    observability: Observability


def sensor_sets(scenario: Scenario) -> list[SensorSet]:
    """The scenario's Kalman filters, those of its modes too, and each with a single sensor.

    ValueError if there are none.
    """
    filters = [("", scenario.control.estimator), *scenario.control.estimators.items()]
    kalman = [(name, spec) for name, spec in filters if isinstance(spec, Filter)]
    if not kalman:
        kalman_filter(scenario)
    found = []
    for name, spec in kalman:
        parts = [spec.sensors] if len(spec.sensors) == 1 else [spec.sensors, *zip(spec.sensors)]
        for sensors in parts:
            with_part = scenario.replace("control.estimator", _with_sensors(spec, sensors))
            found.append(expect_accuracy(with_part, _name_set(name, spec, sensors)))
    return found


def expect_accuracy(scenario: Scenario, name: str) -> SensorSet:
    """Expected accuracy of the scenario's filter, after one revolution or half of a shorter run."""
    expected = expected_accuracy(scenario)
    t_s, length_s = expected.t_s, expected.t_s[-1]
    settled_s = min(scenario.orbit.period_s, 0.5 * length_s)
    rows = np.unique(np.linspace(1, len(t_s) - 1, _INSTANTS).astype(int))
    systematic = systematic_error(scenario, expected)
    error = np.degrees(error_95_rad(expected.covariance[rows, :3, :3], systematic[rows]))
    seen, later = expected.sun_seen[rows], t_s[rows] >= settled_s
    sensors = kalman_filter(scenario).sensors
    whole = len(sensors) > 1 or sensors == ("star_tracker",)
    reached_s = float(stays_from(t_s[rows], error <= REACHED_DEG)) if whole else None
    window_s = min(scenario.orbit.period_s, length_s) / _WINDOWS
    return SensorSet(
        name, _worst(error[later & seen]), _worst(error[later & ~seen]),
        _worst(np.degrees(np.linalg.norm(systematic[rows][later], axis=1))), reached_s,
        float(settled_s), t_s[rows], error, seen, observability(scenario, window_s),
    )  # fmt: skip


def as_plain(sets: list[SensorSet]) -> list[dict]:
    """Sensor sets as plain data."""
    return [
        {
            "sensors": each.name,
            "light_95_deg": each.light_deg,
            "dark_95_deg": each.dark_deg,
            "systematic_deg": each.systematic_deg,
            f"below_{REACHED_DEG:g}_deg_after_s": each.reached_s,
            "settled_s": each.settled_s,
            "windows": [
                {
                    "from_s": float(start),
                    "to_s": float(end),
                    "singular_values": [float(x) for x in values],
                    "weakest": each.observability.weakest_state(k),
                }
                for k, (start, end, values) in enumerate(zip(*each.observability[:3], strict=True))
            ],
        }
        for each in sets
    ]


def _worst(values: np.ndarray) -> float:
    return float(values.max()) if len(values) else float("nan")


def _with_sensors(spec: Filter, sensors) -> dict:
    """Keys of a filter with fewer sensors."""
    keys = spec.model_dump(exclude_none=True) | {"sensors": list(sensors)}
    unwanted = {key for sensor, own in _MORE_KEYS.items() if sensor not in sensors for key in own}
    return {key: value for key, value in keys.items() if key not in unwanted}


def _name_set(name: str, spec: Filter, sensors) -> str:
    """Name of a filter and the sensors that it reads."""
    read = [SENSOR_WORDS[sensor] for sensor in sensors]
    if not isinstance(spec, KalmanDynamics):
        read.append("gyro")
    return (f"{name}: " if name else "") + " + ".join(read)
