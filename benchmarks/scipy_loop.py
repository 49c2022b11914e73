"""The task as one writes it first: NumPy right-hand side, `solve_ivp` over every second.

Slow, and independent of the other rivals: the field is the textbook spherical-harmonic sum in
latitude and longitude. `run` therefore takes the number of seconds to simulate.
"""

import time

import numpy as np
from detumble_task import DEGREE, EARTH_RATE_RAD_S, FIELD_RADIUS_M, Task
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

ORDERS = np.arange(DEGREE + 1)


class Field:
    """Spherical-harmonic field with Gauss coefficients g[n, m], h[n, m] [nT]."""

    def __init__(self, g, h):
        self.g, self.h = 1e-9 * np.asarray(g), 1e-9 * np.asarray(h)
        n, m = np.meshgrid(ORDERS, ORDERS, indexing="ij")
        norm = np.sqrt(np.maximum(n**2 - m**2, 1))
        self.rise = np.where(n > m, (2 * n - 1) / norm, 0.0)
        self.fall = np.where(n > m, np.sqrt(np.maximum((n - 1) ** 2 - m**2, 0)) / norm, 0.0)
        doubled = 2.0 * np.maximum(ORDERS, 1)
        self.diagonal = np.where(ORDERS < 2, 1.0, np.sqrt((doubled - 1.0) / doubled))

    def legendre(self, cos_theta, sin_theta):
        """Schmidt functions P[n, m] of the colatitude theta and dP/dtheta."""
        p, dp = np.zeros((2, DEGREE + 1, DEGREE + 1))
        p[0, 0] = 1.0
        for n in range(1, DEGREE + 1):
            p[n] = self.rise[n] * cos_theta * p[n - 1]
            dp[n] = self.rise[n] * (cos_theta * dp[n - 1] - sin_theta * p[n - 1])
            if n > 1:
                p[n] -= self.fall[n] * p[n - 2]
                dp[n] -= self.fall[n] * dp[n - 2]
            p[n, n] = self.diagonal[n] * sin_theta * p[n - 1, n - 1]
            dp[n, n] = self.diagonal[n] * (
                sin_theta * dp[n - 1, n - 1] + cos_theta * p[n - 1, n - 1]
            )
        return p, dp

    def __call__(self, position_m):
        """Field [T] at an Earth-fixed point [m] off the poles."""
        x, y, z = position_m
        r, rho = np.linalg.norm(position_m), np.hypot(x, y)
        p, dp = self.legendre(z / r, rho / r)
        power = (FIELD_RADIUS_M / r) ** (ORDERS + 2)
        angle = ORDERS * np.arctan2(y, x)
        wave = self.g * np.cos(angle) + self.h * np.sin(angle)
        slope = ORDERS * (self.h * np.cos(angle) - self.g * np.sin(angle))
        b_r = np.sum(power * (ORDERS + 1) * (p * wave).sum(axis=1))
        b_theta = -np.sum(power * (dp * wave).sum(axis=1))
        b_phi = -np.sum(power * (p * slope).sum(axis=1)) * r / rho
        up, east = np.array([x, y, z]) / r, np.array([-y, x, 0.0]) / rho
        return b_r * up + b_theta * np.cross(east, up) + b_phi * east


def environment(task: Task, field: Field, t: float):
    """Field [T] and unit radius vector, inertial."""
    u, theta = task.orbit_rate_rad_s * t, task.theta0_rad + EARTH_RATE_RAD_S * t
    cos_i, sin_i = np.cos(task.inclination_rad), np.sin(task.inclination_rad)
    up = np.array([np.cos(u), np.sin(u) * cos_i, np.sin(u) * sin_i])
    turn = np.array(
        [[np.cos(theta), -np.sin(theta), 0.0], [np.sin(theta), np.cos(theta), 0.0], [0, 0, 1]]
    )
    return turn @ field(task.radius_m * (turn.T @ up)), up


def derivative(t, state, task: Task, field: Field, dipole):
    """Right-hand side: attitude kinematics and Euler's equations."""
    (x, y, z, w), rate = state[:4], state[4:]
    inertia = np.array(task.moments)
    b, up = Rotation.from_quat(state[:4]).apply(environment(task, field, t), inverse=True)
    torque = np.cross(dipole, b) - np.cross(rate, inertia * rate)
    torque += 3.0 * task.orbit_rate_rad_s**2 * np.cross(up, inertia * up)
    kinematics = 0.5 * np.array([[w, -z, y], [z, w, -x], [-y, x, w], [-x, -y, -z]])
    return np.concatenate([kinematics @ rate, torque / inertia])


def run(task: Task, g, h, n_steps: int, method: str = "DOP853", rtol: float = 1e-9):
    """State after n_steps seconds, and wall time per simulated second [s]."""
    field, state, b_before = Field(g, h), task.initial_state, None
    start = time.perf_counter()
    for i in range(n_steps):
        b = Rotation.from_quat(state[:4]).apply(environment(task, field, i)[0], inverse=True)
        rate_of_b = np.zeros(3) if b_before is None else b - b_before
        b_before = b
        dipole = np.clip(-task.gain * rate_of_b, -task.dipole_max, task.dipole_max)
        solution = solve_ivp(
            derivative, (i, i + 1), state, method, rtol=rtol, atol=1e-12, args=(task, field, dipole)
        )
        state = solution.y[:, -1]
        state[:4] /= np.linalg.norm(state[:4])
    return state, (time.perf_counter() - start) / n_steps
