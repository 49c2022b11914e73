"""Covariance of a filter along a nominal motion, by the kernels of the filters themselves.

For the analysis of expected accuracy (`linear_covariance`): the innovations are
zero, so that nothing but the covariance changes.
"""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import called, inlined, kernel, plugged
from torquer.computer.estimation import kalman_dynamics, kalman_gyro
from torquer.computer.estimation.covariance import state_slices, update
from torquer.computer.estimation.kalman_dynamics import ModelEnvironment, full, linearise
from torquer.computer.estimation.measurements.magnetometer import errors_at, measure_field
from torquer.computer.estimation.measurements.measurement import (
    direction_measurement,
    estimated_rows,
)
from torquer.computer.estimation.measurements.star_tracker import measure_attitude
from torquer.computer.estimation.measurements.sun_cells import measure_cell
from torquer.computer.estimation.triad import read_quaternion
from torquer.environment.albedo import earthlight
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, norm, put_matrix, read_vector, scale, unit
from torquer.spacecraft.sensors.attitude_sensor import earth_cosine, is_blind
from torquer.spacecraft.sensors.horizon_sensor import disc_centre, sees_horizon
from torquer.spacecraft.sensors.sun_cells import CELLS
from torquer.spacecraft.sensors.sun_sensor import sensor_that_sees

_ZERO = (0.0, 0.0, 0.0)


class Nominal(NamedTuple):
    """What a filter would see along a motion, a row at each control step.

    Time [s]; attitude, rate [rad/s]; wheels' momentum [N m s, body]; field [T], radius vector of
    `gravity_gradient_at`, direction to the Sun, all inertial; whether a Sun sensor sees it, and
    whether the star tracker sees stars and the horizon sensor the Earth; visible part of the Sun,
    light of the Earth on a cell (inertial).
    """

    t_s: np.ndarray
    q: np.ndarray
    omega: np.ndarray
    wheels: np.ndarray
    b: np.ndarray
    gravity: np.ndarray
    sun: np.ndarray
    seen: np.ndarray
    stars: np.ndarray
    earth: np.ndarray
    sunlit: np.ndarray
    earthlight: np.ndarray


@kernel
def keep_seen(sensors, sun_body, seen):
    """Clear `seen` (k,) where no sensor sees the Sun, in direction `sun_body` (k, 3)."""
    for k in range(seen.shape[0]):
        seen[k] = seen[k] and sensor_that_sees(sensors, read_vector(sun_body[k])) >= 0


@kernel
def put_earthlight(albedo, r, sun, out):
    """Light of the Earth (k, 3) (inertial), as `torquer.environment.albedo` gives it."""
    for k in range(out.shape[0]):
        out[k, 0], out[k, 1], out[k, 2] = earthlight(albedo, read_vector(r[k]), read_vector(sun[k]))


@kernel
def put_stars(sensor, q, omega, sun, r, stars):
    """Whether a star tracker reads an attitude, into `stars` (k,).

    At attitudes (k, 4) and rates (k, 3), with directions to the Sun and positions (k, 3) [m],
    inertial.
    """
    for k in range(stars.shape[0]):
        at, place = read_quaternion(q[k]), read_vector(r[k])
        to_sun, nadir = rotate_inverse(at, read_vector(sun[k])), rotate_inverse(at, unit(place))
        cosine = earth_cosine(sensor, norm(place))
        turning = read_vector(omega[k])
        stars[k] = not is_blind(sensor, turning, to_sun, scale(-1.0, nadir), cosine)


@kernel
def put_earth(sensor, q, omega, r, earth):
    """Whether a horizon sensor sees the Earth, into `earth` (k,).

    At attitudes (k, 4), rates (k, 3), positions (k, 3) [m, inertial].
    """
    for k in range(earth.shape[0]):
        centre = rotate_inverse(read_quaternion(q[k]), disc_centre(sensor, read_vector(r[k])))
        earth[k] = sees_horizon(sensor, read_vector(omega[k]), centre)


@inlined
def field_reading(parameters, q, reference, field):
    """(z, H, R) of a field [T, inertial] where the model gives another one."""
    read = rotate_inverse(q, field)
    return measure_field(q, reference, read, errors_at(parameters), parameters.sensing.r_field)


@inlined
def sun_reading(parameters, q, reference, sun):
    """(z, H, R) of a direction to the Sun [inertial] where the model gives another one."""
    return direction_measurement(q, reference, rotate_inverse(q, sun), parameters.sensing.r_sun)


