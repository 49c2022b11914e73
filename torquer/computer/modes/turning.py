"""How fast the satellite turns, by whatever still turns with it: gyro, field or Sun.

A wrong sign, swapped axes and a bias change where a reading points, hardly how fast it turns. So
nobody needs to know which sensor is right: the fastest of the three counts. What is silent, stuck
or not a number does not turn; noise, which turns to and fro, has no mean.
"""

import math

import numpy as np

from torquer.compile.engine import inlined
from torquer.computer.interface import GYRO, MAGNETOMETER, SUN_SENSORS
from torquer.maths.geometry.vec3 import dot, put_row, turn_between, unit

#: Time [s] over which a turn is averaged, the least for which it must have been seen, longest
#: interval of two readings, and age at which it is not known any more.
_AVERAGED_S, _LEAST_S, _LONGEST_S, _OLDEST_S = 30.0, 15.0, 10.0, 120.0
#: A mean below this part of the root mean square is hidden by noise.
_HIDDEN = 0.3
_NOTHING = (0.0, 0.0, 0.0)
#: Cells of a sensor: time of its reading; time averaged over; direction read, zeros if none; mean
#: of the turn [rad/s]; mean of its square.
_READ, _SPAN, _DIRECTION, _MEAN, _SQUARE = 0, 1, 2, 5, 8
#: The sensors by their places in `turning`.
_BY_GYRO, _BY_FIELD, _BY_SUN = range(3)
TURNING_NOW = [("turning", np.float64, (3, 9))]


def first_turning(checks: np.ndarray) -> None:
    """Nothing read yet."""
    checks["turning"][..., _READ] = -math.inf


@inlined
def forget_turn(row):
    """The turn by a sensor is not known."""
    row[_SPAN] = 0.0
    put_row(row[_DIRECTION:_MEAN], _NOTHING)


@inlined
def average_turn(row, turn, interval_s):
    """Take a turn [rad/s], seen for an interval, into the mean."""
    row[_SPAN] = min(row[_SPAN] + interval_s, _AVERAGED_S)
    part = min(interval_s / row[_SPAN], 1.0)
    for i in range(3):
        row[_MEAN + i] += part * (turn[i] - row[_MEAN + i])
    row[_SQUARE] += part * (dot(turn, turn) - row[_SQUARE])


@inlined
def next_interval(row, read_s):
    """Interval [s] since the reading before, 0 if it is too long to count; this one is taken."""
    interval_s = read_s - row[_READ]
    row[_READ] = read_s
    if interval_s > _OLDEST_S:
        forget_turn(row)
    return interval_s if interval_s <= _LONGEST_S else 0.0


@inlined
def follow_rate(row, read_s, omega):
    """Take a reading of the gyro."""
    interval_s = next_interval(row, read_s)
    if interval_s > 0.0 and dot(omega, omega) < math.inf:
        average_turn(row, omega, interval_s)


@inlined
def follow_direction(row, read_s, v):
    """Take a reading of a direction; one of nothing leaves what is known to grow old."""
    if not 0.0 < dot(v, v) < math.inf:
        put_row(row[_DIRECTION:_MEAN], _NOTHING)
        return
    interval_s, after = next_interval(row, read_s), unit(v)
    before = (row[_DIRECTION], row[_DIRECTION + 1], row[_DIRECTION + 2])
    if interval_s > 0.0 and dot(before, before) > 0.0:
        average_turn(row, turn_between(before, after, interval_s), interval_s)
    put_row(row[_DIRECTION:_MEAN], after)


@inlined
def follow_turning(now, sensors, inputs):
    """Take the new readings of all three."""
    gyro, field, sun = now.turning[_BY_GYRO], now.turning[_BY_FIELD], now.turning[_BY_SUN]
    if sensors[GYRO].failed_s == inputs.t_s:
        forget_turn(gyro)
    elif sensors[GYRO].is_read == 1.0:
        follow_rate(gyro, sensors[GYRO].read_s, inputs.omega_body_rad_s)
    if sensors[MAGNETOMETER].failed_s == inputs.t_s:
        forget_turn(field)
    elif sensors[MAGNETOMETER].is_read == 1.0:
        follow_direction(field, sensors[MAGNETOMETER].read_s, inputs.b_body_t)
    if sensors[SUN_SENSORS].failed_s == inputs.t_s:
        forget_turn(sun)
    elif sensors[SUN_SENSORS].is_read == 1.0:
        follow_direction(sun, sensors[SUN_SENSORS].read_s, inputs.sun_body)


@inlined
def turn_rate(row, t_s):
    """Rate [rad/s] by a sensor, 0 if noise hides it; below zero while it is not known."""
    if row[_SPAN] < _LEAST_S or not t_s - row[_READ] <= _OLDEST_S:
        return -1.0
    mean = (row[_MEAN], row[_MEAN + 1], row[_MEAN + 2])
    square = dot(mean, mean)
    return math.sqrt(square) if square > _HIDDEN * _HIDDEN * row[_SQUARE] else 0.0


@inlined
def fastest_turn(now, t_s):
    """Greatest rate [rad/s] that gyro, field or Sun show; not a number if none is known."""
    fastest = -1.0
    for sensor in range(3):
        fastest = max(fastest, turn_rate(now.turning[sensor], t_s))
    return fastest if fastest >= 0.0 else math.nan
