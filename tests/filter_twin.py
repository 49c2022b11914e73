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
            (x, y, z, w), (p, r, s) = q, np.polyval(course, t)
            products = (w * p + y * s - z * r, w * r + z * p - x * s, w * s + x * r - y * p)
            return 0.5 * np.array([*products, -(x * p + y * r + z * s)])

        start = [0.0, 0.0, 0.0, 1.0]
        found = solve_ivp(rate, (-dt, 0.0), start, "DOP853", rtol=1e-11, atol=1e-13)
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
        """Of rotation vectors from the attitude at the start, to first order in them, and rates."""
        turn, omega = np.hsplit(x.reshape(-1, 6), 2)
        turned = self.attitude * Rotation.from_rotvec(turn)
        distance = np.linalg.norm(r)
        up = turned.inv().apply(r) / distance
        torque = 3.0 * self.mu / distance**3 * np.cross(up, up @ self.inertia)
        torque -= np.cross(omega, omega @ self.inertia)
        across = np.cross(turn, omega)
        turning = omega + 0.5 * across + np.cross(turn, across) / 12.0
        return np.hstack([turning, np.linalg.solve(self.inertia, torque.T).T]).ravel()

    def after(self, r, dt, changes):
        """Attitudes and rates after dt seconds from attitudes and rates changed by rows of six."""
        start = changes + np.concatenate([np.zeros(3), self.others])
        found = solve_ivp(
            self.rates, (0.0, dt), start.ravel(), "DOP853", rtol=1e-10, atol=1e-13, args=(r,)
        ).y[:, -1]
        turn, omega = np.hsplit(found.reshape(-1, 6), 2)
        return Rotation.from_rotvec(turn), omega

    def propagate(self, r, dt):
        """Over dt seconds from a position; the transition matrix by central differences."""
        size = 1e-4
        changes = size * np.vstack([np.zeros(6), np.eye(6), -np.eye(6)])
        turns, rates = self.after(r, dt, changes)
        turned, omega = turns[0], rates[0]
        ends = np.hstack([(turned.inv() * turns).as_rotvec(), rates])
        phi = (ends[1:7] - ends[7:]).T / (2.0 * size)
        f = np.zeros((6, 6))
        f[:3, 3:] = np.eye(3)
        _, q = discrete(f, self.noise, dt)
        self.p = phi @ self.p @ phi.T + q
        self.attitude, self.others = self.attitude * turned, omega
