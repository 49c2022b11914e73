"""Sigma-point filter on the quaternion (USQUE), to compare the linear filter with.

The attitude error of each sigma point is a vector of generalised Rodrigues parameters,
p = 4 tan(angle/4) about the axis, regular up to a whole turn. J. Crassidis, F. Markley, 'Unscented
filtering for spacecraft attitude estimation' (2003). States and noise as of the filter with a
gyro; no bias of the magnetometer. Beyond the publication, each correction turns the covariance
(`covariance.turn_attitude`): it then loses fewer runs from large errors, but still more than the
linear filter with the same turn (design/0010).
"""

import math
from typing import Literal

from pydantic import model_validator

from torquer.engine import inlined, kernel
from torquer.estimation.covariance import frame_across, take_gain, turn_attitude
from torquer.estimation.estimator import Estimator
from torquer.estimation.kalman import as_of_now, keys_of, memory_of
from torquer.estimation.kalman_gyro import (
    GyroFilter,
    estimate_of,
    has_attitude,
)
from torquer.estimation.triad import field_at, put_quaternion, quaternion_of
from torquer.geometry.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    normalised,
    rotate_inverse,
)
from torquer.geometry.vec3 import (
    add,
    add_scaled,
    dot,
    norm,
    put_vector,
    scale,
    sub,
    unit,
    vector_of,
)
from torquer.interface import UNKNOWN_ESTIMATE

#: Number of states; lambda + n, and weights of the centre and of each other point.
_N, _SPREAD, _CENTRE, _OTHER = 6, 7.0, 1.0 / 7.0, 1.0 / 14.0
#: Variance [rad^2] of an attitude of which nothing is known: points 134 deg away.
_PRIOR = 1.0


@inlined
def quaternion_of_grp(p):
    """Quaternion of generalised Rodrigues parameters 4 tan(angle/4)."""
    square = dot(p, p)
    w = (16.0 - square) / (16.0 + square)
    s = 0.25 * (1.0 + w)
    return (s * p[0], s * p[1], s * p[2], w)


@inlined
def grp_of_quaternion(q):
    """Generalised Rodrigues parameters of a rotation, the shorter way."""
    sign = -1.0 if q[3] < 0.0 else 1.0
    return scale(4.0 * sign / (1.0 + sign * q[3]), (q[0], q[1], q[2]))


@inlined
def put_root(p, root, attitude_noise, bias_noise):
    """Cholesky factor of (n + lambda)(P + noise), lower, row by row."""
    for i in range(_N):
        for j in range(i + 1):
            s = p[_N * i + j]
            if i == j:
                s += attitude_noise if i < 3 else bias_noise
            s *= _SPREAD
            for k in range(j):
                s -= root[_N * i + k] * root[_N * j + k]
            root[_N * i + j] = math.sqrt(s) if i == j else s / root[_N * j + j]


@inlined
def deviation_of(root, point, at):
    """Deviation of a sigma point (0: the centre) in three states from place `at` on."""
    if point == 0:
        return (0.0, 0.0, 0.0)
    column, sign = (point - 1) // 2, 1.0 if point % 2 == 1 else -1.0
    x = sign * root[_N * at + column] if at >= column else 0.0
    y = sign * root[_N * (at + 1) + column] if at + 1 >= column else 0.0
    z = sign * root[_N * (at + 2) + column] if at + 2 >= column else 0.0
    return (x, y, z)


@inlined
def propagate(inputs, parameters, memory):
    """Carry the sigma points on to now; half of the noise before, half after."""
    dt = inputs.t_s - memory.t_s
    white = 0.5 * dt * (parameters.white - parameters.walk * dt * dt / 6.0)
    walk = 0.5 * dt * parameters.walk
    p, points, root = memory.covariance, memory.points, memory.root
    put_root(p, root, white, walk)
    read = scale(0.5, add(vector_of(memory.omega_read), inputs.omega_body_rad_s))
    bias, q = vector_of(memory.states), quaternion_of(memory.q)
    centre = multiply(q, from_rotation_vector(scale(dt, sub(read, bias))))
    mean, mean_bias = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(2 * _N + 1):
        own = add(bias, deviation_of(root, k, 3))
        start = multiply(q, quaternion_of_grp(deviation_of(root, k, 0)))
        after = multiply(start, from_rotation_vector(scale(dt, sub(read, own))))
        grp = grp_of_quaternion(multiply(conjugate(centre), after))
        points[_N * k], points[_N * k + 1], points[_N * k + 2] = grp
        points[_N * k + 3], points[_N * k + 4], points[_N * k + 5] = own
        weight = _CENTRE if k == 0 else _OTHER
        mean, mean_bias = add_scaled(mean, weight, grp), add_scaled(mean_bias, weight, own)
    states = memory.correction
    states[0], states[1], states[2] = mean
    states[3], states[4], states[5] = mean_bias
    for i in range(_N):
        for j in range(i, _N):
            s = 0.0
            if i == j:
                s = white if i < 3 else walk
            for k in range(2 * _N + 1):
                weight = _CENTRE if k == 0 else _OTHER
                apart = points[_N * k + i] - states[i]
                s += weight * apart * (points[_N * k + j] - states[j])
            p[_N * i + j] = p[_N * j + i] = s
    put_quaternion(memory.q, normalised(multiply(centre, quaternion_of_grp(mean))))
    put_vector(memory.states, mean_bias)
    memory.t_s = inputs.t_s
    return dt


