"""One step, of order 8 or 5, of a motion that is smooth: between two events of the loop.

The error of a step of order 8 is Hairer's combination of the estimates of orders 5 and 3, that of
one of order 5 its difference from order 4.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.compile.when_compiling import when_compiling
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

    `tables`: () where the environments at the stages are given. `torque` [N m, body]: held;
    `turning`: () without wheels. `since_s`: age of the dipole's path at the start.
    """

    rigid: Rigid
    tables: EnvironmentTables | tuple
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
def time_of_stage(start_s, t, h, part):
    """Time of a stage at a part of a step from `start_s` + t on."""
    return start_s + t + h if part == 1.0 else start_s + (t + part * h)


@inlined
def left_at(lag_s, t, h):
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
def stages_at(tables, local, start_s, t, h):
    """What `step_8` takes of the stages of a step from `start_s` + t on; `local`: before it."""
    return (
        local,
        time_of_stage(start_s, t, h, C[1]),
        time_of_stage(start_s, t, h, C[2]),
        time_of_stage(start_s, t, h, C[3]),
        time_of_stage(start_s, t, h, C[4]),
        time_of_stage(start_s, t, h, C[5]),
        time_of_stage(start_s, t, h, C[6]),
        time_of_stage(start_s, t, h, C[7]),
        time_of_stage(start_s, t, h, C[8]),
        time_of_stage(start_s, t, h, C[9]),
        time_of_stage(start_s, t, h, C[10]),
        environment_at(tables, time_of_stage(start_s, t, h, C[11])),
    )


@inlined
def left_at_5(lag_s, t, h):
    """The same as `left_at` for a step of order 5."""
    c = dp5_stages.C
    return (
        remaining(lag_s, t),
        remaining(lag_s, t + c[1] * h),
        remaining(lag_s, t + c[2] * h),
        remaining(lag_s, t + c[3] * h),
        remaining(lag_s, t + c[4] * h),
        remaining(lag_s, t + h),
    )


@inlined
def stages_at_5(tables, local, start_s, h):
    """What `step_5` takes of the stages of a step from the start on."""
    c = dp5_stages.C
    return (
        local,
        time_of_stage(start_s, 0.0, h, c[1]),
        time_of_stage(start_s, 0.0, h, c[2]),
        time_of_stage(start_s, 0.0, h, c[3]),
        time_of_stage(start_s, 0.0, h, c[4]),
        environment_at(tables, time_of_stage(start_s, 0.0, h, c[5])),
    )


def environment_of(tables, stage):
    """The environment of a stage that is given by it, or by its time, when it is looked up.

    A single run looks it up where it is needed: found before the stages, it would not fit into the
    registers (5 % slower).
    """
    return environment_at(tables, stage) if isinstance(stage, float) else stage


@when_compiling
def _overload() -> None:
    from numba import types
    from numba.extending import overload

    from torquer.compile.numba_private import INLINED_OPTIONS

    @overload(environment_of, jit_options=INLINED_OPTIONS)
    def choose(tables, stage):
        if isinstance(stage, types.Float):
            return lambda tables, stage: environment_at(tables, stage)
        return lambda tables, stage: stage


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
def _rates(smooth, around, left, x, h, stage):
    """Rates of the motion; `around`: environment or time; `left`: of the dipole's way."""
    local = environment_of(smooth.tables, around)
    rigid, torque = _with_wheels(smooth.rigid, smooth.turning, smooth.torque, x, h, stage)
    dipole = add_scaled(smooth.path.target, left, smooth.path.way)
    return motion_rates(rigid, local, dipole, x, torque)


@inlined
def _combine(five, three):
    """Hairer's combination of squares of the two estimates."""
    weight = five + 0.01 * three
    return five / (1.0 if weight == 0.0 else math.sqrt(weight))


