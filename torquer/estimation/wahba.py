"""Wahba's problem: the attitude that fits weighted directions best.

Least sum of w |v_body - R^T v_inertial|^2 over the rotations R. References for TRIAD and filters:
these functions are for analysis, on any number of directions, and allocate.
"""

import numpy as np

#: Newton's steps that QUEST takes at most; two are enough for readings near each other.
_MOST_STEPS = 50


def davenport_matrix(body, inertial, weights) -> np.ndarray:
    """Davenport's K (4, 4), scalar last: q^T K q is to be largest.

    `body`, `inertial`: directions (k, 3) of length one; `weights` (k,).
    """
    z = np.einsum("k,ki,kj->ij", weights, inertial, body)
    k = np.empty((4, 4))
    k[:3, :3] = z + z.T - np.trace(z) * np.eye(3)
    k[:3, 3] = k[3, :3] = (z[2, 1] - z[1, 2], z[0, 2] - z[2, 0], z[1, 0] - z[0, 1])
    k[3, 3] = np.trace(z)
    return k


def davenport_q(body, inertial, weights) -> np.ndarray:
    """Attitude quaternion, body to inertial: eigenvector of K's largest eigenvalue.

    P. Davenport (1968), in J. Keat, 'Analysis of least-squares attitude determination' (1977).
    """
    return np.linalg.eigh(davenport_matrix(body, inertial, weights))[1][:, -1]


def quest(body, inertial, weights) -> np.ndarray:
    """The same by Newton's method on the characteristic polynomial, from the sum of the weights.

    Regular for any attitude: the quaternion is the largest column of the adjugate of
    K - lambda 1. M. Shuster, S. Oh (1981).
    """
    k = davenport_matrix(body, inertial, weights)
    coefficients = np.poly(k)
    value = float(np.sum(weights))
    for _ in range(_MOST_STEPS):
        step = np.polyval(coefficients, value) / np.polyval(np.polyder(coefficients), value)
        value -= step
        if abs(step) < 1e-15 * abs(value):
            break
    m = k - value * np.eye(4)
    cofactors = [
        [(-1.0) ** (i + j) * np.linalg.det(np.delete(np.delete(m, i, 0), j, 1)) for j in range(4)]
        for i in range(4)
    ]
    column = np.array(cofactors)[:, np.argmax(np.abs(np.diag(cofactors)))]
    return column / np.linalg.norm(column)


def wahba_covariance(body, variances) -> np.ndarray:
    """Covariance (3, 3) [rad^2] of the best attitude's error in body axes.

    For weights 1/variance; `variances` (k,) of each direction across it.
    """
    body = np.asarray(body)
    across = np.eye(3) - np.einsum("ki,kj->kij", body, body)
    return np.linalg.inv(np.einsum("k,kij->ij", 1.0 / np.asarray(variances), across))
