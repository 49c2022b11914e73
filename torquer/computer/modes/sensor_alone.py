"""Whether a sensor fails by itself: silent, stuck, or with a reading that is not a number."""

import math

import numpy as np

from torquer.compile.engine import inlined
from torquer.computer.interface import (
    ATTITUDE_SENSOR,
    GYRO,
    HORIZON_SENSOR,
    SEARCH_COIL,
    SUN_CELLS,
    SUN_SENSORS,
    TACHOMETERS,
)

#: A sensor is silent when its reading is older than this [s], or so many times as old as readings
#: become by the timetable if that is longer.
_SILENT_S, _TIMES = 30.0, 3.0
#: Time [s] after which the same numbers again are those of a stuck sensor.
_SAME_S = 30.0

#: A sensor: its last reading, when it was taken and how long after the one before; since when it
#: has sent these numbers; whether there is a reading, and whether it has other numbers, that is new
#: at this control step; when it last failed by itself, and when it was last to blame.
SENSOR_NOW = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("read_s", "interval_s", "x", "y", "z", "w", "same_since_s"),
            *("is_read", "is_new", "failed_s", "blamed_s"),
        )
    ]
)


@inlined
def latest_reading(inputs, sensor):
    """(Time of a sensor's latest reading, its numbers)."""
    at = inputs.read_at
    x, y, z = inputs.b_body_t
    t_s, w = at.magnetometer_s, 0.0
    if sensor == SEARCH_COIL:
        t_s, (x, y, z) = at.search_coil_s, inputs.b_rate_body_t_s
    elif sensor == GYRO:
        t_s, (x, y, z) = at.gyro_s, inputs.omega_body_rad_s
    elif sensor == SUN_SENSORS:
        t_s, (x, y, z) = at.sun_sensors_s, inputs.sun_body
    elif sensor == ATTITUDE_SENSOR:
        t_s, (x, y, z, w) = at.attitude_sensor_s, inputs.q_body_to_inertial
    elif sensor == TACHOMETERS:
        t_s, (x, y, z) = at.tachometers_s, inputs.wheel_momentum_body_n_m_s
    elif sensor == HORIZON_SENSOR:
        t_s, (x, y, z) = at.horizon_sensor_s, inputs.nadir_body
    elif sensor == SUN_CELLS:
        cells = inputs.sun_cells
        t_s, (x, y, z, w) = at.sun_cells_s, cells[:4]
        w += math.pi * (cells[4] + math.pi * cells[5])  # one number that changes with each
    return t_s, (x, y, z, w)


@inlined
def may_stay(sensor, v):
    """Whether a sound sensor may send the same numbers for long: nothing seen, wheels at rest."""
    of_sight = sensor in (SUN_SENSORS, HORIZON_SENSOR, SUN_CELLS)
    nothing = of_sight and v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0 and v[3] == 0.0
    return nothing or sensor in (SEARCH_COIL, TACHOMETERS)


@inlined
def is_number(sensor, v):
    """Whether a reading is one of finite numbers; NaN of an attitude sensor means it is blinded."""
    is_blinded = sensor == ATTITUDE_SENSOR and math.isnan(v[0])
    return is_blinded or math.isfinite(v[0] + v[1] + v[2] + v[3])


@inlined
def fails_by_itself(now, sensor, inputs, first_s, oldest_s):
    """Whether a sensor is silent, stuck, or reads what is not a number.

    `oldest_s`: how old its readings become by the timetable.
    """
    read_s, v = latest_reading(inputs, sensor)
    now.is_read = now.is_new = 0.0
    if read_s > now.read_s:
        same = v[0] == now.x and v[1] == now.y and v[2] == now.z and v[3] == now.w
        now.is_read, now.is_new = 1.0, 0.0 if same else 1.0
        now.same_since_s = now.same_since_s if same and not may_stay(sensor, v) else read_s
        now.interval_s = read_s - now.read_s if now.read_s > -math.inf else 0.0
        now.read_s = read_s
        now.x, now.y, now.z, now.w = v
    silent_s = inputs.t_s - max(now.read_s, first_s)
    is_silent = silent_s > max(_SILENT_S, _TIMES * oldest_s)
    is_stuck = now.read_s - now.same_since_s > _SAME_S
    return is_silent or is_stuck or not is_number(sensor, v)
