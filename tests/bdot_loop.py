"""Multipliers of a sphere under sampled B-dot, by the matrix exponential: for several tests."""

import math

import numpy as np
from scipy.linalg import expm


def multipliers_at(rate, kappa, difference_s, hold_s, lag_s, off_s):
    """Multipliers of a sphere that spins along a constant field, by the matrix exponential.

    In body axes x + iy, linear in: the field p (over B), the rate q, the coils' torque mu (over
    the inertia; its sign turned), the last reading: p' = -i w p + i q, q' = -i mu,
    mu' = (command - mu)/lag. The spin is an exact motion with any gain.
    """

    def flow(span_s, command):  # on (p, q, mu, command)
        matrix = np.array([[-1j * rate, 1j, 0, 0], [0, 0, -1j, 0], [0] * 4, [0] * 4])
        if lag_s > 0.0:
            matrix[2] = [0, 0, -1.0 / lag_s, command / lag_s]
        else:
            matrix[1], matrix[2] = [0, 0, 0, -1j * command], [0, 0, -1.0 / hold_s, 0]  # mu unused
        return expm(span_s * matrix)

    def stage(matrix, reading):  # on (p, q, mu, command, last reading)
        whole = np.eye(5, dtype=complex)
        whole[:4, :4] = matrix
        if reading:
            whole[4] = whole[0]
        return whole

    command = np.eye(5, dtype=complex)
    if difference_s > 0.0:
        command[3] = [-kappa / difference_s, 0, 0, 0, kappa / difference_s]
    else:
        command[3] = [1j * kappa * rate, -1j * kappa, 0, 0, 0]
    held = stage(flow(hold_s, 1.0), False)
    if off_s == 0.0:
        command_and_reading = stage(np.eye(4), True) @ command
        return np.linalg.eigvals(held @ command_and_reading)
    wait = stage(flow(off_s - difference_s, 0.0), True)
    return np.linalg.eigvals(command @ stage(flow(difference_s, 0.0), False) @ wait @ held)


def growth(rate, kappa, *times):
    """ln |multiplier| of the tilt over kappa a. (Another one is 1: the body may spin about any
    axis of its own.)"""
    found = multipliers_at(rate, kappa, *times)
    found = np.delete(found, np.argmin(np.abs(found - 1.0)))
    return math.log(np.abs(found).max()) / (kappa * times[1])
