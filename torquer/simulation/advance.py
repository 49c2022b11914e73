"""The motion between two events of the loop, by the integrator that the run has chosen."""

import math
from typing import NamedTuple

import numpy as np
from numba.extending import overload

from torquer.engine import INLINED_OPTIONS, OPTIONS, inner, internal, kernel
from torquer.geometry.motion import Motion
from torquer.geometry.quaternion import normalised
from torquer.geometry.vec3 import add_scaled, dot, sub, sym_vec
from torquer.integrate.dop853 import DONE, Workspace, dop853, rates_of
from torquer.integrate.rk4 import damping_of_steps, lag_of_steps, moved, rk4_sum
from torquer.integrate.splitting import NODES, drift, kick
from torquer.simulation.adaptive import Auto, by_auto
from torquer.simulation.forces import (
    DipolePath,
    EnvironmentTables,
    Forces,
    dipole_after,
    environment_at,
    environment_tables,
    rates_at,
    spin_of,
    wheels_of,
    with_drawn,
    with_reaction,
)
from torquer.simulation.state import goal_dipole
from torquer.spacecraft.body import Rigid, momentum_body, torque_body
from torquer.spacecraft.coils import present_dipole, remaining
from torquer.spacecraft.disturbance.held import present_torque
from torquer.spacecraft.frequencies import libration_fourth, nutation_square
from torquer.spacecraft.rotors import (
    axis_of,
    relative_momentum,
)


class Rk4(NamedTuple):
    """Runge-Kutta of order 4 with fixed steps.

    Greatest turns within a step [rad] that it follows: of a nutation, of the body.
    """

    most_nutation: float
    most_turn: float


class Splitting(NamedTuple):
    """Exact free rotation between kicks: principal moments [kg m^2] and their axes' attitude."""

    moments: tuple
    q_principal_to_body: tuple


class Dop853(NamedTuple):
    """Dormand-Prince of order 8 with steps of its own; `work`: space to write to."""

    tolerance: float
    work: Workspace


@internal
def rk4_step(forces, x, here, middle, end, left, step, h):
    """Motion after a step of RK4 between the environments `here` and `end`.

    `left`: parts of the dipole's way that are still to go at start, middle and end.
    """
    rigid, _, path, held, wheels = forces
    half = 0.5 * h
    spin = spin_of(wheels, x.omega, step, h)
    torque = with_reaction(held, spin)
    m1 = add_scaled(path.target, left[0], path.way)
    m2 = add_scaled(path.target, left[1], path.way)
    m4 = add_scaled(path.target, left[2], path.way)
    k1 = rates_at(rigid, spin, here, m1, 0.0, x, torque)
    k2 = rates_at(rigid, spin, middle, m2, half, moved(x, half, k1), torque)
    k3 = rates_at(rigid, spin, middle, m2, half, moved(x, half, k2), torque)
    k4 = rates_at(rigid, spin, end, m4, h, moved(x, h, k3), torque)
    return rk4_sum(x, h, k1, k2, k3, k4)


@internal
def left_in_step(lag_s, since, h):
    """Parts of a dipole's way that are still to go at start, middle and end of a step."""
    # before the stages: a call of `exp` between them would empty the registers
    return remaining(lag_s, since), remaining(lag_s, since + 0.5 * h), remaining(lag_s, since + h)


@kernel
def by_rk4(forces, x, here, first, last, h):
    """(Motion, environment) after steps first..last-1 by RK4; `here` is the environment before.

    Two looks at the environment a step.
    """
    for step in range(first, last):
        middle = environment_at(forces.tables, (step + 0.5) * h)
        end = environment_at(forces.tables, (step + 1) * h)
        left = left_in_step(forces.path.lag_s, (step - first) * h, h)
        x = rk4_step(forces, x, here, middle, end, left, step, h)
        here = end
    return x, here


@kernel
def _kicked(forces, x, t, since, h):
    rigid, here = forces.rigid, environment_at(forces.tables, t)
    torque = torque_body(rigid, here, dipole_after(forces.path, since), x, forces.held)
    return kick(rigid.inertia, rigid.wheel_momentum, torque, x, h)


@kernel
def by_splitting(forces, moments, axes, x, first, last, h):
    """Motion after steps first..last-1: exact free rotation between two kicks a step."""
    early, late = NODES
    for step in range(first, last):
        t, since = step * h, (step - first) * h
        sooner, later, half = early * h, late * h, 0.5 * h
        x = drift(moments, axes, x, sooner)
        x = _kicked(forces, x, t + sooner, since + sooner, half)
        x = drift(moments, axes, x, later - sooner)
        x = _kicked(forces, x, t + later, since + later, half)
        x = drift(moments, axes, x, sooner)
        x = Motion(normalised(x.q), x.omega)
    return x


class SmoothMotion(NamedTuple):
    """The motion during a step or more for DOP853; t counts from `start_s`.

    `torque`: disturbance and motors, held for all of it; `spin`: the wheels, or (); `since_s`: age
    of the dipole's path at the start.
    """

    rigid: Rigid
    tables: EnvironmentTables
    path: DipolePath
    torque: tuple
    spin: tuple
    start_s: float
    since_s: float