@inlined
def step_8(smooth, around, left, x, h):
    """(Motion, error) after a step of order 8.

    Of its stages, `around`: environments, or times at which to look them up; `left`: parts of the
    dipole's way.
    """
    k0 = _rates(smooth, around[0], left[0], x, h, 0.0)
    k1 = _rates(smooth, around[1], left[1], stage_1(x, h, k0), h, 1.0)
    k2 = _rates(smooth, around[2], left[2], stage_2(x, h, k0, k1), h, 2.0)
    k3 = _rates(smooth, around[3], left[3], stage_3(x, h, k0, k2), h, 3.0)
    k4 = _rates(smooth, around[4], left[4], stage_4(x, h, k0, k2, k3), h, 4.0)
    k5 = _rates(smooth, around[5], left[5], stage_5(x, h, k0, k3, k4), h, 5.0)
    k6 = _rates(smooth, around[6], left[6], stage_6(x, h, k0, k3, k4, k5), h, 6.0)
    k7 = _rates(smooth, around[7], left[7], stage_7(x, h, k0, k3, k4, k5, k6), h, 7.0)
    k8 = _rates(smooth, around[8], left[8], stage_8(x, h, k0, k3, k4, k5, k6, k7), h, 8.0)
    k9 = _rates(smooth, around[9], left[9], stage_9(x, h, k0, k3, k4, k5, k6, k7, k8), h, 9.0)
    y = stage_10(x, h, k0, k3, k4, k5, k6, k7, k8, k9)
    k10 = _rates(smooth, around[10], left[10], y, h, 10.0)
    y = stage_11(x, h, k0, k3, k4, k5, k6, k7, k8, k9, k10)
    k11 = _rates(smooth, around[11], left[11], y, h, 11.0)
    y = sum_8(x, h, k0, k5, k6, k7, k8, k9, k10, k11)
    e5 = error_5(h, k0, k5, k6, k7, k8, k9, k10, k11)
    e3 = error_3(h, k0, k5, k6, k7, k8, k9, k10, k11)
    attitude = 2.0 * _combine(_square(e5.q), _square(e3.q))
    rate = _combine(dot(e5.omega, e5.omega), dot(e3.omega, e3.omega))
    return Motion(normalise(y.q), y.omega), Error(attitude, rate)


@inlined
def step_5(smooth, around, left, x, h):
    """(Motion, error) after a step of order 5: for slow motion. The error is that of order 4."""
    k0 = _rates(smooth, around[0], left[0], x, h, 0.0)
    k1 = _rates(smooth, around[1], left[1], dp5_stages.stage_1(x, h, k0), h, 1.0)
    k2 = _rates(smooth, around[2], left[2], dp5_stages.stage_2(x, h, k0, k1), h, 2.0)
    k3 = _rates(smooth, around[3], left[3], dp5_stages.stage_3(x, h, k0, k1, k2), h, 3.0)
    k4 = _rates(smooth, around[4], left[4], dp5_stages.stage_4(x, h, k0, k1, k2, k3), h, 4.0)
    k5 = _rates(smooth, around[5], left[5], dp5_stages.stage_5(x, h, k0, k1, k2, k3, k4), h, 5.0)
    y = dp5_stages.sum_5(x, h, k0, k2, k3, k4, k5)
    k6 = _rates(smooth, around[5], left[5], y, h, 6.0)
    e = dp5_stages.error_4(h, k0, k2, k3, k4, k5, k6)
    error = Error(2.0 * math.sqrt(_square(e.q)), math.sqrt(dot(e.omega, e.omega)))
    return Motion(normalise(y.q), y.omega), error


@inlined
def attempt(smooth, local, t, x, h):
    """(Motion, environment, error) after a step from t on; `local`: the environment before it."""
    around = stages_at(smooth.tables, local, smooth.start_s, t, h)
    left = left_at(smooth.path.lag_s, smooth.since_s + t, h)
    y, error = step_8(smooth, around, left, x, h)
    return y, around[11], error


@inlined
def attempt_5(smooth, local, x, h):
    """(Motion, error) after a step of order 5 from the start; `local`: the environment there."""
    around = stages_at_5(smooth.tables, local, smooth.start_s, h)
    left = left_at_5(smooth.path.lag_s, smooth.since_s, h)
    return step_5(smooth, around, left, x, h)


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
