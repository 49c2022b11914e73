"""What the on-board computer knows and what it answers: the interface of estimators, modes, laws.

A plug-in is a function of `Inputs` (`torquer.computer.inputs`), its parameters and its memory. It
never sees the truth: the sensors' readings have errors, times and delays, the ephemeris is the
computer's own.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined
from torquer.spacecraft.sensors.device import MOST_PARTS, MOST_UNITS
from torquer.spacecraft.sensors.devices import DEVICES

_ZERO = (0.0, 0.0, 0.0)
_UNKNOWN = (math.nan, math.nan, math.nan)
_NO_ATTITUDE = (math.nan, math.nan, math.nan, math.nan)


#: Sensors by the names that users give them: the keys of scenarios, conditions and failures.
SENSORS = tuple(device.name for device in DEVICES)
#: Their numbers, of those that something on board asks for by name.
MAGNETOMETER, GYRO, SUN_SENSORS = map(SENSORS.index, ("magnetometer", "gyro", "sun_sensors"))
ATTITUDE_SENSOR, TACHOMETERS = map(SENSORS.index, ("attitude_sensor", "tachometers"))
OWN_SENSOR = SENSORS.index("own_sensor")
SEARCH_COIL = SENSORS.index("search_coil")
#: The same by name.
NUMBERS = {name: number for number, name in enumerate(SENSORS)}
#: Rows of readings: of each sensor by its number, then of each unit where there are several.
ROWS = len(SENSORS) + MOST_UNITS
#: No sensor that an estimator judges to be wrong.
NONE_ISOLATED = (0.0,) * len(SENSORS)
NO_UNITS_ISOLATED = (0.0,) * MOST_UNITS


class Estimate(NamedTuple):
    """What the estimator believes at `t_s`; NaN where it is unknown.

    `q_body_to_inertial`, `omega_body_rad_s` (absolute rate), `gyro_bias_rad_s`; `sigma_rad`:
    standard deviation of the attitude about each axis; `sigma_rad_s`: of the rate. `isolated`: 1
    for each sensor whose readings the estimator judges to be wrong, else 0; in the order of
    `SENSORS`. `isolated_units`: the same of each of several devices of a kind.

        >>> nan = float("nan")
        >>> unknown = (nan, nan, nan)
        >>> known = torquer.Estimate(
        ...     5.0, (0.0, 0.0, 0.0, 1.0), (0.01, 0.0, 0.0), unknown, (0.1, 0.1, 0.1), unknown
        ... )
        >>> known.omega_body_rad_s
        (0.01, 0.0, 0.0)
    """

    t_s: float = -math.inf
    q_body_to_inertial: tuple = _NO_ATTITUDE
    omega_body_rad_s: tuple = _UNKNOWN
    gyro_bias_rad_s: tuple = _ZERO
    sigma_rad: float = math.nan
    sigma_rad_s: float = math.nan
    isolated: tuple = NONE_ISOLATED
    isolated_units: tuple = NO_UNITS_ISOLATED


class Ephemeris(NamedTuple):
    """Where the computer assumes the satellite, and what its models give there; inertial frame.

    Position, velocity, field and its rate of change along the orbit, unit vector to the Sun from
    the satellite, visible part of the Sun's disc (0 in the umbra). NaN unless a plug-in declares
    that it `needs` the ephemeris.
    """

    r_inertial_m: tuple = _UNKNOWN
    v_inertial_m_s: tuple = _UNKNOWN
    b_inertial_t: tuple = _UNKNOWN
    b_rate_inertial_t_s: tuple = _UNKNOWN
    sun_inertial: tuple = _UNKNOWN
    sunlit_fraction: float = math.nan


class Command(NamedTuple):
    """What a law asks for, in body axes: dipole of the coils, torque on the body by the wheels.

    >>> both = torquer.Command((0.1, 0.0, 0.0), (0.0, 0.0, 1e-4))  # A m^2, N m
    >>> both.torque_n_m
    (0.0, 0.0, 0.0001)
    """

    dipole_a_m2: tuple = _ZERO
    torque_n_m: tuple = _ZERO


NO_COMMAND = Command()
UNKNOWN_ESTIMATE = Estimate()


def _xyz(*names: str) -> list[str]:
    return [f"{name}_{c}" for name in names for c in "xyz"]


#: The inputs as a record that the loop holds: what has not changed is not written again. A row of
#: `readings` and a time for each sensor, by its number. `gyro_units`: see `Inputs`.
KNOWN = np.dtype(
    [
        ("t_s", np.float64),
        *((name, np.float64) for name in _xyz("coils")),
        ("readings", np.float64, (ROWS, MOST_PARTS)),
        ("read_s", np.float64, (ROWS,)),
        ("gyro_units", np.float64),
        *(
            (name, np.float64)
            for name in (
                *("estimate_s", "estimate_q_x", "estimate_q_y", "estimate_q_z", "estimate_q_w"),
                *_xyz("estimate_omega", "estimate_bias"),
                *("sigma_rad", "sigma_rad_s"),
            )
        ),
        ("isolated", np.float64, (ROWS,)),
        *(
            (name, np.float64)
            for name in _xyz("position", "velocity", "model_b", "model_b_rate", "to_sun")
        ),
        ("sunlit_fraction", np.float64),
    ]
)
#: Where the numbers of each field stand in the record, seen as numbers.
PLACES = {
    name: slice(at // 8, (at + kind.itemsize) // 8)
    for name, (kind, at) in ((name, field[:2]) for name, field in (KNOWN.fields or {}).items())
}
#: Numbers that sensors write; those of the estimate follow, then those of the ephemeris.
SENSED, ESTIMATED = PLACES["estimate_s"].start, PLACES["position_x"].start


def reading_places(sensor: str) -> slice:
    """Where the numbers of a sensor's reading stand in the record, seen as numbers."""
    number = SENSORS.index(sensor)
    first = PLACES["readings"].start + MOST_PARTS * number
    return slice(first, first + DEVICES[number].count)