@rates_of(SmoothMotion)
def _smooth_rates(problem, t, y, dy):
    rigid, tables, path, torque, spin, start_s, since_s = problem
    here = environment_at(tables, start_s + t)
    x = Motion((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    rate = rates_at(rigid, spin, here, dipole_after(path, since_s + t), t, x, torque)
    dy[0], dy[1], dy[2], dy[3] = rate.q
    dy[4], dy[5], dy[6] = rate.omega


@kernel
def by_dop853(forces, integrator, x, first, last, h):
    """(Motion, steps taken) after steps first..last-1, in own steps; not a number if it fails.

    The torque of the wheels' bearings jumps; it is smooth within a step only.
    """
    rigid, tables, path, held, wheels = forces
    tolerance, work = integrator
    y = np.empty(7)
    y[0], y[1], y[2], y[3] = x.q
    y[4], y[5], y[6] = x.omega
    taken = 0
    stride = 1 if len(wheels) > 0 else last - first
    for step in range(first, last, stride):
        since = (step - first) * h
        spin = spin_of(wheels, (y[4], y[5], y[6]), step, h)
        torque = with_reaction(held, spin)
        problem = SmoothMotion(rigid, tables, path, torque, spin, step * h, since)
        ended = dop853(problem, 0.0, stride * h, y, tolerance, 1e-3 * tolerance, 0.0, work)
        taken += ended[2]
        if ended[0] != DONE:
            y[4] = np.nan
            break
    return Motion(normalised((y[0], y[1], y[2], y[3])), (y[4], y[5], y[6])), taken


def _steps_by_rk4(integrator, forces, cells, x, here, first, last, h):
    return by_rk4(forces, x, here, first, last, h)


def _steps_by_splitting(integrator, forces, cells, x, here, first, last, h):
    moments, axes = integrator
    x = by_splitting(forces, moments, axes, x, first, last, h)
    return x, environment_at(forces.tables, last * h)


def _steps_by_dop853(integrator, forces, cells, x, here, first, last, h):
    x, taken = by_dop853(forces, integrator, x, first, last, h)
    cells.steps += taken
    return x, environment_at(forces.tables, last * h)


def _resolved_by_rk4(integrator, plan, state, x, here):
    return resolves(integrator, plan.plant, plan.step_s, plan.record_steps, state, x, here)


def _resolved_always(integrator, plan, state, x, here):
    return True


_STEPS = {
    Auto: by_auto,
    Rk4: _steps_by_rk4,
    Splitting: _steps_by_splitting,
    Dop853: _steps_by_dop853,
}
_RESOLVED = {
    Auto: _resolved_always,
    Rk4: _resolved_by_rk4,
    Splitting: _resolved_always,
    Dop853: _resolved_always,
}


def steps_by(integrator, forces, cells, x, here, first, last, h):
    """(Motion, environment) after steps first..last-1, by the integrator's type."""
    return _STEPS[type(integrator)](integrator, forces, cells, x, here, first, last, h)


def is_resolved(integrator, plan, state, x, here):
    """Whether the integrator's step follows the motion, by its type."""
    return _RESOLVED[type(integrator)](integrator, plan, state, x, here)


def may_be_too_coarse(integrator) -> bool:
    """Whether `is_resolved` may say no: to ask it compiles for half a second."""
    return _RESOLVED[type(integrator)] is not _resolved_always


@overload(steps_by, jit_options=INLINED_OPTIONS)
def _choose_steps(integrator, forces, cells, x, here, first, last, h):
    return _STEPS[integrator.instance_class]


@overload(is_resolved, jit_options=OPTIONS)
def _choose_resolved(integrator, plan, state, x, here):
    return _RESOLVED[integrator.instance_class]


@internal
def momentum_now(rigid, wheels, omega):
    """Angular momentum [N m s, body] of the body and its wheels."""
    momentum = momentum_body(rigid, omega)
    if len(wheels) == 0:
        return momentum
    rows = wheels.rotors.rows
    for k in range(rows.shape[0]):
        held = relative_momentum(rows, wheels.state, omega, k)
        momentum = add_scaled(momentum, held, axis_of(rows, k))
    return sub(momentum, sym_vec(wheels.rotors.tensor, omega))


@inner
def resolves(integrator, plant, h, steps, state, x, here):
    """Whether RK4's step h resolves the motion; what it does in the next steps is added up."""
    cells = state.cells[0]
    inverse = plant.rigid.inverse_inertia
    momentum = momentum_now(plant.rigid, wheels_of(plant.rotors, state.rotors), x.omega)
    square = nutation_square(inverse, momentum, x.omega)
    dipole = goal_dipole(state.cells)
    square = math.sqrt(square * square + libration_fourth(inverse, dipole, here.b_t))
    turning = dot(x.omega, x.omega)
    cells.damping += damping_of_steps(square, h, steps)
    cells.lag += lag_of_steps(turning, h, steps)
    followed = turning * h * h <= integrator.most_turn**2
    return followed and square * h * h <= integrator.most_nutation**2


@internal
def forces_now(plan, tables, state):
    """What moves the body up to the next event, while the coils go to their targets."""
    plant, way = plan.plant, (0.0, 0.0, 0.0)
    target = goal_dipole(state.cells)
    if plant.coils.lag_s > 0.0:
        way = sub(present_dipole(plant.coils, state.coils), target)
    path = DipolePath(target, way, plant.coils.lag_s)
    rigid = with_drawn(plant.rigid, plant.rigid.acting, state.coefficients)
    held = present_torque(plant.held, state.held)
    wheels = wheels_of(plant.rotors, state.rotors)
    return Forces(rigid, environment_tables(plan, tables), path, held, wheels)
