"""The motion between two events of the loop, by the integrator that the plan names.

The innermost loops. They take just the numbers that they need, not the whole plan: every array
that crosses a call costs reference counting, and a smaller function compiles to better code.
"""

from typing import NamedTuple

import numpy as np

from torquer.conventions import MU_EARTH_M3_S2
from torquer.engine import inlined, kernel
from torquer.environment.table import Table, lookup6
from torquer.geometry.quaternion import normalised
from torquer.geometry.vec3 import add_scaled, norm, scale
from torquer.integrate.dop853 import DONE, dop853, rates_of
from torquer.integrate.rk4 import Motion, moved, rk4_sum
from torquer.integrate.splitting import NODES, drift, kick
from torquer.spacecraft.body import Rigid, World, motion_rates, torque_body
from torquer.spacecraft.coils import remaining


class DipolePath(NamedTuple):
    """Dipole [A m^2, body] from an event on: `target` + `way` exp(-t/lag)."""

    target: tuple
    way: tuple
    lag_s: float


@inlined
def dipole_after(path, t):
    """Dipole t seconds after the event."""
    return add_scaled(path.target, remaining(path.lag_s, t), path.way)


@inlined
def environment_at(orbit, gravity, t):
    """Field, vertical and gravity gradient at time t [s]."""
    r, b = lookup6(orbit, t)
    inverse = 1.0 / norm(r)
    three_mu_over_r3 = gravity * 3.0 * MU_EARTH_M3_S2 * inverse * inverse * inverse
    return World(b, scale(inverse, r), three_mu_over_r3)


@kernel
def by_rk4(rigid, orbit, gravity, path, x, here, first, last, h):
    """(Motion, environment) after steps first..last-1 by RK4; `here` is the environment before.

    Two looks at the environment a step.
    """
    for step in range(first, last):
        middle = environment_at(orbit, gravity, (step + 0.5) * h)
        end = environment_at(orbit, gravity, (step + 1) * h)
        since = (step - first) * h
        dipole = dipole_after(path, since + 0.5 * h)
        k1 = motion_rates(rigid, here, dipole_after(path, since), x)
        k2 = motion_rates(rigid, middle, dipole, moved(x, 0.5 * h, k1))
        k3 = motion_rates(rigid, middle, dipole, moved(x, 0.5 * h, k2))
        k4 = motion_rates(rigid, end, dipole_after(path, since + h), moved(x, h, k3))
        x, here = rk4_sum(x, h, k1, k2, k3, k4), end
    return x, here


@kernel
def _kicked(rigid, orbit, gravity, path, x, t, since, h):
    world = environment_at(orbit, gravity, t)
    torque = torque_body(rigid, world, dipole_after(path, since), x.q)
    return kick(rigid.inertia, rigid.wheel_momentum, torque, x, h)


@kernel
def by_splitting(rigid, principal, orbit, gravity, path, x, first, last, h):
    """Motion after steps first..last-1: exact free rotation between two kicks a step."""
    moments, axes = principal
    early, late = NODES
    for step in range(first, last):
        t, since = step * h, (step - first) * h
        x = drift(moments, axes, x, early * h)
        x = _kicked(rigid, orbit, gravity, path, x, t + early * h, since + early * h, 0.5 * h)
        x = drift(moments, axes, x, (late - early) * h)
        x = _kicked(rigid, orbit, gravity, path, x, t + late * h, since + late * h, 0.5 * h)
        x = drift(moments, axes, x, early * h)
        x = Motion(normalised(x.q), x.omega)
    return x


class SmoothMotion(NamedTuple):
    """The motion between two events as a problem for DOP853; t counts from the first."""

    rigid: Rigid
    orbit: Table
    gravity: float
    path: DipolePath
    start_s: float


@rates_of(SmoothMotion)
def _smooth_rates(problem, t, y, dy):
    rigid, orbit, gravity, path, start_s = problem
    world = environment_at(orbit, gravity, start_s + t)
    x = Motion((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    rate = motion_rates(rigid, world, dipole_after(path, t), x)
    dy[0], dy[1], dy[2], dy[3] = rate.q
    dy[4], dy[5], dy[6] = rate.omega


@kernel
def by_dop853(rigid, orbit, gravity, path, x, first, last, h, tolerance, work):
    """Motion after steps first..last-1, in steps of its own; not a number if it fails."""
    problem = SmoothMotion(rigid, orbit, gravity, path, first * h)
    y, span = np.array(x.q + x.omega), (last - first) * h
    ended = dop853(problem, 0.0, span, y, tolerance, 1e-3 * tolerance, 0.0, work)
    if ended[0] != DONE:
        y[4] = np.nan
    return Motion(normalised((y[0], y[1], y[2], y[3])), (y[4], y[5], y[6]))
