"""What the on-board computer knows at a control step, with a field for each device.

Made of the table of devices by `docs/made_code.py`: do not edit.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.interface import Ephemeris, Estimate


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
    integrating_gyro_s: float = 0.0
    fine_sun_sensor_s: float = 0.0
    own_sensor_s: float = 0.0


#: Several devices of a kind where there are none.
NO_UNITS = ((-math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),) * 12


class Inputs(NamedTuple):
    """All that the on-board computer knows at a control step.

    Readings [unit], in the frame named:

    `b_body_t`: last magnetometer reading [T], body.
    `b_rate_body_t_s`: last reading of the search coil [T/s], body.
    `omega_body_rad_s`: last gyro reading [rad/s], body.
    `sun_body`: last reading of the Sun sensors, a unit vector; zeros where the Sun is not seen [1],
    body.
    `q_body_to_inertial`: last reading of the attitude sensor [1], body to J.
    `wheel_momentum_body_n_m_s`: sum of the wheels' momenta by the last readings of their
    tachometers [N m s], body.
    `nadir_body`: last reading of the horizon sensor, a unit vector; zeros where the Earth is not
    seen [1], body.
    `sun_cells`: last signals of the Sun cells, in parts of full sunlight; zeros for cells that are
    not there [1].
    `angle_body_rad`: last reading of the integrating gyro: angles accumulated since the start
    [rad], body.
    `sun_tangents`: last reading of the fine Sun sensor: two tangents in the frame of its head, 1
    where it sees the Sun; zeros where it does not [1], head.
    `own_reading`: last reading of the sensor of the user's own [1], body.

    `read_at`: when they were taken. `coil_dipole_body_a_m2`: mean dipole of the coils since the
    control step before, as the computer believes: its command within their limits, followed with
    their lag; neither residual dipole nor a wrong polarity is in it. Laws of attitude and rate use
    `estimate`, which is what attitude sensor and gyro read where no estimator is chosen.

    `units`: of several devices of a kind each by its number on board, less that of the first one:
    when it was read, and 6 numbers of its reading. `gyro_units`: which of several gyros
    the rate is of, a bit for each; 0 where there is only one.

        >>> flight = torquer.Flight(scenario)
        >>> inputs = flight.read()  # what a law is called with
        >>> inputs.t_s, len(inputs.b_body_t)
        (0.0, 3)
    """

    t_s: float
    b_body_t: tuple = (0.0, 0.0, 0.0)
    b_rate_body_t_s: tuple = (0.0, 0.0, 0.0)
    omega_body_rad_s: tuple = (0.0, 0.0, 0.0)
    sun_body: tuple = (0.0, 0.0, 0.0)
    q_body_to_inertial: tuple = (0.0, 0.0, 0.0, 0.0)
    wheel_momentum_body_n_m_s: tuple = (0.0, 0.0, 0.0)
    nadir_body: tuple = (0.0, 0.0, 0.0)
    sun_cells: tuple = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    angle_body_rad: tuple = (0.0, 0.0, 0.0)
    sun_tangents: tuple = (0.0, 0.0, 0.0)
    own_reading: tuple = (0.0, 0.0, 0.0)
    coil_dipole_body_a_m2: tuple = (0.0, 0.0, 0.0)
    read_at: ReadingTimes = ReadingTimes()
    estimate: Estimate = Estimate()
    ephemeris: Ephemeris = Ephemeris()
    units: tuple = NO_UNITS
    gyro_units: float = 0.0


@inlined
def flags(v):
    """As many numbers as there are sensors, as floats."""
    return (
        float(v[0]),  # magnetometer
        float(v[1]),  # search_coil
        float(v[2]),  # gyro
        float(v[3]),  # sun_sensors
        float(v[4]),  # attitude_sensor
        float(v[5]),  # tachometers
        float(v[6]),  # horizon_sensor
        float(v[7]),  # sun_cells
        float(v[8]),  # integrating_gyro
        float(v[9]),  # fine_sun_sensor
        float(v[10]),  # own_sensor
    )


@inlined
def unit_flags(v, first):
    """As many numbers, from a place on, as there may be units of several devices, as floats."""
    return (
        float(v[first + 0]),
        float(v[first + 1]),
        float(v[first + 2]),
        float(v[first + 3]),
        float(v[first + 4]),
        float(v[first + 5]),
        float(v[first + 6]),
        float(v[first + 7]),
        float(v[first + 8]),
        float(v[first + 9]),
        float(v[first + 10]),
        float(v[first + 11]),
    )


@inlined
def read_times(k):
    """When the latest readings in the record were taken."""
    return ReadingTimes(
        k.read_s[0],
        k.read_s[1],
        k.read_s[2],
        k.read_s[3],
        k.read_s[4],
        k.read_s[5],
        k.read_s[6],
        k.read_s[7],
        k.read_s[8],
        k.read_s[9],
        k.read_s[10],
    )


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
        flags(k.isolated),
        unit_flags(k.isolated, 11),
    )


@inlined
def read_ephemeris(k):
    """The ephemeris in the record."""
    return Ephemeris(
        (k.position_x, k.position_y, k.position_z),
        (k.velocity_x, k.velocity_y, k.velocity_z),
        (k.model_b_x, k.model_b_y, k.model_b_z),
        (k.model_b_rate_x, k.model_b_rate_y, k.model_b_rate_z),
        (k.to_sun_x, k.to_sun_y, k.to_sun_z),
        k.sunlit_fraction,
    )


@inlined
def read_units(k):
    """The latest readings of several devices of a kind."""
    r, t = k.readings, k.read_s
    return (
        (t[11], r[11, 0], r[11, 1], r[11, 2], r[11, 3], r[11, 4], r[11, 5]),
        (t[12], r[12, 0], r[12, 1], r[12, 2], r[12, 3], r[12, 4], r[12, 5]),
        (t[13], r[13, 0], r[13, 1], r[13, 2], r[13, 3], r[13, 4], r[13, 5]),
        (t[14], r[14, 0], r[14, 1], r[14, 2], r[14, 3], r[14, 4], r[14, 5]),
        (t[15], r[15, 0], r[15, 1], r[15, 2], r[15, 3], r[15, 4], r[15, 5]),
        (t[16], r[16, 0], r[16, 1], r[16, 2], r[16, 3], r[16, 4], r[16, 5]),
        (t[17], r[17, 0], r[17, 1], r[17, 2], r[17, 3], r[17, 4], r[17, 5]),
        (t[18], r[18, 0], r[18, 1], r[18, 2], r[18, 3], r[18, 4], r[18, 5]),
        (t[19], r[19, 0], r[19, 1], r[19, 2], r[19, 3], r[19, 4], r[19, 5]),
        (t[20], r[20, 0], r[20, 1], r[20, 2], r[20, 3], r[20, 4], r[20, 5]),
        (t[21], r[21, 0], r[21, 1], r[21, 2], r[21, 3], r[21, 4], r[21, 5]),
        (t[22], r[22, 0], r[22, 1], r[22, 2], r[22, 3], r[22, 4], r[22, 5]),
    )


@inlined
def read_inputs(k):
    """The record as inputs; what a function does not use is not read."""
    r = k.readings
    return Inputs(
        k.t_s,
        (r[0, 0], r[0, 1], r[0, 2]),
        (r[1, 0], r[1, 1], r[1, 2]),
        (r[2, 0], r[2, 1], r[2, 2]),
        (r[3, 0], r[3, 1], r[3, 2]),
        (r[4, 0], r[4, 1], r[4, 2], r[4, 3]),
        (r[5, 0], r[5, 1], r[5, 2]),
        (r[6, 0], r[6, 1], r[6, 2]),
        (r[7, 0], r[7, 1], r[7, 2], r[7, 3], r[7, 4], r[7, 5]),
        (r[8, 0], r[8, 1], r[8, 2]),
        (r[9, 0], r[9, 1], r[9, 2]),
        (r[10, 0], r[10, 1], r[10, 2]),
        (k.coils_x, k.coils_y, k.coils_z),
        read_times(k),
        read_estimate(k),
        read_ephemeris(k),
        read_units(k),
        k.gyro_units,
    )


@inlined
def ideal_inputs(
    b_body_t,
    b_rate_body_t_s,
    omega_body_rad_s,
    sun_body,
    q_body_to_inertial,
    t_s,
    estimate,
    ephemeris,
):
    """What a computer knows whose devices have just read this, and nothing of all others."""
    return Inputs(
        t_s,
        b_body_t,
        b_rate_body_t_s,
        omega_body_rad_s,
        sun_body,
        q_body_to_inertial,
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        ReadingTimes(t_s, t_s, t_s, t_s, t_s, t_s, t_s, t_s, t_s, t_s, t_s),
        estimate,
        ephemeris,
        NO_UNITS,
        0.0,
    )