@inlined
def take_direction(memory, reference, measured, variance, gate):
    """Update by a direction: measured (body) of a reference (inertial) of length one.

    Components across the expected direction come first.
    """
    root, points, gain = memory.root, memory.points, memory.gain
    put_root(memory.covariance, root, 0.0, 0.0)
    q = quaternion_of(memory.q)
    expected = rotate_inverse(q, reference)
    t, u = frame_across(expected)
    mean = (0.0, 0.0, 0.0)
    for k in range(2 * _N + 1):
        turned = multiply(q, quaternion_of_grp(deviation_of(root, k, 0)))
        seen = rotate_inverse(turned, reference)
        z = (dot(t, seen), dot(u, seen), dot(expected, seen))
        points[_N * k], points[_N * k + 1], points[_N * k + 2] = z
        mean = add_scaled(mean, _CENTRE if k == 0 else _OTHER, z)
    xx, yy, zz, xy, xz, yz = variance, variance, variance, 0.0, 0.0, 0.0
    for i in range(3 * _N):
        gain[i] = 0.0
    for k in range(2 * _N + 1):
        x, y, z = sub((points[_N * k], points[_N * k + 1], points[_N * k + 2]), mean)
        weight = _CENTRE if k == 0 else _OTHER
        xx, yy, zz = xx + weight * x * x, yy + weight * y * y, zz + weight * z * z
        xy, xz, yz = xy + weight * x * y, xz + weight * x * z, yz + weight * y * z
        for at in range(0, _N, 3):
            apart = deviation_of(root, k, at)
            for i in range(3):
                gain[at + i] += weight * apart[i] * x
                gain[_N + at + i] += weight * apart[i] * y
                gain[2 * _N + at + i] += weight * apart[i] * z
    read = (dot(t, measured), dot(u, measured), dot(expected, measured))
    s = (xx, yy, zz, xy, xz, yz)
    c = memory.correction
    found = take_gain(memory.covariance, gain, c, sub(read, mean), s, 3, gate)
    if found.accepted:
        turn = quaternion_of_grp((c[0], c[1], c[2]))
        turn_attitude(memory.covariance, _N, turn)
        put_quaternion(memory.q, normalised(multiply(q, turn)))
        put_vector(memory.states, add(vector_of(memory.states), (c[3], c[4], c[5])))
    else:
        memory.refused += 1.0
    return found


@inlined
def take_readings(inputs, sensing, memory, omega):
    """Update by magnetometer and Sun sensors, where they have been read since."""
    put_vector(memory.innovation_magnetometer, (math.nan, math.nan, math.nan))
    put_vector(memory.innovation_sun, (math.nan, math.nan, math.nan))
    at, b = inputs.read_at.magnetometer_s, inputs.b_body_t
    if sensing.magnetometer != 0.0 and at > memory.field_s and dot(b, b) > 0.0:
        memory.field_s = at
        reference = field_at(inputs, at)
        size = 1.0 / norm(reference)
        read = scale(size, as_of_now(omega, inputs.t_s - at, b))
        r = sensing.r_field * size * size
        found = take_direction(memory, unit(reference), read, r, sensing.gate_3)
        e = found.innovation
        put_vector(memory.innovation_magnetometer, (e[0], e[1], math.nan))
        memory.field_refused = 0.0 if found.accepted else memory.field_refused + 1.0
    at, sun = inputs.read_at.sun_sensors_s, inputs.sun_body
    if sensing.sun != 0.0 and at > memory.sun_s and dot(sun, sun) > 0.0:
        memory.sun_s = at
        reference, read = inputs.ephemeris.sun_inertial, as_of_now(omega, inputs.t_s - at, sun)
        found = take_direction(memory, reference, read, sensing.r_sun, sensing.gate_3)
        e = found.innovation
        put_vector(memory.innovation_sun, (e[0], e[1], math.nan))
        memory.sun_refused = 0.0 if found.accepted else memory.sun_refused + 1.0


@kernel
def usque(inputs, parameters, memory):
    """One step: propagate, then take what has been read of field and Sun."""
    if not has_attitude(inputs, parameters, memory, _PRIOR):
        return UNKNOWN_ESTIMATE
    dt = propagate(inputs, parameters, memory)
    omega = sub(inputs.omega_body_rad_s, vector_of(memory.states))
    take_readings(inputs, parameters.sensing, memory, omega)
    put_vector(memory.omega_read, inputs.omega_body_rad_s)
    return estimate_of(inputs, parameters, memory, dt)


class Usque(GyroFilter):
    """Sigma-point filter on the quaternion, with a gyro, to compare `kalman_gyro` with."""

    __doc__ = f"{__doc__}{keys_of(GyroFilter)}"

    kind: Literal["usque"] = "usque"

    @model_validator(mode="after")
    def _no_bias_of_the_magnetometer(self):
        if self.magnetometer_bias_sigma_nt is not None:
            raise ValueError(
                "magnetometer_bias_sigma_nt: must be left out with kind 'usque'; received "
                f"{self.magnetometer_bias_sigma_nt:g}"
            )
        return self

    def estimator(self) -> Estimator:
        """The filter, not yet started."""
        cells = {"points": (0.0,) * ((2 * _N + 1) * _N), "root": (0.0,) * (_N * _N)}
        memory = memory_of((0.0,) * 3, omega_read=(0.0, 0.0, 0.0), **cells)
        return Estimator(
            self.kind, usque, self.constants(), memory, self.logs(), self.needs, spec=self
        )
