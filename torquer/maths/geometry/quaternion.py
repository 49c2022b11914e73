"""Unit quaternions, scalar last `(x, y, z, w)`, that take body components to reference components.

`v_reference = rotate(q, v_body)`, as `scipy.spatial.transform.Rotation` and SDOT (1.7) have it.
"""

import math

import numpy as np

from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add, add_scaled, cross, norm, scale, sub


@inlined
def put_quaternion(cells, q):
    """Write a quaternion into four cells."""
    cells[0], cells[1], cells[2], cells[3] = q


@inlined
def read_quaternion(cells):
    """The quaternion in four cells."""
    return (cells[0], cells[1], cells[2], cells[3])


@inlined
def multiply(p, q):
    """Product p q: first the rotation q, then p."""
    return (
        p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1],
        p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0],
        p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3],
        p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2],
    )


@inlined
def conjugate(q):
    """Inverse rotation."""
    return (-q[0], -q[1], -q[2], q[3])


@inlined
def rotate(q, v_body):
    """Reference components of a vector given in body components."""
    axis = (q[0], q[1], q[2])
    t = scale(2.0, cross(axis, v_body))
    return add(add_scaled(v_body, q[3], t), cross(axis, t))


@inlined
def rotate_inverse(q, v_reference):
    """Body components of a vector given in reference components."""
    axis = (q[0], q[1], q[2])
    t = scale(2.0, cross(axis, v_reference))
    return add(sub(v_reference, scale(q[3], t)), cross(axis, t))


@inlined
def derivative(q, omega_body):
    """dq/dt = 1/2 q (omega, 0), omega [rad/s] absolute, in body axes. Source: SDOT (1.7)."""
    x, y, z = omega_body
    return (
        0.5 * (q[3] * x + q[1] * z - q[2] * y),
        0.5 * (q[3] * y + q[2] * x - q[0] * z),
        0.5 * (q[3] * z + q[0] * y - q[1] * x),
        -0.5 * (q[0] * x + q[1] * y + q[2] * z),
    )


@inlined
def normalise(q):
    """The quaternion scaled to length one.

    Near it one Newton step does (error 3/8 (|q|^2 - 1)^2): a root and a quotient would be the
    longest operations in a step of the loop.
    """
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    s = 1.5 - 0.5 * square
    if abs(square - 1.0) > 1e-6:
        s = 1.0 / math.sqrt(square)
    return (s * q[0], s * q[1], s * q[2], s * q[3])


@inlined
def from_rotation_vector(phi):
    """Quaternion of the rotation by |phi| [rad] about phi (exponential map)."""
    angle = norm(phi)
    # sin(x/2)/x by its series where the quotient would lose digits
    s = 0.5 - angle * angle / 48.0 if angle < 1e-4 else math.sin(0.5 * angle) / angle
    return (s * phi[0], s * phi[1], s * phi[2], math.cos(0.5 * angle))


@inlined
def to_rotation_vector(q):
    """Rotation vector of a quaternion of any length but 0, by the shorter rotation: up to pi."""
    sine = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    angle = 2.0 * math.atan2(sine, abs(q[3]))
    factor = angle / sine if sine > 0.0 else 2.0
    return scale(math.copysign(factor, q[3]), (q[0], q[1], q[2]))


@inlined
def to_dcm(q):
    """Direction cosines (rows) that take body components to reference components."""
    x, y, z, w = q
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


@inlined
def from_dcm(m):
    """Quaternion of direction cosines (rows), body to reference; the largest component decides."""
    trace = m[0][0] + m[1][1] + m[2][2]
    if trace > max(m[0][0], m[1][1], m[2][2]):
        q = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 1.0 + trace)
    elif m[0][0] >= m[1][1] and m[0][0] >= m[2][2]:
        q = (1.0 + 2.0 * m[0][0] - trace, m[1][0] + m[0][1], m[0][2] + m[2][0], m[2][1] - m[1][2])
    elif m[1][1] >= m[2][2]:
        q = (m[1][0] + m[0][1], 1.0 + 2.0 * m[1][1] - trace, m[2][1] + m[1][2], m[0][2] - m[2][0])
    else:
        q = (m[0][2] + m[2][0], m[2][1] + m[1][2], 1.0 + 2.0 * m[2][2] - trace, m[1][0] - m[0][1])
    return normalise(q)


def angle_between(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Angle [rad] of the rotation between attitudes (n, 4), exact for small ones too."""
    chord = np.minimum(np.linalg.norm(p - q, axis=-1), np.linalg.norm(p + q, axis=-1))
    return 4.0 * np.arcsin(0.5 * chord)
