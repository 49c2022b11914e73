"""Covariance of a filter along a nominal motion, by the kernels of the filters themselves.

For the analysis of expected accuracy (`torquer.analysis.linear_covariance`): the innovations are
zero, so that nothing but the covariance changes.
"""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel, plugged
from torquer.estimation import kalman_dynamics, kalman_gyro
from torquer.estimation.covariance import slices_of, update
from torquer.estimation.kalman_dynamics import Surroundings, full, linearised
from torquer.estimation.measurements.magnetometer import of_field
from torquer.estimation.measurements.measurement import direction_measurement
from torquer.estimation.triad import quaternion_of
from torquer.geometry.quaternion import rotate_inverse
from torquer.geometry.vec3 import add, scale, vector_of
from torquer.spacecraft.sun_sensor import sensor_that_sees

_ZERO = (0.0, 0.0, 0.0)


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
def keep_seen(sensors, sun_body, seen):
    """Clear `seen` (k,) where no sensor sees the Sun, in direction `sun_body` (k, 3)."""
    for k in range(seen.shape[0]):
        seen[k] = seen[k] and sensor_that_sees(sensors, vector_of(sun_body[k])) >= 0


@inlined
def take_readings(parameters, along, k, p, gain, correction):
    """Update a covariance by what sensors would read at a place of the motion."""
    q, sensing = quaternion_of(along.q[k]), parameters.sensing
    if sensing.r_field > 0.0:
        b, at = vector_of(along.b[k]), slices_of(parameters.prior).magnetometer_bias
        m = of_field(q, b, rotate_inverse(q, b), at, sensing.r_field)
        update(p, gain, correction, m, 1.0)
    if sensing.r_sun > 0.0 and along.seen[k]:
        s = vector_of(along.sun[k])
        m = direction_measurement(q, s, rotate_inverse(q, s), sensing.r_sun)
        update(p, gain, correction, m, 1.0)


@plugged
def fill(parameters, along, out, propagate):
    """Covariance (k, n, n) after each control step from `out[0]`, that before the first readings.

    `propagate(parameters, along, k, dt, p)` takes a covariance from step k to the next one.
    """
    gain, correction = np.zeros((3, out.shape[1])), np.zeros(out.shape[1])
    take_readings(parameters, along, 0, out[0], gain, correction)
    for k in range(1, out.shape[0]):
        out[k] = out[k - 1]
        propagate(parameters, along, k - 1, along.t_s[k] - along.t_s[k - 1], out[k])
        take_readings(parameters, along, k, out[k], gain, correction)


@inlined
def _by_gyro(parameters, along, k, dt, p):
    turn = scale(dt, vector_of(along.omega[k]))
    kalman_gyro.propagate_covariance(p, turn, dt, parameters.white, parameters.walk)


@inlined
def _by_dynamics(parameters, along, k, dt, p):
    around = Surroundings(vector_of(along.gravity[k]), vector_of(along.b[k]))
    q, omega = quaternion_of(along.q[k]), vector_of(along.omega[k])
    wheels = add(parameters.fixed, vector_of(along.wheels[k]))
    linear = linearised(parameters, q, omega, wheels, around, _ZERO, dt)
    dipole, inverse = slices_of(parameters.prior).residual_dipole, full(parameters.inverse)
    kalman_dynamics.propagate_covariance(p, linear, parameters.torque, inverse, dipole, dt)


@kernel
def fill_gyro(parameters, along, out):
    """Covariances of a filter with a gyro; see `fill`."""
    fill(parameters, along, out, _by_gyro)


@kernel
def fill_dynamics(parameters, along, out):
    """Covariances of a filter without a gyro; see `fill`."""
    fill(parameters, along, out, _by_dynamics)
