"""What the periodic models of both stages share: field along the orbit, motion of the satellite."""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add, cross, sub

#: Parameters of the satellite (moments of inertia over J, wheel's momentum over J nu0, 1 with
#: gravity gradient) and of the field: parts along t, s and w.
SATELLITE = {"x": 1.0, "y": 0.6, "z": 1.0, "wheel": 8.0, "gravity": 1.0}
DIPOLE = {"along": 2.0 / 3.0, "up": 4.0 / 3.0, "normal": 0.0}
#: The text's 'computed field', of constant strength.
CONE = {"along": 1.0, "up": 1.0, "normal": 0.0}


class Satellite(NamedTuple):
    """Moments of inertia over J about t, w, s; momentum of the wheel over J nu0; 1 or 0."""

    x: float
    y: float
    z: float
    wheel: float
    gravity: float


@inlined
def field_at(tau, along, up, normal):
    """Field (along cos, normal, -up sin) in t, w, s; tau from the ascending magnetic node."""
    return along * math.cos(tau), normal, -up * math.sin(tau)


@inlined
def field_slope(tau, along, up):
    """Derivative of the field's components by tau."""
    return -along * math.sin(tau), 0.0, -up * math.cos(tau)


@inlined
def field_deviation(angles, error, b):
    """How the field that is read differs from the calculated one: -theta x B + error."""
    return sub(error, cross(angles, b))


@inlined
def accelerations(angles, rates, torque, s):
    """Second derivatives of roll, pitch and yaw, small, on a circular orbit."""
    x, y, z, wheel, gravity = s
    gyroscopic = wheel - (x + z - y)
    roll = gyroscopic * rates[2] - (wheel + y - z + 3.0 * gravity * (y - z)) * angles[0]
    pitch = -3.0 * gravity * (x - z) * angles[1]
    yaw = -gyroscopic * rates[0] - (wheel + y - x) * angles[2]
    roll, pitch, yaw = add((roll, pitch, yaw), torque)
    return roll / x, pitch / y, yaw / z


@inlined
def unit_at(j, first):
    """Three components, from number `first` on, of the unit vector number j."""
    x, y, z = j == first, j == first + 1, j == first + 2
    return 1.0 if x else 0.0, 1.0 if y else 0.0, 1.0 if z else 0.0


@inlined
def put_column(parts, out, j):
    """Write triples one below the other into column j."""
    for i in range(len(parts)):
        for k in range(3):
            out[3 * i + k, j] = parts[i][k]
