"""Equations of a gyrostat, free or under the gravity of a circular orbit, for other packages.

The same lines serve numbers (SciPy) and symbols (heyoka).
"""

import math
from typing import NamedTuple

from precision_tasks import Task


class Gyrostat(NamedTuple):
    """Moments of inertia [kg m^2], momentum of the wheel [N m s]; orbital rate [rad/s], 0 where
    nothing turns the body, and inclination [rad].
    """

    inertia: tuple
    wheel: tuple
    orbital_rate: float
    inclination: float


def gyrostat_of(task: Task) -> Gyrostat | None:
    """The task as a gyrostat; None where coils or wheels make events."""
    if {"coils", "wheels"} & set(task.data["spacecraft"]):
        return None
    orbit = task.scenario(task.references[0]).orbit
    n = orbit.rate_rad_s() if task.data["environment"]["gravity_gradient"] else 0.0
    inclination = math.radians(orbit.inclination_deg)
    return Gyrostat(tuple(task.inertia.tolist()), tuple(task.wheel.tolist()), n, inclination)


def rates(body: Gyrostat, cos, sin, t, state) -> list:
    """Rates of quaternion (body to inertial, scalar last) and rate, after `cos` and `sin`."""
    *q, p, q_, r = state
    x, y, z, s = q
    j, h = body.inertia, body.wheel
    a, b, c = j[0] * p + h[0], j[1] * q_ + h[1], j[2] * r + h[2]
    torque = [b * r - c * q_, c * p - a * r, a * q_ - b * p]
    if body.orbital_rate:
        pull = gravity(body, cos, sin, t, q)
        torque = [torque[k] + pull[k] for k in range(3)]
    return [
        0.5 * (s * p + y * r - z * q_),
        0.5 * (s * q_ + z * p - x * r),
        0.5 * (s * r + x * q_ - y * p),
        -0.5 * (x * p + y * q_ + z * r),
        torque[0] / j[0],
        torque[1] / j[1],
        torque[2] / j[2],
    ]


def gravity(body: Gyrostat, cos, sin, t, q) -> tuple:
    """Torque 3 n^2 e x J e: e, the unit radius vector, is along the inertial x at the start."""
    n, i, j = body.orbital_rate, body.inclination, body.inertia
    c, s_in = cos(n * t), sin(n * t)
    e = (c, math.cos(i) * s_in, math.sin(i) * s_in)
    x, y, z, s = q
    u = (2.0 * (y * e[2] - z * e[1]), 2.0 * (z * e[0] - x * e[2]), 2.0 * (x * e[1] - y * e[0]))
    f = e[0] - s * u[0] + y * u[2] - z * u[1]
    g = e[1] - s * u[1] + z * u[0] - x * u[2]
    h = e[2] - s * u[2] + x * u[1] - y * u[0]
    k = 3.0 * n * n
    return k * (j[2] - j[1]) * g * h, k * (j[0] - j[2]) * h * f, k * (j[1] - j[0]) * f * g
