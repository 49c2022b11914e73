"""Covariance of a filter along a nominal motion, by the kernels of the filters themselves.

For the analysis of expected accuracy (`torquer.analysis.linear_covariance`): the innovations are
zero, so that nothing but the covariance changes.
"""

from typing import NamedTuple

import numpy as np

from torquer.engine import kernel
from torquer.estimation.covariance import (
    biased_measurement,
    direction_measurement,
    mat_scale,
    update,
)
from torquer.estimation.kalman_dynamics import (
    Surroundings,
    full,
    linearised,
    propagate_covariance as propagate_dynamics,
)
from torquer.estimation.kalman_gyro import propagate_covariance as propagate_gyro
from torquer.geometry.frames import mat_mul
from torquer.geometry.quaternion import rotate_inverse
from torquer.geometry.vec3 import add, scale

_NO_DIPOLE = (0.0, 0.0, 0.0)


class Nominal(NamedTuple):
    """What a filter would see along a motion, a row at each control step.

    Time [s]; attitude, rate [rad/s]; wheels' momentum [N m s, body]; field [T], radius vector of
    `gravity_gradient_at`, direction to the Sun, all inertial; whether a Sun sensor sees it.
    """

    t_s: np.ndarray
    q: np.ndarray
    omega: np.ndarray
    wheels: np.ndarray
    b: np.ndarray
    gravity: np.ndarray
    sun: np.ndarray
    seen: np.ndarray


@kernel
def row3(a, k):
    """A row of an array as a vector."""
    return (a[k, 0], a[k, 1], a[k, 2])


@kernel
def row4(a, k):
    """A row of an array as a quaternion."""
    return (a[k, 0], a[k, 1], a[k, 2], a[k, 3])


@kernel
def take_readings(sensing, along, k, p, gain, correction):
    """Update a covariance by what sensors would read at a place of the motion."""
    q = row4(along.q, k)
    if sensing.magnetometer != 0.0:
        b = rotate_inverse(q, row3(along.b, k))
        if sensing.bias_at > 0.0:
            m = biased_measurement(b, b, (0.0, 0.0, 0.0), int(sensing.bias_at), sensing.r_field)
            update(p, gain, correction, m, 1.0)
        else:
            update(p, gain, correction, direction_measurement(b, b, sensing.r_field), 1.0)
    if sensing.sun != 0.0 and along.seen[k]:
        s = rotate_inverse(q, row3(along.sun, k))
        update(p, gain, correction, direction_measurement(s, s, sensing.r_sun), 1.0)


@kernel
def fill_gyro(parameters, along, gain, correction, out):
    """Covariance after each control step, of a filter with a gyro; `out[0]`: at the start."""
    n = correction.shape[0]
    take_readings(parameters.sensing, along, 0, out[0], gain, correction)
    for k in range(1, out.shape[0]):
        out[k], dt = out[k - 1], along.t_s[k] - along.t_s[k - 1]
        turn = scale(dt, row3(along.omega, k - 1))
        propagate_gyro(out[k], n, turn, dt, parameters.white, parameters.walk)
        take_readings(parameters.sensing, along, k, out[k], gain, correction)


@kernel
def fill_dynamics(parameters, along, gain, correction, out):
    """The same of a filter without a gyro."""
    n, inverse = correction.shape[0], full(parameters.inverse)
    noise = mat_scale(parameters.torque, mat_mul(inverse, inverse))
    take_readings(parameters.sensing, along, 0, out[0], gain, correction)
    for k in range(1, out.shape[0]):
        out[k], dt = out[k - 1], along.t_s[k] - along.t_s[k - 1]
        around = Surroundings(row3(along.gravity, k - 1), row3(along.b, k - 1))
        q, omega = row4(along.q, k - 1), row3(along.omega, k - 1)
        wheels = add(parameters.fixed, row3(along.wheels, k - 1))
        linear = linearised(parameters, q, omega, wheels, around, _NO_DIPOLE, dt)
        propagate_dynamics(out[k], n, linear, noise, parameters.dipole_at, dt)
        take_readings(parameters.sensing, along, k, out[k], gain, correction)
