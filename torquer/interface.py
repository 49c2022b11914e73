"""What the on-board computer knows and what it answers: the interface of estimators, modes, laws.

A plug-in is a function of `Inputs`, its parameters and its memory. It never sees the truth: the
sensors' readings have errors, times and delays, the ephemeris is the computer's own.
"""

import math
from typing import NamedTuple

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


class Estimate(NamedTuple):
    """What the estimator believes at `t_s`; not numbers where it does not know.

    `q_body_to_inertial`, `omega_body_rad_s` (absolute rate), `gyro_bias_rad_s`; `sigma_rad`:
    standard deviation of the attitude about each axis; `sigma_rad_s`: of the rate.
    """

    t_s: float = -math.inf
    q_body_to_inertial: tuple = _NO_ATTITUDE
    omega_body_rad_s: tuple = _UNKNOWN
    gyro_bias_rad_s: tuple = _ZERO
    sigma_rad: float = math.nan
    sigma_rad_s: float = math.nan


class Ephemeris(NamedTuple):
    """Where the computer believes to be, and what its models say of that place; inertial frame.

    Position, velocity, field and its rate of change along the orbit, unit vector to the Sun from
    the satellite, visible part of the Sun's disc (0 in the umbra). Not numbers unless a plug-in
    says that it `needs` the ephemeris.
    """

    r_inertial_m: tuple = _UNKNOWN
    v_inertial_m_s: tuple = _UNKNOWN
    b_inertial_t: tuple = _UNKNOWN
    b_rate_inertial_t_s: tuple = _UNKNOWN
    sun_inertial: tuple = _UNKNOWN
    lit: float = math.nan


class Inputs(NamedTuple):
    """All that the on-board computer knows at a control step.

    The latest readings, in body axes: `b_body_t` of the magnetometer, `b_rate_body_t_s` of a search
    coil (the field's rate of change as the body sees it), `omega_body_rad_s` of the gyro,
    `sun_body` of the Sun sensors (unit vector, zeros where none sees the Sun), `q_body_to_inertial`
    of the attitude sensor (a star tracker), `wheel_momentum_body_n_m_s`: vector sum of the wheels'
    momenta relative to the body, by their tachometers (a fixed momentum of the body is not in it).
    `read_at`: when they were taken. Laws of attitude and rate use `estimate`, which is what
    attitude sensor and gyro read where no estimator is chosen.
    """

    t_s: float
    b_body_t: tuple
    b_rate_body_t_s: tuple
    omega_body_rad_s: tuple
    sun_body: tuple
    q_body_to_inertial: tuple
    wheel_momentum_body_n_m_s: tuple
    read_at: ReadingTimes
    estimate: Estimate
    ephemeris: Ephemeris


class Command(NamedTuple):
    """What a law asks for, in body axes: dipole of the coils, torque on the body by the wheels."""

    dipole_a_m2: tuple = _ZERO
    torque_n_m: tuple = _ZERO


NO_COMMAND = Command()
UNKNOWN_ESTIMATE = Estimate()
UNKNOWN_EPHEMERIS = Ephemeris()
