"""Steps of order 8 that keep a tolerance, between two events of the loop.

Dormand-Prince 8(5,3) in registers: a step of the whole interval between two control steps costs
less than RK4's short ones, and is far more exact. The step to try next is part of the state, so
that a run goes on bit for bit after a stop.

The error of a step is Hairer's combination of the estimates of orders 5 and 3. What a step may add
is in proportion to its length: then the sum over a run does not depend on the number of steps. No
less than rounding is asked for.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.engine import inlined, inner, internal
from torquer.geometry.motion import Motion
from torquer.geometry.quaternion import normalised
from torquer.geometry.vec3 import add, add_scaled, dot
from torquer.integrate import dp5_stages
from torquer.integrate.dop853_stages import (
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
from torquer.simulation.forces import DipolePath, EnvironmentTables, environment_at
from torquer.spacecraft.body import Rigid, motion_rates
from torquer.spacecraft.coils import remaining
from torquer.spacecraft.disturbance import disturbance_torque_at
from torquer.spacecraft.turning import (
    Turning,
    begin_turning,
    end_turning,
    part_to_change,
    time_to_change,
    turn,
)

#: Least error that is asked of a step: rounding, of the attitude [rad] and as part of the rate.
_ROUNDING_RAD, _ROUNDING = 2e-15, 1e-15
#: Growth and reduction of a step after another.
_GROWTH, _REDUCTION, _SAFETY = 6.0, 0.2, 0.9
#: An error a second is of this order in the step.
_ORDER = 7.0
#: The ratio of error to tolerance below which a step grows as far as it may; and half as much.
_TINY, _EASY = (_SAFETY / _GROWTH) ** _ORDER, (_SAFETY / 1.5) ** _ORDER
_GROWTH_WHEN_EASY = 1.5
#: How the interval that order 5 is tried on changes: when it fails, and with every step of order 8.
_LESS, _MORE = 0.6, 1.02
#: Shortest step [s]: a motion that needs a shorter one is none of a satellite.
LEAST_STEP_S = 1e-7
#: Most steps from one event to the next.
MOST_STEPS = 1_000_000


class Auto(NamedTuple):
    """Steps of order 8; the error that they may make in a second, of attitude and rate.

    `work`, `tableau`: space and weights for the wheels' rotors.
    """

    attitude_rad_s: float
    rate_rad_s2: float
    work: np.ndarray
    tableau: np.ndarray


class Smooth(NamedTuple):
    """What is smooth between two events: constants, start and age [s].

    `torque`, `turning`: () without disturbance torque, without wheels. `since_s`: age of the
    dipole's path at the start.
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


@internal
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


@internal
def _with_wheels(rigid, turning, torque, x, h, stage):
    """(The body with the wheels' momentum, torque with theirs) at a stage."""
    if len(turning) == 0:
        return rigid, torque
    momentum, reaction = turn(turning, stage, h, x.omega)
    momentum = add(rigid.wheel_momentum, momentum)
    body = Rigid(rigid.inertia, turning.inverse, momentum, rigid.surface)
    if len(torque) == 0:
        return body, reaction
    return body, add(torque, reaction)


@internal
def _rates(smooth, here, left, x, h, stage):
    """Rates of the motion; `left`: what is left of the dipole's way."""
    rigid, torque = _with_wheels(smooth.rigid, smooth.turning, smooth.torque, x, h, stage)
    dipole = add_scaled(smooth.path.target, left, smooth.path.way)
    return motion_rates(rigid, here, dipole, x, torque)


@internal
def _rates_after(smooth, t, left, x, h, stage):
    here = environment_at(smooth.tables, smooth.start_s + t)
    return _rates(smooth, here, left, x, h, stage)


@inlined
def _combined(five, three):
    """Hairer's combination of squares of the two estimates."""
    weight = five + 0.01 * three
    if weight == 0.0:
        return 0.0
    return five / math.sqrt(weight)


