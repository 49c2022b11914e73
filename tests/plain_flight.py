"""A satellite with coils on one page: rigid body, field, law, without a line of the simulator's.

Of the package it has the field along the orbit alone.
"""

import math

import numba
import numpy as np
from scipy.integrate import ode


class PlainFlight:
    """Flies a scenario; `law` answers a dipole [A m^2] to the field, its rate, omega."""

    def __init__(self, scenario, law, length_s):
        self.law, self.sample_s = law, scenario.control.sample_s
        self.inertia = np.array(scenario.spacecraft.body.inertia)
        self.inverse = np.linalg.inv(self.inertia)
        craft, self.limit = scenario.spacecraft, np.full(3, np.inf)
        self.residual = np.array(craft.permanent_magnet_a_m2)
        if craft.coils is not None:
            self.residual = self.residual + np.array(craft.coils.residual_dipole_a_m2)
            self.limit = np.broadcast_to(np.array(craft.coils.limit_a_m2), 3)
        self.samples = round(length_s / self.sample_s)
        t_s = np.arange(-1, 2 * self.samples + 2) * 0.5 * self.sample_s
        around = scenario.orbit_environment()
        field = around.field(t_s, *around.state(t_s))
        self.field, self.rate = field[1:-1], (field[2:] - field[:-2]) / self.sample_s
        self.start = scenario.motion_at_start()

    def flown(self, steps=None):
        """State at the end: by so many steps of RK4 a sample, or by DOP853 to 1e-13."""
        state = self.start
        for k in range(self.samples):
            b = in_body(state, self.field[2 * k])
            turning = in_body(state, self.rate[2 * k]) - np.array(_cross(state[4:], b))
            dipole = np.clip(self.law(b, turning, state[4:]), -self.limit, self.limit)

            body = dipole + self.residual, self.inertia, self.inverse
            field = self.field[2 * k : 2 * k + 3]
            if steps:
                state = _by_rk4(state, field, self.sample_s, steps, *body)
            else:
                state = _by_scipy(state, field, self.sample_s, body)
            state = np.array([*(state[:4] / np.linalg.norm(state[:4])), *state[4:]])
        return state


def _by_scipy(state, field, sample_s, body):
    solver = ode(_rates).set_integrator("dop853", rtol=1e-13, atol=1e-15, nsteps=10_000)
    solver.set_initial_value(state, 0.0).set_f_params(field, sample_s, *body)
    state = solver.integrate(sample_s)
    assert solver.successful()
    return state


@numba.njit
def _rates(t, state, field, sample_s, dipole, inertia, inverse):
    return _derivative(state, _field_at(field, t / sample_s), dipole, inertia, inverse)


@numba.njit
def _by_rk4(state, field, sample_s, steps, dipole, inertia, inverse):
    h = sample_s / steps
    for n in range(steps):
        now, middle, then = n / steps, (n + 0.5) / steps, (n + 1.0) / steps
        a = _derivative(state, _field_at(field, now), dipole, inertia, inverse)
        b = _derivative(state + 0.5 * h * a, _field_at(field, middle), dipole, inertia, inverse)
        c = _derivative(state + 0.5 * h * b, _field_at(field, middle), dipole, inertia, inverse)
        d = _derivative(state + h * c, _field_at(field, then), dipole, inertia, inverse)
        state = state + h / 6.0 * (a + 2.0 * (b + c) + d)
    return state


@numba.njit
def _field_at(field, s):
    """The field at a part of a sample: a parabola through three points."""
    a, m, e = field[0], field[1], field[2]
    return a * (1 - s) * (1 - 2 * s) + 4 * m * s * (1 - s) + e * s * (2 * s - 1)


@numba.njit
def _derivative(state, b_inertial, dipole, inertia, inverse):
    p, q, r = state[4], state[5], state[6]
    x, y, z, w = state[0], state[1], state[2], state[3]
    omega = state[4:]
    torque = np.array(_cross(dipole, in_body(state, b_inertial)))
    gyroscopic = np.array(_cross(inertia @ omega, omega))
    found = np.empty(7)
    found[0] = 0.5 * (w * p + y * r - z * q)
    found[1] = 0.5 * (w * q + z * p - x * r)
    found[2] = 0.5 * (w * r + x * q - y * p)
    found[3] = -0.5 * (x * p + y * q + z * r)
    found[4:] = inverse @ (torque + gyroscopic)
    return found


@numba.njit
def _cross(a, b):
    """As numpy.cross, which is slow for one vector."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@numba.njit
def in_body(state, v):
    """A vector of inertial axes in those of the body."""
    size = math.sqrt(state[0] ** 2 + state[1] ** 2 + state[2] ** 2 + state[3] ** 2)
    x, y, z, w = state[0] / size, state[1] / size, state[2] / size, state[3] / size
    found = np.empty(3)
    found[0] = (
        (1 - 2 * (y * y + z * z)) * v[0] + 2 * (x * y + z * w) * v[1] + 2 * (x * z - y * w) * v[2]
    )
    found[1] = (
        2 * (x * y - z * w) * v[0] + (1 - 2 * (x * x + z * z)) * v[1] + 2 * (y * z + x * w) * v[2]
    )
    found[2] = (
        2 * (x * z + y * w) * v[0] + 2 * (y * z - x * w) * v[1] + (1 - 2 * (x * x + y * y)) * v[2]
    )
    return found


def apart(one, other) -> tuple[float, float]:
    """Angle [rad] between two attitudes, and the greatest difference of the rates [rad/s]."""
    between = one[3] * other[:3] - other[3] * one[:3] - np.cross(one[:3], other[:3])
    angle = 2.0 * math.asin(min(1.0, float(np.linalg.norm(between))))
    return angle, float(np.abs(one[4:] - other[4:]).max())
