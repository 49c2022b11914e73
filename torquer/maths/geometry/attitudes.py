"""Many attitudes at once: arrays of unit quaternions [..., 4] in NumPy, for results and pictures.

Conventions of `torquer.maths.geometry.quaternion`: scalar last, from body to reference components.
SciPy's `Rotation` has the same and more; importing it takes a quarter of a second of every run.
"""

import numpy as np


def inverse(q) -> np.ndarray:
    """Quaternions of the inverse rotations."""
    return np.asarray(q) * np.array([-1.0, -1.0, -1.0, 1.0])


def to_reference(q, v_body) -> np.ndarray:
    """Reference components [..., 3] of vectors [..., 3] given in body components."""
    q = np.asarray(q)
    axis = q[..., :3]
    twice = 2.0 * np.cross(axis, v_body)
    return v_body + q[..., 3:] * twice + np.cross(axis, twice)


def to_body(q, v_reference) -> np.ndarray:
    """Body components [..., 3] of vectors [..., 3] given in reference components."""
    return to_reference(inverse(q), v_reference)


def dcm_body_to_reference(q) -> np.ndarray:
    """Direction cosines [..., 3, 3]; their columns are the body's axes."""
    columns = to_reference(np.asarray(q)[..., None, :], np.eye(3))
    return np.swapaxes(columns, -1, -2)


def interpolate(t, q, wanted) -> np.ndarray:
    """Attitudes [m, 4] at times [m] within t [n >= 2], of q [n, 4] turning at constant rates."""
    after = np.clip(np.searchsorted(t, wanted), 1, len(t) - 1)
    part = ((wanted - t[after - 1]) / (t[after] - t[after - 1]))[:, None]
    a, b = q[after - 1], q[after]
    cosine = np.sum(a * b, axis=1, keepdims=True)
    b, angle = np.where(cosine < 0.0, -b, b), np.arccos(np.minimum(np.abs(cosine), 1.0))
    whole = np.sinc(angle / np.pi)
    of_a = (1.0 - part) * np.sinc((1.0 - part) * angle / np.pi) / whole
    of_b = part * np.sinc(part * angle / np.pi) / whole
    return of_a * a + of_b * b


def rotation_vector(p, q) -> np.ndarray:
    """Rotation vectors [n, 3] [rad] of the rotations, in body axes, that take p into q (n, 4).

    q = p exp(v), by the shorter rotation.
    """
    p, q = np.asarray(p), np.asarray(q)
    scalar = np.sum(p * q, axis=1)
    axis = p[:, 3:] * q[:, :3] - q[:, 3:] * p[:, :3] - np.cross(p[:, :3], q[:, :3])
    axis = np.where(scalar[:, None] < 0.0, -axis, axis)
    sine = np.linalg.norm(axis, axis=1)
    angle = 2.0 * np.arctan2(sine, np.abs(scalar))
    return axis * (angle / np.where(sine > 0.0, sine, 1.0) + 2.0 * (sine == 0.0))[:, None]


def axes_about(axis) -> np.ndarray:
    """Right-handed unit vectors as rows, the third of them a given one; the first two are free."""
    away = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(np.cross(axis, away), axis)
    first = first / np.linalg.norm(first)
    return np.array([first, np.cross(axis, first), axis])
