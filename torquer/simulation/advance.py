"""The motion between two events of the loop, by the integrator that the plan names.

The innermost loops. They take just the numbers that they need, not the whole plan: every array
that crosses a call costs reference counting, and a smaller function compiles to better code.
"""

from typing import NamedTuple

import numpy as np

from torquer.engine import inlined, kernel
from torquer.environment.table import Table, lookup3, lookup6
from torquer.geometry.quaternion import normalised
from torquer.geometry.vec3 import add_scaled, scale
from torquer.integrate.dop853 import DONE, dop853, rates_of
from torquer.integrate.rk4 import Motion, moved, rk4_sum
from torquer.integrate.splitting import NODES, drift, kick
from torquer.spacecraft.body import Rigid, World, motion_rates, torque_body
from torquer.spacecraft.coils import remaining
from torquer.spacecraft.disturbance import push_at


class DipolePath(NamedTuple):
    """Dipole [A m^2, body] from an event on: `target` + `way` exp(-t/lag)."""

    target: tuple
    way: tuple
    lag_s: float


@inlined
def dipole_after(path, t):
    """Dipole t seconds after the event."""
    return add_scaled(path.target, remaining(path.lag_s, t), path.way)


class Around(NamedTuple):
    """What the orbit brings: table of position, field and tide; of the air's flow, () for none.

    `gravity`: 1, or 0 for a run without gravity gradient.
    """

    orbit: Table
    air: Table | tuple
    gravity: float


@inlined
def _flow_at(air, t):
    if len(air) == 0:
        return ()
    return lookup3(air, t)


@inlined
def environment_at(around, t):
    """The world at time t [s]."""
    b, tide = lookup6(around.orbit, t, 3)
    return World(b, scale(around.gravity, tide), _flow_at(around.air, t))


@kernel
def by_rk4(rigid, around, path, push, x, here, first, last, h):
    """(Motion, environment) after steps first..last-1 by RK4; `here` is the environment before.

    Two looks at the environment a step.
    """
    for step in range(first, last):
        middle = environment_at(around, (step + 0.5) * h)
        end = environment_at(around, (step + 1) * h)
        since = (step - first) * h
        dipole, extra = dipole_after(path, since + 0.5 * h), push_at(push, step)
        k1 = motion_rates(rigid, here, dipole_after(path, since), x, extra)
        k2 = motion_rates(rigid, middle, dipole, moved(x, 0.5 * h, k1), extra)
        k3 = motion_rates(rigid, middle, dipole, moved(x, 0.5 * h, k2), extra)
        k4 = motion_rates(rigid, end, dipole_after(path, since + h), moved(x, h, k3), extra)
        x, here = rk4_sum(x, h, k1, k2, k3, k4), end
    return x, here


@kernel
def _kicked(rigid, around, path, extra, x, t, since, h):
    world = environment_at(around, t)
    torque = torque_body(rigid, world, dipole_after(path, since), x.q, extra)
    return kick(rigid.inertia, rigid.wheel_momentum, torque, x, h)


@kernel
def by_splitting(rigid, principal, around, path, push, x, first, last, h):
    """Motion after steps first..last-1: exact free rotation between two kicks a step."""
    moments, axes = principal
    early, late = NODES
    for step in range(first, last):
        t, since, extra = step * h, (step - first) * h, push_at(push, step)
        sooner, later, half = early * h, late * h, 0.5 * h
        x = drift(moments, axes, x, sooner)
        x = _kicked(rigid, around, path, extra, x, t + sooner, since + sooner, half)
        x = drift(moments, axes, x, later - sooner)
        x = _kicked(rigid, around, path, extra, x, t + later, since + later, half)
        x = drift(moments, axes, x, sooner)
        x = Motion(normalised(x.q), x.omega)
    return x


class SmoothMotion(NamedTuple):
    """The motion during a step or more for DOP853; t counts from `start_s`.

    `push`: torque held for all of it, or (); `since_s`: age of the dipole's path at the start.
    """

    rigid: Rigid
    around: Around
    path: DipolePath
    push: tuple
    start_s: float
    since_s: float


@rates_of(SmoothMotion)
def _smooth_rates(problem, t, y, dy):
    rigid, around, path, push, start_s, since_s = problem
    world = environment_at(around, start_s + t)
    x = Motion((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    rate = motion_rates(rigid, world, dipole_after(path, since_s + t), x, push)
    dy[0], dy[1], dy[2], dy[3] = rate.q
    dy[4], dy[5], dy[6] = rate.omega


@kernel
def by_dop853(rigid, around, path, push, x, first, last, h, tolerance, work):
    """Motion after steps first..last-1, in steps of its own; not a number if it fails.

    A torque that jumps is smooth within a step only.
    """
    y = np.array(x.q + x.omega)
    stride = last - first if len(push) == 0 else 1
    for step in range(first, last, stride):
        since = (step - first) * h
        extra = push_at(push, step)
        problem = SmoothMotion(rigid, around, path, extra, step * h, since)
        ended = dop853(problem, 0.0, stride * h, y, tolerance, 1e-3 * tolerance, 0.0, work)
        if ended[0] != DONE:
            y[4] = np.nan
    return Motion(normalised((y[0], y[1], y[2], y[3])), (y[4], y[5], y[6]))
