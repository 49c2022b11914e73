"""Whether a sensor fails by itself: silent, stuck, or with a reading that is not a number."""

import math

import numpy as np

from torquer.compile.engine import inlined
from torquer.computer.interface import read_six
from torquer.spacecraft.sensors.devices import DEVICES

#: Sensors that read zeros where they see nothing; NaN where they are blinded; the same for long.
_OF_SIGHT = tuple(k for k, device in enumerate(DEVICES) if device.nothing == "zeros")
_BLINDED = tuple(k for k, device in enumerate(DEVICES) if device.nothing == "nan")
_MAY_STAY = tuple(k for k, device in enumerate(DEVICES) if device.may_stay)
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
def four_numbers(k, sensor):
    """(Time of a sensor's latest reading, four numbers that change with it)."""
    r = read_six(k, sensor)
    return k.read_s[sensor], (r[0], r[1], r[2], r[3] + math.pi * (r[4] + math.pi * r[5]))


@inlined
def may_stay(kind, v):
    """Whether a sound sensor may send the same numbers for long: nothing seen, wheels at rest."""
    nothing = kind in _OF_SIGHT and v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0 and v[3] == 0.0
    return nothing or kind in _MAY_STAY


@inlined
def is_number(kind, v):
    """Whether a reading is one of finite numbers, or means that the sensor is blinded."""
    is_blinded = kind in _BLINDED and math.isnan(v[0])
    return is_blinded or math.isfinite(v[0] + v[1] + v[2] + v[3])


@inlined
def fails_by_itself(now, sensor, kind, k, first_s, oldest_s):
    """Whether a sensor is silent, stuck, or reads what is not a number.

    `kind`: number of its kind; `oldest_s`: how old its readings become by the timetable.
    """
    read_s, v = four_numbers(k, sensor)
    now.is_read = now.is_new = 0.0
    if read_s > now.read_s:
        same = v[0] == now.x and v[1] == now.y and v[2] == now.z and v[3] == now.w
        now.is_read, now.is_new = 1.0, 0.0 if same else 1.0
        now.same_since_s = now.same_since_s if same and not may_stay(kind, v) else read_s
        now.interval_s = read_s - now.read_s if now.read_s > -math.inf else 0.0
        now.read_s = read_s
        now.x, now.y, now.z, now.w = v
    silent_s = k.t_s - max(now.read_s, first_s)
    is_silent = silent_s > max(_SILENT_S, _TIMES * oldest_s)
    is_stuck = now.read_s - now.same_since_s > _SAME_S
    return is_silent or is_stuck or not is_number(kind, v)
