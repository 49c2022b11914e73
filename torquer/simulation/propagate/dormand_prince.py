"""One step, of order 8 or 5, of a motion that is smooth: between two events of the loop.

The error of a step of order 8 is Hairer's combination of the estimates of orders 5 and 3, that of
one of order 5 its difference from order 4.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import normalise
from torquer.maths.geometry.vec3 import add, add_scaled, dot
from torquer.maths.integrate import dp5_stages
from torquer.maths.integrate.dop853_stages import (
    C,
    error_3,
    error_5,
    stage_1,
    stage_2,
    stage_3,
    stage_4,
    stage_5,
    stage_6,
    stage_7,
    stage_8,
    stage_9,
    stage_10,
    stage_11,
    sum_8,
)
from torquer.simulation.propagate.forces import DipolePath, EnvironmentTables, environment_at
from torquer.spacecraft.actuators.coils import remaining
from torquer.spacecraft.actuators.turning import Turning, turn
from torquer.spacecraft.body import Rigid, motion_rates


class Smooth(NamedTuple):
    """What is smooth between two events: constants, start and age [s].

    `torque` [N m, body]: held; `turning`: () without wheels. `since_s`: age of the dipole's path at
    the start.
    """

    rigid: Rigid
    tables: EnvironmentTables
    path: DipolePath
    torque: tuple
    turning: Turning | tuple
    start_s: float
    since_s: float


class Error(NamedTuple):
    """Error of a step: attitude [rad], rate [rad/s]."""

    attitude: float
    rate: float


@inlined
def _left_at(lag_s, t, h):
    """What is left of the dipole's way at the times of the stages of a step from t on.

    Found before the stages: a call of `exp` between them would empty the registers.
    """
    if lag_s == 0.0:
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return (
        remaining(lag_s, t),
        remaining(lag_s, t + C[1] * h),
        remaining(lag_s, t + C[2] * h),
        remaining(lag_s, t + C[3] * h),
        remaining(lag_s, t + C[4] * h),
        remaining(lag_s, t + C[5] * h),
        remaining(lag_s, t + C[6] * h),
        remaining(lag_s, t + C[7] * h),
        remaining(lag_s, t + C[8] * h),
        remaining(lag_s, t + C[9] * h),
        remaining(lag_s, t + C[10] * h),
        remaining(lag_s, t + C[11] * h),
    )


@inlined
def _with_wheels(rigid, turning, torque, x, h, stage):
    """(The body with the wheels' momentum, torque with theirs) at a stage.

    The stage's number is a float: Numba compiles a function once more for every literal integer.
    """
    if len(turning) == 0:
        return rigid, torque
    momentum, reaction = turn(turning, int(stage), h, x.omega)
    momentum = add(rigid.wheel_momentum, momentum)
    body = Rigid(rigid.inertia, turning.inverse, momentum, rigid.surface, rigid.acting)
    return body, add(torque, reaction)


@inlined
def _rates(smooth, local, left, x, h, stage):
    """Rates of the motion; `left`: what is left of the dipole's way."""
    rigid, torque = _with_wheels(smooth.rigid, smooth.turning, smooth.torque, x, h, stage)
    dipole = add_scaled(smooth.path.target, left, smooth.path.way)
    return motion_rates(rigid, local, dipole, x, torque)


@inlined
def _rates_after(smooth, t, left, x, h, stage):
    local = environment_at(smooth.tables, smooth.start_s + t)
    return _rates(smooth, local, left, x, h, stage)


@inlined
def _combine(five, three):
    """Hairer's combination of squares of the two estimates."""
    weight = five + 0.01 * three
    if weight == 0.0:
        return 0.0
    return five / math.sqrt(weight)


@inlined
def attempt(smooth, local, t, x, h):
    """(Motion, environment, error) after a step from t on; `local`: the environment before it."""
    left = _left_at(smooth.path.lag_s, smooth.since_s + t, h)
    k0 = _rates(smooth, local, left[0], x, h, 0.0)
    k1 = _rates_after(smooth, t + C[1] * h, left[1], stage_1(x, h, k0), h, 1.0)
    k2 = _rates_after(smooth, t + C[2] * h, left[2], stage_2(x, h, k0, k1), h, 2.0)
    k3 = _rates_after(smooth, t + C[3] * h, left[3], stage_3(x, h, k0, k2), h, 3.0)
    k4 = _rates_after(smooth, t + C[4] * h, left[4], stage_4(x, h, k0, k2, k3), h, 4.0)
    k5 = _rates_after(smooth, t + C[5] * h, left[5], stage_5(x, h, k0, k3, k4), h, 5.0)
    k6 = _rates_after(smooth, t + C[6] * h, left[6], stage_6(x, h, k0, k3, k4, k5), h, 6.0)
    k7 = _rates_after(smooth, t + C[7] * h, left[7], stage_7(x, h, k0, k3, k4, k5, k6), h, 7.0)
    k8 = _rates_after(smooth, t + C[8] * h, left[8], stage_8(x, h, k0, k3, k4, k5, k6, k7), h, 8.0)
    k9 = _rates_after(
        smooth, t + C[9] * h, left[9], stage_9(x, h, k0, k3, k4, k5, k6, k7, k8), h, 9.0
    )
    y = stage_10(x, h, k0, k3, k4, k5, k6, k7, k8, k9)
    k10 = _rates_after(smooth, t + C[10] * h, left[10], y, h, 10.0)
    end = environment_at(smooth.tables, smooth.start_s + t + h)
    y = stage_11(x, h, k0, k3, k4, k5, k6, k7, k8, k9, k10)
    k11 = _rates(smooth, end, left[11], y, h, 11.0)
    y = sum_8(x, h, k0, k5, k6, k7, k8, k9, k10, k11)
    e5 = error_5(h, k0, k5, k6, k7, k8, k9, k10, k11)
    e3 = error_3(h, k0, k5, k6, k7, k8, k9, k10, k11)
    attitude = 2.0 * _combine(_square(e5.q), _square(e3.q))
    rate = _combine(dot(e5.omega, e5.omega), dot(e3.omega, e3.omega))
    return Motion(normalise(y.q), y.omega), end, Error(attitude, rate)


@inlined
def attempt_5(smooth, local, x, h):
    """(Motion, error) after a step of order 5 from the start: for slow motion.

    The error is that of order 4; `local`: the environment at the start.
    """
    lag_s, since_s = smooth.path.lag_s, smooth.since_s
    c = dp5_stages.C
    left, left_1 = remaining(lag_s, since_s), remaining(lag_s, since_s + c[1] * h)
    left_2, left_3 = remaining(lag_s, since_s + c[2] * h), remaining(lag_s, since_s + c[3] * h)
    left_4, left_5 = remaining(lag_s, since_s + c[4] * h), remaining(lag_s, since_s + h)
    end = environment_at(smooth.tables, smooth.start_s + h)
    k0 = _rates(smooth, local, left, x, h, 0.0)
    k1 = _rates_after(smooth, c[1] * h, left_1, dp5_stages.stage_1(x, h, k0), h, 1.0)
    k2 = _rates_after(smooth, c[2] * h, left_2, dp5_stages.stage_2(x, h, k0, k1), h, 2.0)
    k3 = _rates_after(smooth, c[3] * h, left_3, dp5_stages.stage_3(x, h, k0, k1, k2), h, 3.0)
    k4 = _rates_after(smooth, c[4] * h, left_4, dp5_stages.stage_4(x, h, k0, k1, k2, k3), h, 4.0)
    k5 = _rates(smooth, end, left_5, dp5_stages.stage_5(x, h, k0, k1, k2, k3, k4), h, 5.0)
    y = dp5_stages.sum_5(x, h, k0, k2, k3, k4, k5)
    k6 = _rates(smooth, end, left_5, y, h, 6.0)
    e = dp5_stages.error_4(h, k0, k2, k3, k4, k5, k6)
    error = Error(2.0 * math.sqrt(_square(e.q)), math.sqrt(dot(e.omega, e.omega)))
    return Motion(normalise(y.q), y.omega), error


@inlined
def _square(q):
    return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]


@inlined
def from_later(smooth, tables, after_s):
    """What is smooth, from `after_s` on, with these tables."""
    rigid, _, path, torque, turning, start_s, since_s = smooth
    return Smooth(rigid, tables, path, torque, turning, start_s + after_s, since_s + after_s)


@inlined
def with_turning(smooth, turning):
    """What is smooth, with the rotors of a step."""
    rigid, tables, path, torque, _, start_s, since_s = smooth
    return Smooth(rigid, tables, path, torque, turning, start_s, since_s)
