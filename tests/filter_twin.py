"""Kalman filters written out with matrices, on recorded readings: twins of the package's."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation


def cross_matrix(v):
    """v x."""
    return np.cross(np.eye(3), v)


def discrete(f, noise, dt):
    """Transition matrix and noise of a linear system in dt seconds, by Van Loan's method."""
    n = len(f)
    both = np.zeros((2 * n, 2 * n))
    both[:n, :n], both[:n, n:], both[n:, n:] = -f, noise, f.T
    found = expm(both * dt)
    phi = found[n:, n:].T
    return phi, phi @ found[:n, n:]


class Twin:
    """What both share; `others`: the states beyond the attitude."""

    def update(self, reference, measured, sigma):
        """By a vector with the same noise in every component."""
        expected = self.attitude.inv().apply(reference)
        h = np.hstack([cross_matrix(expected), np.zeros((3, 3))])
        r = sigma**2 * np.eye(3)
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        change = gain @ (measured - expected)
        left = np.eye(6) - gain @ h
        self.p = left @ self.p @ left.T + gain @ r @ gain.T
        turn = Rotation.from_rotvec(change[:3])
        axes = np.eye(6)
        axes[:3, :3] = turn.inv().as_matrix()
        self.p = axes @ self.p @ axes.T
        self.attitude = self.attitude * turn
        self.others = self.others + change[3:]


class GyroTwin(Twin):
    """Gyro, directions, Joseph's form; error in body axes, as the package has it."""

    def __init__(self, q, bias, covariance, white, walk):
        self.attitude, self.others, self.p = Rotation.from_quat(q), np.array(bias), covariance
        self.noise = np.diag([white] * 3 + [walk] * 3)

    def propagate(self, readings, dt):
        """By the rotation from the second to the third of three readings, dt apart.

        Course of the rate through the readings (fewer at the start), integrated by differential
        equations of the attitude.
        """
        times = dt * np.arange(1 - len(readings), 1)
        course = np.polyfit(times, np.array(readings) - self.others, len(readings) - 1)

        def rate(t, q):
            omega = np.array([np.polyval(column, t) for column in course.T])
            return 0.5 * np.array([*(np.cross(q[:3], omega) + q[3] * omega), -q[:3] @ omega])

        found = solve_ivp(rate, (-dt, 0.0), [0.0, 0.0, 0.0, 1.0], rtol=1e-11, atol=1e-13)
        turn = Rotation.from_quat(found.y[:, -1])
        omega = turn.as_rotvec() / dt
        f = np.zeros((6, 6))
        f[:3, :3], f[:3, 3:] = -cross_matrix(omega), -np.eye(3)
        phi, q = discrete(f, self.noise, dt)
        self.p = phi @ self.p @ phi.T + q
        self.attitude = self.attitude * turn


class DynamicsTwin(Twin):
    """No gyro: Euler's equations by DOP853, transition by differences, Joseph's form."""

    mu = 3.986004418e14

    def __init__(self, q, omega, covariance, inertia, torque_noise):
        self.attitude, self.others, self.p = Rotation.from_quat(q), np.array(omega), covariance
        self.inertia = inertia
        spread = torque_noise * np.linalg.inv(inertia)
        self.noise = np.zeros((6, 6))
        self.noise[3:, 3:] = spread @ spread.T

    def rates(self, t, x, r):
        """Of a rotation vector from the attitude at the start, to first order in it, and rate."""
        turned, omega = self.attitude * Rotation.from_rotvec(x[:3]), x[3:]
        distance = np.linalg.norm(r)
        up = turned.inv().apply(r) / distance
        torque = 3.0 * self.mu / distance**3 * np.cross(up, self.inertia @ up)
        torque -= np.cross(omega, self.inertia @ omega)
        across = np.cross(x[:3], omega)
        turning = omega + 0.5 * across + np.cross(x[:3], across) / 12.0
        return np.concatenate([turning, np.linalg.solve(self.inertia, torque)])

    def after(self, r, dt, turn=(0.0, 0.0, 0.0), more=(0.0, 0.0, 0.0)):
        """Attitude and rate after dt seconds from an attitude and a rate slightly changed."""
        start = np.concatenate([turn, self.others + more])
        found = solve_ivp(
            self.rates, (0.0, dt), start, "DOP853", rtol=1e-10, atol=1e-13, args=(r,)
        ).y[:, -1]
        return Rotation.from_rotvec(found[:3]), found[3:]

    def propagate(self, r, dt):
        """Over dt seconds from a position."""
        turned, omega = self.after(r, dt)
        phi, size = np.zeros((6, 6)), 1e-4
        for k in range(6):
            step = size * np.eye(6)[k]
            one = self.after(r, dt, step[:3], step[3:])
            other = self.after(r, dt, -step[:3], -step[3:])
            for sign, (attitude, rate) in ((1.0, one), (-1.0, other)):
                phi[:3, k] += 0.5 * sign * (turned.inv() * attitude).as_rotvec() / size
                phi[3:, k] += 0.5 * sign * rate / size
        f = np.zeros((6, 6))
        f[:3, 3:] = np.eye(3)
        _, q = discrete(f, self.noise, dt)
        self.p = phi @ self.p @ phi.T + q
        self.attitude, self.others = self.attitude * turned, omega
