"""Kalman filters written out with matrices, on recorded readings: twins of the package's."""

import numpy as np
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


class GyroTwin:
    """Gyro, directions, Joseph's form; error in body axes, as the package has it."""

    def __init__(self, q, bias, covariance, white, walk):
        self.attitude, self.bias, self.p = Rotation.from_quat(q), np.array(bias), covariance
        self.noise = np.diag([white] * 3 + [walk] * 3)

    def propagate(self, rate_before, rate_now, dt):
        """By the mean of two readings."""
        omega = 0.5 * (rate_before + rate_now) - self.bias
        f = np.zeros((6, 6))
        f[:3, :3], f[:3, 3:] = -cross_matrix(omega), -np.eye(3)
        phi, q = discrete(f, self.noise, dt)
        self.p = phi @ self.p @ phi.T + q
        self.attitude = self.attitude * Rotation.from_rotvec(omega * dt)

    def update(self, reference, measured, sigma):
        """By a vector with the same noise in every component."""
        expected = self.attitude.inv().apply(reference)
        h = np.hstack([cross_matrix(expected), np.zeros((3, 3))])
        r = sigma**2 * np.eye(3)
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        change = gain @ (measured - expected)
        left = np.eye(6) - gain @ h
        self.p = left @ self.p @ left.T + gain @ r @ gain.T
        self.attitude = self.attitude * Rotation.from_rotvec(change[:3])
        self.bias = self.bias + change[3:]
