"""A satellite with coils in plain NumPy: rigid body, field, law, without a line of the simulator's.

Of the package it has the field along the orbit alone.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp


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

    def derivative(self, state, b_inertial, dipole):
        p, q, r = omega = state[4:]
        x, y, z, w = state[:4]
        b = in_body(state, b_inertial)
        torque = np.array(_cross(dipole + self.residual, b))
        gyroscopic = np.array(_cross(self.inertia @ omega, omega))
        turn = [w * p + y * r - z * q, w * q + z * p - x * r, w * r + x * q - y * p,
                -(x * p + y * q + z * r)]  # fmt: skip
        return np.array([*(0.5 * each for each in turn), *(self.inverse @ (torque + gyroscopic))])

    def flown(self, steps=None):
        """State at the end: by so many steps of RK4 a sample, or by DOP853 to 1e-13."""
        state = self.start
        for k in range(self.samples):
            b = in_body(state, self.field[2 * k])
            turning = in_body(state, self.rate[2 * k]) - np.array(_cross(state[4:], b))
            dipole = np.clip(self.law(b, turning, state[4:]), -self.limit, self.limit)

            def rates(t, y, k=k, dipole=dipole):
                return self.derivative(y, self.field_at(k, t / self.sample_s), dipole)

            state = self._by_rk4(rates, state, steps) if steps else self._by_scipy(rates, state)
            state = np.array([*(state[:4] / np.linalg.norm(state[:4])), *state[4:]])
        return state

    def field_at(self, k, s):
        """The field at a part of a sample: a parabola through three points."""
        a, m, e = self.field[2 * k : 2 * k + 3]
        return a * (1 - s) * (1 - 2 * s) + 4 * m * s * (1 - s) + e * s * (2 * s - 1)

    def _by_scipy(self, rates, state):
        found = solve_ivp(rates, (0.0, self.sample_s), state, "DOP853", rtol=1e-13, atol=1e-15)
        return found.y[:, -1]

    def _by_rk4(self, rates, state, steps):
        h = self.sample_s / steps
        for t in h * np.arange(steps):
            a = rates(t, state)
            b = rates(t + 0.5 * h, state + 0.5 * h * a)
            c = rates(t + 0.5 * h, state + 0.5 * h * b)
            state = state + h / 6.0 * (a + 2.0 * (b + c) + rates(t + h, state + h * c))
        return state


def _cross(a, b):
    """As numpy.cross, which is slow for one vector."""
    (a1, a2, a3), (b1, b2, b3) = a, b
    return a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1


def in_body(state, v):
    """A vector of inertial axes in those of the body."""
    x, y, z, w = state[:4] / math.sqrt(float(state[:4] @ state[:4]))
    to_inertial = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    return v @ to_inertial


def apart(one, other) -> tuple[float, float]:
    """Angle [rad] between two attitudes, and the greatest difference of the rates [rad/s]."""
    angle = 2.0 * math.acos(min(1.0, abs(float(one[:4] @ other[:4]))))
    return angle, float(np.abs(one[4:] - other[4:]).max())