@called
def take_readings(parameters, along, k, p, gain, correction):
    """Update a covariance by what sensors would read at a place of the motion."""
    q, sensing = read_quaternion(along.q[k]), parameters.sensing
    if sensing.r_field > 0.0:
        b = read_vector(along.b[k])
        m = field_reading(parameters, q, b, b)
        update(p, gain, correction, m, 1.0, estimated_rows(sensing, p))
    if sensing.r_sun > 0.0 and along.seen[k]:
        s = read_vector(along.sun[k])
        m = sun_reading(parameters, q, s, s)
        update(p, gain, correction, m, 1.0, estimated_rows(sensing, p))
    if sensing.r_star > 0.0 and along.stars[k]:
        m = measure_attitude(q, q, sensing, 0.0, 0.0)
        update(p, gain, correction, m, 1.0, estimated_rows(sensing, p))
    if sensing.r_nadir > 0.0 and along.earth[k]:
        nadir = nadir_along(along, k)
        m = nadir_reading(parameters, q, nadir, nadir)
        update(p, gain, correction, m, 1.0, estimated_rows(sensing, p))
    if sensing.r_cell > 0.0 and along.sunlit[k] >= 0.5:
        for cell in range(CELLS):
            m = cell_reading(parameters, along, k, cell)
            if m.count > 0:
                update(p, gain, correction, m, 1.0, estimated_rows(sensing, p))


@kernel
def fill_information(parameters, along, b, sun, nadir, gained, pulled):
    """Information of each instant's readings: H^T R^-1 H (k, n, n) and H^T R^-1 z (k, n).

    `b`, `sun`, `nadir` (k, 3): field [T] and directions to the Sun and the Earth's centre that the
    filter assumes, inertial; z is what they differ from those along the motion.
    """
    sensing, h = parameters.sensing, np.zeros(gained.shape[1])
    for k in range(gained.shape[0]):
        q = read_quaternion(along.q[k])
        if sensing.r_field > 0.0:
            field = read_vector(along.b[k])
            m = field_reading(parameters, q, field, read_vector(b[k]))
            add_information(m, h, gained[k], pulled[k])
        if sensing.r_sun > 0.0 and along.seen[k]:
            s = read_vector(along.sun[k])
            m = sun_reading(parameters, q, s, read_vector(sun[k]))
            add_information(m, h, gained[k], pulled[k])
        if sensing.r_star > 0.0 and along.stars[k]:
            m = measure_attitude(q, q, sensing, 0.0, 0.0)
            add_information(m, h, gained[k], pulled[k])
        if sensing.r_nadir > 0.0 and along.earth[k]:
            m = nadir_reading(parameters, q, nadir_along(along, k), read_vector(nadir[k]))
            add_information(m, h, gained[k], pulled[k])
        if sensing.r_cell > 0.0 and along.sunlit[k] >= 0.5:
            for cell in range(CELLS):
                m = cell_reading(parameters, along, k, cell)
                add_information(m, h, gained[k], pulled[k])


@inlined
def nadir_along(along, k):
    """Direction to the Earth's centre (inertial) at a place of the motion."""
    return scale(-1.0, unit(read_vector(along.gravity[k])))


@inlined
def nadir_reading(parameters, q, reference, nadir):
    """(z, H, R) of a direction to the Earth's centre [inertial] where the model gives another."""
    return direction_measurement(q, reference, rotate_inverse(q, nadir), parameters.sensing.r_nadir)


@inlined
def cell_reading(parameters, along, k, cell):
    """(z, H, R) of the expected signal of a Sun cell: z is zero."""
    q, sensing, row = (
        read_quaternion(along.q[k]),
        parameters.sensing,
        parameters.sensing.cells[cell],
    )
    light = scale(along.sunlit[k], read_vector(along.sun[k]))
    earth = read_vector(along.earthlight[k])
    dark = measure_cell(q, row, 0.0, light, earth, sensing, 0.0)
    return measure_cell(q, row, -dark.z[0], light, earth, sensing, 0.0)


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
def fill(parameters, along, out, propagate):
    """Covariance (k, n, n) after each control step from `out[0]`, that before the first readings.

    `propagate(parameters, along, k, dt, p)` takes a covariance from step k to the next one.
    """
    gain, correction = np.zeros((3, out.shape[1])), np.zeros(out.shape[1])
    take_readings(parameters, along, 0, out[0], gain, correction)
    for k in range(1, out.shape[0]):
        put_matrix(out[k], out[k - 1])
        propagate(parameters, along, k - 1, along.t_s[k] - along.t_s[k - 1], out[k])
        take_readings(parameters, along, k, out[k], gain, correction)


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
def fill_gyro(parameters, along, out):
    """Covariances of a filter with a gyro; see `fill`."""
    fill(parameters, along, out, _by_gyro)


@kernel
def fill_dynamics(parameters, along, out):
    """Covariances of a filter without a gyro; see `fill`."""
    fill(parameters, along, out, _by_dynamics)