def nothing_known() -> np.ndarray:
    """The record before the first reading: zeros, read infinitely long ago; nothing estimated."""
    known = np.zeros(1, KNOWN)
    numbers = known.view(np.float64)
    numbers[SENSED:] = np.nan
    known["read_s"] = known["estimate_s"] = -np.inf
    known["isolated"] = 0.0
    for name in _xyz("estimate_bias"):
        known[name] = 0.0
    return known


@inlined
def reading3(k, sensor):
    """Three numbers of a sensor's latest reading in the record."""
    return (k.readings[sensor, 0], k.readings[sensor, 1], k.readings[sensor, 2])


@inlined
def read_six(k, row):
    """Six numbers of a device's latest reading in the record."""
    r = k.readings
    return (r[row, 0], r[row, 1], r[row, 2], r[row, 3], r[row, 4], r[row, 5])


@inlined
def put_estimate(k, e):
    """Write an estimate into the record."""
    k.estimate_s, k.sigma_rad, k.sigma_rad_s = e.t_s, e.sigma_rad, e.sigma_rad_s
    k.estimate_q_x, k.estimate_q_y, k.estimate_q_z, k.estimate_q_w = e.q_body_to_inertial
    k.estimate_omega_x, k.estimate_omega_y, k.estimate_omega_z = e.omega_body_rad_s
    k.estimate_bias_x, k.estimate_bias_y, k.estimate_bias_z = e.gyro_bias_rad_s
    for sensor in range(len(e.isolated)):
        k.isolated[sensor] = e.isolated[sensor]
    for unit in range(len(e.isolated_units)):
        k.isolated[len(SENSORS) + unit] = e.isolated_units[unit]


@inlined
def put_ephemeris(k, e):
    """Write an ephemeris into the record."""
    k.position_x, k.position_y, k.position_z = e.r_inertial_m
    k.velocity_x, k.velocity_y, k.velocity_z = e.v_inertial_m_s
    k.model_b_x, k.model_b_y, k.model_b_z = e.b_inertial_t
    k.model_b_rate_x, k.model_b_rate_y, k.model_b_rate_z = e.b_rate_inertial_t_s
    k.to_sun_x, k.to_sun_y, k.to_sun_z = e.sun_inertial
    k.sunlit_fraction = e.sunlit_fraction
