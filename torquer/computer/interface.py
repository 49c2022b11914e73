"""What the on-board computer knows and what it answers: the interface of estimators, modes, laws.

A plug-in is a function of `Inputs`, its parameters and its memory. It never sees the truth: the
sensors' readings have errors, times and delays, the ephemeris is the computer's own.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined
from torquer.spacecraft.sensors.sun_cells import CELLS

#: Signals of single Sun cells where there are none.
NO_CELLS = (0.0,) * CELLS
_ZERO = (0.0, 0.0, 0.0)
_UNKNOWN = (math.nan, math.nan, math.nan)
_NO_ATTITUDE = (math.nan, math.nan, math.nan, math.nan)


class ReadingTimes(NamedTuple):
    """When the latest readings were taken [s]; minus infinity for a sensor not read yet.

    The age of a reading is `inputs.t_s` less its time: the delay of the sensor and the time since.
    """

    magnetometer_s: float = 0.0
    search_coil_s: float = 0.0
    gyro_s: float = 0.0
    sun_sensors_s: float = 0.0
    attitude_sensor_s: float = 0.0
    tachometers_s: float = 0.0
    horizon_sensor_s: float = 0.0
    sun_cells_s: float = 0.0


#: Sensors by the names that users give them, in the order of `ReadingTimes`.
SENSORS = tuple(name.removesuffix("_s") for name in ReadingTimes._fields)
#: Their numbers, everywhere on board and in the loop.
(
    MAGNETOMETER,
    SEARCH_COIL,
    GYRO,
    SUN_SENSORS,
    ATTITUDE_SENSOR,
    TACHOMETERS,
    HORIZON_SENSOR,
    SUN_CELLS,
) = range(len(SENSORS))
#: Sensors in the names of `KNOWN` and of results.
SHORT_NAMES = ("b", "b_rate", "omega", "sun", "q", "wheels", "nadir", "cells")
#: No sensor that an estimator judges to be wrong.
NONE_ISOLATED = (0.0,) * len(SENSORS)


class Estimate(NamedTuple):
    """What the estimator believes at `t_s`; NaN where it is unknown.

    `q_body_to_inertial`, `omega_body_rad_s` (absolute rate), `gyro_bias_rad_s`; `sigma_rad`:
    standard deviation of the attitude about each axis; `sigma_rad_s`: of the rate. `isolated`: 1
    for each sensor whose readings the estimator judges to be wrong, else 0; in the order of
    `ReadingTimes`.
    """

    t_s: float = -math.inf
    q_body_to_inertial: tuple = _NO_ATTITUDE
    omega_body_rad_s: tuple = _UNKNOWN
    gyro_bias_rad_s: tuple = _ZERO
    sigma_rad: float = math.nan
    sigma_rad_s: float = math.nan
    isolated: tuple = NONE_ISOLATED


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


class Inputs(NamedTuple):
    """All that the on-board computer knows at a control step.

    The latest readings, in body axes: `b_body_t` of the magnetometer, `b_rate_body_t_s` of a search
    coil (the field's rate of change as the body sees it), `omega_body_rad_s` of the gyro,
    `sun_body` of the Sun sensors (unit vector, zeros where none sees the Sun), `q_body_to_inertial`
    of the attitude sensor (a star tracker; NaN while it is blinded), `nadir_body` of a horizon
    sensor (unit vector to the Earth's centre, zeros where it does not see the Earth), `sun_cells`:
    signals of single cells in parts of full sunlight,
    `wheel_momentum_body_n_m_s`: vector sum of the wheels' momenta relative to the body, by their
    tachometers (a fixed momentum of the body is not in it). `read_at`: when they were taken.
    `coil_dipole_body_a_m2`: mean dipole of the coils since the control step before, as the computer
    believes: its command within their limits, followed with their lag; neither residual dipole nor
    a wrong polarity is in it. Laws of attitude and rate use `estimate`, which is what attitude
    sensor and gyro read where no estimator is chosen.
    """

    t_s: float
    b_body_t: tuple
    b_rate_body_t_s: tuple
    omega_body_rad_s: tuple
    sun_body: tuple
    q_body_to_inertial: tuple
    wheel_momentum_body_n_m_s: tuple
    coil_dipole_body_a_m2: tuple
    nadir_body: tuple
    sun_cells: tuple
    read_at: ReadingTimes
    estimate: Estimate
    ephemeris: Ephemeris


class Command(NamedTuple):
    """What a law asks for, in body axes: dipole of the coils, torque on the body by the wheels."""

    dipole_a_m2: tuple = _ZERO
    torque_n_m: tuple = _ZERO


NO_COMMAND = Command()
UNKNOWN_ESTIMATE = Estimate()


def _xyz(*names: str) -> list[str]:
    return [f"{name}_{c}" for name in names for c in "xyz"]


#: The inputs as a record that the loop holds: what has not changed is not written again.
KNOWN = np.dtype(
    [
        (name, np.float64)
        for name in (
            "t_s",
            *_xyz("b", "b_rate", "omega", "sun"),
            *("q_x", "q_y", "q_z", "q_w"),
            *_xyz("wheels", "coils", "nadir"),
            *(f"cells_{k}" for k in range(CELLS)),
            *(f"{sensor}_s" for sensor in SHORT_NAMES),
            *("estimate_s", "estimate_q_x", "estimate_q_y", "estimate_q_z", "estimate_q_w"),
            *_xyz("estimate_omega", "estimate_bias"),
            *("sigma_rad", "sigma_rad_s"),
            *(f"isolated_{sensor}" for sensor in SHORT_NAMES),
            *_xyz("position", "velocity", "model_b", "model_b_rate", "to_sun"),
            "sunlit_fraction",
        )
    ]
)


def nothing_known() -> np.ndarray:
    """The record before the first reading: zeros, read infinitely long ago; nothing estimated."""
    known = np.zeros(1, KNOWN)
    for name in KNOWN.names:
        if name.endswith("_s") and name not in ("t_s", "sigma_rad_s"):
            known[name] = -np.inf
        elif KNOWN.names.index(name) > KNOWN.names.index("estimate_s"):
            known[name] = np.nan
    for name in KNOWN.names:
        if name.startswith(("estimate_bias_", "isolated_")):
            known[name] = 0.0
    return known


@inlined
def read_estimate(k):
    """The estimate in the record."""
    return Estimate(
        k.estimate_s,
        (k.estimate_q_x, k.estimate_q_y, k.estimate_q_z, k.estimate_q_w),
        (k.estimate_omega_x, k.estimate_omega_y, k.estimate_omega_z),
        (k.estimate_bias_x, k.estimate_bias_y, k.estimate_bias_z),
        k.sigma_rad,
        k.sigma_rad_s,
        read_isolated(k),
    )


@inlined
def read_isolated(k):
    """Which sensors the estimate in the record does not use."""
    return (
        k.isolated_b,
        k.isolated_b_rate,
        k.isolated_omega,
        k.isolated_sun,
        k.isolated_q,
        k.isolated_wheels,
        k.isolated_nadir,
        k.isolated_cells,
    )


@inlined
def put_estimate(k, e):
    """Write an estimate into the record."""
    k.estimate_s, k.sigma_rad, k.sigma_rad_s = e.t_s, e.sigma_rad, e.sigma_rad_s
    k.estimate_q_x, k.estimate_q_y, k.estimate_q_z, k.estimate_q_w = e.q_body_to_inertial
    k.estimate_omega_x, k.estimate_omega_y, k.estimate_omega_z = e.omega_body_rad_s
    k.estimate_bias_x, k.estimate_bias_y, k.estimate_bias_z = e.gyro_bias_rad_s
    k.isolated_b, k.isolated_b_rate, k.isolated_omega = e.isolated[0], e.isolated[1], e.isolated[2]
    k.isolated_sun, k.isolated_q, k.isolated_wheels = e.isolated[3], e.isolated[4], e.isolated[5]
    k.isolated_nadir, k.isolated_cells = e.isolated[6], e.isolated[7]


@inlined
def put_ephemeris(k, e):
    """Write an ephemeris into the record."""
    k.position_x, k.position_y, k.position_z = e.r_inertial_m
    k.velocity_x, k.velocity_y, k.velocity_z = e.v_inertial_m_s
    k.model_b_x, k.model_b_y, k.model_b_z = e.b_inertial_t
    k.model_b_rate_x, k.model_b_rate_y, k.model_b_rate_z = e.b_rate_inertial_t_s
    k.to_sun_x, k.to_sun_y, k.to_sun_z = e.sun_inertial
    k.sunlit_fraction = e.sunlit_fraction


@inlined
def read_inputs(k):
    """The record as inputs; what a function does not use is not read."""
    return Inputs(
        k.t_s,
        (k.b_x, k.b_y, k.b_z),
        (k.b_rate_x, k.b_rate_y, k.b_rate_z),
        (k.omega_x, k.omega_y, k.omega_z),
        (k.sun_x, k.sun_y, k.sun_z),
        (k.q_x, k.q_y, k.q_z, k.q_w),
        (k.wheels_x, k.wheels_y, k.wheels_z),
        (k.coils_x, k.coils_y, k.coils_z),
        (k.nadir_x, k.nadir_y, k.nadir_z),
        (k.cells_0, k.cells_1, k.cells_2, k.cells_3, k.cells_4, k.cells_5),
        ReadingTimes(
            k.b_s, k.b_rate_s, k.omega_s, k.sun_s, k.q_s, k.wheels_s, k.nadir_s, k.cells_s
        ),
        read_estimate(k),
        Ephemeris(
            (k.position_x, k.position_y, k.position_z),
            (k.velocity_x, k.velocity_y, k.velocity_z),
            (k.model_b_x, k.model_b_y, k.model_b_z),
            (k.model_b_rate_x, k.model_b_rate_y, k.model_b_rate_z),
            (k.to_sun_x, k.to_sun_y, k.to_sun_z),
            k.sunlit_fraction,
        ),
    )