@internal
def attempt(smooth, here, t, x, h):
    """(Motion, environment, error) after a step from t on; `here`: the environment before it."""
    left = _left_at(smooth.path.lag_s, smooth.since_s + t, h)
    k0 = _rates(smooth, here, left[0], x, h, 0)
    k1 = _rates_after(smooth, t + C[1] * h, left[1], stage_1(x, h, k0), h, 1)
    k2 = _rates_after(smooth, t + C[2] * h, left[2], stage_2(x, h, k0, k1), h, 2)
    k3 = _rates_after(smooth, t + C[3] * h, left[3], stage_3(x, h, k0, k2), h, 3)
    k4 = _rates_after(smooth, t + C[4] * h, left[4], stage_4(x, h, k0, k2, k3), h, 4)
    k5 = _rates_after(smooth, t + C[5] * h, left[5], stage_5(x, h, k0, k3, k4), h, 5)
    k6 = _rates_after(smooth, t + C[6] * h, left[6], stage_6(x, h, k0, k3, k4, k5), h, 6)
    k7 = _rates_after(smooth, t + C[7] * h, left[7], stage_7(x, h, k0, k3, k4, k5, k6), h, 7)
    k8 = _rates_after(smooth, t + C[8] * h, left[8], stage_8(x, h, k0, k3, k4, k5, k6, k7), h, 8)
    k9 = _rates_after(
        smooth, t + C[9] * h, left[9], stage_9(x, h, k0, k3, k4, k5, k6, k7, k8), h, 9
    )
    y = stage_10(x, h, k0, k3, k4, k5, k6, k7, k8, k9)
    k10 = _rates_after(smooth, t + C[10] * h, left[10], y, h, 10)
    end = environment_at(smooth.tables, smooth.start_s + t + h)
    y = stage_11(x, h, k0, k3, k4, k5, k6, k7, k8, k9, k10)
    k11 = _rates(smooth, end, left[11], y, h, 11)
    y = sum_8(x, h, k0, k5, k6, k7, k8, k9, k10, k11)
    e5 = error_5(h, k0, k5, k6, k7, k8, k9, k10, k11)
    e3 = error_3(h, k0, k5, k6, k7, k8, k9, k10, k11)
    attitude = 2.0 * _combined(_square(e5.q), _square(e3.q))
    rate = _combined(dot(e5.omega, e5.omega), dot(e3.omega, e3.omega))
    return Motion(normalised(y.q), y.omega), end, Error(attitude, rate)


@internal
def attempt_5(smooth, here, x, h):
    """The same from the start, of order 5: for slow motion. The error is that of order 4."""
    lag_s, since_s = smooth.path.lag_s, smooth.since_s
    c = dp5_stages.C
    left, left_1 = remaining(lag_s, since_s), remaining(lag_s, since_s + c[1] * h)
    left_2, left_3 = remaining(lag_s, since_s + c[2] * h), remaining(lag_s, since_s + c[3] * h)
    left_4, left_5 = remaining(lag_s, since_s + c[4] * h), remaining(lag_s, since_s + h)
    end = environment_at(smooth.tables, smooth.start_s + h)
    k0 = _rates(smooth, here, left, x, h, 0)
    k1 = _rates_after(smooth, c[1] * h, left_1, dp5_stages.stage_1(x, h, k0), h, 1)
    k2 = _rates_after(smooth, c[2] * h, left_2, dp5_stages.stage_2(x, h, k0, k1), h, 2)
    k3 = _rates_after(smooth, c[3] * h, left_3, dp5_stages.stage_3(x, h, k0, k1, k2), h, 3)
    k4 = _rates_after(smooth, c[4] * h, left_4, dp5_stages.stage_4(x, h, k0, k1, k2, k3), h, 4)
    k5 = _rates(smooth, end, left_5, dp5_stages.stage_5(x, h, k0, k1, k2, k3, k4), h, 5)
    y = dp5_stages.sum_5(x, h, k0, k2, k3, k4, k5)
    k6 = _rates(smooth, end, left_5, y, h, 6)
    e = dp5_stages.error_4(h, k0, k2, k3, k4, k5, k6)
    error = Error(2.0 * math.sqrt(_square(e.q)), math.sqrt(dot(e.omega, e.omega)))
    return Motion(normalised(y.q), y.omega), end, error


@inlined
def _square(q):
    return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]


@internal
def _count(cells, h, error):
    """Add a step to the sums: an error of the rate goes on as one of the attitude."""
    cells.steps += 1.0
    cells.least_step_s = min(cells.least_step_s, h)
    cells.error_rad += error.attitude + h * cells.error_rad_s
    cells.error_rad_s += error.rate


@inlined
def _ratio(integrator, x, h, error):
    """Error of a step as a multiple of what it may make."""
    rounding = _ROUNDING * math.sqrt(dot(x.omega, x.omega))
    attitude = max(integrator.attitude_rad_s * h, _ROUNDING_RAD)
    rate = max(integrator.rate_rad_s2 * h, rounding)
    return max(error.attitude / attitude, error.rate / rate)


@inlined
def _growth(ratio):
    """By what a step may grow after one of this ratio; below 1: must shrink."""
    if ratio <= _TINY:  # spares the power
        return _GROWTH
    return max(_SAFETY * ratio ** (-1.0 / _ORDER), _REDUCTION)


