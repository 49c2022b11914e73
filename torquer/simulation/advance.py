"""The motion between two events of the loop, by the integrator that the plan names.

The innermost loops. They take just the numbers that they need, not the whole plan: every array
that crosses a call costs reference counting, and a smaller function compiles to better code.
"""

from typing import NamedTuple

import numpy as np

from torquer.engine import inlined, kernel
from torquer.environment.local import LocalEnvironment
from torquer.environment.table import Table, lookup3, lookup6
from torquer.geometry.motion import Motion
from torquer.geometry.quaternion import normalised
from torquer.geometry.vec3 import add, add_scaled, scale
from torquer.integrate.dop853 import DONE, dop853, rates_of
from torquer.integrate.rk4 import moved, rk4_sum
from torquer.integrate.splitting import NODES, drift, kick
from torquer.spacecraft.body import Rigid, motion_rates, torque_body
from torquer.spacecraft.coils import remaining
from torquer.spacecraft.disturbance import disturbance_torque_at
from torquer.spacecraft.rotors import Rotors, carried_momentum, reaction, turn_rotors


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
    """What the orbit brings: table of position, field and gravity-gradient vector; of the air's
    flow, () for none.

    `gravity`: 1, or 0 for a run without gravity gradient.
    """

    orbit: Table
    air: Table | tuple
    gravity: float


class Wheels(NamedTuple):
    """The rotors of the wheels and their state, which a step changes."""

    rotors: Rotors
    state: np.ndarray


@inlined
def turned(wheels, omega, step, h):
    """What the wheels do during a step, a `Spin`; () for a satellite without wheels."""
    if len(wheels) == 0:
        return ()
    return turn_rotors(wheels.rotors, wheels.state, omega, step, h)


@inlined
def bearing(rigid, spin, omega, since):
    """The body with the momentum that its wheels have `since` seconds into the step."""
    if len(spin) == 0:
        return rigid
    momentum = add(rigid.wheel_momentum, carried_momentum(spin, omega, since))
    return Rigid(rigid.inertia, rigid.inverse_inertia, momentum, rigid.surface)


@inlined
def pushed(disturbance, spin):
    """The disturbance and what the wheels' motors give to the body; () for none of both."""
    if len(spin) == 0:
        return disturbance
    if len(disturbance) == 0:
        return reaction(spin)
    return add(disturbance, reaction(spin))


@inlined
def _flow_at(air, t):
    if len(air) == 0:
        return ()
    return lookup3(air, t)


@inlined
def environment_at(around, t):
    """The environment at time t [s]."""
    b, gravity_gradient = lookup6(around.orbit, t, 3)
    return LocalEnvironment(b, scale(around.gravity, gravity_gradient), _flow_at(around.air, t))


@inlined
def _rates(rigid, spin, local, path, since, x, disturbance):
    """Rates of a motion; `since`: seconds after the last event, and into the step."""
    after, into = since
    body = bearing(rigid, spin, x.omega, into)
    return motion_rates(body, local, dipole_after(path, after), x, disturbance)


@kernel
def by_rk4(rigid, around, path, disturbance, wheels, x, here, first, last, h):
    """(Motion, environment) after steps first..last-1 by RK4; `here` is the environment before.

    Two looks at the environment a step.
    """
    half = 0.5 * h
    for step in range(first, last):
        middle = environment_at(around, (step + 0.5) * h)
        end = environment_at(around, (step + 1) * h)
        since = (step - first) * h
        spin = turned(wheels, x.omega, step, h)
        extra = pushed(disturbance_torque_at(disturbance, step), spin)
        k1 = _rates(rigid, spin, here, path, (since, 0.0), x, extra)
        k2 = _rates(rigid, spin, middle, path, (since + half, half), moved(x, half, k1), extra)
        k3 = _rates(rigid, spin, middle, path, (since + half, half), moved(x, half, k2), extra)
        k4 = _rates(rigid, spin, end, path, (since + h, h), moved(x, h, k3), extra)
        x, here = rk4_sum(x, h, k1, k2, k3, k4), end
    return x, here


@kernel
def _kicked(rigid, around, path, extra, x, t, since, h):
    local = environment_at(around, t)
    torque = torque_body(rigid, local, dipole_after(path, since), x.q, extra)
    return kick(rigid.inertia, rigid.wheel_momentum, torque, x, h)


@kernel
def by_splitting(rigid, principal, around, path, disturbance, x, first, last, h):
    """Motion after steps first..last-1: exact free rotation between two kicks a step."""
    moments, axes = principal
    early, late = NODES
    for step in range(first, last):
        t, since, extra = step * h, (step - first) * h, disturbance_torque_at(disturbance, step)
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

    `disturbance`: torque held for all of it, or (); `spin`: the wheels, or (); `since_s`: age of
    the dipole's path at the start.
    """

    rigid: Rigid
    around: Around
    path: DipolePath
    disturbance: tuple
    spin: tuple
    start_s: float
    since_s: float


@rates_of(SmoothMotion)
def _smooth_rates(problem, t, y, dy):
    rigid, around, path, disturbance, spin, start_s, since_s = problem
    local = environment_at(around, start_s + t)
    x = Motion((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    rate = _rates(rigid, spin, local, path, (since_s + t, t), x, disturbance)
    dy[0], dy[1], dy[2], dy[3] = rate.q
    dy[4], dy[5], dy[6] = rate.omega


@kernel
def by_dop853(rigid, around, path, disturbance, wheels, x, first, last, h, tolerance, work):
    """Motion after steps first..last-1, in steps of its own; not a number if it fails.

    A torque that jumps, as that of the wheels' bearings, is smooth within a step only.
    """
    y = np.array(x.q + x.omega)
    stride = last - first if len(disturbance) + len(wheels) == 0 else 1
    for step in range(first, last, stride):
        since = (step - first) * h
        spin = turned(wheels, (y[4], y[5], y[6]), step, h)
        extra = pushed(disturbance_torque_at(disturbance, step), spin)
        problem = SmoothMotion(rigid, around, path, extra, spin, step * h, since)
        ended = dop853(problem, 0.0, stride * h, y, tolerance, 1e-3 * tolerance, 0.0, work)
        if ended[0] != DONE:
            y[4] = np.nan
    return Motion(normalised((y[0], y[1], y[2], y[3])), (y[4], y[5], y[6]))
