"""Euler angles: any of the twelve intrinsic sequences, such as "313", "321" or "132".

An intrinsic sequence rotates the reference frame about its first axis, then about the new second,
then about the newest third axis, until it lies on the body frame. The product of the three
elementary rotations, in this order, takes body components to reference components. For a repeated
first axis ("313") the middle angle lies in [0, pi], otherwise in [-pi/2, pi/2].
"""

import math

import numpy as np

from torquer.base import validate
from torquer.compile.engine import kernel
from torquer.maths.geometry import quaternion
from torquer.maths.geometry.frames import mat_mul, rot_x, rot_y, rot_z

#: Below this sine (cosine) of the middle angle the outer two rotations are one.
_LOCK = 1e-12


@kernel
def rot_axis(axis, angle):
    """Elementary rotation about axis 0, 1 or 2 (rows)."""
    if axis == 0:
        return rot_x(angle)
    if axis == 1:
        return rot_y(angle)
    return rot_z(angle)


@kernel
def dcm(axes, angles):
    """Direction cosines, body to reference, of three rotations [rad] about `axes` (0, 1, 2)."""
    last_two = mat_mul(rot_axis(axes[1], angles[1]), rot_axis(axes[2], angles[2]))
    return mat_mul(rot_axis(axes[0], angles[0]), last_two)


@kernel
def euler_angles(axes, m):
    """The three angles [rad] of a rotation matrix (rows); in gimbal lock the third is zero.

    The third angle is read off the matrix with the first rotation undone, where it is well
    conditioned: the matrix is reproduced to rounding error however close the lock.
    """
    i, j, k = axes
    other = 3 - i - j
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    if i == k:
        regular = math.hypot(m[i][j], m[i][other])
        second = math.atan2(regular, m[i][i])
        first = math.atan2(m[j][i], -sign * m[other][i])
    else:
        regular = math.hypot(m[i][i], m[i][j])
        second = math.atan2(sign * m[i][k], regular)
        first = math.atan2(-sign * m[j][k], m[k][k])
    if regular < _LOCK:
        return (math.atan2(sign * m[other][j], m[j][j]), second, 0.0)
    c, s = math.cos(first), sign * math.sin(first)
    across = other if i == k else i
    turn = sign if i != k else -sign
    sine = turn * (c * m[j][across] + s * m[other][across])
    return (first, second, math.atan2(sine, c * m[j][j] + s * m[other][j]))


@kernel
def _fill_dcms(axes, angles, out):
    for row in range(angles.shape[0]):
        m = dcm(axes, (angles[row, 0], angles[row, 1], angles[row, 2]))
        for i in range(3):
            for j in range(3):
                out[row, i, j] = m[i][j]


@kernel
def _fill_angles(axes, m, out):
    for row in range(m.shape[0]):
        a = m[row]
        rows = (
            (a[0, 0], a[0, 1], a[0, 2]),
            (a[1, 0], a[1, 1], a[1, 2]),
            (a[2, 0], a[2, 1], a[2, 2]),
        )
        out[row, 0], out[row, 1], out[row, 2] = euler_angles(axes, rows)


@kernel
def _fill_quaternions(axes, angles, out):
    for row in range(angles.shape[0]):
        m = dcm(axes, (angles[row, 0], angles[row, 1], angles[row, 2]))
        out[row, 0], out[row, 1], out[row, 2], out[row, 3] = quaternion.from_dcm(m)


@kernel
def _fill_quaternion_angles(axes, q, out):
    for row in range(q.shape[0]):
        unit = quaternion.normalise((q[row, 0], q[row, 1], q[row, 2], q[row, 3]))
        out[row, 0], out[row, 1], out[row, 2] = euler_angles(axes, quaternion.to_dcm(unit))


def sequence_axes(sequence: str) -> tuple[int, int, int]:
    """Axis numbers (0, 1, 2) of a sequence such as "313"; another text is a `ValueError`."""
    good = isinstance(sequence, str) and len(sequence) == 3 and set(sequence) <= set("123")
    if not good or sequence[0] == sequence[1] or sequence[1] == sequence[2]:
        raise ValueError(
            "Euler sequence: must be three axes out of 1, 2, 3 with no axis twice in a row, "
            f'such as "313" or "321"; received {sequence!r}'
        )
    return (int(sequence[0]) - 1, int(sequence[1]) - 1, int(sequence[2]) - 1)


def to_dcm(sequence: str, angles) -> np.ndarray:
    """Body to reference direction cosines [..., 3, 3] of Euler angles [..., 3] in rad."""
    return _map_rows(_fill_dcms, sequence, "Euler angles", angles, (3,), (3, 3))


def from_dcm(sequence: str, m) -> np.ndarray:
    """Euler angles [..., 3] in rad of body to reference direction cosines [..., 3, 3].

    In gimbal lock the third angle is zero. The matrices are taken to be rotations.
    """
    return _map_rows(_fill_angles, sequence, "direction cosines", m, (3, 3), (3,))


def to_quaternion(sequence: str, angles) -> np.ndarray:
    """Body to reference quaternions [..., 4], scalar last, of Euler angles [..., 3] in rad."""
    return _map_rows(_fill_quaternions, sequence, "Euler angles", angles, (3,), (4,))


def from_quaternion(sequence: str, q) -> np.ndarray:
    """Euler angles [..., 3] in rad of body to reference quaternions [..., 4], scalar last."""
    return _map_rows(_fill_quaternion_angles, sequence, "quaternion", q, (4,), (3,))


def _map_rows(fill, sequence, name, values, shape, out_shape) -> np.ndarray:
    """Apply a row-wise kernel to an array whose last axes have `shape`."""
    axes = sequence_axes(sequence)
    array = validate.finite(name, values)
    lead = array.shape[: array.ndim - len(shape)]
    if array.shape != lead + shape:
        raise ValueError(f"{name}: must end in shape {shape}; received shape {array.shape}")
    out = np.empty((math.prod(lead), *out_shape))
    fill(axes, np.ascontiguousarray(array).reshape(-1, *shape), out)
    return out.reshape(lead + out_shape)


def known_sequence(sequence: str) -> str:
    """The sequence, if it is one of the 12; ValueError otherwise."""
    sequence_axes(sequence)
    return sequence