@inner
def in_steps(integrator, smooth, cells, x, here, length_s):
    """(Motion, environment) after an interval, in equal steps; not a number where they vanish."""
    t = 0.0
    for _ in range(MOST_STEPS):
        if t == length_s:
            return x, here
        left = length_s - t
        whole = cells.next_step_s >= left
        h = left if whole else left / math.ceil(left / cells.next_step_s)
        y, end, error = attempt(smooth, here, t, x, h)
        ratio = _ratio(integrator, x, h, error)
        factor = _growth(ratio)
        if ratio <= 1.0:
            t = length_s if whole else t + h
            x, here = y, end
            _count(cells, h, error)
            cells.next_step_s = h * factor
        else:
            # also reached by a ratio that is not a number
            cells.next_step_s = h * min(factor, _SAFETY) if ratio < math.inf else 0.1 * h
            if cells.next_step_s <= LEAST_STEP_S:
                break
    cells.next_step_s = 0.0
    return Motion(x.q, (math.nan, math.nan, math.nan)), here


@inner
def in_steps_with_wheels(integrator, smooth, cells, wheels, x, here, length_s, step):
    """The same with wheels: a step ends where a rotor stops, starts or reaches its limit."""
    t, shorter = 0.0, math.inf
    for _ in range(MOST_STEPS):
        if t == length_s:
            return x, here
        turning = begin_turning(
            wheels.rotors, wheels.state, integrator.work, integrator.tableau,
            smooth.rigid.inertia, x.omega, step,
        )  # fmt: skip
        now = with_turning(smooth, turning)
        left = length_s - t
        wanted = left / max(math.ceil(left / cells.next_step_s), 1.0)
        h = min(wanted, time_to_change(turning), shorter)
        y, end, error = attempt(now, here, t, x, h)
        ratio = _ratio(integrator, x, h, error)
        factor = _growth(ratio)
        if ratio <= 1.0:
            part = part_to_change(turning, h, y.omega)
            if part < 1.0:
                shorter = h * part
                continue
            end_turning(turning, wheels.state, h, y.omega)
            t = length_s if h >= left else t + h
            x, here, shorter = y, end, math.inf
            _count(cells, h, error)
            cells.next_step_s = h * factor if h == wanted else max(cells.next_step_s, h * factor)
        else:
            cells.next_step_s = h * min(factor, _SAFETY) if ratio < math.inf else 0.1 * h
            if cells.next_step_s <= LEAST_STEP_S:
                break
    cells.next_step_s = 0.0
    return Motion(x.q, (math.nan, math.nan, math.nan)), here


@internal
def with_turning(smooth, turning):
    """The same with the rotors of a step."""
    rigid, tables, path, torque, _, start_s, since_s = smooth
    return Smooth(rigid, tables, path, torque, turning, start_s, since_s)


@internal
def propagate_smooth(integrator, smooth, cells, wheels, x, here, length_s, step):
    """(Motion, environment) after an interval without events: in one step if it is good enough."""
    if len(wheels) > 0:
        return in_steps_with_wheels(integrator, smooth, cells, wheels, x, here, length_s, step)
    if cells.slow_step_s >= length_s:
        y, end, error = attempt_5(smooth, here, x, length_s)
        ratio = _ratio(integrator, x, length_s, error)
        if ratio <= 1.0:
            _count(cells, length_s, error)
            if ratio <= _EASY:
                cells.slow_step_s = max(cells.slow_step_s, _GROWTH_WHEN_EASY * length_s)
            return y, end
        cells.slow_step_s = _LESS * length_s
    cells.slow_step_s *= _MORE
    if cells.next_step_s >= length_s:
        y, end, error = attempt(smooth, here, 0.0, x, length_s)
        ratio = _ratio(integrator, x, length_s, error)
        if ratio <= 1.0:
            _count(cells, length_s, error)
            cells.next_step_s = length_s * _growth(ratio)
            return y, end
        if ratio < math.inf:
            cells.next_step_s = length_s * min(_growth(ratio), _SAFETY)
    return in_steps(integrator, smooth, cells, x, here, length_s)


@internal
def end_of_hold(disturbance, step, last):
    """The step at which the random torque changes, `last` at the latest."""
    if len(disturbance) == 0:
        return last
    return min(last, step - step % disturbance.hold_steps + disturbance.hold_steps)


@internal
def next_failure(wheels, step, last):
    """The step at which the next motor dies, `last` at the latest."""
    if len(wheels) == 0:
        return last
    rows = wheels.rotors.rows
    for k in range(rows.shape[0]):
        if step < rows[k].dead_from < last:
            last = int(rows[k].dead_from)
    return last


@internal
def by_auto(integrator, forces, cells, x, here, first, last, h):
    """(Motion, environment) after steps first..last-1 of the time grid."""
    step = first
    while step < last:
        until = next_failure(forces.wheels, step, end_of_hold(forces.disturbance, step, last))
        torque = disturbance_torque_at(forces.disturbance, step, forces.seed)
        since_s = (step - first) * h
        smooth = Smooth(forces.rigid, forces.tables, forces.path, torque, (), step * h, since_s)
        length_s = (until - step) * h
        x, here = propagate_smooth(
            integrator, smooth, cells, forces.wheels, x, here, length_s, step
        )
        step = until
    return x, here
