"""Steps that keep a tolerance, between two events of the loop.

Of order 8, or of order 5 where the interval is short for the motion: one step of the whole interval
between two control steps costs less than RK4's short ones, and is far more exact. The steps to try
next are part of the state, so that a run goes on bit for bit after a stop.

What a step may add to the error is in proportion to its length: then the sum over a run does not
depend on the number of steps. No less than rounding is asked for.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.environment.light import next_edge
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.vec3 import dot
from torquer.simulation.propagate.dormand_prince import (
    Smooth,
    attempt,
    attempt_5,
    from_later,
    with_turning,
)
from torquer.simulation.propagate.forces import environment_at, with_light_between
from torquer.spacecraft.actuators.turning import (
    begin_turning,
    end_turning,
    part_to_change,
    time_to_change,
)

#: Least error that is asked of a step: rounding, of the attitude [rad] and as part of the rate.
_ROUNDING_RAD, _ROUNDING = 2e-15, 1e-15
#: Growth and reduction of a step after another.
_GROWTH, _REDUCTION, _SAFETY = 6.0, 0.2, 0.9
#: An error a second is of this order in the step.
_ORDER = 7.0
#: The ratio of error to tolerance below which a step grows as far as it may; by half.
_TINY, _EASY = (_SAFETY / _GROWTH) ** _ORDER, (_SAFETY / 1.5) ** _ORDER
_GROWTH_WHEN_EASY = 1.5
#: How the interval that order 5 is tried on changes: when it fails, and with every step of order 8.
_LESS, MORE = 0.6, 1.02
#: Shortest step [s]: no satellite moves so fast that it needs a shorter one.
LEAST_STEP_S = 1e-7
#: Most steps from one event to the next.
MOST_STEPS = 1_000_000


class Auto(NamedTuple):
    """Adaptive steps: the error that they may make in a second, of attitude and rate.

    `longest_s`: no step is longer. `work`, `tableau`: space and weights for the wheels' rotors, ()
    in lanes.
    """

    attitude_rad_s: float
    rate_rad_s2: float
    longest_s: float
    work: np.ndarray | tuple[()]
    tableau: np.ndarray | tuple[()]


@inlined
def count_step(cells, h, error, taken):
    """Add a step, if it is taken, to the sums: an error of the rate goes on as one of the attitude.

    `taken` chooses between numbers, not between ways: then members side by side are vectors.
    """
    least_s, grown = min(cells.least_step_s, h), error.attitude + h * cells.error_rad_s
    cells.steps += 1.0 if taken else 0.0
    cells.least_step_s = least_s if taken else cells.least_step_s
    cells.error_rad += grown if taken else 0.0
    cells.error_rad_s += error.rate if taken else 0.0


@inlined
def ratio_of(integrator, x, h, error):
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


@inlined
def _shrunk(h, ratio):
    """The step to try after one that failed; also of a ratio that is not a number."""
    return h * min(_growth(ratio), _SAFETY) if ratio < math.inf else 0.1 * h


@inlined
def next_step(integrator, cells, t, length_s):
    """(Length of the step to try at t of an interval, time after it)."""
    left, wanted = length_s - t, min(cells.next_step_s, integrator.longest_s)
    if wanted >= left:
        return left, length_s
    h = left / math.ceil(left / wanted)
    return h, t + h


@inlined
def learn_from(cells, h, ratio):
    """Find the step to try after one of this ratio; whether it has not vanished."""
    if ratio <= 1.0:
        cells.next_step_s = h * _growth(ratio)
        return True
    cells.next_step_s = _shrunk(h, ratio)
    return cells.next_step_s > LEAST_STEP_S


@inlined
def next_slow_step(slow_s, length_s, ratio):
    """The interval to try order 5 on after it was tried on one; `slow_s`: the one before."""
    longer = max(slow_s, _GROWTH_WHEN_EASY * length_s)
    shorter = _LESS * length_s * MORE
    if ratio <= 1.0:
        return longer if ratio <= _EASY else slow_s
    return shorter


@inlined
def in_steps(integrator, smooth, cells, x, local, length_s):
    """Motion after an interval, in equal steps; not a number where they vanish."""
    t = 0.0
    for _ in range(MOST_STEPS):
        if t == length_s:
            return x
        h, then = next_step(integrator, cells, t, length_s)
        y, end, error = attempt(smooth, local, t, x, h)
        ratio = ratio_of(integrator, x, h, error)
        if ratio <= 1.0:
            t, x, local = then, y, end
            count_step(cells, h, error, True)
        if not learn_from(cells, h, ratio):
            break
    cells.next_step_s = 0.0
    return Motion(x.q, (math.nan, math.nan, math.nan))


@kernel
def in_steps_with_wheels(integrator, smooth, cells, wheels, x, local, length_s, step):
    """Motion after an interval with wheels, in steps.

    A step ends where a rotor stops, starts or reaches its limit. Not a number where they vanish.
    After a step that was too short to count, no change is foreseen: the body may turn a rotor away
    from its limit as fast as its motor drives it there. `part_to_change` finds one that passes.
    """
    t, shorter, foreseen = 0.0, math.inf, True
    for _ in range(MOST_STEPS):
        if t == length_s:
            return x
        turning = begin_turning(
            wheels.rotors, wheels.state, integrator.work, integrator.tableau,
            smooth.rigid.inertia, x.omega, step,
        )  # fmt: skip
        now = with_turning(smooth, turning)
        left = length_s - t
        wanted = left / math.ceil(left / min(cells.next_step_s, integrator.longest_s))
        change_s = time_to_change(turning) if foreseen else math.inf
        h = min(wanted, change_s, shorter)
        y, end, error = attempt(now, local, t, x, h)
        ratio = ratio_of(integrator, x, h, error)
        if ratio <= 1.0:
            part = part_to_change(turning, h, y.omega)
            if part == 0.0:
                continue
            if part < 1.0:
                shorter = h * part
                continue
            end_turning(turning, wheels.state, h, y.omega)
            t = length_s if h >= left else t + h
            x, local, shorter = y, end, math.inf
            foreseen = h != change_s or h > LEAST_STEP_S
            count_step(cells, h, error, True)
            grown = h * _growth(ratio)
            cells.next_step_s = grown if h == wanted else max(cells.next_step_s, grown)
        else:
            cells.next_step_s = _shrunk(h, ratio)
            if cells.next_step_s <= LEAST_STEP_S:
                break
    cells.next_step_s = 0.0
    return Motion(x.q, (math.nan, math.nan, math.nan))


@inlined
def propagate_smooth(integrator, smooth, cells, wheels, x, local, length_s, step):
    """Motion after an interval without events: a step of order 5 may do."""
    if len(wheels) > 0:
        return in_steps_with_wheels(integrator, smooth, cells, wheels, x, local, length_s, step)
    if length_s <= integrator.longest_s:
        if cells.slow_step_s >= length_s:
            y, error = attempt_5(smooth, local, x, length_s)
            ratio = ratio_of(integrator, x, length_s, error)
            cells.slow_step_s = next_slow_step(cells.slow_step_s, length_s, ratio)
            if ratio <= 1.0:
                count_step(cells, length_s, error, True)
                return y
        else:
            cells.slow_step_s *= MORE
    return in_steps(integrator, smooth, cells, x, local, length_s)


@inlined
def propagate_in_light(integrator, smooth, light, cells, wheels, x, local, length_s, step):
    """Motion after an interval, in steps that end where the sunlight jumps or bends.

    `light`: () for none.
    """
    if len(light) == 0:
        return propagate_smooth(integrator, smooth, cells, wheels, x, local, length_s, step)
    t, edge_s = 0.0, next_edge(light, smooth.start_s)
    while t < length_s:
        end = min(edge_s - smooth.start_s, length_s)
        edge_s = next_edge(light, edge_s)
        if end == t:  # by rounding
            continue
        tables = with_light_between(smooth.tables, smooth.start_s + t, smooth.start_s + end)
        part = from_later(smooth, tables, t)
        local = environment_at(tables, smooth.start_s + t)
        x = propagate_smooth(integrator, part, cells, wheels, x, local, end - t, step)
        t = end
    return x


@inlined
def next_failure(wheels, step, last):
    """The step at which the next motor dies, `last` at the latest."""
    if len(wheels) == 0:
        return last
    return next_death(wheels.rotors.rows, step, last)


@inlined
def next_death(rows, step, last):
    """The step at which the next motor of these rotors dies, `last` at the latest."""
    for k in range(rows.shape[0]):
        if step < rows[k].dead_from < last:
            last = int(rows[k].dead_from)
    return last


@inlined
def by_auto(integrator, forces, cells, x, local, first, last, h):
    """Motion after steps first..last-1 of the time grid; `local`: the environment before."""
    rigid, tables, path, held, wheels = forces
    step = first
    while step < last:
        until, since_s = next_failure(wheels, step, last), (step - first) * h
        smooth = Smooth(rigid, tables, path, held, (), step * h, since_s)
        x = propagate_in_light(
            integrator, smooth, tables.light, cells, wheels, x, local, (until - step) * h, step
        )
        step = until
        if step < last:
            local = environment_at(tables, step * h)
    return x
