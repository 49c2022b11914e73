"""Covariance of a filter along a nominal motion, by the kernels of the filters themselves.

For the analysis of expected accuracy (`linear_covariance`): the innovations are
zero, so that nothing but the covariance changes.
"""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import called, inlined, kernel, plugged
from torquer.computer.estimation import kalman_dynamics, kalman_gyro
from torquer.computer.estimation.channels import expect
from torquer.computer.estimation.covariance import state_slices, update
from torquer.computer.estimation.kalman_dynamics import ModelEnvironment, full, linearise
from torquer.computer.estimation.measurements.measurement import estimated_rows
from torquer.environment.albedo import earthlight
from torquer.maths.geometry.quaternion import read_quaternion
from torquer.maths.geometry.vec3 import add, put_matrix, read_vector, scale

_ZERO = (0.0, 0.0, 0.0)


class Nominal(NamedTuple):
    """What a filter would see along a motion, a row at each control step.

    Time [s]; attitude, rate [rad/s]; wheels' momentum [N m s, body]; field [T], radius vector of
    `gravity_gradient_at`, direction to the Sun, all inertial; whether each device reads anything
    (devices, k); visible part of the Sun, light of the Earth on a cell (inertial).
    """

    t_s: np.ndarray
    q: np.ndarray
    omega: np.ndarray
    wheels: np.ndarray
    b: np.ndarray
    gravity: np.ndarray
    sun: np.ndarray
    visible: np.ndarray
    sunlit: np.ndarray
    earthlight: np.ndarray


@kernel
def put_earthlight(albedo, r, sun, out):
    """Light of the Earth (k, 3) (inertial), as `torquer.environment.albedo` gives it."""
    for k in range(out.shape[0]):
        out[k, 0], out[k, 1], out[k, 2] = earthlight(albedo, read_vector(r[k]), read_vector(sun[k]))


@called
def take_readings(parameters, along, truth, k, p, gain, correction):
    """Update a covariance by what sensors would read at a place of the motion.

    `truth` (channels, k, 3): the vector of the surroundings that each channel reads.
    """
    for channel in range(int(parameters.sensing.after_last)):
        m = expect(parameters, along, k, channel, read_vector(truth[channel, k]))
        if m.count > 0:
            update(p, gain, correction, m, 1.0, estimated_rows(parameters.sensing, p))


@kernel
def fill_information(parameters, along, assumed, gained, pulled):
    """Information of each instant's readings: H^T R^-1 H (k, n, n) and H^T R^-1 z (k, n).

    `assumed` (channels, k, 3): field [T] and directions to the Sun and the Earth's centre that the
    filter assumes, inertial; z is what they differ from those along the motion.
    """
    h = np.zeros(gained.shape[1])
    for k in range(gained.shape[0]):
        for channel in range(int(parameters.sensing.after_last)):
            m = expect(parameters, along, k, channel, read_vector(assumed[channel, k]))
            add_information(m, h, gained[k], pulled[k])


@inlined
def add_information(m, h, gained, pulled):
    """Add what a measurement contributes; `h` (n): room for a row of H."""
    for row in range(m.count):
        h[:] = 0.0
        for i in range(3):
            h[i] = m.h[row][i]
            for other in range(len(m.at)):
                if m.at[other] > 0:
                    h[m.at[other] + i] = m.h_other[other][row][i]
        for i in range(h.shape[0]):
            pulled[i] -= h[i] * m.z[row] / m.r
            for j in range(h.shape[0]):
                gained[i, j] += h[i] * h[j] / m.r


@plugged
def fill(parameters, along, truth, out, propagate):
    """Covariance (k, n, n) after each control step from `out[0]`, that before the first readings.

    `propagate(parameters, along, k, dt, p)` takes a covariance from step k to the next one.
    """
    gain, correction = np.zeros((3, out.shape[1])), np.zeros(out.shape[1])
    take_readings(parameters, along, truth, 0, out[0], gain, correction)
    for k in range(1, out.shape[0]):
        put_matrix(out[k], out[k - 1])
        propagate(parameters, along, k - 1, along.t_s[k] - along.t_s[k - 1], out[k])
        take_readings(parameters, along, truth, k, out[k], gain, correction)


@inlined
def _by_gyro(parameters, along, k, dt, p):
    omega = read_vector(along.omega[k])
    kalman_gyro.propagate_covariance(parameters, p, omega, scale(dt, omega), dt)


@inlined
def _by_dynamics(parameters, along, k, dt, p):
    around = ModelEnvironment(read_vector(along.gravity[k]), read_vector(along.b[k]))
    q, omega = read_quaternion(along.q[k]), read_vector(along.omega[k])
    wheels = add(parameters.fixed, read_vector(along.wheels[k]))
    linear = linearise(parameters, q, omega, wheels, around, _ZERO, dt)
    dipole, inverse = state_slices(parameters.prior).residual_dipole, full(parameters.inverse)
    kalman_dynamics.propagate_covariance(p, linear, parameters.torque, inverse, dipole, dt)


@kernel
def fill_gyro(parameters, along, truth, out):
    """Covariances of a filter with a gyro; see `fill`."""
    fill(parameters, along, truth, out, _by_gyro)


@kernel
def fill_dynamics(parameters, along, truth, out):
    """Covariances of a filter without a gyro; see `fill`."""
    fill(parameters, along, truth, out, _by_dynamics)
